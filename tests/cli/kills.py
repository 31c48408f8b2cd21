#!/usr/bin/env python3
"""Ends runs of the program at random moments, by signals that cannot be caught and by those that can: every output is as
it was or as it is to be, byte for byte; nothing else is in the folder, nor in that of temporary files, once another run
has written there; no process is left.

  kills.py PROGRAM [--count N] [--seed S]

N runs that were ended before their end. Prints a line per signal and exits with 1 where something was torn or left.
"""
import argparse
import os
import random
import shutil
import signal
import subprocess
import sys
import tempfile
import time

CAUGHT = [signal.SIGTERM, signal.SIGINT, signal.SIGHUP, signal.SIGQUIT, signal.SIGPIPE]

# Lines and their outputs. DPX would tell the time.
LINES = [
    ("a.exr --saturate 1.2 -o o.exr -o o.png", ["o.exr", "o.png"]),
    ("a.exr --blur:sigma=9 -o o.exr --resize 50% -o o.tif -o o.jpg", ["o.exr", "o.tif", "o.jpg"]),
    ("a.png --resize 120% -o o.png", ["o.png"]),
    ("--safe a.png a.exr --add --mulc .5 -d uint8 -o o.tif -o o.ppm", ["o.tif", "o.ppm"]),
    ("--no-fsync a.tif --median 3x3 -o o.tga", ["o.tga"]),
    ("--frames 1-4 a.exr --hue 30 -o o.#.exr", ["o.%04d.exr" % k for k in range(1, 5)]),
    ("--formats all a.iff --mulc .5 -o o.hdr", ["o.hdr"]),
    ("--pattern perlin:octaves=4 900x700 3 -o o.webp", ["o.webp"]),
    ("--verify a.png --hue 30 -o o.png", ["o.png"]),
    ("-i:thumbnail=99x99 a.jpg --resize 99x99 -o o.jpg", ["o.jpg"]),
    ("--max-memory 8 a.exr --blur:sigma=3 -d float -o o.exr", ["o.exr"]),
    ("a.exr --cut 300x200+9+9 -o o.tif -o p.tif -o q.tif -o r.tif", ["o.tif", "p.tif", "q.tif", "r.tif"]),
    # A LUT with a byte-order mark is copied; the cost is tried in a file.
    ("a.exr --lut marked.cube -d uint8 -o o.png", ["o.png"]),
    ("--explain:cost=1 a.exr --blur 5x5 -o o.webp", []),
]
SCRATCH = "scratch"


class Folder:
    def __init__(self, program, path):
        self.program, self.path = program, path
        os.mkdir(os.path.join(path, SCRATCH))
        self.environment = dict(os.environ, TMPDIR=os.path.join(path, SCRATCH))

    def run(self, line):
        return subprocess.run([self.program] + line.split(), cwd=self.path, env=self.environment, capture_output=True,
                              text=True)

    def start(self, line):
        return subprocess.Popen([self.program] + line.split(), cwd=self.path, env=self.environment,
                                stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)

    def must(self, line):
        result = self.run(line)
        if result.returncode != 0:
            sys.exit(f"kills.py: {line}: {result.stderr}")

    def bytes_of(self, name):
        try:
            with open(os.path.join(self.path, name), "rb") as f:
                return f.read()
        except FileNotFoundError:
            return None

    def put(self, name, content):
        if content is None:
            try:
                os.remove(os.path.join(self.path, name))
            except FileNotFoundError:
                pass
            return
        with open(os.path.join(self.path, name), "wb") as f:
            f.write(content)

    def remove(self, name):
        whole = os.path.join(self.path, name)
        shutil.rmtree(whole) if os.path.isdir(whole) else os.remove(whole)

    def names(self):
        scratch = os.listdir(os.path.join(self.path, SCRATCH))
        return set(os.listdir(self.path)) | {os.path.join(SCRATCH, name) for name in scratch}

    def processes(self):
        """Numbers of those that run in the folder."""
        found = []
        for number in os.listdir("/proc"):
            if not number.isdigit():
                continue
            try:
                if os.readlink(f"/proc/{number}/cwd") == self.path:
                    found.append(number)
            except OSError:
                pass
        return found


