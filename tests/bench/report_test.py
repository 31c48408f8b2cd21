#!/usr/bin/env python3
"""bench/report on made-up measurements: table, plots, page, README, and its errors."""
import importlib.machinery
import importlib.util
import json
import pathlib
import re
import subprocess
import sys
import tempfile
import unittest
import xml.etree.ElementTree

REPORT = pathlib.Path(__file__).resolve().parents[2] / "bench" / "report"


def item(task, pixels, threads, method, ns, copy_ns=0.8, **extra):
    copy = method.startswith("copy ")
    row = {"name": f"pipelines/{task}/{pixels}/3840x2160/threads:{threads}/{method}/iterations:1/manual_time",
           "run_type": "iteration", "ns_per_pixel": ns, "times_copy": ns / copy_ns}
    if not copy:
        row.update({"copy_share": copy_ns / ns, "max_error": 1e-7, "rms_error": 1e-8, "values_checked": 1000})
    row.update(extra)
    return row


def measurements():
    rows = []
    for threads in (1, 2):
        rows += [item("chain", "float", threads, "copy memcpy", 1.0), item("chain", "float", threads, "copy streaming", 0.8),
                 item("chain", "float", threads, "tessera AVX3", 0.81 / threads, max_error=6e-8),
                 item("chain", "float", threads, "tessera AVX2", 0.82 / threads, max_error=6e-8),
                 item("chain", "float", threads, "tessera AVX3 unfolded", 1.9 / threads, max_error=1.2e-7),
                 item("chain", "float", threads, "OpenColorIO 2.1.2", 4.0 / threads, max_error=2e-7),
                 item("chain", "float", threads, "OpenImageIO", 46.6, max_error=0.0)]
    rows += [item("chain", "uint8", 1, "copy streaming", 0.19, copy_ns=0.19),
             item("chain", "uint8", 1, "tessera AVX3", 0.34, copy_ns=0.19, max_error=0.5 / 255, wrong_codes=0, max_code_error=0),
             item("chain", "uint8", 1, "OpenCV", 3.3, copy_ns=0.19, max_error=1.0 / 255, wrong_codes=25, max_code_error=1),
             {"name": "pipelines/chain/uint8/3840x2160/threads:1/OpenImageIO/iterations:1", "error_occurred": True,
              "error_message": "no <call>"}]
    return {"context": {"cpu": "A & B", "num_cpus": 2, "date": "2024-05-06T00:00:00", "OpenCV": "4.6.0"},
            "benchmarks": rows}


def run(*arguments):
    return subprocess.run([sys.executable, REPORT, *map(str, arguments)], capture_output=True, text=True, check=False)


