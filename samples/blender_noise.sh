#!/bin/bash
# Cycles' noise textures against tessera's lattice=osl at the same positions: within 2/255 everywhere.
# Without Blender it says so and exits with 77 (skipped).
#   samples/blender_noise.sh [OUTDIR]     tessera is taken from $TESSERA or the path
set -euo pipefail
fail() {
  echo "blender_noise.sh: error: $*" >&2
  exit 1
}
here=$(cd "$(dirname "$0")" && pwd)
out=${1:-blender_noise}
tessera=${TESSERA:-tessera}
command -v blender >/dev/null || { echo "blender_noise.sh: skipped: Blender is not installed (Debian package blender)"; exit 77; }
command -v oiiotool >/dev/null || { echo "blender_noise.sh: skipped: oiiotool is not installed (Debian package openimageio-tools)"; exit 77; }
command -v "$tessera" >/dev/null || fail "$tessera: no such program; set TESSERA"
mkdir -p "$out"
blender -b --factory-startup -P "$here/blender_noise.py" -- "$(realpath "$out")/cycles.exr" 320 180 >"$out/blender.log" 2>&1 ||
  fail "Blender failed: $(tail -n 1 "$out/blender.log")"
cycles=$out/cycles.exr
[ -f "$cycles" ] || fail "Blender wrote no picture (see $out/blender.log)"

# NAME, channels of the position, modifiers of --noiseat. Four octaves are detail 3; Cycles divides by their weights.
compare() {
  "$tessera" "$cycles" --ch "$2" --noiseat:"$3" -d float -o "$out/$1.exr"
  "$tessera" "$cycles" --ch "Y=ViewLayer.$1.X" -d float -o "$out/$1_cycles.exr"
  oiiotool "$out/$1.exr" --chnames Y "$out/$1_cycles.exr" --absdiff -o "$out/difference.exr"
  local largest
  largest=$(oiiotool --stats "$out/difference.exr" | sed -n 's/.*Stats Max: *\([0-9.e+-]*\).*/\1/p')
  echo "$1: largest difference from Cycles $largest"
  awk -v d="$largest" 'BEGIN { exit !(d <= 2 / 255) }' || fail "$1 is not Cycles' noise: difference $largest"
}
plane="X=ViewLayer.Position.X,Y=ViewLayer.Position.Y"
space="$plane,Z=ViewLayer.Position.Z"
octaves="octaves=4:weights=0.53333333333,0.26666666667,0.13333333333,0.06666666667"
compare perlin2Ddetail0 "$plane" dims=2:freq=2:lattice=osl
compare perlin2Ddetail3 "$plane" "dims=2:freq=2:lattice=osl:$octaves"
compare perlin3Ddetail0 "$space" dims=3:freq=2:lattice=osl
compare perlin3Ddetail3 "$space" "dims=3:freq=2:lattice=osl:$octaves"
compare white "$space" type=hash:dims=3:lattice=osl
