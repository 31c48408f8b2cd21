#!/bin/bash
# A scene rendered by Blender's Cycles, its passes taken through fog, shadow, environment, bump and solid texture by
# tessera. Checks that linear fog is Blender's own Mist pass, and that shadows are its Shadow pass. Without Blender it
# says so and exits with 77 (skipped).
#   samples/blender.sh [OUTDIR]     tessera is taken from $TESSERA or the path
set -euo pipefail
. "$(dirname "$0")/blender_common.sh" blender "$@"
passes=$out/passes.exr
cycles blender_aovs.py passes.exr "$(realpath "$out")/light.exr" 640 360
eye=$(said eye) light=$(said light) sun=$(said sun)

# The background has index 0 and, in Blender, position 0: it is masked. Mist is 1 - T of linear fog, 5 to 35.
mask="mask=ViewLayer.IndexOB.X"
position=("$passes" --aov:"$mask" position)
"$tessera" "$passes" --ch R=1.0,G=1.0,B=1.0 "${position[@]}" \
  --fog:mode=linear:start=5:end=35:color=0,0,0:eye="$eye" -d float -o "$out/fog.exr"
"$tessera" "$passes" --ch R=1.0,G=1.0,B=1.0 "$passes" --aov:"$mask" mist --ch R=mist,G=mist,B=mist --invert \
  --fog:mode=transmittance:color=0,0,0 -d float -o "$out/mist.exr"
oiiotool --fail 1e-5 --failpercent 0.05 "$out/fog.exr" "$out/mist.exr" --diff >"$out/diff.log" ||
  fail "linear fog is not Blender's Mist pass: $(grep Max "$out/diff.log")"
oiiotool "$out/fog.exr" "$out/mist.exr" --absdiff -o "$out/difference.exr"
echo "linear fog against Blender's Mist: largest difference $(statistic Max "$out/difference.exr")"

# The sun's map holds depths from 5 to 45 units; Blender's 1e10, where nothing is, lies beyond 1: lit. A surface turned
# away from the sun is dark whatever the map says, and Blender's pass leaves it out: what faces the sun is compared.
"$tessera" "$out/light.exr" --aov depth --subc 5 --mulc 0.025 -d float -o "$out/map.exr"
"$tessera" "${position[@]}" "$out/map.exr" --shadow:light="$light" -d float -o "$out/shadow.exr"
"$tessera" "$passes" --aov normal --phong:light="$sun" --ch R -d float -o "$out/facing.exr"
"$tessera" "$passes" --ch Y=ViewLayer.IndexOB.X -d float -o "$out/things.exr"
"$tessera" "$passes" --ch Y=ViewLayer.Shadow.R -d float -o "$out/cycles.exr"
oiiotool "$out/facing.exr" --ch 0 --mulc 20 --clamp:min=0:max=1 "$out/things.exr" --ch 0 --clamp:min=0:max=1 --mul \
  -o "$out/counts.exr"
oiiotool "$out/shadow.exr" --ch 0 "$out/cycles.exr" --ch 0 --absdiff "$out/counts.exr" --mul -o "$out/difference.exr"
oiiotool --fail 0.5 "$out/cycles.exr" --ch 0 --mulc 0 "$out/counts.exr" --diff >"$out/diff.log" && fail "no pixel was compared"
wrong=$(statistic Avg "$out/difference.exr")
echo "shadows against Blender's Shadow pass: mean difference $wrong"
at_most "$wrong" 0.005 "shadows are not Blender's: mean difference $wrong"

# The passes shaded anew: fog, marble, the sun with soft shadows, a mirrored and a glossy sky (y up; Blender's world has
# z up), dents.
oiiotool --pattern fill:top=0.15,0.3,0.75:bottom=0.8,0.85,0.9 512x128 3 \
  --pattern checker:color1=0.3,0.26,0.2:color2=0.12,0.1,0.08:width=32:height=32 512x128 3 --mosaic 1x2 -d half -o "$out/sky.exr"
sky=("$passes" --aov normal "${position[@]}" "$out/sky.exr")
up="eye=$eye:matrix=1,0,0,0,0,1,0,-1,0"
"$tessera" "$passes" --aov:layer=ViewLayer color "${position[@]}" \
  --fog:density=0.06:color=0.6,0.7,0.8:eye="$eye" -d uint8 -o "$out/fog.png"
"$tessera" "$passes" --aov:layer=ViewLayer color "${position[@]}" \
  --solid:procedure=marble:box=-6,-6,-6,6,6,6:freq=8:lod=1 -d uint8 -o "$out/marble.png"
"$tessera" "${position[@]}" "$out/map.exr" --shadow:light="$light":pcf=5 -d half -o "$out/soft.exr"
"$tessera" "$passes" --aov normal --phong:light="$sun":diffuse=2.4,2.2,1.9 "$out/soft.exr" --mul --addc 0.25,0.3,0.4 \
  "$passes" --aov albedo --mul -d uint8 -o "$out/relit.png"
"$tessera" "${sky[@]}" --envmap:position=1:"$up" -d uint8 -o "$out/mirror.png"
"$tessera" "${sky[@]}" --envmap:position=1:gloss=20:"$up" -d uint8 -o "$out/glossy.png"
"$tessera" "${position[@]}" --noiseat:dims=3:freq=6 --normalmap:scale=4 \
  "$passes" --aov normal "$passes" --aov normal --ch X=1.0,Y=0.0,Z=0.01 --tangentnormals:packed=0 \
  --phong:light="$sun":diffuse=0.9:ambient=0.08 -d uint8 -o "$out/dented.png"
pictures=()
for picture in fog marble relit mirror glossy dented; do pictures+=("$out/$picture.png" --ch R,G,B); done
oiiotool "${pictures[@]}" --mosaic:pad=4 3x2 -o "$out/pictures.png"
echo "pictures  $out/pictures.png"
