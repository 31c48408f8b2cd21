"""Graphs on Dask's arrays, of any size: every chunk of the result is computed from exactly the pixels that it needs,
which the engine's own planner tells, on whatever machine Dask chooses. Bits are those of one machine.

>>> import dask.array as da
>>> import tessera as ts
>>> look = ts.graph(lambda image: image.saturate(1.2).blur(sigma=3))
>>> soft = ts.dask.apply(look, da.from_zarr("plate.zarr"))
>>> soft.to_zarr("soft.zarr")
"""
import json
import os
import pickle
import threading

import dask.array as da
import numpy as np
from dask.base import tokenize
from dask.highlevelgraph import HighLevelGraph

from . import _core
from .errors import DataError, UsageError
from .graph import Graph, graph as recorded
from .image import Image, _dtype_of, _new_array, _samples_of, _TYPE_OF, from_rows
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

    def holds(self, region):
        """Whether one chunk has all pixels of a region."""
        return sum(1 for _ in self.pieces(region)) <= 1 if region[2] > region[0] else True

    def pieces(self, region):
        """(chunk, slices of it; where they begin, as (x, y, channel)) of all that have some of it."""
        x0, y0, x1, y1 = region
        for i, rows, y in self._along(0, y0, y1):
            for j, columns, x in self._along(1, x0, x1):
                for k, samples, c in self._along(2, 0, self.shape[2]):
                    yield (i, j, k), (rows, columns, samples), (x, y, c)

    def _along(self, axis, first, last):
        """(number, slice, where it begins) of an axis's chunks that have some of [first, last)."""
        bounds = self.bounds[axis]
        low = int(np.searchsorted(bounds, first, "right")) - 1
        for k in range(low, int(np.searchsorted(bounds, last, "left"))):
            begin, end = int(bounds[k]), int(bounds[k + 1])
            yield k, slice(max(first - begin, 0), min(last, end) - begin), max(begin, first)

    def size(self, chunk):
        """Its rows and columns."""
        return tuple(int(bounds[n + 1] - bounds[n]) for bounds, n in zip(self.bounds, chunk[:2]))


class _Exchange:
    """The tasks that hand on what chunks of a result need of an array's chunks. A chunk that is needed whole goes as it is,
    and large parts one by one; its thin edges are cut by one task (a frame), and those of a row of chunks that one column
    of the result needs are gathered by another. So Dask's order of tasks goes along rows and a chunk is let go soon. Where
    a task takes from all eight neighbours, that order goes round the array's edges and keeps nearly all of it."""

    def __init__(self, description, name, number):
        self.description, self.name, self.number = description, name, number
        self.cuts, self.rows = {}, {}  # chunk: {(rows, columns): None}; (row, columns): {(chunk, cut): place}
        self.tasks = {}

    def need(self, region):
        """Takes down what a region needs; for `given` when all regions have."""
        needs = []
        for chunk, (rows, columns, _), corner in self.description.pieces(region) if region[2] > region[0] else ():
            high, wide = self.description.size(chunk)
            cut = (rows.start, rows.stop, columns.start, columns.stop)
            if cut == (0, high, 0, wide):
                cut = None
            else:
                self.cuts.setdefault(chunk, {})[cut] = None
            needs.append((corner, chunk, cut, (chunk[0], region[0], region[2])))
        return needs

    def close(self, all_needs):
        """The tasks that cut."""
        for chunk, cuts in self.cuts.items():
            high, wide = self.description.size(chunk)
            thin = 4 * sum((r1 - r0) * (c1 - c0) for r0, r1, c0, c1 in cuts) <= high * wide
            source = (self.description.key, *chunk)
            if thin:
                self.tasks[self._key("frame", chunk)] = (_cut, source, list(cuts))
            for n, cut in enumerate(cuts):
                cuts[cut] = n if thin else self._key("part", chunk, n)
                if not thin:
                    self.tasks[cuts[cut]] = (_cut, source, [cut])
        for _, chunk, cut, row in all_needs:
            if cut is not None and isinstance(self.cuts[chunk][cut], int):
                places = self.rows.setdefault(row, {})
                places.setdefault((chunk, cut), len(places))
        for row, places in self.rows.items():
            self.tasks[self._key("row", row)] = (_gathered, [[self._key("frame", chunk), self.cuts[chunk][cut]]
                                                             for chunk, cut in places])

    def _key(self, kind, where, *more):
        return (self.name, self.number, kind, *where, *more)

    def given(self, needs):
        """For a task that computes: [where it begins, what has it, its place there] of all pieces."""
        pieces = []
        for corner, chunk, cut, row in needs:
            if cut is None and chunk in self.cuts:  # the order again: a task between the chunk and its last reader
                own = self._key("own", chunk)
                self.tasks[own] = (_same, (self.description.key, *chunk))
                pieces.append([corner, own, None])
            elif cut is None:
                pieces.append([corner, (self.description.key, *chunk), None])
            elif isinstance(self.cuts[chunk][cut], int):
                pieces.append([corner, self._key("row", row), self.rows[row][chunk, cut]])
            else:
                pieces.append([corner, self.cuts[chunk][cut], 0])
        return pieces


