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
head="file=$scan:dims=181,217,181:type=uint8:header=352:up=z"
seen="azimuth=35:elevation=8:zoom=1.3:size=640x640"
skin_of="mode=iso:iso=.2:color=.82,.62,.5:specular=.15"
"$tessera" "--volume:$head:$seen:$skin_of:samples=4" -o "$skin"
# The front is cut away, the rest closed by a thin slab of tissue as it is, unlit: fluid is clear below .24; grey matter
# has about .37, white matter .44, fat .7. value,r,g,b,opacity of .003 (the head is 2 long):
tissue=.24,.1,.03,.02,0,.27,.3,.09,.07,.9,.33,.55,.31,.26,.99,.38,.66,.45,.38,.99
tissue=$tissue,.44,.93,.84,.75,.99,.6,.94,.86,.74,.99,.8,1,.86,.55,.99
"$tessera" "--volume:$head:$seen:$skin_of:planes=0,-1,-.35,-.09" \
  "--volume:with=1:$head:mode=under:planes=0,-1,-.35,-.12:step=.003:transfer=$tissue:transferlength=.003:samples=4" \
  -o "$cut"
echo "$skin, $cut: 640x640"
