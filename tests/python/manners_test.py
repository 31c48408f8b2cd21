"""Errors, options, threads, Ctrl-C, progress, files."""
import os
import signal
import subprocess
import sys
import tempfile
import threading
import time
import unittest

import numpy as np
import tessera as ts
from pictures import picture, refused

LONG = """
import signal, sys, time
import tessera as ts
image = ts.clouds((9000, 9000), 3, octaves=24)
print("ready", flush=True)
try:
    image.render()
    print("ended")
except KeyboardInterrupt:
    print("interrupted", time.time())
"""


class Errors(unittest.TestCase):
    def test_have_kind_subject_and_hint(self):
        image = ts.from_array(picture(0))
        with refused(ts.UsageError, "blur", "sigma"):
            image.blur(sigmma=2)
        try:
            image.blur(sigma=2, method="dirct")
        except ts.UsageError as error:
            self.assertEqual((error.kind, error.subject, error.hint), ("usage", "blur:method", "did you mean direct?"))
            self.assertIsInstance(error, ValueError)
        with refused(ts.DataError, "/no/such.exr"):
            ts.read("/no/such.exr")
        with refused(ts.UsageError, "saturate", "'much'", "a number"):
            image.saturate("much")
        with refused(ts.UsageError, "add", "images"):
            image.add()
        with refused(ts.DataError, "saturate", "channels"):
            image[..., :2].saturate(1.5)
        with refused(ts.UsageError, "size"):
            ts.checker(5)
        with refused(ts.UsageError, "images first"):
            image.mad(1, image, image)
        with self.assertRaises(TypeError):
            ts.Image(3)

    def test_of_the_system(self):
        with refused(ts.Error, "/no/such/folder"):
            ts.from_array(picture(0)).write("/no/such/folder/a.exr")


class Options(unittest.TestCase):
    def test_hold_inside_the_block(self):
        image = ts.from_array(picture(0, 640, 480)).blur(sigma=3)
        want = np.asarray(image)
        for options in ({"threads": 1}, {"memory": "32M"}, {"tile": (16, 16)}, {"optimize": False},
                        {"rules_off": ["all"]}, {"target": ts.targets()[-1]}):
            with self.subTest(options=options), ts.options(**options):
                found = image.render()
                if "target" in options:
                    self.assertEqual(ts.target(), options["target"])
                if options in ({"threads": 1},):
                    self.assertEqual(image.stats["threads"], 1)
                if "target" not in options:  # one without fused multiply-add has bits of its own
                    self.assertTrue(np.array_equal(found, want))
        self.assertNotEqual(ts.target(), None)
        image.render()
        self.assertEqual(image.stats["threads"], len(os.sched_getaffinity(0)))

    def test_that_are_wrong_are_refused(self):
        for options, word in (({"threads": -1}, "threads"), ({"memory": "much"}, "memory"),
                              ({"target": "MMX"}, "MMX"), ({"progress": 3}, "progress")):
            with refused(ts.UsageError, word), ts.options(**options):
                pass


class Progress(unittest.TestCase):
    def setUp(self):
        self.image = ts.white((2000, 2000), 3).median("15x15")

    def test_is_told_in_this_thread(self):
        told = []
        with ts.options(progress=lambda share: told.append((share, threading.get_ident()))):
            self.image.render()
        shares = [share for share, _ in told]
        self.assertEqual(shares, sorted(shares))
        self.assertGreater(len(shares), 2)
        self.assertEqual(shares[-1], 1)
        self.assertEqual({thread for _, thread in told}, {threading.get_ident()})

    def test_cancels(self):
        with refused(ts.Cancelled), ts.options(progress=lambda share: False):
            self.image.render()

    def test_raises(self):
        def fail(share):
            raise RuntimeError("of the progress function")
        with refused(RuntimeError, "progress function"), ts.options(progress=fail):
            self.image.render()


