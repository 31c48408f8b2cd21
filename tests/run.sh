#!/bin/sh
# Sets the machine up, builds everything and runs every test.
#   tests/run.sh [--preset release|debug|asan|asan-avx512|tsan] [CTEST_OPTION...]
set -eu

preset=release
case "${1:-}" in
  --preset) preset=${2:?tests/run.sh: --preset needs a name: release, debug, asan or tsan}; shift 2 ;;
  --preset=*) preset=${1#*=}; shift ;;
  -h|--help) sed -n '2,3s/^# *//p' "$0"; exit 0 ;;
esac

cd "$(dirname "$0")/.."
# What only tests want: a scheduler, Dask, what pictures of science are drawn with.
./samples/setup.sh slurm-wlm munge python3-dask python3-distributed python3-zarr python3-xarray python3-matplotlib python3-tqdm
cmake --preset "$preset"
cmake --build --preset "$preset"
# Suppressed leaks are recognised by their stack, through libraries without frame pointers: slow, so no more of it than
# they need.
case "$preset" in asan*)
  export LSAN_OPTIONS="suppressions=$PWD/tests/support/lsan.supp print_suppressions=0 ${LSAN_OPTIONS:-}"
  export ASAN_OPTIONS="fast_unwind_on_malloc=0 malloc_context_size=16 ${ASAN_OPTIONS:-}"
  export UBSAN_OPTIONS="halt_on_error=1 print_stacktrace=1 ${UBSAN_OPTIONS:-}"  # else findings pass unseen
esac
# Readers in a sandbox are forked from a program with threads and have threads of their own.
export TSAN_OPTIONS="suppressions=$PWD/tests/support/tsan.supp die_after_fork=0 ${TSAN_OPTIONS:-}"
exec ctest --test-dir "build/$preset" --output-on-failure -j "$(nproc)" "$@"
