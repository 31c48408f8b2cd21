"""Vector fields of science as images: coordinates that are degrees or any other steps, rows upwards, masks; a line
integral convolution of them, and its picture."""
import numpy as np

from .errors import DataError, UsageError
from .image import from_array

_WHOLE = 360.0


def _steps(coordinate, count, name):
    """What a coordinate grows by from one pixel to the next, at each of them; signed, 1 where there is none."""
    if coordinate is None:
        return np.ones(count)
    values = np.asarray(coordinate, np.float64)
    if values.shape != (count,):
        raise DataError(name, f"found coordinates of {values.shape}, expected {count} numbers")
    if count == 1:
        return np.ones(1)
    steps = np.gradient(values)
    if not np.isfinite(values).all() or not ((np.diff(values) > 0).all() or (np.diff(values) < 0).all()):
        raise DataError(name, "found coordinates that neither rise nor fall throughout, expected that")
    return steps


def is_whole_globe(x, y):
    """Whether degrees of longitude and latitude at these pixels cover all of a map, evenly."""
    if x is None or y is None or len(x) < 4 or len(y) < 3:
        return False
    x, y = np.asarray(x, np.float64), np.asarray(y, np.float64)
    dx, dy = np.diff(x), np.diff(y)
    even = np.allclose(dx, dx[0], rtol=1e-3) and np.allclose(dy, dy[0], rtol=1e-3)
    wide = np.isclose(abs(dx[0]) * len(x), _WHOLE, rtol=1e-3)
    high = np.isclose(abs(dy[0]) * len(y), _WHOLE / 2, rtol=1e-3) and abs(y[0] + y[-1]) < 0.5 * abs(dy[0])
    return bool(even and wide and high and dx[0] > 0)


def field_of(u, v, x=None, y=None, geographic=False):
    """The field of components along two coordinates as an image of vectors in pixels, x right and y down: what the
    operation `lic` takes.

    u, v: arrays of rows x columns; NaN and masked elements are masked.
    x, y: coordinates of columns and rows, rising or falling, evenly or not; of pixels without them, y then pointing
        down as rows do.
    geographic: x and y are degrees of longitude and latitude, u and v lengths eastward and northward: a degree of
        longitude is cos(latitude) of one of latitude.
    """
    u, v = (np.ma.filled(np.ma.asarray(a, np.float64), np.nan) for a in (u, v))
    if u.shape != v.shape or u.ndim != 2:
        raise DataError("field", f"found components of {u.shape} and {v.shape}, expected rows x columns of both")
    rows, columns = u.shape
    across, down = _steps(x, columns, "x")[np.newaxis, :], _steps(y, rows, "y")[:, np.newaxis]
    if geographic:
        if y is None:
            raise UsageError("y", "found no latitudes, expected those of the rows")
        latitudes = np.asarray(y, np.float64)
        if np.abs(latitudes).max() > 90.001:
            raise DataError("y", f"found a latitude of {np.abs(latitudes).max():g}, expected -90 to 90")
        across = across * np.maximum(np.cos(np.radians(latitudes)), 1e-6)[:, np.newaxis]
    with np.errstate(over="ignore", invalid="ignore"):
        return np.stack([u / across, v / down], axis=-1).astype(np.float32)


def lic_of(u, v, x=None, y=None, geographic=False, **how):
    """The line integral convolution of such a field, as an array of rows x columns (x channels where `magnitude` is
    "color"); NaN where the field is masked. `how`: what the operation `lic` takes, tessera.Image.lic.__doc__. Lines
    of a whole map, even in degrees, cross the date line."""
    for name in ("units", "alpha", "yup", "scale", "input", "size"):
        if name in how:
            raise UsageError(name, "is found from the coordinates, expected another parameter")
    if geographic and is_whole_globe(x, y):
        # The engine's own map of the globe: the first row is the northernmost.
        upwards = y[0] < y[-1]
        u, v = (np.ma.filled(np.ma.asarray(a, np.float64), np.nan) for a in (u, v))
        vectors = np.stack([u, v], axis=-1).astype(np.float32)
        vectors = vectors[::-1] if upwards else vectors
        pixels = np.asarray(from_array(vectors).lic(units="latlong", alpha=True, **how))
        pixels = pixels[::-1] if upwards else pixels
    else:
        pixels = np.asarray(from_array(field_of(u, v, x, y, geographic)).lic(alpha=True, **how))
    shown, alpha = pixels[..., :-1].copy(), pixels[..., -1]
    shown[alpha == 0] = np.nan
    return shown[..., 0] if shown.shape[-1] == 1 else shown


