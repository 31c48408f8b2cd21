"""Graphs on Dask's arrays: the bits of one machine, chunk by chunk, on two processes, one of which is killed."""
import os
import pickle
import signal
import subprocess
import sys
import tempfile
import time
import unittest

import numpy as np
import tessera as ts
from pictures import picture, refused
from rows_test import called, count_of

try:
    import dask
    import dask.array as da
except ImportError:
    dask = None
try:
    import distributed
except ImportError:
    distributed = None
try:
    import zarr
except ImportError:
    zarr = None

HEIGHT, WIDTH = 61, 83


def arrays(k, chunks=(16, 24, 4), channels=4, dtype=np.float32):
    """A picture, and the same in chunks that do not divide it."""
    values = (picture(k, WIDTH, HEIGHT, channels) * (255 if dtype == np.uint8 else 1)).astype(dtype)
    return values, da.from_array(values, chunks=chunks)


def bits(a, b):
    return np.array_equal(np.asarray(a), np.asarray(b), equal_nan=True)


@unittest.skipUnless(dask, "dask is not there")
class Chunks(unittest.TestCase):
    def setUp(self):
        dask.config.set(scheduler="synchronous")

    def test_have_no_seams(self):
        values, chunked = arrays(0)
        for name, look in {
                "colours": lambda image: image.saturate(1.3) * [1, 0.9, 0.8, 1],
                "a window": lambda image: image.blur(sigma=2),
                "around the edge": lambda image: image.blur(sigma=3, border="periodic"),
                "mirrored": lambda image: image.median("5x3").blur(sigma=2, border="mirror"),
                "turned round": lambda image: image.flip().rotate90(),
                "twice": lambda image: image.blur(sigma=1.5) - image,
                "smaller": lambda image: image.resize((29, 37)),
                "larger": lambda image: image.resize((201, 122), filter="lanczos3"),
                "a part": lambda image: image.blur(sigma=1)[7:50, 11:60],
                "several": lambda image: image.saturate(1.2).blur(sigma=2).unsharp()}.items():
            with self.subTest(graph=name):
                graph = ts.graph(look)
                found = ts.dask.apply(graph, chunked)
                want = np.asarray(graph(values))
                self.assertEqual(found.shape, want.shape)
                self.assertTrue(bits(found.compute(), want))
                self.assertTrue(bits(ts.dask.apply(look, chunked, chunks=(13, 40)).compute(), want))

    def test_take_every_operation(self):
        """Every example of the registry: the bits, or a refusal that says what needs all of it."""
        computed, whole = 0, set()
        for row in ts.operations():
            if row["generator"]:
                continue
            for example in row["examples"]:
                count = count_of(row, example)
                if count == 0:
                    continue
                given = [arrays(k, chunks=(23, 31, 4)) for k in range(count)]
                with self.subTest(operation=row["name"], example=example):
                    def function(*opened, of=row, line=example):
                        return called(of, line, opened)
                    graph = _graph_of(function, count)
                    want = graph(*(values for values, _ in given))
                    try:
                        found = ts.dask.apply(graph, *(chunked for _, chunked in given), chunks=(20, 33))
                    except ts.DataError as error:
                        self.assertIn("all of which it needs", error.reason)
                        self.assertIn("expected", error.hint)
                        whole.add(row["name"])
                        continue
                    self.assertTrue(bits(found.compute(), want))
                    computed += 1
        self.assertGreater(computed, 300)
        self.assertLess(len(whole), 45, sorted(whole))
        self.assertNotIn("saturate", whole)

    def test_need_no_more_than_their_halo(self):
        _, chunked = arrays(0, chunks=(20, 20, 4))
        graph = ts.graph(lambda image: image.blur(sigma=1, method="direct"))
        found = ts.dask.apply(graph, chunked)
        tasks = dict(found.__dask_graph__())
        cuts = [cut for key, task in tasks.items() if "frame" in key or "part" in key for cut in task[2]]
        self.assertGreater(len(cuts), 20)
        for y0, y1, x0, x1 in cuts:
            self.assertLess(min(y1 - y0, x1 - x0), 9)

    def test_let_chunks_go(self):
        """In Dask's order of tasks a few rows of chunks are there at a time, not the array."""
        chunked = da.zeros((1280, 1280, 1), chunks=(80, 80, 1), dtype=np.float32) + np.float32(1)
        graph = ts.graph(lambda image: image.blur(sigma=0.5, method="direct").median("3x3"))
        found = ts.dask.apply(graph, chunked)
        for lazy in (found, found.sum()):
            with self.subTest(lazy=lazy):
                self.assertLess(self.chunks_there(lazy), 4 * 16)

    def chunks_there(self, lazy):
        """The most chunks without inputs that are in memory at a time, where tasks run one by one."""
        (lazy,) = dask.optimize(lazy)
        tasks = dict(lazy.__dask_graph__())
        order = dask.order.order(tasks)
        needs = {key: dask.core.get_dependencies(tasks, key) for key in tasks}
        last = {}
        for key in sorted(tasks, key=order.get):
            last.update(dict.fromkeys(needs[key], order[key]))
        chunks = [key for key in tasks if not needs[key] and key in last and isinstance(key, tuple)]
        self.assertEqual(len(chunks), 256)
        there = [sum(order[key] <= n < last[key] for key in chunks) for n in range(len(tasks))]
        return max(there)

    def test_are_not_copied_but_for_a_frame(self):
        """The middle of a chunk is computed from the chunk where it lies."""
        values, chunked = arrays(0, chunks=(40, 40, 4))
        graph = ts.graph(lambda image: image.median("3x3"))
        found = ts.dask.apply(graph, chunked)
        tasks = {key: task for key, task in found.__dask_graph__().items() if isinstance(key, tuple) and key[0] == found.name}
        parts = tasks[(found.name, 0, 1, 0)][-1]
        self.assertEqual(len(parts), 5)
        self.assertEqual(parts[0][0], (41, 1, 79, 39))
        self.assertEqual(sum((x1 - x0) * (y1 - y0) for (x0, y0, x1, y1), _ in parts), 1600)
        self.assertEqual(len(tasks[(found.name, 1, 2, 0)][-1]), 1)  # too small for it
        self.assertTrue(bits(found.compute(), graph(values)))
        two = ts.graph(lambda a, b: a.median("3x3") - b)
        other, others = arrays(1, chunks=(40, 40, 4))
        self.assertTrue(bits(ts.dask.apply(two, chunked, others).compute(), two(values, other)))
        self.assertTrue(bits(ts.dask.apply(two, chunked, others.rechunk((17, 30, 4))).compute(), two(values, other)))

    def test_may_begin_at_any_byte(self):
        """As those that another process sent."""
        values, chunked = arrays(0, chunks=(40, 40, 4))

        def moved(block):
            raw = np.empty(block.nbytes + 1, np.uint8)
            block = np.frombuffer(block.tobytes(), np.uint8)
            raw[1:] = block
            return raw[1:]
        odd = chunked.map_blocks(lambda block: moved(block).view(np.float32).reshape(block.shape), dtype=np.float32,
                                 meta=np.empty((0, 0, 0), np.float32))
        self.assertFalse(odd.blocks[0, 0].compute().flags.aligned)
        for look in (lambda image: image.mulc(2), lambda image: image.median("3x3")):
            self.assertTrue(bits(ts.dask.apply(look, odd).compute(), look(ts.from_array(values))))

    def test_are_of_every_type(self):
        for dtype in (np.uint8, np.uint16, np.float16, np.float32):
            with self.subTest(dtype=dtype):
                values, chunked = arrays(1, dtype=dtype)
                graph = ts.graph(lambda image: image.blur(sigma=1.5))
                for wanted in ("float", np.uint8, "half"):
                    found = ts.dask.apply(graph, chunked, dtype=wanted)
                    want = graph(values).render(dtype=wanted)
                    self.assertEqual(found.dtype, want.dtype)
                    self.assertTrue(bits(found.compute(), want))

    def test_of_flat_and_named_arrays(self):
        values = picture(2, WIDTH, HEIGHT, 1)[..., 0]
        found = ts.dask.apply(lambda image: image.blur(sigma=2), da.from_array(values, chunks=20))
        self.assertTrue(bits(found.compute(), ts.from_array(values).blur(sigma=2)))
        values, chunked = arrays(3, chunks=(30, 30, 2))  # channels in two chunks
        look = lambda image: image["Z,X"].mulc(2)
        found = ts.dask.apply(look, chunked, channels="X,Y,Z,A")
        self.assertTrue(bits(found.compute(), look(ts.from_array(values, channels="X,Y,Z,A"))))

    def test_take_whole_images_beside(self):
        values, chunked = arrays(4)
        kernel = np.ones((3, 3, 1), np.float32) / 9
        look = ts.graph(lambda image, kernel: image.convolve(kernel))
        self.assertTrue(bits(ts.dask.apply(look, chunked, kernel).compute(), look(values, kernel)))
        self.assertTrue(bits(ts.dask.apply(look, kernel=ts.from_array(kernel), image=chunked).compute(),
                             look(values, kernel)))
        inner = ts.from_array(picture(5, WIDTH, HEIGHT, 4))
        mixed = ts.graph(lambda image: image * inner)
        self.assertTrue(bits(ts.dask.apply(mixed, chunked).compute(), mixed(values)))

    def test_of_nothing_are_made(self):
        image = ts.clouds((300, 200), 3, octaves=4).blur(sigma=2)
        found = ts.dask.apply(image, chunks=(64, 100))
        self.assertEqual(found.numblocks, (4, 3, 1))
        self.assertTrue(bits(found.compute(), image))
        with tempfile.TemporaryDirectory() as folder:
            path = os.path.join(folder, "a.exr")
            image.write(path)
            found = ts.dask.apply(ts.read(path).mulc(2), chunks=64)
            self.assertTrue(bits(found.compute(), ts.read(path).mulc(2)))
            self.assertEqual(ts.dask.apply(ts.read(path).mulc(2), chunks=64).name, found.name)
            image.mulc(3).write(path)
            self.assertNotEqual(ts.dask.apply(ts.read(path).mulc(2), chunks=64).name, found.name)

    def test_are_refused_where_all_is_needed(self):
        _, chunked = arrays(0)
        with refused(ts.DataError, "blur", "all of which it needs", "method=direct", "tessera.dask.image"):
            ts.dask.apply(lambda image: image.blur(sigma=20, method="recursive"), chunked)
        with refused(ts.DataError, "lic"):
            ts.dask.apply(lambda image: image["R,G"].lic(), chunked)
        for action, word in ((lambda: ts.dask.apply(3, chunked), "graph"),
                             (lambda: ts.dask.apply(lambda image: image.abs()), "image"),
                             (lambda: ts.dask.apply(lambda image: image.abs(), chunked, chunked), "2 arrays"),
                             (lambda: ts.dask.apply(lambda image: image.abs(), plate=chunked), "plate"),
                             (lambda: ts.dask.apply(lambda image: image.abs(), chunked.astype(float)), "float64"),
                             (lambda: ts.dask.apply(lambda image: image.abs(), chunked, channels="X,Y"), "2 names"),
                             (lambda: ts.dask.apply(lambda image: image.abs(), chunked, chunks="many"), "chunks"),
                             (lambda: ts.dask.apply(lambda image: image.abs(), chunked, threads=-1), "threads"),
                             (lambda: ts.dask.apply(lambda image: image.abs(), chunked[0, 0]), "axes"),
                             (lambda: ts.dask.apply(lambda image: image.abs(), chunked[chunked[:, 0, 0] > 0.5]),
                              "unknown size")):
            with refused(ts.UsageError, word):
                action()

    def test_go_through_numpy_files(self):
        with tempfile.TemporaryDirectory() as folder:
            path = os.path.join(folder, "a.npy")
            values, _ = arrays(6)
            np.save(path, values)
            mapped = np.load(path, mmap_mode="r")
            graph = ts.graph(lambda image: image.blur(sigma=2))
            out = np.lib.format.open_memmap(os.path.join(folder, "b.npy"), "w+", np.float32, values.shape)
            da.store(ts.dask.apply(graph, da.from_array(mapped, chunks=(20, 20, 4))), out, lock=False)
            self.assertTrue(bits(np.load(os.path.join(folder, "b.npy")), graph(values)))

    @unittest.skipUnless(zarr, "zarr is not there")
    def test_go_through_zarr(self):
        with tempfile.TemporaryDirectory() as folder:
            values, chunked = arrays(6, chunks=(16, 16, 4))
            chunked.to_zarr(os.path.join(folder, "a.zarr"))
            graph = ts.graph(lambda image: image.saturate(1.2).blur(sigma=2))
            found = ts.dask.apply(graph, da.from_zarr(os.path.join(folder, "a.zarr")))
            found.rechunk((16, 16, 4)).to_zarr(os.path.join(folder, "b.zarr"))
            self.assertTrue(bits(da.from_zarr(os.path.join(folder, "b.zarr")).compute(), graph(values)))


