#!/usr/bin/python3
"""Holds bench_volume's lit picture against that of VTK's fixed-point volume ray caster: the same field and view.

usage: xvfb-run -a bench/vtk_volume.py BENCH_VOLUME [OUT.json]

BENCH_VOLUME is the program (build/release/bin/bench_volume). It writes the field: 256^3 unsigned 16-bit distances,
negative (inside) below 32768. The two take turns, on two threads each, so that what else the machine does meets both.
VTK's mapper works on the processor; its window (Mesa's software renderer under xvfb) only shows the finished picture.
Two of its times are taken: the whole frame, and the ray casting alone, which is the one that is compared. OUT.json is
what bench/report reads. Needs Debian's python3-vtk9 and xvfb.
"""
import json
import math
import os
import pathlib
import statistics
import subprocess
import sys
import tempfile
import time

try:
    import vtk
except ImportError:
    sys.exit("vtk_volume: error: found no VTK for this Python, expected Debian's python3-vtk9 and xvfb, and its "
             "/usr/bin/python3")

SIDE, ZOOM, AZIMUTH, ELEVATION, VIEW = 256, 2, 25, 15, 30  # as in bench_volume.cc
SIZES, THREADS, REPETITIONS, TURNS = [(300, 300), (1024, 768)], 2, 5, 5


def seconds(call):
    times = []
    for _ in range(REPETITIONS):
        start = time.perf_counter()
        call()
        times.append(time.perf_counter() - start)
    return times


