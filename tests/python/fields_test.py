"""Fields of science: coordinates, degrees, masks; xarray's accessor and matplotlib's axes."""
import math
import os
import subprocess
import sys
import tempfile
import unittest

import numpy as np
import tessera as ts
from pictures import refused
from tessera import fields

try:
    import xarray as xr
except ImportError:
    xr = None
try:
    import matplotlib
    matplotlib.use("Agg")
    from matplotlib import pyplot
except ImportError:
    matplotlib = None


def wind(latitudes, longitudes):
    """Eastward and northward, smooth."""
    lat, lon = np.meshgrid(np.radians(latitudes), np.radians(longitudes), indexing="ij")
    return np.cos(lat) * (1 + 0.3 * np.sin(3 * lon)), 0.8 * np.sin(2 * lon) * np.cos(lat)


def bits(a, b):
    return np.array_equal(np.asarray(a), np.asarray(b), equal_nan=True)


class Coordinates(unittest.TestCase):
    def test_are_pixels_where_there_are_none(self):
        u, v = np.random.default_rng(0).normal(size=(2, 20, 30))
        self.assertTrue(bits(fields.field_of(u, v), np.stack([u, v], -1).astype(np.float32)))

    def test_scale_and_turn(self):
        u, v = np.ones((2, 3, 4))
        found = fields.field_of(u, v, x=[0, 2, 4, 6], y=[10, 5, 0])
        self.assertTrue(bits(found[..., 0], np.full((3, 4), 0.5)))
        self.assertTrue(bits(found[..., 1], np.full((3, 4), -0.2, np.float32)))
        uneven = fields.field_of(u, v, x=[0, 1, 3, 7])
        self.assertTrue(np.allclose(uneven[0, :, 0], 1 / np.gradient([0, 1, 3, 7.0])))

    def test_of_degrees(self):
        """A degree of longitude is cos(latitude) of one of latitude: a north-easterly's slope on the map."""
        u, v = np.ones((2, 5, 4))
        found = fields.field_of(u, v, x=[0, 1, 2, 3], y=[0, 15, 30, 45, 60], geographic=True)
        slope = found[..., 1] * 15 / found[..., 0]
        for row, latitude in enumerate([0, 15, 30, 45, 60]):
            self.assertAlmostEqual(slope[row, 0], math.cos(math.radians(latitude)), places=6)

    def test_that_are_wrong_are_refused(self):
        u = np.ones((3, 4))
        for wrong, word in (({"x": [0, 1, 2]}, "4 numbers"), ({"x": [0, 1, 1, 2]}, "rise"),
                            ({"y": [0, 1, 200], "geographic": True}, "latitude")):
            with refused(ts.DataError, word):
                fields.field_of(u, u, **wrong)
        with refused(ts.DataError, "field"):
            fields.field_of(u, u[:2])
        with refused(ts.UsageError, "units"):
            fields.lic_of(u, u, units="latlong")

    def test_lines_follow_the_coordinates(self):
        """A uniform field: the texture changes little along its diagonal, whichever way coordinates run."""
        rows, columns = 80, 120
        u, v = np.ones((2, rows, columns))
        picture = fields.lic_of(u, v, x=np.arange(columns) * 2.0, y=np.arange(rows) * 2.0, length=25)
        along = np.mean(np.abs(picture[1:, 1:] - picture[:-1, :-1]))
        across = np.mean(np.abs(picture[1:, :-1] - picture[:-1, 1:]))
        self.assertLess(along * 2, across)
        falling = fields.lic_of(u, v, x=np.arange(columns), y=-np.arange(rows), length=25)
        self.assertLess(np.mean(np.abs(falling[1:, :-1] - falling[:-1, 1:])) * 2,
                        np.mean(np.abs(falling[1:, 1:] - falling[:-1, :-1])))


class Pictures(unittest.TestCase):
    def test_keep_masks(self):
        u, v = wind(np.linspace(60, -60, 61), np.linspace(0, 90, 91))
        masked = np.ma.masked_where(np.hypot(*np.mgrid[-30:31, -45:46]) < 10, u)
        picture = fields.lic_of(masked, v)
        self.assertTrue(bits(np.isnan(picture), np.ma.getmaskarray(masked)))
        colored = fields.lic_of(masked, v, magnitude="color")
        self.assertEqual(colored.shape, (61, 91, 3))

    def test_of_the_globe_cross_the_date_line(self):
        lat, lon = np.linspace(89.5, -89.5, 180), np.arange(360) + 0.5
        self.assertTrue(fields.is_whole_globe(lon, lat))
        self.assertTrue(fields.is_whole_globe(lon, lat[::-1]))
        self.assertFalse(fields.is_whole_globe(lon[:300], lat))
        self.assertFalse(fields.is_whole_globe(lon, lat[20:-20]))
        u, v = wind(lat, lon)
        down = fields.lic_of(u, v, lon, lat, geographic=True)
        self.assertTrue(bits(down[..., np.newaxis], ts.from_array(np.stack([u, v], -1).astype(np.float32)).lic(
            units="latlong")))
        up = fields.lic_of(u[::-1], v[::-1], lon, lat[::-1], geographic=True)
        self.assertTrue(bits(up[::-1], down))
        # No seam: neighbours across the date line are as alike as others along the wind.
        seam, inside = np.mean(np.abs(down[60:120, 0] - down[60:120, -1])), np.mean(np.abs(np.diff(down[60:120], axis=1)))
        self.assertLess(seam, 1.6 * inside)


