#!/usr/bin/env python3
"""Ends runs of --resume at random moments, one or several at once, tears and alters what they have left, and has them go on:
whatever was done to it, the last run leaves the files of a run that nobody touched, byte for byte, and finds all of them
finished.

  resume_kills.py PROGRAM [--count N] [--seed S]

N runs that were ended before their end. Prints what was met and exits with 1 where a file was wrong.
"""
import argparse
import json
import os
import random
import shutil
import signal
import subprocess
import sys
import tempfile
import time

FRAMES = 12
LINE = ["in.#.exr", "--blur:sigma=3", "--saturate", "1.2", "-o", "out.#.exr", "-d", "uint8", "-o", "small.#.png"]
OUTPUTS = [name % k for k in range(1, FRAMES + 1) for name in ("out.%04d.exr", "small.%04d.png")]


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("program")
    parser.add_argument("--count", type=int, default=300)
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    draw = random.Random(options.seed)
    program = os.path.abspath(options.program)
    folder = os.path.realpath(tempfile.mkdtemp(prefix="tessera-resume-"))

    def start(words):
        return subprocess.Popen([program, *words], cwd=folder, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)

    def must(words):
        process = start(words)
        out, err = process.communicate()
        if process.returncode != 0:
            sys.exit(f"resume_kills.py: {words}: {err}")
        return out

    def read(name):
        try:
            with open(os.path.join(folder, name), "rb") as file:
                return file.read()
        except FileNotFoundError:
            return None

    def write(name, content):
        with open(os.path.join(folder, name), "wb") as file:
            file.write(content)

    def records():
        return [n for n in os.listdir(folder) if n.endswith(".jsonl")]

    def whole(k):
        """The last run: all is right, and says so."""
        must(["-q", "--resume", "--frames", f"1-{FRAMES}", *LINE])
        wrong = [n for n, content in right.items() if read(n) != content]
        report = json.loads(must(["--json", "--resume", "--frames", f"1-{FRAMES}", *LINE]))
        if wrong or report["left"] != FRAMES:
            bad.append(f"before run {k}: wrong {wrong}, {report['left']} finished")

    met = dict(ended=0, first=0, kept=0, torn_outputs=0, altered_outputs=0, torn_records=0, wholes=0)
    bad, spoilt = [], {}
    try:
        must(["--frames", f"1-{FRAMES}", "--pattern", "perlin:seed={FRAME_NUMBER}", "320x240", "3", "-d", "half",
              "-o", "in.#.exr"])
        began = time.monotonic()
        must(["--frames", f"1-{FRAMES}", *LINE])
        seconds = time.monotonic() - began
        right = {name: read(name) for name in OUTPUTS}
        for name in OUTPUTS:
            os.remove(os.path.join(folder, name))
        k = 0
        while met["ended"] < options.count:
            k += 1
            count = draw.choice([1, 1, 2, 3])
            part = lambda i: ["--part", f"{i + 1}/{count}"] if draw.random() < 0.8 else []
            runs = [start(["-q", "--resume", "--parallel-frames", str(draw.choice([1, 3, 8])), *part(i), "--frames", f"1-{FRAMES}",
                           *LINE]) for i in range(count)]
            time.sleep(draw.uniform(0, 1.2) * seconds)
            for run in runs:
                run.send_signal(draw.choice([signal.SIGKILL, signal.SIGKILL, signal.SIGTERM]))
            for run in runs:
                run.communicate()
                met["ended" if run.returncode != 0 else "first"] += 1
            found = [n for n in OUTPUTS if read(n) is not None]
            met["kept"] += len(found)
            # What was spoilt here may not have been come to yet.
            wrong = [n for n in found if read(n) not in (right[n], spoilt.get(n))]
            if wrong:
                bad.append(f"run {k}: {wrong} are not whole")
            for name in draw.sample(found, min(len(found), draw.choice([0, 0, 1, 3]))):
                content = read(name)
                if draw.random() < 0.5:
                    write(name, content[:draw.randrange(len(content) or 1)])
                    met["torn_outputs"] += 1
                elif not content:
                    continue
                else:
                    at = draw.randrange(len(content))
                    write(name, content[:at] + bytes([content[at] ^ 1 << draw.randrange(8)]) + content[at + 1:])
                    met["altered_outputs"] += 1
                spoilt[name] = read(name)
            if records() and draw.random() < 0.3:
                name = draw.choice(records())
                content = read(name)
                write(name, content[:draw.randrange(len(content) + 1)])
                met["torn_records"] += 1
            if draw.random() < 0.15:
                whole(k)
                met["wholes"] += 1
                for name in OUTPUTS + records():
                    if draw.random() < 0.9:
                        os.remove(os.path.join(folder, name))
        whole(k)
        left = set(os.listdir(folder)) - set(OUTPUTS) - set(records()) - {"in.%04d.exr" % f for f in range(1, FRAMES + 1)}
        if left:
            bad.append(f"left {sorted(left)}")
    finally:
        shutil.rmtree(folder, ignore_errors=True)
    print(", ".join(f"{name.replace('_', ' ')} {value}" for name, value in met.items()))
    for line in bad[:20]:
        print(line)
    return 1 if bad else 0


if __name__ == "__main__":
    sys.exit(main())