def _same(chunk):
    return chunk


def _cut(chunk, cuts):
    """Parts of a chunk, which need not be kept for them."""
    return [np.ascontiguousarray(chunk[r0:r1, c0:c1]) for r0, r1, c0, c1 in cuts]


def _gathered(entries):
    return [frame[place] for frame, place in entries]


def _pieces(given):
    """((x, y, channel), pixels) of what a task is given."""
    return [(corner, found if place is None else found[place]) for corner, found, place in given]


class _Job:
    """What all tasks of an array share: the graph, its inputs and how it is evaluated."""

    def __init__(self, look, inputs, channels, dtype, options):
        self.look, self.inputs, self.options = look, inputs, options
        self.channels, self.dtype = channels, dtype


class _Scratch(threading.local):
    """A thread's memory for halos, which the next chunk needs again."""

    memory = np.empty(0, np.uint8)

    def array(self, shape, dtype):
        """Pixels of any values, until the next call."""
        wanted = int(np.prod(shape)) * dtype.itemsize
        if self.memory.nbytes < wanted:
            self.memory = np.empty(wanted, np.uint8)
        return self.memory[:wanted].view(dtype).reshape(shape)


_SCRATCH = _Scratch()


def _assembled(region, pieces, count, fresh):
    """The pixels of a region from those of chunks: where one has all of them, as they lie there."""
    x0, y0, x1, y1 = region
    pixels = None
    for (x, y, c), piece in pieces:
        h, w, n = piece.shape
        if x <= x0 and y <= y0 and x + w >= x1 and y + h >= y1 and n == count:
            part = piece[y0 - y:y1 - y, x0 - x:x1 - x]
            return part if part.flags.aligned else part.copy()  # what came over a network may begin at any byte
    for (x, y, c), piece in pieces:
        h, w, n = piece.shape
        left, top, right, bottom = max(x, x0), max(y, y0), min(x + w, x1), min(y + h, y1)
        if left >= right or top >= bottom:
            continue
        if pixels is None:
            shape = (y1 - y0, x1 - x0, count)
            pixels = np.empty(shape, piece.dtype) if fresh else _SCRATCH.array(shape, piece.dtype)
        pixels[top - y0:bottom - y0, left - x0:right - x0, c:c + n] = piece[top - y:bottom - y, left - x:right - x]
    return pixels


def _computed(job, region, pieces, parts):
    """A chunk of the result: its parts, each with the regions that it needs of the inputs."""
    left, top, right, bottom = region
    pieces = [_pieces(given) for given in pieces]
    out = _new_array((bottom - top, right - left, job.channels), _dtype_of(job.dtype))
    with evaluated(**job.options):
        for (x0, y0, x1, y1), needs in parts:
            images = {}
            for name, needed, given in zip(job.inputs, needs, pieces):
                description = job.inputs[name]
                pixels = None
                if needed[2] > needed[0]:
                    pixels = _assembled(needed, given, description.shape[2], len(job.inputs) > 1)
                images[name] = description.part(pixels, needed[0], needed[1])
            job.look(**images).render(out=out[y0 - top:y1 - top, x0 - left:x1 - left], region=(x0, y0, x1, y1))
    return out


