"""The Python of the README, as it stands there."""
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


if __name__ == "__main__":
    unittest.main()
