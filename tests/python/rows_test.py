"""Every row of the registry as a method: the bits that C++ computes for its first example (tests/c/rows.cc)."""
import inspect
import os
import unittest

import numpy as np
import tessera as ts
from pictures import CHANNELS, HEIGHT, WIDTH, fnv, picture
from tessera import _core, rows

ROWS = os.environ["TESSERA_ROWS"]


def python_value(parameter, text):
    """As somebody would write it in Python."""
    kind = parameter["kind"] if parameter else "text"
    if kind == "number":
        return float(text)
    if kind == "integer":
        return int(text)
    if kind == "flag":
        return text != "0"
    if kind == "numbers" or (kind == "choice" and parameter["numbers_too"] and text[:1] in "+-.0123456789"):
        return [float(v) for v in text.split(",")]
    return text


def count_of(row, example):
    """How many images it takes."""
    return _core.check(row["name"], _core.split_example(row["name"], example))


def called(row, example, images=None):
    """The operation as a call with the example's values, on these images."""
    known = {p["name"]: p for p in row["parameters"]}
    positional, named = [], {}
    for name, text in _core.split_example(row["name"], example):
        value = python_value(known.get(name), text)
        if name in known and known[name]["positional"]:
            positional.append(value)
        else:
            named[rows.python_name(name)] = value
    method = rows.python_name(row["name"])
    if row["generator"]:
        return getattr(ts, method)((WIDTH, HEIGHT), CHANNELS, *positional, **named)
    images = [ts.from_array(picture(k)) for k in range(count_of(row, example))] if images is None else images
    if row["images"] < 0:
        return getattr(ts, method)(*images, *positional, **named)
    return getattr(images[0], method)(*images[1:], *positional, **named)


class EveryRow(unittest.TestCase):
    def test_has_the_bits_of_cpp(self):
        compared = 0
        with open(ROWS) as lines:
            for line in lines:
                name, *numbers, want = line.split()
                with self.subTest(operation=name):
                    row = rows.BY_NAME[name]
                    image = called(row, row["examples"][0])
                    self.assertEqual([*image.data_window, len(image.channels)], [int(n) for n in numbers])
                    self.assertEqual(fnv(np.asarray(image).tobytes()), int(want, 16), "other bits than in C++")
                compared += 1
        self.assertEqual(compared, len([row for row in ts.operations() if row["examples"]]))
        self.assertGreater(compared, 150)

    def test_is_made_by_every_example(self):
        for row in ts.operations():
            for example in row["examples"]:
                with self.subTest(operation=row["name"], example=example):
                    self.assertIsInstance(called(row, example), ts.Image)

    def test_has_signature_and_docstring(self):
        for row in ts.operations():
            with self.subTest(operation=row["name"]):
                name = rows.python_name(row["name"])
                method = getattr(ts.Image, name)
                signature = inspect.signature(method)
                for own, parameter in rows.parameters_of(row):
                    self.assertIn(own, signature.parameters)
                    self.assertIn(f"{own}: {parameter['help']}"[:60], method.__doc__)
                self.assertTrue(method.__doc__.startswith(row["summary"]))
                if row["examples"]:
                    self.assertIn(">>> ", method.__doc__)
                if row["generator"]:
                    self.assertIs(getattr(ts, name), method)

    def test_does_not_hide_what_images_have(self):
        own = {name for name in vars(ts.Image) if not name.startswith("_")} | set(dir(_core.Image))
        hidden = own & {rows.python_name(row["name"]) for row in ts.operations() if not row["generator"]}
        self.assertEqual(hidden, set())

    def test_takes_values_as_numpy_has_them(self):
        image = ts.from_array(picture(0))
        want = np.asarray(image.mulc([2, 1, 0.5, 1]))
        for values in (np.array([2, 1, 0.5, 1]), np.float32([2, 1, 0.5, 1]), (2, 1, 0.5, 1), [np.float64(2), 1, 0.5, True + 0]):
            self.assertTrue(np.array_equal(np.asarray(image.mulc(values)), want))
        self.assertTrue(np.array_equal(np.asarray(image.saturate(np.float32(0.5))), np.asarray(image.saturate(0.5))))
        flagged = image.lens(0.05, apply=np.bool_(True))
        self.assertTrue(np.array_equal(np.asarray(flagged), np.asarray(image.lens(0.05, apply=1))))
        self.assertEqual(image.resize((12, 8), filter="box").shape, (8, 12, 4))
        self.assertEqual(image.originoffset((3, -2)).data_window, (3, -2, 27, 14))

    def test_takes_names_as_the_line_does(self):
        image = ts.from_array(picture(0))
        want = np.asarray(image.blur(sigma=2, wrap="repeat"))
        self.assertTrue(np.array_equal(np.asarray(image.blur(sigma=2, border="periodic")), want))
        self.assertTrue(np.array_equal(np.asarray(image.saturate(s=0.5)), np.asarray(image.saturate(0.5))))


if __name__ == "__main__":
    unittest.main()