def _edges(coordinate, count):
    """Where the first pixel begins and the last one ends."""
    if coordinate is None:
        return -0.5, count - 0.5
    values = np.asarray(coordinate, np.float64)
    if count == 1:
        return values[0] - 0.5, values[0] + 0.5
    return values[0] - (values[1] - values[0]) / 2, values[-1] + (values[-1] - values[-2]) / 2


def lic_plot(u, v, x=None, y=None, *, geographic=False, ax=None, cmap="viridis", norm=None, colorbar=True, label="",
             strength=0.75, **how):
    """Draws a field with matplotlib: lines by their texture, lengths by colours, axes in the coordinates, a bar of
    colours. Returns the picture (matplotlib's AxesImage); its `colorbar` is the bar, None without one.

    u, v, x, y, geographic, how: as in the operation `lic` of `tessera.fields.lic_of`; coordinates have to be even,
        as matplotlib's pictures are.
    ax: matplotlib's axes to draw into; the current ones.
    cmap, norm: of the colours; lengths from 0 to the longest by default.
    label: of the bar, such as "m/s".
    strength: of the texture, 0 (none) to 1.

    >>> ts.lic_plot(u, v, longitudes, latitudes, geographic=True, label="m/s", length=30)
    """
    try:
        import matplotlib
        from matplotlib import cm, colors, pyplot
    except ImportError as error:
        raise UsageError("lic_plot", "found no matplotlib, expected that package") from error
    if not 0 <= strength <= 1:
        raise UsageError("strength", f"found {strength}, expected 0 to 1")
    texture = lic_of(u, v, x, y, geographic, **how)
    if texture.ndim == 3:
        raise UsageError("magnitude", "found color, which the plot has of its own, expected none, noise or length")
    rows, columns = texture.shape
    for name, values in (("x", x), ("y", y)):
        steps = np.diff(np.asarray(values, np.float64)) if values is not None else np.ones(1)
        if len(steps) and not np.allclose(steps, steps[0], rtol=0.02):
            raise DataError(name, "found steps that differ, expected even coordinates; interpolate the field first")
    size = np.ma.masked_invalid(np.hypot(np.ma.filled(np.ma.asarray(u, np.float64), np.nan),
                                         np.ma.filled(np.ma.asarray(v, np.float64), np.nan)))
    norm = norm or colors.Normalize(0, float(size.max()) if size.count() else 1)
    maps = getattr(matplotlib, "colormaps", None)
    chosen = cmap if isinstance(cmap, colors.Colormap) else maps[cmap] if maps is not None else cm.get_cmap(cmap)
    shown = chosen(norm(size))
    light = 1 + strength * (np.nan_to_num(texture, nan=0.5) - 0.5) * 1.6
    shown[..., :3] = np.clip(shown[..., :3] * light[..., np.newaxis], 0, 1)
    shown[..., 3] = np.where(np.isnan(texture), 0, 1)
    ax = ax if ax is not None else pyplot.gca()
    left, right = _edges(x, columns)
    first, last = _edges(y, rows)
    picture = ax.imshow(shown, extent=(left, right, last, first), interpolation="nearest",
                        aspect="equal" if x is None or y is None or geographic else "auto")
    if y is not None and first < last:
        ax.set_ylim(first, last)  # upwards, as coordinates rise
    if geographic:
        ax.set_xlabel("longitude"), ax.set_ylabel("latitude")
    scale = cm.ScalarMappable(norm, chosen)
    scale.set_array([])
    picture.colorbar = None
    if colorbar:
        # As high as the picture, whose sides may be equal in length per degree.
        tall = abs(last - first) / abs(right - left) if ax.get_aspect() in ("equal", 1) else 1
        picture.colorbar = ax.figure.colorbar(scale, ax=ax, label=label, fraction=0.046 * min(tall, 1), pad=0.03)
    return picture
