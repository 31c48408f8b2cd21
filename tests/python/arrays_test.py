"""Arrays in and out without a copy, regions, channels, operators."""
import ctypes
import unittest

import numpy as np
import tessera as ts
from pictures import address, picture, refused

def layouts():
    """Ten ways for pixels of 16 x 24 x 3 to lie in memory, all with the same values."""
    values = picture(3, channels=3)
    wide = np.zeros((40, 60, 5), np.float32)
    part = wide[7:23, 11:35, 1:4]
    steps = np.zeros((48, 48, 6), np.float32)[::3, ::2, ::2]
    return {
        "interleaved": values.copy(),
        "planar": np.ascontiguousarray(values.transpose(2, 0, 1)).transpose(1, 2, 0),
        "rows of planes": np.ascontiguousarray(values.transpose(0, 2, 1)).transpose(0, 2, 1),
        "columns first": np.asfortranarray(values),
        "part of a larger": _filled(part, values),
        "every other": _filled(steps, values),
        "upside down": np.ascontiguousarray(values[::-1])[::-1],
        "right to left": np.ascontiguousarray(values[:, ::-1])[:, ::-1],
        "channels backwards": np.ascontiguousarray(values[:, :, ::-1])[:, :, ::-1],
        "all backwards": np.ascontiguousarray(values[::-1, ::-1, ::-1])[::-1, ::-1, ::-1],
    }


def _filled(array, values):
    array[...] = values
    return array


class Shares:
    """Another array library's array: nothing but DLPack."""

    def __init__(self, array):
        self.array, self.device = array, (1, 0)

    def __dlpack__(self, stream=None):
        return self.array.__dlpack__()

    def __dlpack_device__(self):
        return self.device


class Layouts(unittest.TestCase):
    def test_are_read_where_they_lie(self):
        want = picture(3, channels=3)
        self.assertEqual(len(layouts()), 10)
        for name, array in layouts().items():
            with self.subTest(layout=name):
                image = ts.from_array(array)
                self.assertTrue(np.array_equal(np.asarray(image), want))
                # The same memory: the image sees what is written there.
                array[5, 6, 1] = 9
                self.assertEqual(np.asarray(image)[5, 6, 1], 9)

    def test_are_written_where_they_lie(self):
        source = ts.from_array(picture(3, channels=3)).mulc([2, 1, 0.5])
        want = picture(3, channels=3) * np.float32([2, 1, 0.5])
        for name, out in layouts().items():
            with self.subTest(layout=name):
                base, before = out if out.base is None else out.base, address(out)
                base = base if isinstance(base, np.ndarray) else out
                outside = base.copy()
                self.assertIs(source.render(out=out), out)
                self.assertEqual(address(out), before)
                self.assertTrue(np.array_equal(out, want))
                if name == "part of a larger":  # and nothing beside it
                    outside[7:23, 11:35, 1:4] = want
                    self.assertTrue(np.array_equal(base, outside))

    def test_of_every_type(self):
        for dtype, scale in ((np.uint8, 255), (np.uint16, 65535), (np.float16, 1), (np.float32, 1)):
            with self.subTest(dtype=dtype):
                codes = (picture(1) * scale).astype(dtype)[::-1, 1:]
                image = ts.from_array(codes)
                self.assertTrue(np.array_equal(image.render(dtype=dtype), codes))
                self.assertTrue(np.allclose(np.asarray(image), codes.astype(np.float64) / scale, rtol=1e-6))
                self.assertEqual(np.asarray(image).dtype, np.float32)

    def test_live_as_long_as_images(self):
        array = picture(2)
        image = ts.from_array(array).mulc(2)
        want = array * np.float32(2)
        count = ctypes.c_ssize_t.from_address(id(array)).value
        self.assertGreater(count, 1)
        soft = image.addc(0)
        del array, image
        self.assertTrue(np.array_equal(np.asarray(soft), want))

    def test_are_let_go(self):
        import weakref

        class Watched(np.ndarray):
            pass
        array = picture(2).view(Watched)
        gone = weakref.ref(array)
        image = ts.from_array(array).mulc(2).addc(1).blur(sigma=1)
        np.asarray(image)
        del array
        self.assertIsNotNone(gone())
        del image
        self.assertIsNone(gone())

    def test_a_long_chain_is_let_go(self):
        image = ts.from_array(picture(2))
        for _ in range(50000):
            image = image.addc(1)
        del image

    def test_through_dlpack(self):
        array = picture(4)[::-1, ::2]
        image = ts.from_array(Shares(array))
        array[3, 4, 0] = 7
        self.assertEqual(np.asarray(image)[3, 4, 0], 7)
        back = np.from_dlpack(image)
        self.assertTrue(np.array_equal(back, array))
        elsewhere = Shares(array)
        elsewhere.device = (2, 0)
        with refused(ts.DataError, "array", "host"):
            ts.from_array(elsewhere)

    def test_through_buffers(self):
        image = ts.from_array(picture(5))
        view = memoryview(image)
        self.assertEqual((view.shape, view.format), ((16, 24, 4), "f"))
        self.assertTrue(np.array_equal(np.asarray(view), picture(5)))
        interface = image.__array_interface__
        self.assertEqual((interface["shape"], interface["typestr"]), ((16, 24, 4), "<f4"))

        class Only:
            __array_interface__ = interface
        self.assertTrue(np.array_equal(np.asarray(Only()), picture(5)))
        self.assertEqual(np.asarray(image, np.float64).dtype, np.float64)

    def test_that_do_not_fit_are_refused(self):
        with refused(ts.UsageError, "array", "float64", "astype"):
            ts.from_array(np.zeros((4, 4, 3)))
        with refused(ts.UsageError, "axes"):
            ts.from_array(np.zeros(4, np.float32))
        with refused(ts.UsageError, "channels", "found 2 names"):
            ts.from_array(picture(0), channels="R,G")
        raw = np.zeros(4 * 4 * 3 * 4 + 1, np.uint8)
        with refused(ts.UsageError, "aligned"):
            ts.from_array(raw[1:].view(np.float32).reshape(4, 4, 3))
        image = ts.from_array(picture(0))
        with refused(ts.UsageError, "out", "expected (16, 24, 4)"):
            image.render(out=np.zeros((16, 24, 3), np.float32))
        with refused(ts.UsageError, "out", "memory"):
            image.render(out=np.lib.stride_tricks.as_strided(np.zeros(4, np.float32), (16, 24, 4), (0, 0, 4)))
        frozen = np.zeros((16, 24, 4), np.float32)
        frozen.flags.writeable = False
        with refused(ts.UsageError, "out", "written"):
            image.render(out=frozen)
        with refused(ts.UsageError, "region"):
            image.render(region=(0, 0, 25, 16))

    def test_may_be_their_own_results(self):
        array = picture(6)
        want = np.asarray(ts.from_array(array.copy()).blur(sigma=3).flip())
        ts.from_array(array).blur(sigma=3).flip().render(out=array)
        self.assertTrue(np.array_equal(array, want))


