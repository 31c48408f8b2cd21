"""Tessera: image-space work on CPUs, lazily, fused, tile by tile, to a stated error.

>>> import tessera as ts
>>> graded = ts.read("shot.exr").saturate(1.2).hue(30).blur(sigma=20)
>>> graded.write("out.exr", dtype="half")

Every operation of `tessera --help` is a method of Image under its name; help(ts.Image.blur) tells all about
one. Generators (checker, ramp, noise, ...) are functions: ts.checker((640, 480), width=32, height=32);
so is what takes any number of images: ts.average(a, b, c, N=3).
"""
from ._core import target, targets, version as __version__
from .errors import Cancelled, DataError, Error, SystemError_, UsageError
from .graph import Graph, OpenImage, graph, load_graph
from .image import FUNCTIONS as _FUNCTIONS
from .image import Image, Verification, from_array, read, subimages
from .options import options
from .rows import ROWS as _ROWS


def operations():
    """The registry: a dictionary per operation, in the order of the help."""
    return list(_ROWS)


globals().update(_FUNCTIONS)
__all__ = ["Cancelled", "DataError", "Error", "Graph", "Image", "OpenImage", "SystemError_", "UsageError", "Verification", "from_array",
           "graph", "load_graph", "operations", "options", "read", "subimages", "target", "targets", *sorted(_FUNCTIONS)]
