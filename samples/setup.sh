#!/bin/sh
# Installs the Debian packages that Tessera is built, tested and shown with; names on the line are installed too.
# Packages that are there are skipped, so without anything missing it needs neither root nor a network.
#   TESSERA_SETUP=skip    trust that everything is there (other systems, other package managers)
set -eu

fail() {
  echo "setup.sh: error: $*" >&2
  exit 1
}

# openimageio-tools is needed to build too: OpenImageIO's CMake package checks that its programs exist. OpenVDB's
# headers include Boost's, which its package does not bring.
packages="g++ cmake ninja-build ccache doxygen clang-format clang-tidy
  libopenimageio-dev openimageio-tools libopencolorio-dev libhwy-dev libtbb-dev
  nlohmann-json3-dev libdeflate-dev libxxhash-dev libopenexr-dev libtiff-dev libjpeg-dev libseccomp-dev libopenvdb-dev libboost-dev libgtest-dev libgmock-dev libbenchmark-dev python3 python3-dev python3-numpy pybind11-dev mypy abigail-tools
  pkg-config pngcheck libtiff-tools openexr mate-backgrounds $*"

[ "${TESSERA_SETUP:-}" = skip ] && exit 0
command -v dpkg-query >/dev/null && command -v apt-get >/dev/null ||
  fail "this is not a Debian system; install the counterparts of" $packages "and set TESSERA_SETUP=skip"

missing=
for package in $packages; do
  status=$(dpkg-query -W -f='${db:Status-Status}' "$package" 2>/dev/null) || status=absent
  [ "$status" = installed ] || missing="$missing $package"
done
[ -n "$missing" ] || exit 0

if [ "$(id -u)" = 0 ]; then
  as_root=
elif ! command -v sudo >/dev/null; then
  fail "run as root, or install sudo, to install:$missing"
elif sudo -n true 2>/dev/null; then
  as_root="sudo -n"
elif [ -t 0 ]; then
  as_root=sudo
else
  fail "run as root, or with a sudo that needs no password, to install:$missing"
fi

log=$(mktemp)
trap 'rm -f "$log"' EXIT
apt() {
  # The frontend travels inside the command because sudo drops the environment.
  $as_root env DEBIAN_FRONTEND=noninteractive apt-get -qq -y -o DPkg::Lock::Timeout=300 "$@" >>"$log" 2>&1
}

echo "Installing$missing"
apt update || true  # a machine with a stale mirror or a full local one may still succeed
apt install --no-install-recommends $missing ||
  fail "apt-get could not install$missing: $(grep '^[EW]:' "$log" | tail -n 1)"
