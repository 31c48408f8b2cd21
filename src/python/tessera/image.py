"""Lazy images: arrays, files, and operations on them. Nothing is computed before pixels are asked for."""
import os
import tempfile

import numpy as np

from . import _core, rows
from .errors import DataError, UsageError
from .options import current

_TYPE_OF = {np.dtype(np.uint8): "uint8", np.dtype(np.uint16): "uint16", np.dtype(np.float16): "half",
            np.dtype(np.float32): "float"}
_DTYPE_OF = {name: dtype for dtype, name in _TYPE_OF.items()}


def _dtype_of(dtype):
    """A NumPy dtype of one of the four types, by its own or the library's name."""
    if isinstance(dtype, str) and dtype in _DTYPE_OF:
        return _DTYPE_OF[dtype]
    try:
        found = np.dtype(dtype)
    except TypeError:
        found = None
    if found not in _TYPE_OF:
        raise UsageError("dtype", f"found {dtype}, expected uint8, uint16, float16 or float32")
    return found


def _samples_of(array, subject):
    """Where an array's samples are, as rows of pixels of channels."""
    if array.ndim == 2:
        array = array[:, :, np.newaxis]
    if array.ndim != 3:
        raise UsageError(subject, f"found {array.ndim} axes, expected height x width x channels")
    if array.dtype not in _TYPE_OF:
        raise UsageError(subject, f"found {array.dtype}, expected uint8, uint16, float16 or float32 in the "
                                  "machine's byte order; array.astype(numpy.float32) makes that")
    return array, _core.Samples(array.__array_interface__["data"][0], array.shape, array.strides,
                                _TYPE_OF[array.dtype])


def _new_array(shape, dtype):
    """An array of any values, a large one in the engine's memory."""
    height, width, channels = shape
    if height * width * channels < 1 << 18:
        return np.empty(shape, dtype)
    return np.asarray(_core.Pixels(width, height, channels, _TYPE_OF[np.dtype(dtype)]))


def _array_of(data):
    """A NumPy array on the same memory."""
    if isinstance(data, np.ndarray):
        return data
    if hasattr(data, "__dlpack__") and not isinstance(data, _core.Image):
        device = getattr(data, "__dlpack_device__", lambda: (1, 0))()
        if device[0] != 1:
            raise DataError("array", f"found one on DLPack device {tuple(device)}, expected the host's memory; "
                                     "copy it there first")
        try:
            return np.from_dlpack(data)
        except (BufferError, RuntimeError, TypeError) as error:
            raise DataError("array", f"is not given through DLPack: {error}") from error
    return np.asarray(data)


_SHOWN = 1024
_NAMES_SHOWN = {1: "Y", 2: "Y,A", 3: "R,G,B", 4: "R,G,B,A"}
_LINEAR = ("scene_linear", "linear", "lin_rec709", "lin_srgb", "Linear")


def _shown_size(width, height):
    """The sides of a thumbnail, as the operation `resize` takes them."""
    scale = _SHOWN / max(width, height)
    return f"{max(1, round(width * scale))}x{max(1, round(height * scale))}"