def _parts(region, required, inputs):
    """The chunk as it is, or, where most of it needs one chunk of every input, that and a frame around it: what lies
    in one chunk is not copied. `required(region)`: the regions that one needs of the inputs."""
    needs = required(region)
    x0, y0, x1, y1 = region
    whole = [(region, needs)]
    if all(description.holds(needed) for description, needed in zip(inputs, needs)):
        return whole
    halo = [max((sign * (needed[k] - region[k]) for needed in needs if needed[2] > needed[0]), default=0)
            for k, sign in enumerate((-1, -1, 1, 1))]
    # Borders have no halo there, and the chunk's own may be wider than the other side's.
    wide, high = max(halo[0], halo[2], 0), max(halo[1], halo[3], 0)
    inner = (x0 + wide, y0 + high, x1 - wide, y1 - high)
    if 2 * wide * 8 > x1 - x0 or 2 * high * 8 > y1 - y0:
        return whole
    inner_needs = required(inner)
    if not all(description.holds(needed) for description, needed in zip(inputs, inner_needs)):
        return whole
    frame = [(x0, y0, x1, inner[1]), (x0, inner[3], x1, y1), (x0, inner[1], inner[0], inner[3]),
             (inner[2], inner[1], x1, inner[3])]
    return [(inner, inner_needs), *((r, required(r)) for r in frame if r[2] > r[0] and r[3] > r[1])]


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
    bound = look._bound(arrays, named, "arrays")
    for name in named:
        if name not in look.inputs:
            raise UsageError(name, "is no open input of the graph, expected " + (", ".join(look.inputs) or "none"))
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
    job = _Job(look, inputs, result.shape[2], _TYPE_OF[dtype], given)
    packed = pickle.dumps(job)
    token = tokenize(packed, _files_of(look), *(array.name for array in open_arrays.values()), sizes)
    name, job_name, part_name = f"tessera-{token}", f"tessera-graph-{token}", f"tessera-part-{token}"
    # A task of which all others depend spoils Dask's order of them; what is large they have to share all the same.
    tasks = {job_name: job} if len(packed) > 1 << 16 else {}
    shared = job_name if tasks else job
    exchanges = [_Exchange(description, part_name, number) for number, description in enumerate(inputs.values())]

    def required(region):
        return [prepared.required(source, region) for source in empty.values()]

    left, top, _, _ = result.data_window
    regions, y0 = {}, top
    for i, rows in enumerate(sizes[0]):
        x0 = left
        for j, columns in enumerate(sizes[1]):
            region = (x0, y0, x0 + columns, y0 + rows)
            regions[i, j] = region, [exchange.need(needed) for exchange, needed in zip(exchanges, required(region))]
            x0 += columns
        y0 += rows
    for number, exchange in enumerate(exchanges):
        exchange.close([need for _, needs in regions.values() for need in needs[number]])
    for (i, j), (region, needs) in regions.items():
        given = [exchange.given(need) for exchange, need in zip(exchanges, needs)]
        tasks[name, i, j, 0] = (_computed, shared, region, given, _parts(region, required, inputs.values()))
    for exchange in exchanges:
        tasks.update(exchange.tasks)
    layers = HighLevelGraph.from_collections(name, tasks, dependencies=list(open_arrays.values()))
    return da.Array(layers, name, chunks=sizes, dtype=dtype, shape=result.shape)


def _files_of(look):
    """The files of a graph as they are now: another state of one is another result."""
    states = []
    for node in json.loads(look.text)["nodes"]:
        if "file" in node and os.path.exists(node["file"]):
            found = os.stat(node["file"])
            states.append((node["file"], found.st_mtime_ns, found.st_size))
    return states


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
