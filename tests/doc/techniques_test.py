#!/usr/bin/env python3
"""doc/techniques.md: its lines run on the book's inputs, its functions, samples and tests are there.

usage: techniques_test.py TESSERA SCENE FOLDER
"""
import pathlib
import re
import shutil
import sys
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[2]
BOOK = ROOT / "doc" / "book"
sys.dont_write_bytecode = True
sys.path.insert(0, str(BOOK))
import blocks  # noqa: E402
import headers  # noqa: E402

TOOL, SCENE, FOLDER = sys.argv[1], sys.argv[2], pathlib.Path(sys.argv[3])
HEAD = ["source", "technique", "line, function or sample", "held by"]


def rows(text):
    """The cells of every row of every table, without heads."""
    found = []
    for line in text.splitlines():
        if not line.startswith("|") or set(line) <= set("|- "):
            continue
        cells = [c.strip().replace("\\|", "|") for c in re.split(r"(?<!\\)\|", line.strip())[1:-1]]
        if cells != HEAD:
            found.append(cells)
    return found


class TechniquesTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.rows = rows((ROOT / "doc/techniques.md").read_text())
        shutil.rmtree(FOLDER, ignore_errors=True)
        cls.kitchen = blocks.Kitchen(FOLDER, {"tessera": TOOL, "scene": SCENE}, (320, 200), ROOT,
                                     "/usr/share/backgrounds/mate")
        cls.kitchen.make_inputs(blocks.read(BOOK / "inputs.txt"), BOOK / "data")

    def test_rows_are_whole(self):
        self.assertGreater(len(self.rows), 100)
        for cells in self.rows:
            with self.subTest(cells[:2]):
                self.assertEqual(len(cells), len(HEAD))
                self.assertTrue(cells[0] and cells[1] and cells[2])
                self.assertRegex(cells[2], r"^(`tessera |function `|sample `|partial: |missing: )")
                self.assertTrue(cells[3] or cells[2].startswith(("partial: ", "missing: ")))

    def test_lines_run_and_leave_a_picture(self):
        for number, cells in enumerate(self.rows):
            if not cells[2].startswith("`tessera "):
                continue
            with self.subTest(cells[1]):
                line = cells[2].strip("`")
                try:
                    result = self.kitchen.run(line, self.kitchen.place(str(number)), "doc/techniques.md")
                except blocks.Trouble as trouble:
                    self.fail(str(trouble))
                self.assertIsNotNone(result.picture, line)

    def test_functions_samples_and_tests_are_there(self):
        declared = headers.read(ROOT / "include")
        samples = (ROOT / "samples" / "CMakeLists.txt").read_text()
        tests = (ROOT / "tests" / "CMakeLists.txt").read_text()
        for cells in self.rows:
            with self.subTest(cells[1]):
                for name in re.findall(r"function `(\w+)`", cells[2]):
                    self.assertIn(name, declared)
                for name in re.findall(r"sample `(\w+)`", cells[2]):
                    self.assertIn(name, samples)
                if cells[3]:
                    name = cells[3].strip("`")
                    self.assertTrue(list((ROOT / "tests").glob(f"*/{name}.cc")), name)
                    self.assertRegex(tests, rf"\b{name.removesuffix('_test')}\b|/{name}\.cc\b")


if __name__ == "__main__":
    if not pathlib.Path("/usr/share/backgrounds/mate").is_dir():
        print("the Debian package mate-backgrounds is not installed")
        sys.exit(77)
    unittest.main(argv=sys.argv[:1])