class Threads(unittest.TestCase):
    def test_eight_compute_at_once(self):
        image = ts.from_array(picture(0, 400, 300))
        want = [np.asarray(image.blur(sigma=1 + k)) for k in range(8)]
        wrong = []

        def work(k):
            for _ in range(5):
                own = ts.from_array(picture(0, 400, 300)).blur(sigma=1 + k)
                if not np.array_equal(np.asarray(own), want[k]):
                    wrong.append(k)
        threads = [threading.Thread(target=work, args=(k,)) for k in range(8)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        self.assertEqual(wrong, [])

    def test_do_not_wait_for_the_interpreter(self):
        """Another Python thread goes on while one computes, in the main thread and beside it."""
        image = ts.white((2500, 2500), 3).median("25x25")
        for beside in (False, True):
            count = [0]
            stop = threading.Event()

            def spin():
                while not stop.is_set():
                    count[0] += 1
                    time.sleep(0.001)
            spinner = threading.Thread(target=spin)
            spinner.start()
            begin = time.perf_counter()
            if beside:
                worker = threading.Thread(target=image.render)
                worker.start()
                worker.join()
            else:
                image.render()
            seconds = time.perf_counter() - begin
            stop.set()
            spinner.join()
            self.assertGreater(count[0], seconds * 50, f"{count[0]} turns in {seconds:.2f} s")


class Interrupts(unittest.TestCase):
    def test_cancel_soon(self):
        late = []
        for _ in range(3):  # a machine that is busy may hold one up
            with subprocess.Popen([sys.executable, "-c", LONG], stdout=subprocess.PIPE, text=True) as process:
                self.assertEqual(process.stdout.readline(), "ready\n")
                time.sleep(0.5)
                sent = time.time()
                process.send_signal(signal.SIGINT)
                word, *when = process.stdout.read().split()
            self.assertEqual(word, "interrupted")
            late.append(float(when[0]) - sent)
        self.assertLess(min(late), 0.3, late)


class Files(unittest.TestCase):
    def test_come_back(self):
        image = ts.from_array(picture(0, channels=3))
        with tempfile.TemporaryDirectory() as folder:
            for name, dtype in (("a.exr", "half"), ("a.exr", None), ("a.tif", "uint16"), ("a.png", np.uint8)):
                with self.subTest(file=name, dtype=dtype):
                    path = os.path.join(folder, name)
                    image.write(path, dtype=dtype, attributes={"Artist": "nobody", "pixel": 3})
                    back = ts.read(path)
                    self.assertTrue(np.allclose(np.asarray(back), picture(0, channels=3), atol=1 / 500))
                    self.assertEqual(back.metadata["Artist"], "nobody")
                    self.assertIn("seconds", image.stats)
            self.assertIn("a.exr", ts.read(os.path.join(folder, "a.exr")).blur(sigma=2).explain())
            cost = ts.read(os.path.join(folder, "a.exr")).blur(sigma=2).cost("half")
            self.assertIn("compute", [part["name"] for part in cost["parts"]])
            self.assertGreater(cost["seconds"], 0)
            self.assertLessEqual(max(part["elapsed"] for part in cost["parts"]), cost["seconds"] * (1 + 1e-9))

    def test_are_written_as_asked(self):
        image = ts.from_array(picture(0, 200, 150, 3))
        with tempfile.TemporaryDirectory() as folder:
            def size(name, **how):
                path = os.path.join(folder, name)
                image.write(path, **how)
                return os.path.getsize(path), ts.read(path).metadata
            self.assertLess(size("a.jpg", quality=20)[0], size("b.jpg", quality=95)[0])
            self.assertEqual(size("a.exr", compression="piz")[1]["compression"], "piz")
            image = ts.read(os.path.join(folder, "a.exr"))
            image.write(os.path.join(folder, "c.exr"), attributes={"Artist": "nobody", "level": 0.5})
            image = ts.read(os.path.join(folder, "c.exr"))
            self.assertEqual(image.metadata["level"], 0.5)
            self.assertNotIn("Artist", size("d.exr", attributes={"Artist": None})[1])
            self.assertEqual(ts.subimages(os.path.join(folder, "a.exr")), [""])
        with refused(ts.DataError, "folder.exr"):
            ts.read("/no/folder.exr", part=2)

    def test_verify(self):
        image = ts.from_array(picture(0, 100, 80)).blur(sigma=2)
        found = image.verify()
        self.assertTrue(found)
        self.assertGreater(found.samples, 1000)
        self.assertIn("within bound", str(found))
        self.assertTrue(image.verify(dtype="uint8"))


if __name__ == "__main__":
    unittest.main()