def tessera_seconds(program, size):
    """Frames of bench_volume's lit picture, by its own measure: the median and the least."""
    with tempfile.NamedTemporaryFile(suffix=".json") as out:
        subprocess.run([program, f"--benchmark_filter=volume/lit/.*/{size[0]}x{size[1]}/threads:{THREADS}/",
                        f"--threads={THREADS}", f"--repetitions={REPETITIONS}", f"--benchmark_out={out.name}",
                        "--benchmark_out_format=json"],
                       check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        rows = json.loads(pathlib.Path(out.name).read_text())["benchmarks"]
    ours = next(row for row in rows if "/tessera" in row["name"])
    return [ours[key] * size[0] * size[1] / 1e9 for key in ("ns_per_pixel", "ns_per_pixel_min")]


def copy_milliseconds(size):
    """A copy of the picture's bytes, as four floats a pixel: the unit of the report's tables."""
    source, target = bytearray(size[0] * size[1] * 16), bytearray(size[0] * size[1] * 16)

    def copy():
        target[:] = source

    copy()
    return statistics.median(seconds(copy)) * 1e3


def volume(field):
    reader = vtk.vtkImageReader2()
    reader.SetFileName(str(field))
    reader.SetFileDimensionality(3)
    reader.SetDataScalarTypeToUnsignedShort()
    reader.SetDataByteOrderToLittleEndian()
    reader.SetDataExtent(0, SIDE - 1, 0, SIDE - 1, 0, SIDE - 1)
    reader.FileLowerLeftOn()
    spacing = 2 / SIDE
    reader.SetDataSpacing(spacing, spacing, spacing)
    reader.SetDataOrigin(*[-0.5 * (SIDE - 1) * spacing] * 3)
    reader.Update()
    mapper = vtk.vtkFixedPointVolumeRayCastMapper()
    mapper.SetInputConnection(reader.GetOutputPort())
    mapper.SetNumberOfThreads(THREADS)
    mapper.AutoAdjustSampleDistancesOff()
    mapper.LockSampleDistanceToInputSpacingOff()
    mapper.SetImageSampleDistance(1)
    mapper.SetSampleDistance(spacing)  # a voxel
    opacity = vtk.vtkPiecewiseFunction()  # inside is opaque
    for value, alpha in [(0, 1), (32767, 1), (32768, 0), (65535, 0)]:
        opacity.AddPoint(value, alpha)
    color = vtk.vtkColorTransferFunction()
    color.AddRGBPoint(0, 0.80, 0.60, 0.42)
    shading = vtk.vtkVolumeProperty()
    shading.SetScalarOpacity(opacity)
    shading.SetColor(color)
    shading.SetInterpolationTypeToLinear()
    shading.ShadeOn()
    shading.SetAmbient(0.25)
    shading.SetDiffuse(0.75)
    shading.SetSpecular(0.35)
    shading.SetSpecularPower(40)
    drawn = vtk.vtkVolume()
    drawn.SetMapper(mapper)
    drawn.SetProperty(shading)
    return mapper, drawn


def covered(window):
    """The share of pixels that are not black."""
    grab = vtk.vtkWindowToImageFilter()
    grab.SetInput(window)
    grab.ReadFrontBufferOff()
    grab.Update()
    image = grab.GetOutput()
    values = memoryview(image.GetPointData().GetScalars()).tobytes()
    return sum(map(any, zip(values[0::3], values[1::3], values[2::3]))) / (len(values) // 3)


def scene(field, size):
    """The mapper and its window, once warm."""
    mapper, drawn = volume(field)
    renderer = vtk.vtkRenderer()
    renderer.AddVolume(drawn)
    window = vtk.vtkRenderWindow()
    window.SetOffScreenRendering(1)
    window.SetMultiSamples(0)
    window.SetSize(*size)
    window.AddRenderer(renderer)
    azimuth, elevation = math.radians(AZIMUTH), math.radians(ELEVATION)
    away = math.sqrt(3) / math.sin(math.radians(VIEW / 2)) / ZOOM
    camera = renderer.GetActiveCamera()
    camera.SetPosition(away * math.sin(azimuth) * math.cos(elevation), away * math.sin(elevation),
                       away * math.cos(azimuth) * math.cos(elevation))
    camera.SetFocalPoint(0, 0, 0)
    camera.SetViewUp(0, 1, 0)
    camera.SetViewAngle(VIEW)
    renderer.ResetCameraClippingRange()
    window.Render()  # gradients and tables are made once
    share = covered(window)
    if not 0.1 < share < 0.9:
        sys.exit(f"vtk_volume: error: found {share:.0%} of the picture covered, expected the body")
    return mapper, window


def row(size, cast, frame):
    name = f"volume/lit/uint16 field/{size[0]}x{size[1]}/threads:{THREADS}/VTK"
    copy = copy_milliseconds(size)
    return {"name": name, "run_name": name, "run_type": "iteration", "real_time": cast, "time_unit": "ms",
            "ns_per_pixel": cast * 1e6 / (size[0] * size[1]), "times_copy": cast / copy, "copy_share": copy / cast,
            "frames_per_second": 1e3 / cast, "milliseconds_with_display": frame}


def main():
    if len(sys.argv) not in (2, 3):
        sys.exit(__doc__)
    program = sys.argv[1]
    if not os.access(program, os.X_OK):
        sys.exit(f"vtk_volume: error: {program}: found no program, expected bench_volume")
    if not os.environ.get("DISPLAY"):
        sys.exit("vtk_volume: error: found no display, expected one as xvfb-run -a gives it")
    results = []
    with tempfile.TemporaryDirectory() as directory:
        field = pathlib.Path(directory) / "field.raw"
        subprocess.run([program, f"--field={field}"], check=True)
        for size in SIZES:
            mapper, window = scene(field, size)
            ours, cast, frame = [], [], []
            for _ in range(TURNS):
                ours += tessera_seconds(program, size)
                cast += seconds(mapper.RenderSubVolume)
                frame += seconds(window.Render)
            least, fewest = min(ours) * 1e3, min(cast) * 1e3
            ours, cast, frame = (statistics.median(times) * 1e3 for times in (ours[::2], cast, frame))
            print(f"{size[0]}x{size[1]}, {THREADS} threads, median (least) ms: tessera {ours:.1f} ({least:.1f}), VTK's "
                  f"ray casting alone {cast:.1f} ({fewest:.1f}): {cast / ours:.1f} ({fewest / least:.1f}) times that; "
                  f"its frame {frame:.1f}")
            results.append(row(size, cast, frame))
    if len(sys.argv) == 3:
        out = {"context": {"VTK": vtk.vtkVersion().GetVTKVersion()}, "benchmarks": results}
        pathlib.Path(sys.argv[2]).write_text(json.dumps(out, indent=1))


if __name__ == "__main__":
    main()
