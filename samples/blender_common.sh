# What the samples with Blender share; sourced as ". blender_common.sh NAME [OUTDIR]" by the sample NAME.
# Sets out, tessera and here; without Blender or oiiotool it says so and exits with 77 (skipped).
fail() {
  echo "$name.sh: error: $*" >&2
  exit 1
}
name=$1
here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
out=${2:-$name}
tessera=${TESSERA:-tessera}
for program in "blender blender" "oiiotool openimageio-tools"; do
  command -v "${program% *}" >/dev/null ||
    { echo "$name.sh: skipped: ${program% *} is not installed (Debian package ${program#* })"; exit 77; }
done
command -v "$tessera" >/dev/null || fail "$tessera: no such program; set TESSERA"
mkdir -p "$out"

# cycles SCRIPT.py FILE ARGUMENTS...: runs a script of this folder in Blender, which has to write FILE in the output folder.
cycles() {
  blender -b --factory-startup -P "$here/$1" -- "$(realpath "$out")/$2" "${@:3}" >"$out/blender.log" 2>&1 ||
    fail "Blender failed: $(tail -n 1 "$out/blender.log")"
  [ -f "$out/$2" ] || fail "Blender wrote no picture (see $out/blender.log)"
}
# said NAME: what the script printed as NAME=...
said() { sed -n "s/^$1=//p" "$out/blender.log"; }
# statistic NAME FILE: oiiotool's Max, Avg, ... of the first channel.
statistic() { oiiotool --stats "$2" | sed -n "s/.*Stats $1: *\([-0-9.e+]*\).*/\1/p"; }
# at_most VALUE LIMIT MESSAGE
at_most() { awk -v v="$1" -v limit="$2" 'BEGIN { exit !(v <= limit) }' || fail "$3"; }
