#!/bin/sh
# Runs the benchmark programs on tiny pictures and reports them: everything but the timing is checked.
# usage: smoke.sh BENCH_OPS BENCH_PIPELINES SCRATCH_DIRECTORY
set -eu
here=$(dirname "$0")
out=$3
rm -rf "$out"
mkdir -p "$out"

fail() {
  echo "smoke.sh: error: $*" >&2
  exit 1
}

small="--sizes=160x64 --repetitions=1"
# Without those whose references alone take minutes; other tests hold them to these.
"$1" $small --targets=best --threads=1 --benchmark_filter='-ops/(lic|deband|reproject|nlmeans|softshadow|dof)/' \
  --benchmark_out="$out/ops.json" --benchmark_out_format=json >"$out/ops.log"
"$2" $small --targets=all --threads=1,2 --benchmark_out="$out/pipelines.json" --benchmark_out_format=json >"$out/pipelines.log"
"$here/../../bench/report" "$out/ops.json" "$out/pipelines.json" --out "$out/report" 2>"$out/warnings"
[ ! -s "$out/warnings" ] || fail "$(cat "$out/warnings")"

for file in index.html report.md; do
  [ -s "$out/report/$file" ] || fail "$file is missing"
done
for task in ops-saturate ops-add pipelines-eight-folded pipelines-eight-unfoldable pipelines-matrix-4x4; do
  for pixels in float half uint8; do
    for threads in 1 2; do
      case $task in ops-*) [ $threads = 1 ] || continue ;; esac
      plot=$out/report/plots/$task-$pixels-160x64-t$threads.svg
      grep -q '>tessera ' "$plot" || fail "$plot shows no point of this library"
      grep -q '>OpenImageIO ' "$plot" || fail "$plot shows no point of OpenImageIO"
    done
  done
done
grep -q "pipelines/eight folded" "$out/pipelines.json" || fail "the JSON has no folded chain"

# A wrong flag is an error that says what was expected.
if "$2" --sizes=wide 2>"$out/error"; then fail "a malformed size was accepted"; fi
grep -q "expected WIDTHxHEIGHT" "$out/error" || fail "a malformed size gave: $(cat "$out/error")"
