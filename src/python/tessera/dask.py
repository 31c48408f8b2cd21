"""Graphs on Dask's arrays, of any size: every chunk of the result is computed from exactly the pixels that it needs,
which the engine's own planner tells, on whatever machine Dask chooses. Bits are those of one machine.

>>> import dask.array as da
>>> import tessera as ts
>>> look = ts.graph(lambda image: image.saturate(1.2).blur(sigma=3))
>>> soft = ts.dask.apply(look, da.from_zarr("plate.zarr"))
>>> soft.to_zarr("soft.zarr")
"""
import pickle

import dask.array as da
import numpy as np
from dask.base import tokenize
from dask.highlevelgraph import HighLevelGraph

from . import _core
from .errors import DataError, UsageError
from .graph import Graph, graph as recorded
from .image import Image, _dtype_of, _samples_of, _TYPE_OF, from_rows
from .options import current, options as evaluated


class _Input:
    """What every task knows of an array: where its chunks begin, and how it is an image."""

    def __init__(self, array, channels):
        self.key = array.name
        self.bounds = [np.concatenate([[0], np.cumsum(sizes)]).astype(int) for sizes in array.chunks]
        self.shape = tuple(map(int, array.shape))
        self.type = _TYPE_OF[array.dtype]
        self.channels = channels

    def part(self, pixels=None, x=0, y=0):
        """The image of which `pixels`, from (x, y) on, are there; or none."""
        samples = None
        if pixels is not None:
            pixels, samples = _samples_of(pixels, "part")
        height, width, count = self.shape
        return Image(_core.from_part(samples, x, y, (0, 0, width, height), count, self.channels, self.type, pixels))

    def pieces(self, region):
        """(chunk, slices of it, where they begin in the region) of all chunks that have some of it."""
        x0, y0, x1, y1 = region
        axes = []
        for bounds, first, last in zip(self.bounds, (y0, x0, 0), (y1, x1, self.shape[2])):
            low = int(np.searchsorted(bounds, first, "right")) - 1
            axes.append([(k, slice(max(first - int(bounds[k]), 0), min(last, int(bounds[k + 1])) - int(bounds[k])),
                          max(int(bounds[k]) - first, 0))
                         for k in range(low, int(np.searchsorted(bounds, last, "left")))])
        for i, rows, y in axes[0]:
            for j, columns, x in axes[1]:
                for k, samples, c in axes[2]:
                    whole = all(s == slice(0, int(b[n + 1] - b[n])) for s, b, n in zip(
                        (rows, columns, samples), self.bounds, (i, j, k)))
                    yield (i, j, k), None if whole else (rows, columns, samples), (y, x, c)


class _Job:
    """What all tasks of an array share: the graph, its inputs and how it is evaluated."""

    def __init__(self, look, inputs, dtype, options):
        self.look, self.inputs, self.dtype, self.options = look, inputs, dtype, options


def _cut(chunk, slices):
    """A part of a chunk, which need not be kept for it."""
    return np.ascontiguousarray(chunk[slices])


def _assembled(region, pieces, count):
    """The pixels of a region from those of chunks."""
    x0, y0, x1, y1 = region
    shape = (y1 - y0, x1 - x0, count)
    if len(pieces) == 1 and pieces[0][1].shape == shape:
        return pieces[0][1]
    pixels = np.empty(shape, pieces[0][1].dtype)
    for (y, x, c), piece in pieces:
        h, w, n = piece.shape
        pixels[y:y + h, x:x + w, c:c + n] = piece
    return pixels


def _computed(job, region, parts):
    """A chunk of the result. `parts`: of each input, by its name, the region and the pieces that cover it."""
    images = {}
    for name, needed, pieces in parts:
        given = job.inputs[name]
        if pieces:
            pixels = _assembled(needed, pieces, given.shape[2])
            images[name] = given.part(pixels, needed[0], needed[1])
        else:
            images[name] = given.part()
    with evaluated(**job.options):
        return job.look(**images).render(region=region, dtype=job.dtype)


