#!/bin/sh
# A scanned head (magnetic resonance, 181x217x181 bytes, from Debian's mricron-data): its skin, and cut open.
#   samples/head.sh TESSERA [skin.png cut.png]
set -eu
tessera=${1:?usage: samples/head.sh TESSERA [skin.png cut.png]}
skin=${2:-skin.png}
cut=${3:-cut.png}

"$(dirname "$0")/setup.sh" mricron-data
scan=$(mktemp)
trap 'rm -f "$scan"' EXIT
gunzip -c /usr/share/mricron/templates/ch2.nii.gz >"$scan"

# A NIfTI file is 352 bytes of header, then samples: left to right, back to front, feet to head.
head="file=$scan:dims=181,217,181:type=uint8:header=352:up=z:azimuth=35:elevation=8:zoom=1.3:size=640x640"
"$tessera" "--volume:$head:mode=iso:iso=0.2:color=.82,.62,.5:specular=.15:samples=4" -o "$skin"
# Nothing below 0.22; grey matter about 0.45, white matter 0.65. The front is cut away.
"$tessera" "--volume:$head:mode=under:planes=0,-1,-.35,-.12:shade=1:specular=0:ambient=.55:\
transfer=.22,.5,.25,.2,0,.3,.8,.5,.4,.25,.5,.85,.6,.5,.6,.62,1,.92,.85,.8,1,1,1,1,.9:transferlength=.02:samples=4" -o "$cut"
echo "$skin, $cut: 640x640"
