"""Graphs with open inputs: recorded from a function, written as JSON, read, and run on images.

The format stands in include/tessera/graph_json.h; what the command line saves is read here and the other way
round.
"""
import inspect
import json
import os

from . import _core
from .errors import DataError, UsageError
from .image import Image, Operations, _list_of, from_array


def _image_of(value):
    return value if isinstance(value, Image) else from_array(value)


class _Recording:
    """The nodes of a graph while its function runs."""

    def __init__(self, names):
        self.nodes = [{"input": name} for name in names]
        self.names = list(names)
        self.captured = {}
        self.numbers = {}  # of images that were there before
        self.kept = []

    def number_of(self, image):
        """The node of an image; one from outside is written into the graph."""
        if isinstance(image, OpenImage):
            if image._recording is not self:
                raise UsageError("graph", "found an open input of another graph, expected this one's")
            return image._number
        if id(image) in self.numbers:
            return self.numbers[id(image)]
        text, inputs = _core.to_json(image)
        inner = json.loads(text)
        names = {}
        for name, pixels in inputs:
            free, k = name, 2
            while free in self.names:
                free, k = f"{name}{k}", k + 1
            names[name] = free
            self.names.append(free)
            self.captured[free] = Image(pixels)
        first = len(self.nodes)
        for node in inner["nodes"]:
            if "input" in node:
                node["input"] = names[node["input"]]
            if "inputs" in node:
                node["inputs"] = [k + first for k in node["inputs"]]
            self.nodes.append(node)
        self.numbers[id(image)] = first + inner["result"]
        self.kept.append(image)  # so that its id stays its own
        return self.numbers[id(image)]

    def text(self, result):
        lines = ",\n".join("  " + json.dumps(node, separators=(",", ":"), ensure_ascii=False) for node in self.nodes)
        names = json.dumps(self.names, separators=(",", ":"), ensure_ascii=False)
        return (f'{{\n "tessera_graph": 1,\n "inputs": {names},\n "nodes": [\n{lines}\n ],\n "result": {result}\n}}\n')


class OpenImage(Operations):
    """What stands for an image that is not there yet, inside of a function given to `tessera.graph`. It has the
    operations and operators of Image; of its pixels, size and channels nothing is known."""

    __slots__ = ("_recording", "_number")

    def __init__(self, recording, number):
        self._recording, self._number = recording, number

    def __repr__(self):
        return f"<tessera.OpenImage {self._recording.nodes[self._number]}>"

    def __bool__(self):
        return True

    def __iter__(self):
        raise TypeError("an open image has no rows to go through")

    def _made(self, name, images, values, texts):
        wanted = _core.check(name, texts)
        if len(images) != wanted:
            raise UsageError(name, f"found {len(images)} images, expected {wanted}")
        node = {"operation": name}
        if values:
            node["parameters"] = values
        node["inputs"] = [self._recording.number_of(image) for image in images]
        self._recording.nodes.append(node)
        return OpenImage(self._recording, len(self._recording.nodes) - 1)

    def _divided_into(self, constants):
        raise UsageError("div", "found a number divided by an open image, whose size is not known; "
                                "expected an image there")

    def _part(self, y, x):
        flips, corners = [], []
        for key, axis in ((x, "column"), (y, "row")):
            step = key.step if isinstance(key, slice) else None
            if key in (slice(None), slice(None, None, -1)):
                corners.append(None)
            elif isinstance(key, slice) and step in (None, 1) and None not in (key.start, key.stop) and (
                    0 <= key.start < key.stop):
                corners.append((key.start, key.stop))
            else:
                raise UsageError("index", f"found {key!r} for {axis} of an open image, whose size is not known; "
                                          "expected first:last from 0 on")
            flips.append(step == -1)
        image = self
        if corners != [None, None]:
            if None in corners:
                raise UsageError("index", "found a part of one axis of an open image, whose size is not known; "
                                          "expected both")
            (x0, x1), (y0, y1) = corners
            image = image.cut(f"{x0},{y0},{x1 - 1},{y1 - 1}")
        image = image.flop() if flips[0] else image
        return image.flip() if flips[1] else image

    def _channels(self, key):
        return self.ch(_list_of(key, None))


