#!/bin/sh
# Installs the packages of a build (cpack's .deb files) in a bare Debian 12 and tries them as a new user would.
#   tests/install/debian.sh build/deb [FOLDER]   as root, with mmdebstrap and a mirror in reach; FOLDER is where it goes
set -e
packages=$(cd "$1" && pwd)
root=${2:-$(mktemp -d)}
[ -d "$root/usr" ] || mmdebstrap --variant=apt --aptopt='APT::Install-Recommends "false"' bookworm "$root" http://deb.debian.org/debian
mkdir -p "$root/packages"
cp "$packages"/*.deb "$root/packages/"
in_root() { chroot "$root" env -i PATH=/usr/sbin:/usr/bin:/sbin:/bin HOME=/root DEBIAN_FRONTEND=noninteractive "$@"; }
in_root sh -c 'apt-get update -q && apt-get install -y -q /packages/tessera_*.deb /packages/tessera-doc_*.deb'
in_root tessera --version
in_root sh -ec '
  cd /tmp
  tessera --pattern checker 64x48 3 --exposure -1 -d half -o a.exr
  tessera a.exr --blur:sigma=2 --verify -o b.png
  tessera --info b.png
  tessera a.exr --resize 50% -o - > c.exr
  test -s c.exr
  test -s /usr/share/man/man1/tessera.1 -o -s /usr/share/man/man1/tessera.1.gz
  test -s /usr/share/bash-completion/completions/tessera
  test -s /usr/share/doc/tessera/copyright'
in_root sh -c 'apt-get install -y -q g++ make cmake pkg-config /packages/libtessera1_*.deb /packages/libtessera-dev_*.deb'
mkdir -p "$root/tmp/program"
cat > "$root/tmp/program/main.cc" <<'END'
#include <cstdio>
#include <tessera/tessera.h>
int main() {
  const tessera::Node node = tessera::Exposure(tessera::Constant(tessera::ImageSpec(4, 4, 3), {.color = {0.25}}), 1);
  std::printf("%g\n", tessera::Render(node).at<float>(1, 1, 0));
}
END
cat > "$root/tmp/program/CMakeLists.txt" <<'END'
cmake_minimum_required(VERSION 3.22)
project(program CXX)
find_package(tessera CONFIG REQUIRED COMPONENTS core)
add_executable(program main.cc)
target_link_libraries(program PRIVATE tessera::core)
END
in_root sh -ec 'cd /tmp/program && cmake -B build -DBUILD_SHARED_LIBS=ON && cmake --build build && test "$(build/program)" = 0.5'
in_root sh -ec 'apt-get remove -y -q tessera libtessera1 libtessera-dev tessera-doc && ! test -e /usr/bin/tessera && ! ls /usr/lib/*/libtessera* 2>/dev/null'
echo "the packages install, work, and leave nothing"