class ReportTest(unittest.TestCase):
    def setUp(self):
        self.directory = tempfile.TemporaryDirectory()
        self.path = pathlib.Path(self.directory.name)
        self.json = self.path / "m.json"
        self.json.write_text(json.dumps(measurements()))

    def tearDown(self):
        self.directory.cleanup()

    def test_tasks_that_differ_in_a_number_share_a_plot(self):
        rows = []
        for sigma in (1, 5, 20):
            rows += [item(f"blur sigma {sigma}", "float", 1, "copy streaming", 0.8),
                     item(f"blur sigma {sigma}", "float", 1, "tessera AVX3", 3.0 * sigma, max_error=1e-7),
                     item(f"blur sigma {sigma}", "float", 1, "OpenCV", 6.0 * sigma, max_error=1e-5)]
        self.json.write_text(json.dumps({"context": {}, "benchmarks": rows}))
        done = run(self.json, "--out", self.path / "out")
        self.assertEqual(done.returncode, 0, done.stderr)
        svg = self.path / "out" / "plots" / "pipelines-blur-sigma-all-float-3840x2160-t1.svg"
        root = xml.etree.ElementTree.parse(svg).getroot()
        words = [t.text for t in root.iter("{http://www.w3.org/2000/svg}text")]
        for word in ("tessera AVX3", "OpenCV", "1", "5", "20"):
            self.assertIn(word, words)
        self.assertEqual((self.path / "out" / "index.html").read_text().count("<svg "), 4)

    def test_everything_is_written(self):
        done = run(self.json, "--out", self.path / "out")
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertIn("1 benchmarks failed", done.stderr)
        svgs = sorted((self.path / "out" / "plots").glob("*.svg"))
        self.assertEqual(len(svgs), 3)
        for svg in svgs:
            root = xml.etree.ElementTree.parse(svg).getroot()
            words = [t.text for t in root.iter("{http://www.w3.org/2000/svg}text")]
            self.assertTrue(any(w.startswith("tessera AVX3 0.") for w in words), words)
        page = (self.path / "out" / "index.html").read_text()
        self.assertEqual(page.count("<svg "), 3)
        self.assertIn("A &amp; B, 2 cores, OpenCV 4.6.0, 2024-05-06", page)
        self.assertIn("no &lt;call&gt;", page)
        table = (self.path / "out" / "report.md").read_text()
        self.assertIn("| chain | float 3840x2160 | 0.80 / 0.80 | **0.81 / 0.41**<br>6.0e-08 | 4.00 / 2.00<br>2.0e-07 | "
                      "46.6 / 46.6<br>0 | - |", table)
        self.assertIn("| **0.34**<br>0 wrong | - | - | 3.30<br>2.50% wrong, up to 1 |", table)

    def test_labels_do_not_overlap(self):
        loader = importlib.machinery.SourceFileLoader("report", str(REPORT))
        spec = importlib.util.spec_from_loader("report", loader)
        report = importlib.util.module_from_spec(spec)
        sys.dont_write_bytecode = True
        loader.exec_module(report)
        groups, _, _ = report.load([self.json])
        for group in groups:
            boxes = [(float(x), float(y), 6.5 * len(label)) for x, y, label in re.findall(
                r'<text x="([\d.]+)" y="([\d.]+)" fill="#[0-9a-f]{6}"(?: font-weight="bold")?[^>]*>([A-Z a-z\d.]+ [\d.]+)</text>',
                report.plot(group))]
            self.assertEqual(len(boxes), len(group.methods))
            for i, (x, y, w) in enumerate(boxes):
                for x2, y2, w2 in boxes[:i]:
                    self.assertFalse(x < x2 + w2 and x2 < x + w and abs(y - y2) < 14, (group.title, i))

    def test_frames_stand_beside_the_papers(self):
        rows = [item("lit", "field", 2, "copy memcpy", 0.8),
                item("lit", "field", 2, "tessera AVX3", 35.0, frames_per_second=240.0, paper_frames_per_second=60.0),
                item("lit", "field", 2, "OpenCV", 700.0, frames_per_second=12.0)]
        for name in ("max_error", "rms_error", "values_checked"):  # a peer that shows no pixels
            del rows[2][name]
        self.json.write_text(json.dumps({"context": {}, "benchmarks": rows}))
        done = run(self.json, "--out", self.path / "out")
        self.assertEqual(done.returncode, 0, done.stderr)
        table = (self.path / "out" / "report.md").read_text()
        self.assertIn("| lit | 3840x2160 | 2 | 240.0 | 60 | 4.00 | 1.0e-07 | 1.0e-08 |", table)
        self.assertRegex(table, r"\| tessera AVX3 \| 35\.0 .* 20\.00 \|")  # times the peer's speed

    def test_errors_are_one_clear_line(self):
        self.json.write_text("not json")
        done = run(self.json, "--out", self.path / "out")
        self.assertEqual(done.returncode, 1)
        self.assertRegex(done.stderr, r"^report: error: .*m\.json: found no benchmark JSON")
        self.assertEqual(len(done.stderr.splitlines()), 1)


if __name__ == "__main__":
    unittest.main()
