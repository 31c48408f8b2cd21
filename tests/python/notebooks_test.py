"""The notebooks of samples/notebooks, cell by cell as a notebook runs them, at a small size."""
import ast
import base64
import contextlib
import glob
import io
import os
import re
import sys
import tempfile
import unittest

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
FOLDER = os.path.join(ROOT, "samples", "notebooks")
os.environ["TESSERA_NOTEBOOK_SIZE"] = "96"
os.environ.setdefault("MPLBACKEND", "Agg")


def cells(text):
    """(first line, source) of every cell of code."""
    starts = [m.start() for m in re.finditer(r"^# %%", text, re.MULTILINE)]
    for start, end in zip(starts, [*starts[1:], len(text)]):
        if not text.startswith("# %% [markdown]", start):
            yield text.count("\n", 0, start), text[start:end]


def shown(value):
    """The PNG that a notebook shows for a value, None for text."""
    if hasattr(value, "_repr_html_"):
        return base64.b64decode(re.search(r"base64,([^\"]*)", value._repr_html_()).group(1))
    return value._repr_png_() if hasattr(value, "_repr_png_") else None


def run(path):
    """The pictures that it shows, and what it prints."""
    with open(path, encoding="utf-8") as file:
        text = file.read()
    names, pictures = {"__name__": "__main__"}, []
    with contextlib.redirect_stdout(io.StringIO()) as printed:
        for line, source in cells(text):
            tree = ast.parse("\n" * line + source, path)
            last = tree.body.pop() if tree.body and isinstance(tree.body[-1], ast.Expr) else None
            exec(compile(tree, path, "exec"), names)  # noqa: what a notebook does
            if last is not None:
                picture = shown(eval(compile(ast.Expression(last.value), path, "eval"), names))  # noqa
                pictures += [picture] if picture else []
    return pictures, printed.getvalue()


class Notebooks(unittest.TestCase):
    def test_run(self):
        files = sorted(glob.glob(os.path.join(FOLDER, "*.py")))
        self.assertGreaterEqual(len(files), 10)
        before = os.getcwd()
        for path in files:
            with self.subTest(notebook=os.path.basename(path)), tempfile.TemporaryDirectory() as folder:
                os.chdir(folder)
                try:
                    pictures, _ = run(path)
                except SystemExit as left:  # for want of a package
                    self.assertIn("needs", str(left))
                    continue
                finally:
                    os.chdir(before)
                self.assertGreater(len(pictures), 0)
                for picture in pictures:
                    self.assertEqual(picture[:8], b"\x89PNG\r\n\x1a\n")

    def test_begin_with_their_subject(self):
        for path in glob.glob(os.path.join(FOLDER, "*.py")):
            with open(path, encoding="utf-8") as file:
                lines = file.read().splitlines()
            self.assertEqual(lines[0], "# %% [markdown]", path)
            self.assertTrue(lines[1].startswith("# # "), path)


if __name__ == "__main__":
    sys.exit(unittest.main())
