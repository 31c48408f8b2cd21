"""Images that show themselves: comparisons, bars of progress; images whose rows a function gives; tables."""
import base64
import os
import re
import tempfile
import threading
import unittest

import numpy as np
import tessera as ts
from pictures import picture, refused

try:
    import tqdm
except ImportError:
    tqdm = None


def bits(a, b):
    return np.array_equal(np.asarray(a), np.asarray(b), equal_nan=True)


class Comparisons(unittest.TestCase):
    def test_have_the_numbers_of_numpy(self):
        a, b = picture(0, 60, 40, 3), picture(0, 60, 40, 3)
        b[10:20, 5:9] += np.float32(0.25)
        b[30, 50, 1] -= np.float32(0.5)
        found = ts.compare(a, ts.from_array(b))
        off = np.abs(a.astype(np.float64) - b)
        self.assertEqual(found.max, off.max())
        self.assertEqual(found.where, (50, 30, 1))
        self.assertAlmostEqual(found.rms, np.sqrt(np.mean(off ** 2)), places=12)
        self.assertAlmostEqual(found.psnr, -20 * np.log10(found.rms), places=9)
        self.assertEqual(found.different, 41)
        self.assertFalse(found)
        for word in ("max 0.5 at (50, 30) channel 1", "PSNR", "41 pixels"):
            self.assertIn(word, str(found))
        wiped = np.asarray(found.wipe)
        self.assertTrue(bits(wiped[:, :30], a[:, :30]))
        self.assertTrue(bits(wiped[:, 31:], b[:, 31:]))
        heat = np.asarray(found.heat)
        self.assertEqual(heat.shape, (40, 60, 3))
        self.assertGreater(heat[30, 50].sum(), heat[15, 6].sum())
        self.assertGreater(heat[15, 6].sum(), heat[0, 0].sum())

    def test_of_equal_images(self):
        a = picture(1, channels=4)
        a[2, 3, 0] = np.nan
        a[2, 4, 0] = np.inf
        found = ts.compare(a, a.copy())
        self.assertTrue(found)
        self.assertEqual((found.max, found.rms, found.psnr, str(found)), (0, 0, float("inf"), "equal"))
        b = a.copy()
        b[2, 3, 0], b[5, 5, 1] = 1, np.nan
        found = ts.compare(a, b)
        self.assertEqual((found.nan_mismatches, found.different, found.max), (2, 2, 0))
        self.assertTrue((np.asarray(found.heat)[5, 5] == 1).all())

    def test_show_themselves(self):
        for channels in (1, 2, 3, 4, 6):
            found = ts.compare(picture(0, channels=channels), picture(1, channels=channels))
            text = found._repr_html_()
            self.assertIn("PSNR", text)
            data = base64.b64decode(re.search(r"base64,([^\"]*)", text).group(1))
            self.assertEqual(data, found._repr_png_())
            self.assertEqual((int.from_bytes(data[16:20], "big"), int.from_bytes(data[20:24], "big")), (48, 16))

    def test_of_what_has_another_shape_are_refused(self):
        with refused(ts.DataError, "compare", "(16, 24, 3)"):
            ts.compare(picture(0), picture(0, channels=3))
        with refused(ts.UsageError, "split"):
            ts.compare(picture(0), picture(0), split=2)
        with refused(ts.UsageError, "peak"):
            ts.compare(picture(0), picture(0), peak=0)


class Bars(unittest.TestCase):
    def setUp(self):
        self.image = ts.white((1500, 1500), 3).median("15x15")

    @unittest.skipUnless(tqdm, "tqdm is not there")
    def test_move(self):
        with open(os.devnull, "w", encoding="utf-8") as nowhere, tqdm.tqdm(total=100, file=nowhere) as bar:
            with ts.options(progress=bar):
                self.image.render()
                self.assertAlmostEqual(bar.n, 100)
                self.image.render()
            self.assertAlmostEqual(bar.n, 100)
        with ts.options(progress=True):
            self.image[:400, :400].render()

    def test_that_are_none_are_refused(self):
        for wrong in (3, "bar", object()):
            with refused(ts.UsageError, "progress"), ts.options(progress=wrong):
                pass