class Parts(unittest.TestCase):
    def setUp(self):
        self.array = picture(7)
        self.image = ts.from_array(self.array)

    def test_are_those_of_numpy(self):
        a, n = self.array, self.image
        for key in (np.s_[2:9, 3:20], np.s_[-5:, :-3], np.s_[4], np.s_[:, 5:6], np.s_[::-1], np.s_[2:9, ::-1],
                    np.s_[..., 0], np.s_[..., 1:3], np.s_[1:5, 2:7, ::-1], np.s_[..., -1], np.s_[3, 4, [2, 0]]):
            with self.subTest(index=key):
                rows, columns, channels = np.mgrid[0:16, 0:24, 0:4]
                want = a[key]
                found = np.asarray(n[key])
                self.assertEqual(found.ndim, 3)
                self.assertTrue(np.array_equal(found.reshape(want.shape) if want.size == found.size else found, want))
        self.assertEqual(n["B,R"].channels, ["B", "R"])
        self.assertEqual(n[..., ["A", "G"]].channels, ["A", "G"])
        self.assertTrue(np.array_equal(np.asarray(n[2:12, 3:][1:4, 2:5]), a[3:6, 5:8]))

    def test_that_are_not_there_are_refused(self):
        for key in (np.s_[30], np.s_[5:5], np.s_[::2], np.s_[..., 4], np.s_[1, 2, 3, 4], np.s_[1.5]):
            with self.subTest(index=key), refused(ts.UsageError, "index"):
                self.image[key]
        with refused(ts.Error, "Q"):
            self.image[..., "Q"]

    def test_are_rendered_alone(self):
        soft = self.image.blur(sigma=2)
        whole = np.asarray(soft)
        self.assertTrue(np.array_equal(soft.render(region=(3, 2, 20, 9)), whole[2:9, 3:20]))
        moved = ts.from_array(self.array, origin=(100, -50))
        self.assertEqual(moved.data_window, (100, -50, 124, -34))
        self.assertTrue(np.array_equal(moved.render(region=(102, -49, 105, -48)), self.array[1:2, 2:5]))
        self.assertTrue(np.array_equal(np.asarray(moved[1:2, 2:5]), self.array[1:2, 2:5]))


class Operators(unittest.TestCase):
    def test_are_operations(self):
        a, b = picture(8), picture(9)
        n, m = ts.from_array(a), ts.from_array(b)
        half, one = np.float32(0.5), np.float32(1)
        for found, want in (
                (n + m, a + b), (n - m, a - b), (n * m, a * b), (n + 0.5, a + half), (0.5 + n, a + half),
                (n - 0.5, a - half), (1 - n, one - a), (n * [2, 1, 0.5, 1], a * np.float32([2, 1, 0.5, 1])),
                (2 * n, a * 2), (n / 2, a / 2), (-n, -a), (abs(-n), a), (a + m, a + b), (a - m, a - b),
                (np.float32([2, 1, 0.5, 1]) * n, a * np.float32([2, 1, 0.5, 1]))):
            self.assertTrue(np.array_equal(np.asarray(found), want))
        self.assertTrue(np.array_equal(np.asarray(n @ m), np.asarray(n.over(m))))
        self.assertTrue(np.allclose(np.asarray(n ** 2), a * a, atol=1e-6))
        self.assertTrue(np.allclose(np.asarray(1 / (n + 1)), 1 / (a + 1), rtol=1e-6))

    def test_refuse_what_is_no_image(self):
        n = ts.from_array(picture(8))
        for action in (lambda: n + "x", lambda: n @ 2, lambda: n + None, lambda: n ** n):
            with self.assertRaises(TypeError):
                action()


if __name__ == "__main__":
    unittest.main()
