"""The package as a whole: its stub, its wheel, and how it shows itself."""
import ast
import os
import subprocess
import sys
import tempfile
import unittest
import zipfile

import numpy as np
import tessera as ts
from pictures import picture
from tessera import rows, stub

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
MYPY = os.environ.get("TESSERA_MYPY")

TYPED = '''
import numpy as np
import tessera as ts
image: ts.Image = ts.read("a.exr").saturate(1.2).hue(30).blur(sigma=20, method="auto")
over: ts.Image = (image @ ts.checker((64, 64), 3, width=8)) * [2, 1, .5] - 0.5
mean: ts.Image = ts.average(image, image, N=2)
array = np.asarray(over[10:20, 5:]["R,G"])
with ts.options(threads=2, memory="1G", progress=lambda share: share < 1):
    over.write("b.exr", dtype="half", attributes={"Artist": "nobody"})
look: ts.Graph = ts.graph(lambda plate: plate.blur(sigma=2))
found: ts.Comparison = ts.compare(image, array, split=0.3)
psnr: float = found.psnr
rows: ts.Image = ts.from_rows(lambda y0, y1: array[y0:y1], array.shape, array.dtype)
table: ts.Image = ts.table_of(lambda s, t: s * t, (9, 9)).lookup(ts.volume_of(array), dims=3, slices=10)
chunks = ts.dask.apply(look, array, chunks=(64, 64), dtype="half", threads=2)
whole: ts.Image = ts.dask.image(chunks)
texture = ts.fields.lic_of(array[..., 0], array[..., 1], length=12)
with ts.options(progress=True):
    ts.lic_plot(array[..., 0], array[..., 1], geographic=False, label="m/s", length=20)
try:
    look(array).verify()
except ts.Error as error:
    print(error.kind, error.subject, error.hint)
'''
UNTYPED = '''
import tessera as ts
image = ts.read("a.exr")
image.blur(sigmma=3)
image.blur(method="dirct")
image.blurr()
ts.read(3)
'''


class Stub(unittest.TestCase):
    def setUp(self):
        with open(os.path.join(os.path.dirname(ts.__file__), "__init__.pyi"), encoding="utf-8") as file:
            self.text = file.read()

    def test_is_the_registry(self):
        self.assertEqual(self.text, stub.stub(), "the stub of the build is not the command's")
        tree = ast.parse(self.text)
        image = next(n for n in tree.body if isinstance(n, ast.ClassDef) and n.name == "Image")
        methods = {n.name: n for n in image.body if isinstance(n, ast.FunctionDef)}
        functions = {n.name: n for n in tree.body if isinstance(n, ast.FunctionDef)}
        for row in ts.operations():
            name = rows.python_name(row["name"])
            arguments = methods[name].args
            found = {a.arg for a in arguments.posonlyargs + arguments.args + arguments.kwonlyargs}
            self.assertLessEqual({own for own, _ in rows.parameters_of(row)}, found, name)
            if row["generator"] or row["images"] < 0:
                self.assertIn(name, functions)
        for name in ts.__all__:
            self.assertTrue(name in functions or f"class {name}" in self.text, name)
        for name in dir(ts.Image):
            if not name.startswith("_"):
                self.assertRegex(self.text, rf"\b{name}\b")

    @unittest.skipUnless(MYPY, "mypy is not there")
    def test_is_what_mypy_takes(self):
        def run(text):
            with tempfile.TemporaryDirectory() as folder:
                path = os.path.join(folder, "user.py")
                with open(path, "w", encoding="utf-8") as file:
                    file.write(text)
                found = subprocess.run([MYPY, "--strict", "--cache-dir", os.devnull, "--python-executable",
                                        sys.executable, path], cwd=folder, capture_output=True, text=True, check=False,
                                       env={**os.environ, "MYPYPATH": os.path.dirname(os.path.dirname(ts.__file__))})
                return found.returncode, found.stdout
        code, words = run(TYPED)
        self.assertEqual(code, 0, words)
        code, words = run(UNTYPED)
        self.assertNotEqual(code, 0)
        for line in range(4, 8):
            self.assertIn(f"user.py:{line}: error", words)


class Wheel(unittest.TestCase):
    def test_is_imported(self):
        sys.path.insert(0, os.path.join(ROOT, "src", "python", "build_backend"))
        import tessera_build
        with tempfile.TemporaryDirectory() as folder:
            wheel = tessera_build.build_wheel(folder, {"package": os.path.dirname(ts.__file__)})
            with zipfile.ZipFile(os.path.join(folder, wheel)) as archive:
                archive.extractall(folder)
                names = archive.namelist()
            self.assertIn("tessera/__init__.pyi", names)
            self.assertIn("tessera/py.typed", names)
            where = subprocess.run(
                [sys.executable, "-c", "import tessera, tessera._core; print(tessera.__file__, tessera.__version__)"],
                cwd=folder, env={**os.environ, "PYTHONPATH": folder}, capture_output=True, text=True, check=True).stdout
            self.assertEqual(where.split(), [os.path.join(folder, "tessera", "__init__.py"), ts.__version__])


class Notebooks(unittest.TestCase):
    def test_show_a_png(self):
        with tempfile.TemporaryDirectory() as folder:
            for channels in (1, 2, 3, 4, 5):
                with self.subTest(channels=channels):
                    image = ts.from_array(picture(0, channels=channels))
                    data = image._repr_png_()
                    self.assertEqual(data[:8], b"\x89PNG\r\n\x1a\n")
                    path = os.path.join(folder, "a.png")
                    with open(path, "wb") as file:
                        file.write(data)
                    shown = np.asarray(ts.read(path))
                    self.assertEqual(shown.shape[:2], (16, 24))
                    if channels == 3:
                        self.assertLess(np.abs(shown - picture(0, channels=3)).max(), 1 / 500)
            large = ts.checker((3000, 1500))._repr_png_()
            self.assertEqual(int.from_bytes(large[16:20], "big"), 1024)
            # Linear colours are brighter on a screen than their numbers.
            path = os.path.join(folder, "linear.exr")
            ts.constant((8, 8), 3, color=0.2140).write(path)
            with open(os.path.join(folder, "b.png"), "wb") as file:
                file.write(ts.read(path)._repr_png_())
            self.assertLess(abs(np.asarray(ts.read(os.path.join(folder, "b.png"))).mean() - 0.5), 1 / 200)


if __name__ == "__main__":
    unittest.main()