def _graph_of(function, count):
    import inspect
    function.__signature__ = inspect.Signature([
        inspect.Parameter(f"image{k}", inspect.Parameter.POSITIONAL_ONLY) for k in range(count)])
    return ts.graph(function)


@unittest.skipUnless(dask, "dask is not there")
class Whole(unittest.TestCase):
    def setUp(self):
        dask.config.set(scheduler="synchronous")

    def test_images_of_chunks(self):
        values, chunked = arrays(0)
        count = []

        def seen(block):
            count.append(block.shape)
            return block
        image = ts.dask.image(chunked.map_blocks(seen, dtype=np.float32, meta=np.empty((0, 0, 0), np.float32)))
        self.assertEqual((image.shape, image.channels), (values.shape, ["R", "G", "B", "A"]))
        self.assertEqual(count, [])
        self.assertTrue(bits(image, values))
        self.assertEqual(len(count), chunked.npartitions)  # each once
        self.assertTrue(bits(image.mean(), ts.from_array(values).mean()))
        self.assertTrue(bits(image.blur(sigma=20), ts.from_array(values).blur(sigma=20)))
        with tempfile.TemporaryDirectory() as folder:
            path = os.path.join(folder, "a.tif")
            ts.dask.image(ts.dask.apply(lambda image: image.blur(sigma=2), chunked)).write(path, dtype="float")
            self.assertTrue(bits(ts.read(path), ts.from_array(values).blur(sigma=2)))
        flat = ts.dask.image(chunked[..., 0])
        self.assertTrue(bits(flat, values[..., :1]))

    def test_fail_as_their_chunks_do(self):
        def fail(block):
            raise RuntimeError("of a chunk")
        _, chunked = arrays(0)
        broken = ts.dask.image(chunked.map_blocks(fail, dtype=np.float32, meta=np.empty((0, 0, 0), np.float32)))
        with refused(RuntimeError, "of a chunk"):
            broken.render()