def prepare(folder):
    size = 32
    with open(os.path.join(folder.path, "marked.cube"), "w", encoding="utf-8-sig") as lut:
        lut.write(f"LUT_3D_SIZE {size}\n")
        for k in range(size**3):
            lut.write(" ".join(f"{(k // size**c % size / (size - 1)) ** 2:.5f}" for c in range(3)) + "\n")
    folder.must("--pattern fractalnoise:basefreq=.01 700x500 3 -d half -o a.exr")
    for name in ("a.png", "a.tif", "a.jpg"):
        folder.must(f"a.exr -d uint8 -o {name}")
    known = []
    for line, outputs in LINES:
        if "a.iff" in line:
            if folder.run("a.png -o a.iff").returncode != 0:
                continue
        seconds = []
        for _ in range(2):
            start = time.monotonic()
            result = folder.run(line)
            seconds.append(time.monotonic() - start)
            if result.returncode != 0:
                sys.exit(f"kills.py: {line}: {result.stderr}")
        right = [folder.bytes_of(name) for name in outputs]
        known.append((line, outputs, right, min(seconds)))
        for name in outputs:
            folder.put(name, None)
    return known


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("program")
    parser.add_argument("--count", type=int, default=2000)
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    for caught in CAUGHT:  # whoever started this may have it ignored, which runs would inherit
        signal.signal(caught, signal.SIG_DFL)
    draw = random.Random(options.seed)
    path = os.path.realpath(tempfile.mkdtemp(prefix="tessera-kills-"))
    folder = Folder(os.path.abspath(options.program), path)
    counts = {}
    bad = []
    try:
        known = prepare(folder)
        inputs = folder.names()
        k = in_time = 0
        while in_time < options.count:
            k += 1
            line, outputs, right, seconds = draw.choice(known)
            how = signal.SIGKILL if draw.random() < 0.6 else draw.choice(CAUGHT)
            tally = counts.setdefault(how.name, dict(runs=0, before=0, old=0, new=0, mixed=0, temporaries=0, torn=0, left=0))
            old = [draw.choice([None, b"what was there before"]) for _ in outputs]
            for name, content in zip(outputs, old):
                folder.put(name, content)
            # Half of them while outputs are written and get their names.
            share = draw.uniform(0.6, 1.05) if draw.random() < 0.5 else draw.uniform(0, 1)
            process = folder.start(line)
            time.sleep(share * seconds)
            process.send_signal(how)
            code = process.wait()
            tally["runs"] += 1
            now = [folder.bytes_of(name) for name in outputs]
            fresh = [n == r for n, r in zip(now, right)]
            torn = [name for name, n, r, o in zip(outputs, now, right, old) if n not in (r, o)]
            together = all(fresh) or not any(fresh) or "--frames" in line
            tally["old" if not any(fresh) else "new" if all(fresh) else "mixed"] += 1
            if code == 0:
                tally["before"] += 1  # the end was there first: none of those that are counted
            else:
                in_time += 1
            # A signal that can be caught waits until all have their names.
            if torn or (how != signal.SIGKILL and not together) or code not in (0, -how, 128 + how):
                tally["torn"] += 1
                bad.append(f"run {k}: {line}: {how.name} at {share:.2f}: exit code {code}, torn {torn}, new {fresh}")
            temporaries = folder.names() - inputs - set(outputs)
            if temporaries:
                tally["temporaries"] += 1
                if how != signal.SIGKILL:
                    tally["left"] += 1
                    bad.append(f"run {k}: {line}: {how.name}: left {sorted(temporaries)}")
                folder.must("--pattern checker 8x8 3 --lut marked.cube -o swept.ppm")
                folder.put("swept.ppm", None)
                rest = folder.names() - inputs - set(outputs)
                if rest:
                    tally["left"] += 1
                    bad.append(f"run {k}: {line}: {how.name}: not swept {sorted(rest)}")
                    for name in rest:
                        folder.remove(name)
            for name in outputs:
                folder.put(name, None)
            until = time.monotonic() + 5
            while (alive := folder.processes()) and time.monotonic() < until:
                time.sleep(0.01)
            if alive:
                tally["left"] += 1
                bad.append(f"run {k}: {line}: {how.name}: processes left {alive}")
    finally:
        shutil.rmtree(path, ignore_errors=True)
    print("signal      runs  ended first  old  new  some new  temporaries, then swept  torn  left")
    for name, t in sorted(counts.items()):
        print(f"{name:9} {t['runs']:6} {t['before']:12} {t['old']:4} {t['new']:4} {t['mixed']:9} "
              f"{t['temporaries']:24} {t['torn']:5} {t['left']:5}")
    for line in bad[:20]:
        print(line)
    return 1 if bad else 0


if __name__ == "__main__":
    sys.exit(main())