class Operations:
    """What images and the open inputs of graphs share: every operation of the registry as a method, operators."""

    __slots__ = ()
    __array_ufunc__ = None  # NumPy leaves operators with arrays to us

    def _pair(self, other, name, swapped=False):
        """The operation of two images, or the one of an image and constants."""
        if isinstance(other, np.ndarray) and other.ndim >= 2:
            other = from_array(other)
        if isinstance(other, Operations):
            return getattr(other, name)(self) if swapped else getattr(self, name)(other)
        if isinstance(other, (str, bytes)) or not (np.isscalar(other) or hasattr(other, "__len__")):
            return NotImplemented
        return getattr(self, name + "c")(other)

    def __add__(self, other):
        return self._pair(other, "add")

    def __radd__(self, other):
        return self._pair(other, "add")

    def __sub__(self, other):
        return self._pair(other, "sub")

    def __rsub__(self, other):
        if isinstance(other, np.ndarray) and other.ndim >= 2:
            return self._pair(other, "sub", swapped=True)
        return (-self)._pair(other, "add")  # the same sum, rounded once

    def __mul__(self, other):
        return self._pair(other, "mul")

    def __rmul__(self, other):
        return self._pair(other, "mul")

    def __truediv__(self, other):
        return self._pair(other, "div")

    def __rtruediv__(self, other):
        if isinstance(other, np.ndarray) and other.ndim >= 2:
            return self._pair(other, "div", swapped=True)
        return self._divided_into(other)

    def __matmul__(self, other):
        """a @ b: a over b."""
        return self.over(other) if isinstance(other, Operations) else NotImplemented

    def __neg__(self):
        return self.mulc(-1)

    def __pos__(self):
        return self

    def __abs__(self):
        return self.abs()

    def __pow__(self, other):
        return NotImplemented if isinstance(other, Operations) else self.powc(other)

    def __getitem__(self, key):
        """image[y0:y1, x0:x1]: a part, as a picture of its own; image[..., 0], image[..., "R"],
        image[..., ["R", "A"]], image["R,G"]: channels. Steps of -1 flip. Channels stay the last axis."""
        if isinstance(key, str) or (isinstance(key, list) and key and all(isinstance(k, str) for k in key)):
            return self._channels(key)
        if not isinstance(key, tuple):
            key = (key,)
        if Ellipsis in [k for k in key if k is Ellipsis]:
            at = [k is Ellipsis for k in key].index(True)
            key = key[:at] + (slice(None),) * (3 - len(key) + 1) + key[at + 1:]
        if len(key) > 3:
            raise UsageError("index", f"found {len(key)} axes, expected rows, columns, channels")
        y, x, c = (*key, *(slice(None),) * (3 - len(key)))
        image = self
        if y != slice(None) or x != slice(None):
            image = image._part(y, x)
        return image if isinstance(c, slice) and c == slice(None) else image._channels(c)


def _list_of(key, count):
    """Channels of an index, as the operation `ch` takes them."""
    if isinstance(key, str):
        return key
    if isinstance(key, slice):
        if count is None:
            raise UsageError("index", "found a slice of channels in a graph with open inputs, expected a list")
        key = list(range(*key.indices(count)))
    elif isinstance(key, (int, np.integer)):
        key = [key]
    words = []
    for k in key:
        if isinstance(k, str):
            words.append(k)
            continue
        k = int(k)
        if count is not None and not -count <= k < count:
            raise UsageError("index", f"found channel {k}, expected less than {count}")
        words.append(str(k + count if k < 0 and count is not None else k))
    if not words:
        raise UsageError("index", "found no channel, expected at least one")
    return ",".join(words)


def _range_of(key, count, axis):
    """(first, behind the last, whether backwards) of an index along an axis."""
    if isinstance(key, (int, np.integer)):
        if not -count <= key < count:
            raise UsageError("index", f"found {axis} {int(key)}, expected less than {count}")
        first = int(key) % count
        return first, first + 1, False
    if not isinstance(key, slice):
        raise UsageError("index", f"found {key!r} for {axis}, expected a number or first:last")
    first, last, step = key.indices(count)
    if step not in (1, -1):
        raise UsageError("index", f"found a step of {step}, expected 1 or -1; resize makes images smaller")
    if step < 0:
        first, last = last + 1, first + 1
    if last <= first:
        raise UsageError("index", f"found no {axis} in {key.start}:{key.stop}, expected at least one of {count}")
    return first, last, step < 0


