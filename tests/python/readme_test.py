"""The Python of the README and of doc/python.md, as it stands there."""
import os
import re
import tempfile
import unittest

import numpy as np
import tessera as ts
from pictures import picture

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))


class Readme(unittest.TestCase):
    def test_runs(self):
        with open(os.path.join(ROOT, "README.md"), encoding="utf-8") as file:
            blocks = re.findall(r"```python\n(.*?)```", file.read(), re.DOTALL)
        self.assertEqual(len(blocks), 1)
        before = os.getcwd()
        with tempfile.TemporaryDirectory() as folder:
            os.chdir(folder)
            try:
                ts.from_array(picture(0, 64, 48, 3)).write("shot.0001.exr")
                names = {}
                exec(compile(blocks[0], "README.md", "exec"), names)  # noqa: what a reader would do
                self.assertTrue(np.array_equal(np.asarray(ts.read("soft.exr")),
                                               names["soft"].render(dtype="half").astype(np.float32)))
                self.assertEqual(names["pixels"].shape, (32, 40, 3))
            finally:
                os.chdir(before)

    def test_and_so_does_its_page(self):
        with open(os.path.join(ROOT, "doc/python.md"), encoding="utf-8") as file:
            blocks = re.findall(r"```python\n(.*?)```", file.read(), re.DOTALL)
        self.assertGreater(len(blocks), 3)
        before = os.getcwd()
        with tempfile.TemporaryDirectory() as folder:
            os.chdir(folder)
            try:
                names = {}
                for number, block in enumerate(blocks):
                    exec(compile(block, f"doc/python.md block {number}", "exec"), names)  # noqa: what a reader would do
                self.assertEqual(ts.read("soft.tif").shape, (300, 400, 3))
                self.assertEqual(names["brighter"].shape, (300, 400, 1))
                self.assertEqual(names["inside"].shape, (300, 400, 1))
                self.assertEqual(names["texture"].shape, (61, 121))
            finally:
                os.chdir(before)


if __name__ == "__main__":
    unittest.main()
