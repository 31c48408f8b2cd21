"""Fields of xarray's datasets: `ds.tessera.lic("u", "v")`. Importing tessera after xarray, or this module, adds it.

Coordinates, dimensions and masks stay; degrees of longitude and latitude are understood.
"""
import numpy as np
import xarray as xr

from .errors import DataError, UsageError
from .fields import lic_of
from .fields import lic_plot as _lic_plot

_EAST = ("degrees_east", "degree_east", "degree_e", "degrees_e")
_NORTH = ("degrees_north", "degree_north", "degree_n", "degrees_n")


def _is_degrees(coordinate, standard, units, names):
    """Whether a coordinate says, as CF has it, or by its name, that it is a longitude or latitude."""
    if coordinate is None:
        return False
    attributes = coordinate.attrs
    if attributes.get("standard_name") or attributes.get("units"):
        return (attributes.get("standard_name") == standard or str(attributes.get("units", "")).lower() in units)
    return str(coordinate.name).lower() in names


class _Plane:
    """Two components along the last two dimensions of an array, whatever their order is there."""

    def __init__(self, dataset, u, v):
        for name in (u, v):
            if name not in dataset:
                raise UsageError("tessera", f"found no variable {name!r}, expected one of "
                                            f"{', '.join(map(str, dataset.data_vars)) or 'none'}")
        self.u, self.v = dataset[u], dataset[v]
        if set(self.u.dims) != set(self.v.dims) or self.u.ndim < 2:
            raise DataError(u, f"found dimensions {self.u.dims} and {self.v.dims}, expected the same, two at least")
        self.v = self.v.transpose(*self.u.dims)
        across = [d for d in self.u.dims if self._degrees(d, east=True)]
        up = [d for d in self.u.dims if self._degrees(d, east=False)]
        self.geographic = len(across) == 1 and len(up) == 1
        self.rows, self.columns = (up[0], across[0]) if self.geographic else self.u.dims[-2:]
        others = [d for d in self.u.dims if d not in (self.rows, self.columns)]
        self.u, self.v = (a.transpose(*others, self.rows, self.columns) for a in (self.u, self.v))
        self.x, self.y = self._coordinate(self.columns), self._coordinate(self.rows)

    def _coordinate(self, dimension):
        found = self.u.coords.get(dimension)
        return None if found is None or found.dtype.kind not in "iuf" else np.asarray(found, np.float64)

    def _degrees(self, dimension, east):
        found = self.u.coords.get(dimension)
        if east:
            return _is_degrees(found, "longitude", _EAST, ("lon", "longitude"))
        return _is_degrees(found, "latitude", _NORTH, ("lat", "latitude"))


class _Tessera:
    """`dataset.tessera`: pictures of fields."""

    def __init__(self, dataset):
        self._dataset = dataset

    def lic(self, u, v, **how):
        """The line integral convolution of two variables, eastward and northward (or along the coordinates of the
        last two dimensions), as a DataArray with their dimensions and coordinates: lines for every time, level, ...
        of its own. NaN where they are masked. `how`: what tessera.Image.lic takes; magnitude="color" adds the
        dimension "channel".

        >>> ds.tessera.lic("u10", "v10", length=30)
        """
        plane = _Plane(self._dataset, u, v)
        shape = plane.u.shape
        us, vs = (np.asarray(a, np.float64).reshape(-1, *shape[-2:]) for a in (plane.u, plane.v))
        pictures = [lic_of(one, other, plane.x, plane.y, plane.geographic, **how) for one, other in zip(us, vs)]
        pixels = np.stack(pictures).reshape(*shape, *pictures[0].shape[2:])
        dims, coords = list(plane.u.dims), dict(plane.u.coords)
        if pixels.ndim > len(dims):
            dims, coords["channel"] = [*dims, "channel"], ["R", "G", "B"]
        return xr.DataArray(pixels, coords, dims, name="lic",
                            attrs={"long_name": f"line integral convolution of {u}, {v}", "units": "1"})

    def lic_plot(self, u, v, **how):
        """Draws them with matplotlib, as `tessera.lic_plot`: axes in the coordinates, a bar of the lengths in the
        variables' units."""
        plane = _Plane(self._dataset, u, v)
        if plane.u.ndim != 2 and plane.u.size != plane.u.shape[-1] * plane.u.shape[-2]:
            raise DataError(u, f"found dimensions {plane.u.dims}, expected two; select one of the others first "
                               "(isel, sel)")
        how.setdefault("label", str(plane.u.attrs.get("units", "")))
        us, vs = (np.asarray(a).reshape(plane.u.shape[-2:]) for a in (plane.u, plane.v))
        picture = _lic_plot(us, vs, plane.x, plane.y, geographic=plane.geographic, **how)
        if not plane.geographic:
            picture.axes.set_xlabel(str(plane.columns)), picture.axes.set_ylabel(str(plane.rows))
        return picture


if not hasattr(xr.Dataset, "tessera"):
    xr.register_dataset_accessor("tessera")(_Tessera)
