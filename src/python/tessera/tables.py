"""Tables for the operation `lookup`: of functions, and of volumes that are arrays."""
import numpy as np

from .errors import DataError, UsageError
from .image import _array_of, from_array


def table_of(function, sizes):
    """The table of a function on [0, 1] in one to three dimensions, as an image for `lookup(..., align="ends")`.

    function: of one to three arrays of coordinates (s, t, r), called once; it returns an array of their shape, or a
        sequence of those, one for each channel.
    sizes: entries along each coordinate, a number or up to three; the first and the last are at 0 and 1.

    >>> gamma = ts.table_of(lambda s: s ** 0.45, 256)
    >>> image["Y"].lookup(gamma, dims=1, align="ends")
    """
    if not callable(function):
        raise UsageError("table_of", f"found {type(function).__name__}, expected a function of coordinates")
    sizes = [int(v) for v in np.atleast_1d(sizes)]
    if not 1 <= len(sizes) <= 3 or min(sizes) < 2 or int(np.prod(sizes)) > 1 << 28:
        raise UsageError("sizes", f"found {sizes}, expected one to three numbers of at least 2, 2^28 entries together")
    # The first coordinate runs along rows, the last one from slice to slice.
    axes = np.meshgrid(*(np.linspace(0, 1, n) for n in reversed(sizes)), indexing="ij")
    found = function(*reversed(axes))
    channels = list(found) if isinstance(found, (tuple, list)) else [found]
    for channel in channels:
        if np.shape(channel) not in ((), axes[0].shape):
            raise DataError("table_of", f"found a function that returns {np.shape(channel)} for coordinates of "
                                        f"{axes[0].shape}, expected their shape")
    values = np.stack([np.broadcast_to(np.asarray(c, np.float32), axes[0].shape) for c in channels], axis=-1)
    return from_array(values.reshape(-1, sizes[0], len(channels)))


def volume_of(array, channels=None):
    """A volume (depth x height x width, or with channels behind) as an image for `lookup(..., dims=3, slices=depth)`:
    slices from the top downwards. The array's memory where its slices follow one another, else a copy.

    >>> inside = positions.lookup(ts.volume_of(density), dims=3, slices=len(density))
    """
    found = _array_of(array)
    if found.ndim not in (3, 4):
        raise UsageError("array", f"found {found.ndim} axes, expected depth x height x width, or channels behind")
    found = found if found.ndim == 4 else found[..., np.newaxis]
    depth, height, width, count = found.shape
    return from_array(found.reshape(depth * height, width, count), channels=channels)
