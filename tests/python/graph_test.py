"""Graphs with open inputs, as JSON, through the command line, pickled."""
import inspect
import os
import pickle
import subprocess
import tempfile
import unittest

import numpy as np
import tessera as ts
from pictures import picture, refused
from rows_test import called, count_of

PROGRAM = os.environ.get("TESSERA_PROGRAM")


def same(a, b):
    return np.array_equal(np.asarray(a), np.asarray(b), equal_nan=True)


class Graphs(unittest.TestCase):
    def setUp(self):
        self.a, self.b = ts.from_array(picture(0)), ts.from_array(picture(1))

    def test_are_recorded_from_functions(self):
        def look(plate, light):
            soft = plate.saturate(1.2).blur(sigma=2, border="periodic")
            return (soft @ light) * [1, 0.5, 2, 1] + 0.25 - plate
        graph = ts.graph(look)
        self.assertEqual(graph.inputs, ["plate", "light"])
        want = look(self.a, self.b)
        self.assertTrue(same(graph(self.a, self.b), want))
        self.assertTrue(same(graph(light=self.b, plate=self.a), want))
        self.assertTrue(same(graph(picture(0), picture(1)), want))

    def test_take_every_operation(self):
        count = 0
        for row in ts.operations():
            for example in row["examples"]:
                images = [] if row["generator"] else [picture(k) for k in range(count_of(row, example))]
                if not images:
                    continue
                with self.subTest(operation=row["name"], example=example):
                    def function(*opened, of=row, line=example):
                        return called(of, line, opened)
                    function.__signature__ = inspect.Signature([
                        inspect.Parameter(f"image{k}", inspect.Parameter.POSITIONAL_ONLY) for k in range(len(images))])
                    self.assertTrue(same(ts.graph(function)(*images), called(row, example)))
                    count += 1
        self.assertGreater(count, 400)

    def test_share_what_is_shared(self):
        def twice(image):
            soft = image.blur(sigma=2)
            return soft + soft
        self.assertEqual(ts.graph(twice).text.count("blur"), 1)

    def test_hold_images_from_outside(self):
        graph = ts.graph(lambda image: image + self.b)
        self.assertEqual(graph.inputs, ["image"])
        self.assertTrue(same(graph(self.a), self.a + self.b))
        with tempfile.TemporaryDirectory() as folder, refused(ts.DataError, "graph", "memory"):
            graph.save(os.path.join(folder, "a.json"))
        self.assertTrue(same(pickle.loads(pickle.dumps(graph))(self.a), self.a + self.b))

    def test_index_open_images(self):
        graph = ts.graph(lambda image: image[2:9, 3:20][..., ["B", "R"]][::-1])
        self.assertTrue(same(graph(self.a), self.a[2:9, 3:20][..., ["B", "R"]][::-1]))
        for wrong in (lambda image: image[1:], lambda image: image[-3:4, 2:5], lambda image: image[3]):
            with refused(ts.UsageError, "index", "not known"):
                ts.graph(wrong)

    def test_are_wrong_where_they_are_written(self):
        with refused(ts.UsageError, "blur", "did you mean sigma"):
            ts.graph(lambda image: image.blur(sigmma=2))
        with refused(ts.UsageError, "blur:sigma"):
            ts.graph(lambda image: image.blur(sigma=-2))
        with refused(ts.UsageError, "add", "found 1 images"):
            ts.graph(lambda image: image.add())
        with refused(ts.UsageError, "returns int"):
            ts.graph(lambda image: 3)
        with refused(ts.UsageError, "plate"):
            ts.graph(lambda plate: plate.abs())()
        with refused(ts.UsageError, "found 2 images, expected 1"):
            ts.graph(lambda plate: plate.abs())(self.a, self.b)

    def test_come_back_from_files(self):
        graph = ts.graph(lambda plate, light: (plate @ light).blur(sigma=1.5))
        with tempfile.TemporaryDirectory() as folder:
            path = os.path.join(folder, "look.json")
            graph.save_graph(path)
            back = ts.load_graph(path)
            self.assertEqual(back, graph)
            self.assertTrue(same(back(self.a, self.b), graph(self.a, self.b)))
            with open(path, "w", encoding="utf-8") as file:
                file.write('{"tessera_graph": 1, "nodes": 3}')
            with refused(ts.DataError, "look.json", "result"):
                ts.load_graph(path)(self.a)
            with refused(ts.DataError, "none.json"):
                ts.load_graph(os.path.join(folder, "none.json"))

    def test_pickle(self):
        graph = ts.graph(lambda plate: plate.blur(sigma=2))
        self.assertEqual(pickle.loads(pickle.dumps(graph)), graph)
        image = ts.from_array(picture(3), origin=(5, -2), display_window=(0, 0, 40, 30)).blur(sigma=3) + self.b
        back = pickle.loads(pickle.dumps(image))
        self.assertEqual((back.data_window, back.display_window), (image.data_window, image.display_window))
        self.assertTrue(same(back, image))

    def test_of_images(self):
        with tempfile.TemporaryDirectory() as folder:
            path = os.path.join(folder, "look.json")
            (self.a.named("plate") + self.b).save_graph(path)
            graph = ts.load_graph(path)
            self.assertEqual(sorted(graph.inputs), ["image", "plate"])
            self.assertTrue(same(graph(plate=self.a, image=self.b), self.a + self.b))


@unittest.skipUnless(PROGRAM, "TESSERA_PROGRAM is not set")
class CommandLine(unittest.TestCase):
    def run_line(self, folder, *words):
        subprocess.run([PROGRAM, *words], cwd=folder, check=True)

    def test_saves_what_python_runs(self):
        with tempfile.TemporaryDirectory() as folder:
            ts.from_array(picture(0, channels=3)).write(os.path.join(folder, "a.exr"))
            self.run_line(folder, os.path.join(folder, "a.exr"), "--saturate", "1.3", "--blur:sigma=2", "-o", "b.exr",
                          "--save-graph", "g.json")
            graph = ts.load_graph(os.path.join(folder, "g.json"))
            self.assertEqual(graph.inputs, [])
            self.assertTrue(same(graph(), ts.read(os.path.join(folder, "b.exr"))))

    def test_runs_what_python_saves(self):
        with tempfile.TemporaryDirectory() as folder:
            a, b = (ts.from_array(picture(k, channels=3)) for k in range(2))
            a.write(os.path.join(folder, "a.exr"))
            b.write(os.path.join(folder, "b.exr"))
            graph = ts.graph(lambda plate, light: plate.blur(sigma=2) * light - 0.5)
            graph.save(os.path.join(folder, "g.json"))
            self.run_line(folder, "run", "g.json", "-i", "light=b.exr", "-i", "plate=a.exr", "-d", "float", "-o", "c.exr")
            self.assertTrue(same(ts.read(os.path.join(folder, "c.exr")), graph(a, b)))
            line = subprocess.run([PROGRAM, "run", "g.json", "-i", "light=b.exr", "-o", "d.exr"], cwd=folder,
                                  capture_output=True, text=True, check=False)
            self.assertNotEqual(line.returncode, 0)
            self.assertIn('open input "plate"', line.stderr)


if __name__ == "__main__":
    unittest.main()