class Image(Operations, _core.Image):
    """A lazy image: an array, a file, or an operation on others. Immutable; nothing is computed until pixels
    are asked for.

    To NumPy it is an array of height x width x channels of float32, 1.0 being the white of integers:
    numpy.asarray(image), memoryview(image) and numpy.from_dlpack(image) each evaluate. `render` gives other
    types and parts, or fills an array of yours; `write` makes a file.
    """

    __slots__ = ("stats",)

    def __init__(self, image):
        if not isinstance(image, _core.Image):
            raise TypeError("tessera.Image is made by tessera.read, tessera.from_array or an operation")
        super().__init__(image)
        self.stats = None

    # data_window, display_window, channels, alpha, type and metadata are the compiled half's.

    @property
    def width(self):
        """Columns of the data window."""
        x0, _, x1, _ = self.data_window
        return x1 - x0

    @property
    def height(self):
        """Rows of the data window."""
        _, y0, _, y1 = self.data_window
        return y1 - y0

    @property
    def shape(self):
        """(height, width, channels)."""
        return self.height, self.width, len(self.channels)

    @property
    def ndim(self):
        return 3

    @property
    def dtype(self):
        """What NumPy sees: float32. `type` is how the source is stored, and a file would be."""
        return np.dtype(np.float32)

    def __len__(self):
        return self.height

    def __iter__(self):
        raise TypeError("a tessera.Image has no rows to go through; numpy.asarray(image) has")

    def __bool__(self):
        return True

    def __repr__(self):
        h, w, _ = self.shape
        x0, y0, _, _ = self.data_window
        at = f" at ({x0}, {y0})" if (x0, y0) != (0, 0) else ""
        return f"<tessera.Image {w} x {h}{at}, {','.join(self.channels)}, {self.type}>"

    def _divided_into(self, constants):
        if not (np.isscalar(constants) or hasattr(constants, "__len__")) or isinstance(constants, (str, bytes)):
            return NotImplemented
        above = Image(_core.generate("constant", self.data_window, len(self.channels), [
            ("color", ",".join(repr(float(v)) for v in np.atleast_1d(constants)))]))
        return above.div(self)

    def _part(self, y, x):
        x0, y0, _, _ = self.data_window
        left, right, flop = _range_of(x, self.width, "column")
        top, bottom, flip = _range_of(y, self.height, "row")
        image = self.cut(f"{x0 + left},{y0 + top},{x0 + right - 1},{y0 + bottom - 1}")
        image = image.flop() if flop else image
        return image.flip() if flip else image

    def _channels(self, key):
        return self.ch(_list_of(key, len(self.channels)))

    def render(self, out=None, region=None, dtype=None):
        """Evaluates into an array of height x width x channels and returns it.

        out: an array of yours, of any strides (negative ones too) and one of the four types; float32 of a new
            one is the default. Integers are rounded once, 1.0 being the largest.
        region: (x0, y0, x1, y1) in the image's coordinates, x1 and y1 excluded: only that part. The default is
            the data window. image[y0:y1, x0:x1] counts from its corner instead.
        dtype: of a new array: "uint8", "uint16", "float16" ("half") or "float32".

        Raises UsageError, DataError, SystemError_, Cancelled, KeyboardInterrupt on Ctrl-C.
        """
        window = tuple(int(v) for v in (self.data_window if region is None else region))
        if len(window) != 4 or window[2] <= window[0] or window[3] <= window[1]:
            raise UsageError("region", f"found {region}, expected (x0, y0, x1, y1) with at least one pixel")
        x0, y0, x1, y1 = window
        shape = (y1 - y0, x1 - x0, len(self.channels))
        if out is None:
            out = _new_array(shape, np.float32 if dtype is None else _dtype_of(dtype))
            target = out
        else:
            target = out if isinstance(out, np.ndarray) else np.asarray(_array_of(out))
            if dtype is not None and _dtype_of(dtype) != target.dtype:
                raise UsageError("dtype", f"found {dtype} with an array of {target.dtype}, expected one of both")
            full = target[:, :, np.newaxis] if target.ndim == 2 else target
            if full.shape != shape:
                raise UsageError("out", f"found an array of {target.shape}, expected {shape}")
            if not target.flags.writeable:
                raise UsageError("out", "found an array that cannot be written, expected one that can")
            if any(s == 0 and n > 1 for s, n in zip(target.strides, target.shape)):
                raise UsageError("out", "found elements that share memory, expected each to have its own")
        whole, samples = _samples_of(target, "out")
        low, high = np.lib.array_utils.byte_bounds(whole) if hasattr(np.lib, "array_utils") else np.byte_bounds(whole)
        if self._reads_memory(low, high):
            # What it is computed from would be overwritten meanwhile.
            apart = np.empty(whole.shape, whole.dtype)
            self.stats = _core.render(self, _samples_of(apart, "out")[1], x0, y0, current())
            whole[...] = apart
        else:
            self.stats = _core.render(self, samples, x0, y0, current())
        return out

    def __array__(self, dtype=None, copy=None):
        pixels = self.render()
        return pixels if dtype is None else pixels.astype(dtype, copy=False)

    @property
    def __array_interface__(self):
        # The dictionary keeps the pixels alive through its array.
        pixels = self.render()
        return {**pixels.__array_interface__, "data": pixels}

    def __dlpack__(self, stream=None, **how):
        return self.render().__dlpack__()

    def __dlpack_device__(self):
        return (1, 0)

    def write(self, path, dtype=None, compression=None, quality=None, attributes=None):
        """Evaluates and writes, in bands; the file appears whole or not at all.

        path: the extension is the format.
        dtype: of the samples; `type`, what the sources are stored as, where none is named. What the format does
            not have becomes the nearest that it has.
        compression, quality: as the format names it ("zip", "dwaa", "jpeg"), 0 to 100.
        attributes: metadata added, by name: text, an int or a float; None removes one.
        """
        items = dict(attributes or {})
        if compression is not None:
            items["compression"] = compression
        if quality is not None:
            items["compression"] = f"{compression or 'jpeg'}:{quality}"
        texts = []
        for name, value in items.items():
            kind = {bool: "int", int: "int", float: "float"}.get(type(value), "string")
            texts.append((name, "" if value is None else str(int(value) if kind == "int" else value), kind))
        stored = "" if dtype is None else _TYPE_OF[_dtype_of(dtype)]
        self.stats = _core.write(self, os.fspath(path), stored, texts, current())

    def _screen_pixels(self, like=None):
        """At most 1024 x 1024 pixels as a screen shows them: one to four channels; linear colours through sRGB's
        transfer function, as `color_space` says (that of `like`, where it is another image's picture)."""
        image = self
        if max(image.width, image.height) > _SHOWN:
            image = image.resize(_shown_size(image.width, image.height))
        if len(image.channels) == 2 and image.alpha < 0:
            image = image[..., [0]]
        elif len(image.channels) > 3:
            image = image[..., [0, 1, 2, image.alpha] if image.alpha > 2 else [0, 1, 2]]
        pixels = image.render()
        if (like or self).color_space in _LINEAR:
            colors = pixels[..., :3] if pixels.shape[2] > 2 else pixels[..., :1]
            low = np.clip(colors, 0, 1)
            colors[...] = np.where(low <= 0.0031308, low * 12.92, 1.055 * low ** (1 / 2.4) - 0.055)
        return pixels

    def _repr_png_(self):
        """A PNG for notebooks, of at most 1024 pixels along a side. Linear colours are shown through sRGB's
        transfer function, as `color_space` says; others as they are."""
        pixels = self._screen_pixels()
        with tempfile.TemporaryDirectory() as folder:
            path = os.path.join(folder, "shown.png")
            from_array(pixels, channels=_NAMES_SHOWN[pixels.shape[2]]).write(path, dtype=np.uint8)
            with open(path, "rb") as file:
                return file.read()

    def verify(self, dtype=None, samples=16, tile=64, seconds=2.0):
        """Evaluates, and compares with the double-precision reference on `samples` tiles of tile x tile pixels,
        for about so many seconds. Returns a Verification, true where no value is out of its bound."""
        stored = "float" if dtype is None else _TYPE_OF[_dtype_of(dtype)]
        return Verification(_core.verify(self, stored, samples, tile, seconds, current()))

    def explain(self, dtype=None):
        """The plan in words: passes, fused stages, tiles, bytes moved. Nothing is evaluated."""
        return _core.explain(self, "float" if dtype is None else _TYPE_OF[_dtype_of(dtype)], current())

    def cost(self, dtype=None):
        """What `render` is expected to take, a dict: `seconds` of the clock, `limit` (the longest part), `threads`,
        `memory` and `bytes` (of the last pass), `pixels`, and `parts`, each with `name`, `elapsed` and `busy`
        (seconds of the clock and of all threads) and `pass` (those of one pass overlap). Found by trying small
        parts of the graph, a second or so: the first rows of its files, some of the result's."""
        return _core.cost(self, "float" if dtype is None else _TYPE_OF[_dtype_of(dtype)], current())


