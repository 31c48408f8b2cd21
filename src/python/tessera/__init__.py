"""Tessera: image-space work on CPUs, lazily, fused, tile by tile, to a stated error.

>>> import tessera as ts
>>> graded = ts.read("shot.exr").saturate(1.2).hue(30).blur(sigma=20)
>>> graded.write("out.exr", dtype="half")

Every operation of `tessera --help` is a method of Image under its name; help(ts.Image.blur) tells all about
one. Generators (checker, ramp, noise, ...) are functions: ts.checker((640, 480), width=32, height=32);
so is what takes any number of images: ts.average(a, b, c, N=3).
"""
import importlib
import sys

from ._core import target, targets, version as __version__
from .compare import Comparison, compare
from .errors import Cancelled, DataError, Error, SystemError_, UsageError
from .fields import lic_plot
from .graph import Graph, OpenImage, graph, load_graph
from .image import FUNCTIONS as _FUNCTIONS
from .image import Image, Verification, from_array, from_rows, read, subimages
from .options import options
from .rows import ROWS as _ROWS
from .tables import table_of, volume_of


def operations():
    """The registry: a dictionary per operation, in the order of the help."""
    return list(_ROWS)


def __getattr__(name):
    """tessera.dask and tessera.xarray, whose packages are imported when they are asked for."""
    if name in ("dask", "xarray"):
        return importlib.import_module("." + name, __name__)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


globals().update(_FUNCTIONS)
if "xarray" in sys.modules:
    importlib.import_module(".xarray", __name__)
__all__ = ["Cancelled", "Comparison", "DataError", "Error", "Graph", "Image", "OpenImage", "SystemError_", "UsageError",
           "Verification", "compare", "from_array", "from_rows", "graph", "lic_plot", "load_graph", "operations",
           "options", "read", "subimages", "table_of", "target", "targets", "volume_of", *sorted(_FUNCTIONS)]
