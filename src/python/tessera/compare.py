"""Two images side by side: numbers, a wipe, a heat map of the differences."""
import base64
import html

import numpy as np

from .errors import DataError, UsageError
from .image import Image, from_array


def _image_of(value):
    return value if isinstance(value, Image) else from_array(value)


class Comparison:
    """What `tessera.compare` found; shows itself in notebooks.

    max: the largest absolute difference; where: (x, y, channel) of it.
    rms: the root of the mean squared difference; psnr: 20 log10(peak / rms) in decibels, infinite for equal ones.
    different: pixels with any difference; share: of all. A NaN differs from everything but a NaN.
    nan_mismatches: samples that are NaN in one image alone, which count in no other number but `different`.
    wipe: an image, a on the left and b on the right of a line.
    heat: an image, the largest difference of a pixel's channels from black to yellow, white where one is NaN.
    """

    def __init__(self, a, b, peak, split, top):
        first, second = a.render(), b.render()
        with np.errstate(invalid="ignore", over="ignore"):
            off = np.abs(first.astype(np.float64) - second)
        off[first == second] = 0  # infinities
        mismatch = np.isnan(first) != np.isnan(second)
        off[np.isnan(off)] = 0
        x0, y0, _, _ = a.data_window
        row, column, channel = np.unravel_index(int(np.argmax(off)), off.shape)
        self.max, self.where = float(off[row, column, channel]), (x0 + int(column), y0 + int(row), int(channel))
        self.rms = float(np.sqrt(np.mean(np.square(off))))
        self.peak = float(peak)
        self.psnr = float(20 * np.log10(peak / self.rms)) if self.rms > 0 else float("inf")
        self.nan_mismatches = int(mismatch.sum())
        changed = ((off > 0) | mismatch).any(axis=2)
        self.different, self.share = int(changed.sum()), float(changed.mean())
        at = max(0, min(first.shape[1], round(split * first.shape[1])))
        wiped = np.concatenate([first[:, :at], second[:, at:]], axis=1)
        if 0 < at < first.shape[1]:
            wiped[:, at] = 1
        self.wipe = from_array(wiped, channels=a.channels)
        self._shown_like = a
        self.top = float(top) if top is not None else self.max
        level = np.minimum(off.max(axis=2, keepdims=True) / (self.top or 1), 1).astype(np.float32)
        heat = from_array(level).colormap("inferno").render()
        heat[mismatch.any(axis=2)] = 1
        self.heat = from_array(heat)

    def __bool__(self):
        """Whether all bits that mean something are equal."""
        return self.different == 0

    def __str__(self):
        if self.different == 0:
            return "equal"
        x, y, channel = self.where
        text = (f"max {self.max:.6g} at ({x}, {y}) channel {channel}, rms {self.rms:.6g}, PSNR {self.psnr:.2f} dB, "
                f"{self.different} pixels differ ({100 * self.share:.3g} %)")
        return text + (f", {self.nan_mismatches} NaN mismatches" if self.nan_mismatches else "")

    def __repr__(self):
        return f"<tessera.Comparison {self}>"

    def _repr_png_(self):
        """The wipe beside the heat map."""
        return self.picture()._repr_png_()

    def picture(self):
        """The wipe beside the heat map, as one image in the colours of a screen."""
        wipe = self.wipe._screen_pixels(self._shown_like)
        colors = wipe[..., :3] if wipe.shape[2] > 2 else np.repeat(wipe[..., :1], 3, axis=2)
        return from_array(np.concatenate([colors, self.heat._screen_pixels()], axis=1))

    def _repr_html_(self):
        data = base64.b64encode(self._repr_png_()).decode()
        return (f'<figure><img src="data:image/png;base64,{data}" alt="a wipe, and a map of differences">'
                f"<figcaption>{html.escape(str(self))}; heat up to {self.top:.3g}</figcaption></figure>")


def compare(a, b, *, peak=1.0, split=0.5, top=None):
    """Compares two images (or arrays) of one size and number of channels; both are rendered whole.

    peak: what PSNR takes for the largest value.
    split: where the wipe's line is, from 0 (all of b) to 1 (all of a).
    top: the difference that is the heat map's brightest; the largest that was found.

    >>> found = ts.compare(image, image.blur(sigma=1))
    >>> print(found)                              # max, rms, PSNR, how many
    >>> found.heat.write("heat.png")
    """
    a, b = _image_of(a), _image_of(b)
    if a.shape != b.shape:
        raise DataError("compare", f"found {a.shape} and {b.shape}, expected one shape")
    for name, value, low in (("peak", peak, 0), ("top", top, 0)):
        if value is not None and not value > low:
            raise UsageError(name, f"found {value}, expected more than 0")
    if not 0 <= split <= 1:
        raise UsageError("split", f"found {split}, expected 0 to 1")
    return Comparison(a, b, peak, split, top)