class Verification:
    """What `Image.verify` found. Members: within_bound, max_error, rms_error, bound, largest_bound, closest,
    samples, share, undecided, nan_mismatches, out_of_bound, codes_at_tie, codes_wrong, worst (x, y, channel),
    remarks, summary."""

    def __init__(self, found):
        self.__dict__.update(found)

    def __bool__(self):
        return self.within_bound

    def __str__(self):
        return self.summary

    def __repr__(self):
        return f"<tessera.Verification {self.summary}>"


def read(path, *, part=None, all_formats=False):
    """A lazy image of a file: the header is read now, pixels when they are needed.

    part: of a file of several images, the number or the name of one.
    all_formats: also those whose readers damaged files can harm.

    Raises DataError naming the file: missing, no image, truncated.
    """
    index = part if isinstance(part, int) else 0
    return Image(_core.read(os.fspath(path), index, part if isinstance(part, str) else "", all_formats))


def subimages(path):
    """The names of a file's images in their order; [] for one that has no names."""
    return _core.subimages(os.fspath(path))


def from_array(array, channels=None, origin=(0, 0), display_window=None):
    """A lazy image on the memory of a NumPy array, or of any that speaks DLPack or the buffer protocol: height
    x width x channels, or height x width. No copy is made, whatever the strides are, negative ones too; the
    array is kept alive and must not be changed while it is computed with.

    channels: names, ["R", "G", "B", "A"] or "R,G,B,A"; by default Y; Y,A; R,G,B; R,G,B,A, channel4, ...
    origin: (x, y) of the first pixel; display_window: the frame, (x0, y0, x1, y1), where it is another.

    uint8 and uint16 stand for 0 to 1; float16 and float32 are themselves. Others raise UsageError.
    """
    found = _array_of(array)
    whole, samples = _samples_of(found, "array")
    names = channels.split(",") if isinstance(channels, str) else list(channels or [])
    return Image(_core.from_array(samples, names, int(origin[0]), int(origin[1]),
                                  None if display_window is None else tuple(map(int, display_window)), whole))


