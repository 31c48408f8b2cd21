#!/bin/sh
# Installs the peers, builds the release preset, measures everything against them and writes the report.
#   bench/run.sh            all sizes, targets, pixel types, one and two threads (about half an hour)
#   bench/run.sh --quick    the pipelines at 3840x2160 and the operations at 1920x1080, best target, one thread
#   bench/run.sh --readme   also refreshes bench/measured.json and the table in README.md
#   bench/run.sh --peers FOLDER   sources of the newest peers (see bench/newest); without, ../peers where there is one
# Output: build/bench/index.html, report.md, plots/, *.json, start.log (the program's start), thumbnails.log (--batch),
#   streams.log (--stream beside FFmpeg),
#   displays.log (PNG files for a display against OpenColorIO and a browser), dask.log (chunks on Dask, two workers)
set -eu
cd "$(dirname "$0")/.."

quick=
readme=
sources=../peers
while [ $# -gt 0 ]; do
  case $1 in
    --quick) quick=1 ;;
    --readme) readme=1 ;;
    --peers)
      [ -d "${2-}" ] || { echo "bench/run.sh: error: --peers: found '${2-}', expected a folder of sources" >&2; exit 2; }
      sources=$2
      shift ;;
    *) echo "bench/run.sh: error: $1: found an unknown argument, expected --quick, --readme or --peers FOLDER" >&2; exit 2 ;;
  esac
  shift
done

samples/setup.sh python3-pyopencolorio libnoise-dev libopencv-dev libvips-dev libvips-tools ffmpeg meson autoconf automake libtool liblcms2-dev libpixman-1-dev librsvg2-bin python3 python3-dask python3-distributed \
  python3-vtk9 xvfb xauth
if [ -d "$sources" ]; then
  bench/newest "$sources"
else
  echo "no sources of newer peers: those that the system ships are measured alone (bench/newest says which are wanted)"
fi
build=build/release
cmake --preset release >/dev/null
cmake --build --preset release --target bench_composite bench_curves bench_environment bench_filter bench_footprint bench_layouts \
  bench_lic bench_lookup bench_noise bench_ops bench_pipelines bench_resample bench_shade bench_volume tessera_cli tessera_python
out=build/bench
rm -rf "$out"
mkdir -p "$out"

# measure NAME PROGRAM FLAGS...: one JSON file per run; the programs interleave their contestants themselves.
measure() {
  name=$1
  program=$2
  shift 2
  echo "measuring $name"
  "$build/bin/$program" "$@" --benchmark_out="$out/$name.json" --benchmark_out_format=json >"$out/$name.log"
}

if [ -n "$quick" ]; then
  measure pipelines bench_pipelines --sizes=3840x2160 --targets=best --threads=1,2 --seconds=1
  measure curves bench_curves --sizes=3840x2160 --types=float --targets=best --threads=1 --seconds=1
  measure lookup bench_lookup --sizes=3840x2160 --targets=best --threads=1 --seconds=1
  measure noise bench_noise --targets=best --threads=1 --seconds=1
  measure filter bench_filter --sizes=3840x2160 --targets=best --threads=1,2 --seconds=1
  measure layouts bench_layouts --sizes=1920x1080 --types=float,uint8 --targets=best --threads=1 --seconds=0.2
  measure shade bench_shade --sizes=3840x2160 --targets=best --threads=2 --seconds=1
  measure composite bench_composite --sizes=3840x2160 --types=float,uint8 --targets=best --threads=1,2 --seconds=1
  measure environment bench_environment --types=half --targets=best --threads=2 --repetitions=7
  measure footprint bench_footprint --sizes=1920x1080 --targets=best --threads=1 --seconds=1
  measure lic bench_lic --quick --targets=best --repetitions=5
  measure ops bench_ops --sizes=1920x1080 --targets=best --threads=1 --seconds=1
  measure resample bench_resample --sizes=1920x1080 --targets=best --threads=1 --seconds=1
  measure volume bench_volume --threads=2 --seconds=1
else
  measure pipelines bench_pipelines --sizes=3840x2160,1920x1080 --targets=all --threads=1,2
  measure curves bench_curves --sizes=3840x2160 --types=float,uint8 --targets=all --threads=1,2
  measure lookup bench_lookup --sizes=3840x2160 --targets=all
  measure noise bench_noise --targets=all
  measure filter bench_filter --sizes=3840x2160 --targets=all --threads=1,2 --seconds=2
  measure layouts bench_layouts --sizes=1920x1080 --types=float,uint16,uint8 --targets=best --threads=1 --seconds=0.5
  measure shade bench_shade --sizes=3840x2160 --targets=all --threads=1,2 --seconds=2
  measure composite bench_composite --sizes=3840x2160 --types=float,half,uint8 --targets=all --threads=1,2
  measure environment bench_environment --types=half,float --targets=all --threads=1,2
  measure footprint bench_footprint --sizes=1920x1080 --targets=all --threads=1,2 --seconds=2
  measure lic bench_lic --targets=best
  "$build/bin/bench_lic" --table >"$out/lic.md"  # integrators and steps: end-point error, time
  measure volume bench_volume --threads=2 --seconds=3
  measure ops bench_ops --sizes=3840x2160,1920x1080 --targets=all --threads=1,2
  measure resample bench_resample --sizes=3840x2160 --targets=all --threads=1,2 --seconds=5
  measure pipelines-large bench_pipelines --sizes=large --targets=best --threads=1,2
fi
# VTK's ray caster beside the lit volume; its window needs a display.
xvfb-run -a bench/vtk_volume.py "$build/bin/bench_volume" "$out/volume-vtk.json" >"$out/vtk.log"
echo "measuring start"
bench/start "$build/bin/tessera" >"$out/start.log"
echo "comparing displays"
bench/displays "$build/bin/tessera" >"$out/displays.log"
echo "measuring thumbnails"
bench/thumbnails "$build/bin/tessera" ${quick:+--jobs 500} >"$out/thumbnails.log"
echo "measuring streams"
bench/streams "$build/bin/tessera" ${quick:+--frames 20} >"$out/streams.log"
echo "measuring Dask"
PYTHONPATH="$build/python" bench/dask ${quick:+--side 4096 --repeat 3} >"$out/dask.log"
bench/report "$out"/*.json --out "$out"
[ -z "$readme" ] || bench/readme "$out"/*.json
