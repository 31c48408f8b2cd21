#!/usr/bin/env python3
"""samples/gallery: every line makes a picture at a small size that is one; the page and the sheet are made.

usage: gallery_test.py TESSERA FOLDER
"""
import json
import pathlib
import shutil
import subprocess
import sys
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[2]
TOOL, FOLDER = pathlib.Path(sys.argv[1]).resolve(), pathlib.Path(sys.argv[2])


class Gallery(unittest.TestCase):
    def test_pictures(self):
        shutil.rmtree(FOLDER, ignore_errors=True)
        done = subprocess.run([sys.executable, "-B", ROOT / "samples/gallery/make", TOOL, "--size", "96x54", "--out", FOLDER,
                               "--sheet", FOLDER / "sheet.jpg"], capture_output=True, text=True, check=False)
        self.assertEqual(done.returncode, 0, done.stderr)
        pictures = sorted(p for p in FOLDER.glob("*.jpg") if p.name != "sheet.jpg")
        self.assertGreaterEqual(len(pictures), 24)
        for picture in pictures:
            with self.subTest(picture=picture.name):
                said = subprocess.run([TOOL, "-q", "--json", "--printstats", picture], capture_output=True, text=True, check=True)
                report = json.loads(said.stdout.splitlines()[-1])
                self.assertEqual((report["width"], report["height"]), (96, 54))
                self.assertGreater(max(channel["deviation"] for channel in report["channels"]), 0.02)
        page = (FOLDER / "index.html").read_text(encoding="utf-8")
        for picture in pictures:
            self.assertIn(picture.name, page)
        self.assertIn("Gallery", page)
        self.assertTrue((ROOT / "samples/pictures/gallery.jpg").exists())


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