def from_rows(function, shape, dtype=np.float32, channels=None):
    """A lazy image of shape (height, width, channels) whose rows a function gives when they are needed: of a file of
    another library, of a mapped array, of whatever makes them.

    function: `function(y0, y1)` returns an array of y1 - y0 x width x channels of that dtype (or y1 - y0 x width).
        It is asked for rows downwards, by one thread at a time, not the caller's; an exception of its ends the
        evaluation and is raised there.
    channels: names, as in `from_array`.

    >>> big = numpy.load("big.npy", mmap_mode="r")
    >>> ts.from_rows(lambda y0, y1: big[y0:y1], big.shape, big.dtype).blur(sigma=3).write("soft.tif")
    """
    if not callable(function):
        raise UsageError("rows", "found no function, expected one of the first row and the one behind the last")
    sizes = [int(v) for v in shape]
    sizes = [*sizes, 1] if len(sizes) == 2 else sizes
    if len(sizes) != 3:
        raise UsageError("shape", f"found {tuple(shape)}, expected (height, width, channels)")
    wanted = _dtype_of(dtype)

    def rows(y0, y1):
        found = _array_of(function(y0, y1))
        if found.dtype != wanted:
            raise UsageError("rows", f"found {found.dtype}, expected {wanted}")
        # They are copied, so that they may begin at any byte.
        whole, samples = _samples_of(found if found.flags.aligned else found.copy(), "rows")
        return samples, whole

    names = channels.split(",") if isinstance(channels, str) else list(channels or [])
    return Image(_core.from_rows(rows, sizes, _TYPE_OF[wanted], names))


def _generated(name, window, channels, values, texts):
    return Image(_core.generate(name, window, channels, texts))


def _made(name, images, values, texts):
    for image in images:
        if not isinstance(image, Image):
            return image._made(name, images, values, texts)
    return Image(_core.apply(name, images, texts))


FUNCTIONS = {}  # of the package: generators, and what may take no image at all
for _row in rows.ROWS:
    _name = rows.python_name(_row["name"])
    if _row["generator"]:
        FUNCTIONS[_name] = rows.make_generator(_row, _generated)
        setattr(Image, _name, staticmethod(FUNCTIONS[_name]))
        continue
    if _row["images"] < 0:
        FUNCTIONS[_name] = rows.make_function(_row, Operations, _made)
    if not hasattr(Operations, _name):
        setattr(Operations, _name, rows.make_method(_row, Operations, _made))
