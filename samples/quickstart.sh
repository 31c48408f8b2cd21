#!/bin/bash
# Installs what is missing, builds the tessera command and grades a photograph: how it looks, how fast beside
# oiiotool, how exact.
#   samples/quickstart.sh [IMAGE]
set -euo pipefail

usage() { sed -n '2,4s/^# \{0,1\}//p' "$0"; }
fail() {
  echo "quickstart.sh: error: $*" >&2
  exit 1
}

case "${1:-}" in -h|--help) usage; exit 0 ;; esac
[ $# -le 1 ] || fail "found $# arguments, expected one image at most"
root=$(cd "$(dirname "$0")/.." && pwd)
image=${1:-/usr/share/backgrounds/mate/nature/LadyBird.jpg}
[ $# = 0 ] || [ -f "$image" ] || fail "$image: no such file"
image=$(realpath -m "$image")

cd "$root"
./samples/setup.sh
[ -f "$image" ] || fail "$image: no such file (the Debian package mate-backgrounds has it)"
out=build/quickstart
mkdir -p "$out"
log=$out/build.log
echo "Building (messages in $log) ..."
{ cmake --preset release && cmake --build --preset release --target tessera_cli scene; } >"$log" 2>&1 ||
  fail "the build failed: $(grep -m 1 -E 'error|Error' "$log" || tail -n 1 "$log") (see $log)"
PATH=$root/build/release/bin:$PATH

# The grade: exposure, white balance, saturation, hue, contrast about a pivot, limits.
weights=0.2126,0.7152,0.0722  # rec709
ours=(--mulc 1.12,1.05,0.95,1 --saturate:weights=$weights 1.35 --hue:weights=$weights 150
      --contrast:pivot=0.4 1.2 --clamp:min=0,0,0:max=1,1,1)

# The same for oiiotool, which wants matrices: rows of S = s I + (1-s) 1 w' and of H = 1 w' + cos P + sin P [g]x.
matrices=$(LC_ALL=C awk -v weights=$weights -v s=1.35 -v degrees=150 'BEGIN {
  split(weights, w, ","); t = degrees * atan2(0, -1) / 180; c = cos(t); n = sin(t) / sqrt(3)
  split("0 -1 1 1 0 -1 -1 1 0", g, " ")
  for (i = 0; i < 3; ++i) for (j = 1; j <= 3; ++j) {
    saturate = saturate sprintf("%.9g,", (1 - s) * w[j] + (i + 1 == j) * s)
    wg = w[1] * g[j] + w[2] * g[3 + j] + w[3] * g[6 + j]
    hue = hue sprintf("%.9g,", w[j] + c * ((i + 1 == j) - w[j]) + n * (g[3 * i + j] - wg))
  }
  sub(/,$/, "", saturate); sub(/,$/, "", hue); print saturate, hue }')
read -r saturate hue <<<"$matrices"
theirs=(--mulc 1.12,1.05,0.95,1 --ccmatrix:transpose=1 "$saturate" --ccmatrix:transpose=1 "$hue"
        --mulc 1.2,1.2,1.2,1 --addc -0.08,-0.08,-0.08,0 --clamp:min=0,0,0:max=1,1,1)

# best N COMMAND...: milliseconds of the fastest of N runs.
best() {
  local runs=$1 least= start spent
  shift
  for ((i = 0; i < runs; ++i)); do
    start=$(date +%s%N)
    "$@" >"$out/run.log" 2>&1 || fail "$1 failed: $(tail -n 1 "$out/run.log")"
    spent=$((($(date +%s%N) - start) / 10000))
    [ -n "$least" ] && [ "$least" -le "$spent" ] || least=$spent
  done
  printf '%d.%02d' $((least / 100)) $((least % 100))
}

# Uncompressed files, so that the comparison is about the pixels; the pictures to look at are PNG.
oiiotool "$image" --ch R,G,B --compression none -o "$out/before.tif"
ours_ms=$(best 7 tessera "$out/before.tif" "${ours[@]}" -o "$out/tessera.tif")
ours_start=$(best 7 tessera --version)
theirs_start=$(best 7 oiiotool --version)
theirs_ms=$(best 7 oiiotool "$out/before.tif" "${theirs[@]}" -o "$out/oiiotool.tif")
difference=$(oiiotool --fail 0.0040 "$out/tessera.tif" "$out/oiiotool.tif" --diff 2>&1) ||
  fail "tessera and oiiotool made different pictures: $(echo "$difference" | tr '\n' ' ')"
difference=$(echo "$difference" | sed -n 's/^ *Max error *= *\([0-9.e+-]*\).*/\1/p')
report=$(tessera "$out/before.tif" "${ours[@]}" --verify -o "$out/after.png") || fail "--verify found an error: $report"
oiiotool "$image" --ch R,G,B "$out/after.png" --mosaic:pad=8 2x1 -d uint8 -o "$out/before-after.png"

size=$(iinfo "$out/before.tif" | sed -n 's/.* : *\([0-9]*\) x *\([0-9]*\),.*/\1 x \2/p')
echo "Graded $(basename "$image") ($size): exposure and white balance, saturation, hue, contrast, limits."
echo "  pictures  $root/$out/before-after.png, after.png"
ratio() { LC_ALL=C awk -v a="$1" -v b="$2" 'BEGIN { printf "%.1f", b / a }'; }
minus() { LC_ALL=C awk -v a="$1" -v b="$2" 'BEGIN { printf "%.2f", a - b }'; }
ours_work=$(minus "$ours_ms" "$ours_start")
theirs_work=$(minus "$theirs_ms" "$theirs_start")
echo "  speed     $ours_ms ms, $ours_work without starting the program; oiiotool $theirs_ms and $theirs_work ms" \
     "($(ratio "$ours_ms" "$theirs_ms") and $(ratio "$ours_work" "$theirs_work") times as long); best of 7, file to file"
echo "  error     $(echo "$report" | grep -i -m 1 verify || echo "$report")"
echo "            largest difference between the two pictures: ${difference:-0} (one code of uint8 is 0.0039)"

# A scene's AOVs and its sun's depths, cast without a renderer: shadows and fog that lies in the valleys, then half size.
scene view "$out/view.exr" size=1280x720 eye=2.5,4.6,11.5 target=0,0.6,-2 >"$out/run.log" 2>&1 &&
  scene light "$out/sun.exr" size=1024x1024 height=30 >>"$out/run.log" 2>&1 || fail "$(tail -n 1 "$out/run.log")"
tessera "$out/view.exr" --ch R,G,B --resize 640x360 --mulc 0.6 --curve srgb -d uint8 -o "$out/scene-before.png"
tessera "$out/view.exr" --ch R=direct.R,G=direct.G,B=direct.B "$out/view.exr" "$out/sun.exr" --shadow:pcf=3 --ch R=V,G=V,B=V \
  --mul "$out/view.exr" --ch R=ambient.R,G=ambient.G,B=ambient.B --add \
  "$out/view.exr" --layerfog:layers=-4,0.16,-0.6,0.05,0.5,0.012,2.5,0.001:color=0.62,0.70,0.80 \
  --resize 640x360 --mulc 0.6 --curve srgb -d uint8 -o "$out/scene-after.png"
oiiotool "$out/scene-before.png" "$out/scene-after.png" --mosaic:pad=8 2x1 -o "$out/scene.png"
echo "Relit a scene from its AOVs: shadows of the sun and layered fog."
echo "  pictures  $root/$out/scene.png, scene-after.png"
