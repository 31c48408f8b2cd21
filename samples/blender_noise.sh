#!/bin/bash
# Cycles' noise textures against tessera's lattice=osl at the same positions: within 2/255 everywhere.
# Without Blender it says so and exits with 77 (skipped).
#   samples/blender_noise.sh [OUTDIR]     tessera is taken from $TESSERA or the path
set -euo pipefail
. "$(dirname "$0")/blender_common.sh" blender_noise "$@"
cycles blender_noise.py cycles.exr 320 180
cycles=$out/cycles.exr

# NAME, channels of the position, modifiers of --noiseat. Four octaves are detail 3; Cycles divides by their weights.
compare() {
  "$tessera" "$cycles" --ch "$2" --noiseat:"$3" -d float -o "$out/$1.exr"
  "$tessera" "$cycles" --ch "Y=ViewLayer.$1.X" -d float -o "$out/$1_cycles.exr"
  oiiotool "$out/$1.exr" --chnames Y "$out/$1_cycles.exr" --absdiff -o "$out/difference.exr"
  local largest
  largest=$(statistic Max "$out/difference.exr")
  echo "$1: largest difference from Cycles $largest"
  at_most "$largest" 0.00784 "$1 is not Cycles' noise: difference $largest"
}
plane="X=ViewLayer.Position.X,Y=ViewLayer.Position.Y"
space="$plane,Z=ViewLayer.Position.Z"
octaves="octaves=4:weights=0.53333333333,0.26666666667,0.13333333333,0.06666666667"
compare perlin2Ddetail0 "$plane" dims=2:freq=2:lattice=osl
compare perlin2Ddetail3 "$plane" "dims=2:freq=2:lattice=osl:$octaves"
compare perlin3Ddetail0 "$space" dims=3:freq=2:lattice=osl
compare perlin3Ddetail3 "$space" "dims=3:freq=2:lattice=osl:$octaves"
compare white "$space" type=hash:dims=3:lattice=osl