def _array_of(array, subject):
    """A Dask array as rows of pixels of channels, of a type that images have."""
    if array.ndim == 2:
        array = array[:, :, np.newaxis]
    if array.ndim != 3:
        raise UsageError(subject, f"found {array.ndim} axes, expected height x width x channels")
    if array.dtype not in _TYPE_OF:
        raise UsageError(subject, f"found {array.dtype}, expected uint8, uint16, float16 or float32; "
                                  "array.astype(numpy.float32) makes that")
    if any(np.isnan(size) for size in array.shape):
        raise UsageError(subject, "found chunks of unknown size, expected known ones; "
                                  "array.compute_chunk_sizes() makes that")
    if 0 in array.shape:
        raise UsageError(subject, f"found no pixel in {array.shape}, expected at least one")
    return array


def _graph_of(look):
    if isinstance(look, Graph):
        return look
    if isinstance(look, Image):
        text, inputs = _core.to_json(look)
        return Graph(text, {name: Image(pixels) for name, pixels in inputs})
    if callable(look):
        return recorded(look)
    raise UsageError("graph", f"found {type(look).__name__}, expected a tessera.Graph, an image or a function of images")


def _bound(look, arrays, named):
    """Values by the names of the open inputs: Dask's arrays, and what every task has whole."""
    if len(arrays) > len(look.inputs):
        raise UsageError("graph", f"found {len(arrays)} arrays, expected {len(look.inputs)} "
                                  f"({', '.join(look.inputs) or 'none'})")
    bound = dict(zip(look.inputs, arrays))
    for name, value in named.items():
        if name in bound:
            raise UsageError(name, "found twice, expected it once")
        if name not in look.inputs:
            raise UsageError(name, "is no open input of the graph, expected " + (", ".join(look.inputs) or "none"))
        bound[name] = value
    missing = [name for name in look.inputs if name not in bound]
    if missing:
        raise UsageError(missing[0], "is an open input of the graph, expected an array for it")
    open_ones = {name: _array_of(value, name) for name, value in bound.items() if isinstance(value, da.Array)}
    return open_ones, {name: value for name, value in bound.items() if name not in open_ones}


def _channels_of(channels, name, array):
    names = channels.get(name) if isinstance(channels, dict) else channels
    names = names.split(",") if isinstance(names, str) else list(names or [])
    if names and len(names) != array.shape[2]:
        raise UsageError("channels", f"found {len(names)} names, expected {array.shape[2]}")
    return names


