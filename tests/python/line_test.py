"""Every row of the registry from Python and from the command line, on the same files: the same bits."""
import json
import os
import subprocess
import tempfile
import unittest

import numpy as np
import tessera as ts
from pictures import CHANNELS, HEIGHT, WIDTH, picture
from rows_test import called, count_of
from tessera import _core

PROGRAM = os.environ.get("TESSERA_PROGRAM")


def needs_nothing(row):
    """Whether a line can ask for it by its name alone."""
    return not any(p["positional"] for p in row["parameters"])


@unittest.skipUnless(PROGRAM, "TESSERA_PROGRAM is not set")
class EveryRow(unittest.TestCase):
    """One process answers for all rows: --batch."""

    def line_of(self, row, example, out):
        words = {p["name"]: [] for p in row["parameters"] if p["positional"]}
        mods = ""
        for name, text in _core.split_example(row["name"], example):
            if name in words:
                words[name] = [text]
            else:
                mods += f":{name}={text}"
        values = [w for word in words.values() for w in word]
        if row["generator"]:
            line = ["--pattern", row["name"] + mods, *values, f"{WIDTH}x{HEIGHT}", str(CHANNELS)]
        else:
            line = [f"{k}.exr" for k in range(count_of(row, example))] + [f"--{row['name']}{mods}", *values]
        return [*line, "-d", "float", "-o", out]

    def test_has_the_bits_of_the_line(self):
        cases = []
        for row in ts.operations():
            examples = set(row["examples"][:1]) | ({""} if needs_nothing(row) else set())
            for example in sorted(examples):
                try:
                    count = count_of(row, example)
                except ts.Error:
                    continue  # values that only go together
                if count or row["generator"]:
                    cases.append((row, example))
        with tempfile.TemporaryDirectory() as folder:
            for k in range(24):
                ts.from_array(picture(k)).write(os.path.join(folder, f"{k}.exr"), dtype="float")
            made, files = [], []
            for k, (row, example) in enumerate(cases):
                images = None if row["generator"] else [
                    ts.read(os.path.join(folder, f"{i}.exr")) for i in range(count_of(row, example))]
                try:
                    made.append(called(row, example, images))
                except ts.Error as error:
                    made.append(error)
                # An array is all of the frame; what has other pixels goes to a file that says which.
                image = made[-1]
                framed = isinstance(image, ts.Error) or image.data_window == image.display_window
                files.append(f"out{k}." + ("npy" if framed else "exr"))
            lines = [self.line_of(row, example, file) for (row, example), file in zip(cases, files)]
            run = subprocess.run([PROGRAM, "--batch"], input="".join(json.dumps(line) + "\n" for line in lines),
                                 cwd=folder, capture_output=True, text=True, check=False)
            answers = [json.loads(answer) for answer in run.stdout.splitlines()]
            self.assertEqual(len(answers), len(lines), run.stderr)
            compared = 0
            for k, (row, example) in enumerate(cases):
                with self.subTest(operation=row["name"], example=example):
                    if isinstance(made[k], ts.Error):  # of both or of none
                        self.assertNotEqual(answers[k]["exit_code"], 0, made[k])
                        continue
                    path = os.path.join(folder, files[k])
                    self.assertTrue(os.path.exists(path), answers[k])
                    want = np.asarray(made[k])
                    found = np.load(path) if path.endswith(".npy") else np.asarray(ts.read(path))
                    self.assertTrue(np.array_equal(found.reshape(want.shape), want, equal_nan=True), lines[k])
                    compared += 1
            self.assertGreater(compared, 190)


if __name__ == "__main__":
    unittest.main()
