#!/bin/bash
# A scene rendered by Blender's Cycles, its passes taken through fog and solid texture by tessera.
# Checks that linear fog is Blender's own Mist pass. Without Blender it says so and exits with 77 (skipped).
#   samples/blender.sh [OUTDIR]     tessera is taken from $TESSERA or the path
set -euo pipefail
fail() {
  echo "blender.sh: error: $*" >&2
  exit 1
}
here=$(cd "$(dirname "$0")" && pwd)
out=${1:-blender}
tessera=${TESSERA:-tessera}
command -v blender >/dev/null || { echo "blender.sh: skipped: Blender is not installed (Debian package blender)"; exit 77; }
command -v oiiotool >/dev/null || { echo "blender.sh: skipped: oiiotool is not installed (Debian package openimageio-tools)"; exit 77; }
command -v "$tessera" >/dev/null || fail "$tessera: no such program; set TESSERA"
mkdir -p "$out"
blender -b --factory-startup -P "$here/blender_aovs.py" -- "$(realpath "$out")/passes.exr" 640 360 >"$out/blender.log" 2>&1 ||
  fail "Blender failed: $(tail -n 1 "$out/blender.log")"
passes=$out/passes.exr
[ -f "$passes" ] || fail "Blender wrote no picture (see $out/blender.log)"
eye=$(sed -n 's/^eye=//p' "$out/blender.log")

# The background has index 0 and, in Blender, position 0: it is masked. Mist is 1 - T of linear fog, 5 to 35.
mask="mask=ViewLayer.IndexOB.X"
"$tessera" "$passes" --ch R=1.0,G=1.0,B=1.0 "$passes" --aov:"$mask" position \
  --fog:mode=linear:start=5:end=35:color=0,0,0:eye="$eye" -d float -o "$out/fog.exr"
"$tessera" "$passes" --ch R=1.0,G=1.0,B=1.0 "$passes" --aov:"$mask" mist --ch R=mist,G=mist,B=mist --invert --fog:mode=transmittance:color=0,0,0 \
  -d float -o "$out/mist.exr"
oiiotool --fail 1e-5 --failpercent 0.05 "$out/fog.exr" "$out/mist.exr" --diff >"$out/diff.log" ||
  fail "linear fog is not Blender's Mist pass: $(grep Max "$out/diff.log")"
largest=$(oiiotool "$out/fog.exr" "$out/mist.exr" --absdiff --printstats | sed -n 's/.*Stats Max: *\([0-9.e+-]*\).*/\1/p')
echo "linear fog against Blender's Mist: largest difference $largest"

"$tessera" "$passes" --aov:layer=ViewLayer color "$passes" --aov:"$mask" position \
  --fog:density=0.06:color=0.6,0.7,0.8:eye="$eye" -d uint8 -o "$out/fog.png"
"$tessera" "$passes" --aov:layer=ViewLayer color "$passes" --aov:"$mask" position \
  --solid:procedure=marble:box=-6,-6,-6,6,6,6:freq=8:lod=1 -d uint8 -o "$out/marble.png"
oiiotool "$out/fog.png" "$out/marble.png" --mosaic:pad=4 2x1 -o "$out/pictures.png"
echo "pictures  $out/pictures.png"