@unittest.skipUnless(dask and distributed, "distributed is not there")
class Cluster(unittest.TestCase):
    """A scheduler and two workers, three processes beside this one."""

    @classmethod
    def setUpClass(cls):
        # Whoever fetches from a worker that is dead is to give up soon.
        dask.config.set({"distributed.comm.timeouts.connect": "5s", "distributed.comm.timeouts.tcp": "15s"})
        cls.cluster = distributed.LocalCluster(n_workers=2, threads_per_worker=1, processes=True,
                                               dashboard_address=None, silence_logs=50)
        cls.client = distributed.Client(cls.cluster)
        cls.client.wait_for_workers(2)

    @classmethod
    def tearDownClass(cls):
        cls.client.close()
        cls.cluster.close()

    def pids(self):
        return self.client.run(os.getpid)

    def test_has_the_bits_of_one_machine(self):
        values, chunked = arrays(0, chunks=(13, 17, 4))
        graph = ts.graph(lambda image: image.saturate(1.3).blur(sigma=2).resize((120, 90)))
        self.assertEqual(len(set(self.pids().values())), 2)
        self.assertNotIn(os.getpid(), self.pids().values())
        found = self.client.compute(ts.dask.apply(graph, chunked, chunks=(20, 20))).result(timeout=300)
        self.assertTrue(bits(found, graph(values)))

    def test_gives_rows_to_this_process(self):
        values, chunked = arrays(2, chunks=(13, 17, 4))
        with dask.config.set(scheduler=self.client):
            image = ts.dask.image(ts.dask.apply(lambda image: image.blur(sigma=2), chunked))
            self.assertTrue(bits(image.mean(), ts.from_array(values).blur(sigma=2).mean()))

    def test_goes_on_without_a_worker(self):
        """One is killed while it computes; what it held and did is done again, with the same bits."""
        side = 1200
        plate = ts.clouds((side, side), 3, octaves=6)
        graph = ts.graph(lambda image: image.blur(sigma=4, method="direct").median("9x9"))
        plates = ts.dask.apply(plate, chunks=100)
        result = self.client.compute(ts.dask.apply(graph, plates, chunks=100))
        deadline = time.time() + 120
        while time.time() < deadline:
            done = [sum(k.startswith("('tessera") for k in held) for held in self.client.has_what().values()]
            if len(done) == 2 and min(done) >= 3:
                break
            time.sleep(0.02)
        self.assertGreaterEqual(min(done), 3, "the workers have not begun")
        self.assertNotEqual(result.status, "finished", "was done before one could be killed")
        before = self.pids()
        os.kill(next(iter(before.values())), signal.SIGKILL)
        found = result.result(timeout=200)
        self.assertNotEqual(before, self.pids())
        self.assertTrue(bits(found, graph(plate)))


class Graphs(unittest.TestCase):
    def test_need_no_dask_to_be_imported(self):
        code = "import sys, tessera; print('dask' in sys.modules, hasattr(tessera, 'nothing'))"
        found = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout
        self.assertEqual(found.split(), ["False", "False"])

    def test_pickle_with_what_they_hold(self):
        inner = ts.from_array(picture(1))
        graph = ts.graph(lambda image: image + inner)
        self.assertTrue(bits(pickle.loads(pickle.dumps(graph))(picture(0)), graph(picture(0))))


if __name__ == "__main__":
    unittest.main()
