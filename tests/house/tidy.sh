#!/bin/sh
# Runs clang-tidy, by the rules of .clang-tidy, over the sources named, or over a few that say much of the rest.
#   tests/house/tidy.sh [--build DIR] [FILE...]
# The build's compile database names precompiled headers of another compiler; this writes one without them, DIR/tidy.
set -eu
cd "$(dirname "$0")/../.."
build=build/release
if [ "${1:-}" = --build ]; then build=${2:?tidy.sh: --build needs a folder}; shift 2; fi
[ -f "$build/compile_commands.json" ] || { echo "tidy.sh: error: $build/compile_commands.json: not there, configure first" >&2; exit 1; }
[ $# -gt 0 ] || set -- src/graph/plan.cc src/cli/describe.cc src/ops/modifiers.cc
mkdir -p "$build/tidy"
python3 - "$build/compile_commands.json" >"$build/tidy/compile_commands.json" <<'END'
import json, re, sys
commands = json.load(open(sys.argv[1]))
for entry in commands:
    entry["command"] = re.sub(r" -Winvalid-pch| -include \S*cmake_pch\.hxx", "", entry["command"]) + " -Wno-unknown-warning-option"
json.dump(commands, sys.stdout)
END
exec clang-tidy --quiet --warnings-as-errors='*' -p "$build/tidy" "$@"
