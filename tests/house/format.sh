#!/bin/sh
# Fails, naming files and lines, where a source is not as clang-format with .clang-format would leave it.
#   tests/house/format.sh [FILE...]     without files: every source of the project
set -eu
cd "$(dirname "$0")/../.."
if [ $# -gt 0 ]; then
  exec clang-format --style=file --dry-run --Werror "$@"
fi
find include src tests bench samples \( -name '*.h' -o -name '*.cc' -o -name '*.c' \) -print0 |
  xargs -0 clang-format --style=file --dry-run --Werror