class Rows(unittest.TestCase):
    def test_are_asked_for_as_they_are_needed(self):
        for dtype, scale in ((np.float32, 1), (np.uint8, 255), (np.float16, 1)):
            values = (picture(0, 90, 3000) * scale).astype(dtype)
            asked, threads = [], set()

            def rows(y0, y1):
                asked.append((y0, y1))
                threads.add(threading.get_ident())
                return values[y0:y1]
            image = ts.from_rows(rows, values.shape, dtype)
            self.assertEqual((image.shape, asked), (values.shape, []))
            self.assertTrue(bits(image.blur(sigma=2), ts.from_array(values).blur(sigma=2)))
            self.assertEqual(asked[0][0], 0)
            self.assertEqual([b for _, b in asked][:-1], [a for a, _ in asked][1:])  # each once, in order
            self.assertTrue(bits(image["B,G"], ts.from_array(values)["B,G"]))
            asked.clear()
            self.assertTrue(bits(image[1000:1010], ts.from_array(values)[1000:1010]))
            self.assertGreaterEqual(asked[0][0], 0)

    def test_go_to_files(self):
        values = picture(0, 90, 700, 3)
        with tempfile.TemporaryDirectory() as folder:
            np.save(os.path.join(folder, "a.npy"), values)
            mapped = np.load(os.path.join(folder, "a.npy"), mmap_mode="r")
            image = ts.from_rows(lambda y0, y1: mapped[y0:y1], mapped.shape, mapped.dtype, channels="X,Y,Z")
            self.assertEqual(image.channels, ["X", "Y", "Z"])
            image.flip().write(os.path.join(folder, "a.exr"))
            self.assertTrue(bits(ts.read(os.path.join(folder, "a.exr")), values[::-1]))

    def test_of_strides_and_flat_ones(self):
        values = picture(0, 90, 70, 3)[::-1, ::2, ::-1]
        self.assertTrue(bits(ts.from_rows(lambda y0, y1: values[y0:y1], values.shape), values))
        raw = np.zeros(values.size * 4 + 1, np.uint8)
        odd = raw[1:].view(np.float32).reshape(values.shape)
        odd[...] = values
        self.assertTrue(bits(ts.from_rows(lambda y0, y1: odd[y0:y1], odd.shape), values))
        flat = values[..., 0]
        self.assertTrue(bits(ts.from_rows(lambda y0, y1: flat[y0:y1], flat.shape), flat[..., None]))

    def test_that_are_wrong_end_the_evaluation(self):
        def fail(y0, y1):
            raise KeyError("of the function")
        with refused(KeyError, "of the function"):
            ts.from_rows(fail, (10, 10, 3)).render()
        short = ts.from_rows(lambda y0, y1: np.zeros((1, 10, 3), np.float32), (10, 10, 3))
        with refused(ts.UsageError, "rows", "expected 10 of 10 x 3"):
            short.render()
        with refused(ts.UsageError, "rows", "float64"):
            ts.from_rows(lambda y0, y1: np.zeros((10, 10, 3)), (10, 10, 3)).render()
        with refused(ts.UsageError, "rows"):
            ts.from_rows(3, (10, 10, 3))
        with refused(ts.UsageError, "shape"):
            ts.from_rows(fail, (10,))
        with refused(ts.UsageError, "shape"):
            ts.from_rows(fail, (0, 10, 3))
        with refused(ts.UsageError, "channels"):
            ts.from_rows(fail, (10, 10, 3), channels="R,G")

    def test_are_asked_for_in_other_threads_too(self):
        values = picture(0, 90, 700, 3)
        want = np.asarray(ts.from_array(values).blur(sigma=2))
        wrong = []

        def work():
            image = ts.from_rows(lambda y0, y1: values[y0:y1], values.shape)
            if not bits(image.blur(sigma=2), want):
                wrong.append(1)
        threads = [threading.Thread(target=work) for _ in range(8)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        self.assertEqual(wrong, [])


class Tables(unittest.TestCase):
    def test_of_functions(self):
        at = picture(0, channels=1)
        found = np.asarray(ts.from_array(at).lookup(ts.table_of(lambda s: s * s, 129), dims=1, align="ends"))
        self.assertLess(np.abs(found - at * at).max(), 1 / 129 ** 2)
        two = ts.table_of(lambda s, t: (s, t, s * t), (17, 9))
        self.assertEqual(two.shape, (9, 17, 3))
        self.assertTrue(np.allclose(np.asarray(two)[4, 8], [0.5, 0.5, 0.25]))
        places = picture(1, channels=2)
        found = np.asarray(ts.from_array(places).lookup(two, dims=2, align="ends"))
        self.assertTrue(np.allclose(found[..., 2], places[..., 0] * places[..., 1], atol=1e-6))
        three = ts.table_of(lambda s, t, r: s + 10 * t + 100 * r, (5, 4, 3))
        self.assertEqual(three.shape, (12, 5, 1))
        places = picture(1, channels=3)
        found = np.asarray(ts.from_array(places).lookup(three, dims=3, slices=3, align="ends"))
        self.assertTrue(np.allclose(found[..., 0], places @ [1, 10, 100], atol=1e-3))
        with refused(ts.UsageError, "sizes"):
            ts.table_of(lambda s: s, 1)
        with refused(ts.DataError, "table_of"):
            ts.table_of(lambda s: s[:3], 9)

    def test_of_volumes(self):
        volume = np.random.default_rng(1).random((6, 5, 4), np.float32)
        image = ts.volume_of(volume)
        self.assertEqual(image.shape, (30, 4, 1))
        volume[1, 0, 0] = 7
        self.assertEqual(np.asarray(image)[5, 0, 0], 7)  # no copy
        z, y, x = np.mgrid[0:6, 0:5, 0:4]
        places = np.stack([(x + 0.5) / 4, (y + 0.5) / 5, (z + 0.5) / 6], -1).reshape(30, 4, 3).astype(np.float32)
        found = np.asarray(ts.from_array(places).lookup(image, dims=3, slices=6, filter="nearest"))
        self.assertTrue(bits(found, image))
        with refused(ts.UsageError, "axes"):
            ts.volume_of(np.zeros((3, 3), np.float32))


if __name__ == "__main__":
    unittest.main()
