#!/bin/sh
# Writes the source of a library that stands in for a shared one: every function calls tessera_start_over(), objects are
# zeros of the same size.
#   stand_in.sh NM REAL SOURCE MAP USER...    USERs are shared libraries or archives that link REAL
# Weak symbols (inline functions, instantiations) are there only where a USER asks for them: others have their own.
set -eu
nm=$1 real=$2 source=$3 map=$4
shift 4
{
  for user; do
    case $user in
      *.a) "$nm" -u "$user" ;;
      *) "$nm" -D -u "$user" ;;
    esac | awk 'NF > 1 { sub(/@.*/, "", $NF); print "asked", $NF }'
  done
  "$nm" -D -S --defined-only --with-symbol-versions "$real"
} | awk -v source="$source" -v map="$map" '
  BEGIN { print "void tessera_start_over(void);" > source }
  $1 == "asked" { asked[$2] = 1; next }
  {
    type = $(NF - 1); name = $NF; version = ""
    if (split(name, parts, /@+/) > 1) { name = parts[1]; version = parts[2] }
    if (type == "A" || name in seen || name !~ /^[A-Za-z_][A-Za-z0-9_]*$/) next
    if (type !~ /[TDBR]/ && !(name in asked)) next
    if (name == "_init" || name == "_fini") next
    seen[name] = 1
    if (type ~ /[TWi]/) {
      print "void " name "(void) { tessera_start_over(); }" > source
    } else {
      print "__attribute__((aligned(64))) char " name "[0x" (NF == 4 ? $2 : "8") "];" > source
    }
    names[version] = names[version] " " name ";"
  }
  END {
    for (version in names) {
      print (version == "" ? "{ global: *; };" : version " { global:" names[version] " };") > map
    }
  }'
