#!/usr/bin/python3
"""Measures VTK's fixed-point volume ray caster on the field and the view of bench_volume's lit picture.

usage: bench_volume --field=FIELD.raw && xvfb-run -a bench/vtk_volume.py FIELD.raw OUT.json

FIELD.raw holds 256^3 unsigned 16-bit distances, negative (inside) below 32768. The mapper runs on two threads, on
the processor; its window (Mesa's software renderer under xvfb) only shows the finished picture. Two times are taken:
the whole frame, and the ray casting alone, which is the one that is compared. OUT.json is what bench/report reads.
Needs python3-vtk9 and xvfb.
"""
import json
import math
import pathlib
import statistics
import sys
import time

import vtk

SIDE, ZOOM, AZIMUTH, ELEVATION, VIEW = 256, 2, 25, 15, 30  # as in bench_volume.cc
SIZES, THREADS, REPETITIONS = [(300, 300), (1024, 768)], 2, 9


def median_seconds(call):
    times = []
    for _ in range(REPETITIONS):
        start = time.perf_counter()
        call()
        times.append(time.perf_counter() - start)
    return statistics.median(times)


def copy_seconds(size):
    """A copy of the picture's bytes, as four floats a pixel: the unit of the report's tables."""
    source, target = bytearray(size[0] * size[1] * 16), bytearray(size[0] * size[1] * 16)

    def copy():
        target[:] = source

    copy()
    return median_seconds(copy)


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


def main():
    if len(sys.argv) != 3:
        sys.exit(__doc__)
    field, out = map(pathlib.Path, sys.argv[1:])
    if not field.is_file() or field.stat().st_size != 2 * SIDE ** 3:
        sys.exit(f"vtk_volume: error: {field}: found no {SIDE}^3 16-bit samples, expected what bench_volume --field= writes")
    results = []
    for size in SIZES:
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
        frame = median_seconds(window.Render)
        cast = median_seconds(mapper.RenderSubVolume)
        copy = copy_seconds(size)
        print(f"VTK {size[0]}x{size[1]}, {THREADS} threads, {share:.0%} covered: frame {frame * 1e3:.1f} ms, "
              f"ray casting alone {cast * 1e3:.1f} ms")
        name = f"volume/lit/uint16 field/{size[0]}x{size[1]}/threads:{THREADS}/VTK"
        pixels = size[0] * size[1]
        results.append({"name": name, "run_name": name, "run_type": "iteration", "real_time": cast * 1e3,
                        "time_unit": "ms", "ns_per_pixel": cast * 1e9 / pixels, "times_copy": cast / copy,
                        "copy_share": copy / cast, "frames_per_second": 1 / cast, "milliseconds_with_display": frame * 1e3})
    out.write_text(json.dumps({"context": {"VTK": vtk.vtkVersion().GetVTKVersion()}, "benchmarks": results}, indent=1))


if __name__ == "__main__":
    main()