def apply(graph, *arrays, chunks=None, dtype=None, channels=None, threads=1, **named):
    """The graph's result of Dask arrays, as a Dask array of height x width x channels. Nothing is computed yet.

    graph: a tessera.Graph, a function of images (as tessera.graph takes it), or an image, for what has no open
        inputs (files, generators): its chunks are computed one by one.
    arrays, named: for its open inputs, as in a call of the graph. A Dask array (height x width x channels, or height x
        width; uint8, uint16, float16 or float32) stays where it is: a task is sent the part of it that its chunk
        needs, halos and borders included, and no more. Anything else (NumPy's arrays, images) every task has whole.
    chunks: of the result, as Dask takes them, (rows, columns) or all three; by default those of the first array
        where its size is the result's, else Dask's choice. Channels are not divided.
    dtype: of the result: float32, or what `Image.render` takes. Integers are rounded once.
    channels: names of the arrays' channels where they are not R, G, B, A; a dictionary for inputs that differ.
    threads: of a task. Dask runs one on each of a worker's threads.

    `tessera.options` around the call holds for the tasks. Raises DataError that names the operation for one that
    needs all of an array, with the method that does not where there is one; `tessera.dask.image` is the way then.
    """
    look = _graph_of(graph)
    open_arrays, whole = _bound(look, arrays, named)
    captured = {**look._captured, **whole}
    look = Graph(look.text, captured) if whole else look
    inputs = {name: _Input(array, _channels_of(channels, name, array)) for name, array in open_arrays.items()}
    given = {name: value for name, value in current().items() if name in ("memory", "optimize", "rules_off")}
    with evaluated(threads=threads):  # refuses what is no number of threads
        given["threads"] = threads
        empty = {name: description.part() for name, description in inputs.items()}
        result = look(**empty)
        try:
            prepared = _core.Prepared(result, current())
        except DataError as error:
            if "all of which it needs" not in error.reason:
                raise
            raise DataError(error.subject, error.reason + "; tessera.dask.image(array) gives it whole, rows by "
                                                          "rows") from None
    dtype = np.dtype(np.float32) if dtype is None else _dtype_of(dtype)
    sizes = _chunks_of(chunks, result.shape, open_arrays, dtype)
    job = _Job(look, inputs, _TYPE_OF[dtype], given)
    token = tokenize(pickle.dumps(job), *(array.name for array in open_arrays.values()), sizes)
    name, job_name, part_name = f"tessera-{token}", f"tessera-graph-{token}", f"tessera-part-{token}"
    tasks = {job_name: job}
    left, top, _, _ = result.data_window
    y0 = top
    for i, rows in enumerate(sizes[0]):
        x0 = left
        for j, columns in enumerate(sizes[1]):
            region = (x0, y0, x0 + columns, y0 + rows)
            parts = []
            for number, (key, description) in enumerate(inputs.items()):
                needed = prepared.required(empty[key], region)
                pieces = []
                for chunk, slices, corner in description.pieces(needed) if needed[2] > needed[0] else ():
                    source = (description.key, *chunk)
                    if slices is not None:
                        cut = (part_name, number, i, j, *chunk)
                        tasks[cut] = (_cut, source, slices)
                        source = cut
                    pieces.append([corner, source])
                parts.append([key, needed, pieces])
            tasks[(name, i, j, 0)] = (_computed, job_name, region, parts)
            x0 += columns
        y0 += rows
    layers = HighLevelGraph.from_collections(name, tasks, dependencies=list(open_arrays.values()))
    return da.Array(layers, name, chunks=sizes, dtype=dtype, shape=result.shape)


def _chunks_of(chunks, shape, arrays, dtype):
    first = next(iter(arrays.values()), None)
    if chunks is None and first is not None and first.shape[:2] == shape[:2]:
        return (*first.chunks[:2], (shape[2],))
    chunks = "auto" if chunks is None else chunks
    if isinstance(chunks, (tuple, list)):
        chunks = (*chunks[:2], -1)
    elif isinstance(chunks, (int, str)):
        chunks = (chunks, chunks, -1)
    try:
        return da.core.normalize_chunks(chunks, shape, dtype=dtype)
    except (ValueError, TypeError) as error:
        raise UsageError("chunks", f"found {chunks}, expected sizes of rows and columns: {error}") from error


def image(array, channels=None):
    """A lazy image of a Dask array (height x width x channels, or height x width), whose chunks are computed when
    their rows are needed, each once for an evaluation that goes down the image: what needs all of it, and files.

    >>> level = ts.dask.image(plate).mean()             # reads it once, holds a row of chunks
    >>> ts.dask.image(soft).write("soft.tif", dtype="uint16")
    """
    array = _array_of(array, "array")
    bounds = np.concatenate([[0], np.cumsum(array.chunks[0])])
    held = {}

    def rows(y0, y1):
        first = int(np.searchsorted(bounds, y0, "right")) - 1
        last = int(np.searchsorted(bounds, y1, "left"))
        for k in [k for k in held if k < first]:
            del held[k]
        missing = [k for k in range(first, last) if k not in held]
        if missing:
            held.update({k: array.blocks[k].compute() for k in missing})
        parts = [held[k][max(y0 - bounds[k], 0):y1 - bounds[k]] for k in range(first, last)]
        return parts[0] if len(parts) == 1 else np.concatenate(parts)

    return from_rows(rows, array.shape, dtype=array.dtype, channels=channels)


__all__ = ["apply", "image"]