class Graph:
    """A graph of operations with open inputs. Called with images (or arrays), it gives the image that it makes of
    them, as lazy as any other. Pickles; equal graphs have equal text.

    inputs: the names of the open inputs, in the order of a call without names.
    text: the JSON.
    """

    def __init__(self, text, captured=None):
        """`text`: the JSON. `captured`: images of some of its open inputs, which are then no longer open."""
        names = _core.graph_inputs(text)
        self._captured = {name: _image_of(image) for name, image in (captured or {}).items()}
        for name in self._captured:
            if name not in names:
                raise UsageError(name, "is no open input of the graph, expected " + (", ".join(names) or "none"))
        self.text = text
        self.inputs = [name for name in names if name not in self._captured]

    def _bound(self, values, named, what):
        """Values by the names of the open inputs."""
        if len(values) > len(self.inputs):
            raise UsageError("graph", f"found {len(values)} {what}, expected {len(self.inputs)} "
                                      f"({', '.join(self.inputs) or 'none'})")
        bound = dict(zip(self.inputs, values))
        for name, value in named.items():
            if name in bound:
                raise UsageError(name, "found twice, expected it once")
            bound[name] = value
        return bound

    def __call__(self, *images, **named):
        bound = self._bound(images, named, "images")
        given = {name: _image_of(image) for name, image in bound.items()}
        return Image(_core.from_json(self.text, {**self._captured, **given}))

    def save(self, path):
        """Writes the JSON. Raises DataError where the function used an array of its own, which no JSON holds."""
        if self._captured:
            raise DataError("graph", f"holds pixels in memory ({', '.join(self._captured)}), expected files or open "
                                     "inputs")
        _write(path, self.text)

    save_graph = save

    def __reduce__(self):
        return Graph, (self.text, self._captured)

    def __eq__(self, other):
        return isinstance(other, Graph) and self.text == other.text and not self._captured and not other._captured

    def __hash__(self):
        return hash(self.text)

    def __repr__(self):
        return f"<tessera.Graph of {', '.join(self.inputs) or 'no open inputs'}>"


def _write(path, text):
    path = os.fspath(path)
    try:
        with open(path, "w", encoding="utf-8") as file:
            file.write(text)
    except OSError as error:
        raise DataError(path, f"cannot be written: {error.strerror}") from error


def graph(function):
    """The graph of a function of images: it runs once, now, with open inputs named as its parameters.

    >>> look = ts.graph(lambda image: image.saturate(1.2).blur(sigma=3))
    >>> look(ts.read("a.exr")).write("b.exr")
    >>> look.save("look.json")
    """
    names = []
    for parameter in inspect.signature(function).parameters.values():
        if parameter.kind not in (parameter.POSITIONAL_ONLY, parameter.POSITIONAL_OR_KEYWORD):
            raise UsageError("graph", f"found the parameter {parameter}, expected names of images alone")
        if parameter.default is parameter.empty:
            names.append(parameter.name)
    recording = _Recording(names)
    result = function(*(OpenImage(recording, k) for k in range(len(names))))
    if not isinstance(result, Operations):
        raise UsageError("graph", f"found a function that returns {type(result).__name__}, expected an image")
    return Graph(recording.text(recording.number_of(result)), recording.captured)


def load_graph(path):
    """The graph of a file that `save_graph`, `tessera --save-graph` or a program wrote. It holds no code:
    operations by name, and files, which are opened when it is called. Raises DataError for what is none."""
    path = os.fspath(path)
    try:
        with open(path, encoding="utf-8") as file:
            text = file.read()
    except OSError as error:
        raise DataError(path, f"cannot be read: {error.strerror}, expected a graph") from error
    except UnicodeDecodeError as error:
        raise DataError(path, "holds no UTF-8, expected a graph") from error
    try:
        return Graph(text)
    except DataError as error:
        raise DataError(path, f"{error.subject}: {error.reason}") from error


def _save_image(self, path):
    """Writes what the image is made of as a graph in JSON: operations and files by their names. Pixels in memory
    are its open inputs, named by `named`, else "image", "image2", ..."""
    _write(path, _core.to_json(self)[0])


def _named(self, name):
    """This image as the open input of that name, where a graph that it is in is written."""
    return Image(_core.as_input(self, name))


def _restored(text, arrays):
    images = {name: from_array(array, channels, window[:2], display_window=display)
              for name, (array, channels, window, display) in arrays.items()}
    return Image(_core.from_json(text, images))


def _reduce_image(self):
    text, inputs = _core.to_json(self)
    arrays = {}
    for name, pixels in inputs:
        image = Image(pixels)
        arrays[name] = (image.render(dtype=image.type), image.channels, image.data_window, image.display_window)
    return _restored, (text, arrays)


Image.save_graph, Image.named, Image.__reduce__ = _save_image, _named, _reduce_image