@unittest.skipUnless(xr, "xarray is not there")
class Datasets(unittest.TestCase):
    def setUp(self):
        ts.xarray  # noqa: adds the accessor, whoever was imported first
        self.lat, self.lon = np.linspace(-60, 60, 61), np.linspace(0, 90, 91)
        u, v = wind(self.lat, self.lon)
        self.u = u
        u = u.copy()
        u[5:9, 10:20] = np.nan
        self.ds = xr.Dataset({"u": (("lat", "lon"), u, {"units": "m/s"}), "v": (("lat", "lon"), v)},
                             {"lat": self.lat, "lon": self.lon, "height": 10.0})

    def test_keep_coordinates_and_masks(self):
        found = self.ds.tessera.lic("u", "v", length=12)
        self.assertEqual(found.dims, ("lat", "lon"))
        self.assertTrue(bits(found.lat, self.lat))
        self.assertEqual(float(found.height), 10)
        self.assertTrue(bits(np.isnan(found), np.isnan(self.ds.u)))
        self.assertTrue(bits(found, fields.lic_of(self.ds.u.values, self.ds.v.values, self.lon, self.lat, True, length=12)))
        turned = self.ds.transpose("lon", "lat").tessera.lic("u", "v", length=12)
        self.assertTrue(bits(turned.transpose("lat", "lon"), found))
        colored = self.ds.tessera.lic("u", "v", magnitude="color")
        self.assertEqual(colored.dims, ("lat", "lon", "channel"))

    def test_of_several_times(self):
        several = xr.concat([self.ds, -2 * self.ds], "time")
        found = several.tessera.lic("u", "v", length=8)
        self.assertEqual(found.dims, ("time", "lat", "lon"))
        self.assertTrue(bits(found[0], self.ds.tessera.lic("u", "v", length=8)))

    def test_understand_degrees_by_cf(self):
        names = self.ds.rename(lat="j", lon="i")
        plain = names.tessera.lic("u", "v", length=12)
        names.j.attrs["units"], names.i.attrs["standard_name"] = "degrees_north", "longitude"
        self.assertTrue(bits(names.tessera.lic("u", "v", length=12), self.ds.tessera.lic("u", "v", length=12)))
        self.assertFalse(bits(plain, self.ds.tessera.lic("u", "v", length=12)))
        self.ds.lat.attrs["units"] = "km"  # a name alone says less than a unit
        self.assertTrue(bits(self.ds.tessera.lic("u", "v", length=12), plain))

    def test_that_are_wrong_are_refused(self):
        with refused(ts.UsageError, "'w'", "u, v"):
            self.ds.tessera.lic("u", "w")
        with refused(ts.DataError, "dimensions"):
            self.ds.assign(w=("lat", self.lat)).tessera.lic("u", "w")

    def test_come_by_either_import(self):
        for code in ("import xarray, tessera", "import tessera, xarray, tessera.xarray", "import tessera; tessera.xarray; import xarray"):
            subprocess.run([sys.executable, "-c", code + "; xarray.Dataset().tessera.lic"], check=True)

    @unittest.skipUnless(matplotlib, "matplotlib is not there")
    def test_are_drawn(self):
        picture = self.ds.tessera.lic_plot("u", "v", length=12)
        self.assertEqual(picture.colorbar.ax.get_ylabel(), "m/s")
        self.assertEqual((picture.axes.get_xlabel(), picture.axes.get_ylabel()), ("longitude", "latitude"))
        pyplot.close("all")
        with refused(ts.DataError, "select one"):
            xr.concat([self.ds, self.ds], "time").tessera.lic_plot("u", "v")


@unittest.skipUnless(matplotlib, "matplotlib is not there")
class Plots(unittest.TestCase):
    def tearDown(self):
        pyplot.close("all")

    def test_have_axes_and_a_bar(self):
        lat, lon = np.linspace(-60, 60, 61), np.linspace(0, 90, 91)
        u, v = wind(lat, lon)
        u[20:30, 40:50] = np.nan
        figure, ax = pyplot.subplots()
        picture = ts.lic_plot(u, v, lon, lat, geographic=True, ax=ax, label="m/s", length=10)
        self.assertEqual(ax.get_xlim(), (-0.5, 90.5))
        self.assertEqual(ax.get_ylim(), (-61, 61))  # north is up
        self.assertEqual(picture.colorbar.ax.get_ylabel(), "m/s")
        self.assertAlmostEqual(picture.colorbar.vmax, np.nanmax(np.hypot(u, v)))
        pixels = np.asarray(picture.get_array())
        self.assertEqual(pixels.shape, (61, 91, 4))
        self.assertTrue(bits(pixels[..., 3] == 0, np.isnan(u)))
        self.assertGreater(pixels[..., :3].std(), 0.05)
        with tempfile.TemporaryDirectory() as folder:
            figure.savefig(os.path.join(folder, "a.png"))
        self.assertIsNone(ts.lic_plot(u, v, colorbar=False).colorbar)

    def test_that_are_wrong_are_refused(self):
        u = np.ones((5, 6))
        with refused(ts.UsageError, "strength"):
            ts.lic_plot(u, u, strength=2)
        with refused(ts.UsageError, "magnitude"):
            ts.lic_plot(u, u, magnitude="color")
        with refused(ts.DataError, "steps that differ"):
            ts.lic_plot(u, u, x=[0, 1, 2, 3, 4, 9])


if __name__ == "__main__":
    unittest.main()
