#!/usr/bin/env python3
"""Plants faults in a copy of the sources, one at a time, and shows which test sees each.

    tests/planted/run.py --build DIR [--only NAME]... [--jobs N] [--table FILE] [--no-plain]
    tests/planted/run.py --list | --check

Every fault is one replacement of text (faults_engine.py, faults_kernels.py). For each the copy in DIR is rebuilt and
asked, in this order, until one of them fails: the random pipelines as the tests run them, the laws (laws_test and
packed_test, which ask every operation), lines of the program with --verify. First all of them run without a fault, and must pass. A fault that none of them sees, or whose
text is not there any more, is an error.
"""
import argparse
import os
import re
import signal
import subprocess
import sys
import time

sys.dont_write_bytecode = True

import verify_lines
from faults import Fault
from faults_engine import FAULTS as ENGINE
from faults_kernels import FAULTS as KERNELS
from faults_open import FAULTS as OPEN

ROOT = os.path.abspath(os.path.join(os.path.dirname(__file__), "..", ".."))
FAULTS = OPEN if "--open" in sys.argv else ENGINE + KERNELS
# As the tests run them, until the first finding; nothing is gained from a shorter case.
RANDOM = ["--seed", "27", "--count", "5000", "--failures", "1", "--no-shrink"]
LONGEST = 1800  # seconds that one of the tests may take


def run(words, seconds=LONGEST, **more):
    """What a command prints and its exit code, None where it took too long."""
    try:
        done = subprocess.run(words, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, timeout=seconds,
                              errors="replace", **more)
        return done.stdout, done.returncode
    except subprocess.TimeoutExpired as late:
        out = late.stdout or ""
        return out if isinstance(out, str) else out.decode(errors="replace"), None


def write_if_new(path, data):
    """Files that stay as they are are not built again."""
    if os.path.exists(path):
        with open(path, "rb") as file:
            if file.read() == data:
                return
    os.makedirs(os.path.dirname(path), exist_ok=True)
    with open(path, "wb") as file:
        file.write(data)


class Tree:
    """A copy of what git has of the sources, as they are now, and its build."""

    def __init__(self, folder, jobs):
        self.source = os.path.join(os.path.abspath(folder), "source")
        self.build = os.path.join(self.source, "build", "release")
        self.work = os.path.join(os.path.abspath(folder), "work")
        self.jobs = jobs
        os.makedirs(self.work, exist_ok=True)

    def sync(self):
        listed, code = run(["git", "-C", ROOT, "ls-files", "-z", "--cached", "--others", "--exclude-standard"])
        if code != 0:
            sys.exit("planted: no list of sources: " + listed)
        names = {n for n in listed.split("\0") if n and os.path.isfile(os.path.join(ROOT, n))}
        for name in sorted(names):
            with open(os.path.join(ROOT, name), "rb") as file:
                write_if_new(os.path.join(self.source, name), file.read())
            os.chmod(os.path.join(self.source, name), os.stat(os.path.join(ROOT, name)).st_mode & 0o777)
        for at, folders, files in os.walk(self.source):
            if at == self.source and "build" in folders:
                folders.remove("build")
            for file in files:
                path = os.path.join(at, file)
                if os.path.relpath(path, self.source) not in names:
                    os.remove(path)

    def configure(self):
        out, code = run(["cmake", "--preset", "release", "-DTESSERA_BENCH=OFF", "-DTESSERA_SAMPLES=OFF"],
                        cwd=self.source)
        if code != 0:
            sys.exit("planted: not configured\n" + out)

    def make(self, target):
        """What went wrong in building it, or nothing."""
        out, code = run(["cmake", "--build", self.build, "--target", target, "-j", str(self.jobs)], seconds=7200)
        return "" if code == 0 else "\n".join(out.splitlines()[-12:])

    def program(self, name):
        return os.path.join(self.build, "bin", name)

    def path(self, fault):
        return os.path.join(self.source, fault.file)


def ask_random(tree, fault):
    """(how it was caught, after how much) or None."""
    out, code = run([tree.program("random_pipelines"), *RANDOM, "--workers", str(tree.jobs)])
    if code == 0:
        return None
    what = re.search(r"^FAILED ([\w-]+)", out, re.M)
    cases = re.search(r"^(\d+) cases in ([\d.]+) s", out, re.M)
    index = re.search(r"^case \d+ (\d+)", out, re.M)
    how = "random pipelines, " + (what.group(1) if what else "code %s" % code)
    much = "case %s" % index.group(1) if index else ""
    if cases:
        much += ", %s s" % cases.group(2)
    return how, much, out


def ask_tests(program):
    def ask(tree, fault):
        words = [tree.program(program), "--gtest_brief=1"]
        if not fault.laws:
            words.append("--gtest_fail_fast")
        else:
            names = [name + tail for name in fault.laws.split() for tail in ("", "_?", "_??", "_???")]
            words.append("--gtest_filter=" + ":".join("*/" + name for name in names))
        start = time.time()
        out, code = run(words)
        if code == 0:
            return None
        failed = re.findall(r"^\[  FAILED  \] (\S+)(?:,| \()", out, re.M)
        law = re.search(r"(\w+\.\w+)", failed[0]) if failed else None
        how = "laws, " + (law.group(1) if law else "code %s" % code)
        return how, "%d failed, %.1f s" % (len(set(failed)), time.time() - start), out
    return ask


def ask_verify(tree, fault):
    start = time.time()
    for number, line in enumerate(verify_lines.LINES, 1):
        out, code = run([tree.program("tessera"), *line.split()], cwd=tree.work)
        if code != 0:
            return "--verify", "line %d, %.1f s" % (number, time.time() - start), line + "\n" + out
    return None


ASKED = (("random_pipelines", ask_random), ("laws_test", ask_tests("laws_test")),
         ("packed_test", ask_tests("packed_test")), ("tessera_cli", ask_verify))


def caught(tree, fault, verbose):
    """(how, after how much), how being empty where nothing sees it."""
    for target, ask in ASKED:
        problem = tree.make(target)
        if problem:
            return "", "does not build: " + problem
        found = ask(tree, fault)
        if found:
            if verbose:
                print(found[2])
            return found[0], found[1]
    return "", "MISSED"


def text_of(path):
    if not os.path.exists(path):
        return ""
    with open(path) as file:
        return file.read()


def planted(tree, fault, verbose):
    text = text_of(tree.path(fault))
    count = text.count(fault.old)
    if count != 1:
        return "", "the text to replace is there %d times" % count
    try:
        with open(tree.path(fault), "w") as file:
            file.write(text.replace(fault.old, fault.new))
        return caught(tree, fault, verbose)
    finally:
        with open(tree.path(fault), "w") as file:
            file.write(text)


def without_faults(tree):
    """Everything passes, and the pictures of the lines are made by the program as it ought to be."""
    none = Fault("none", "", "", "", "", "nothing is wrong")
    for target, _ in ASKED:
        problem = tree.make(target)
        if problem:
            sys.exit("planted: %s does not build\n%s" % (target, problem))
    verify_lines.make_pictures(tree.program("tessera"), tree.work)
    for target, ask in ASKED:
        start = time.time()
        found = ask(tree, none)
        if found:
            sys.exit("planted: without a fault this fails\n" + found[2])
        print("without a fault %s passes in %.0f s" % (target, time.time() - start), flush=True)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--build", metavar="DIR", help="where the copy and its build are kept; some 2 GB")
    parser.add_argument("--only", metavar="NAME", action="append", help="this fault alone; may be given again")
    parser.add_argument("--jobs", type=int, default=os.cpu_count(), help="processes at once; all processors")
    parser.add_argument("--table", metavar="FILE", help="the table is written there too")
    parser.add_argument("--no-plain", action="store_true", help="does not ask first whether all passes without a fault")
    parser.add_argument("--verbose", action="store_true", help="prints what the test said that saw it")
    parser.add_argument("--check", action="store_true", help="only looks whether every text to replace is there")
    parser.add_argument("--open", action="store_true", help="the faults of faults_open.py instead")
    parser.add_argument("--list", action="store_true", help="prints the faults")
    options = parser.parse_args()
    signal.signal(signal.SIGTERM, lambda *_: sys.exit("planted: ended"))  # by way of what puts the sources back
    if options.list:
        for f in FAULTS:
            print("%-24s %-20s %-40s %s" % (f.name, f.area, f.file, f.means))
        return 0
    if options.check:
        lost = [f for f in FAULTS if text_of(os.path.join(ROOT, f.file)).count(f.old) != 1]
        for f in lost:
            print("%s: the text to replace is not there, or more than once: %s" % (f.name, f.file))
        return 1 if lost else 0
    if not options.build:
        parser.error("--build DIR is needed: where the copy and its build are kept")
    chosen = [f for f in FAULTS if not options.only or f.name in options.only]
    unknown = set(options.only or []) - {f.name for f in FAULTS}
    if unknown or len({f.name for f in FAULTS}) < len(FAULTS):
        sys.exit("planted: no fault, or two, named " + ", ".join(unknown or {f.name for f in FAULTS}))
    tree = Tree(options.build, options.jobs)
    tree.sync()
    tree.configure()
    if options.no_plain:
        failed = tree.make("tessera_cli")
        if failed:
            sys.exit("planted: not built\n" + failed)
        verify_lines.make_pictures(tree.program("tessera"), tree.work)
    else:
        without_faults(tree)
    begin, missed, lines = time.time(), 0, []
    for n, fault in enumerate(chosen, 1):
        how, much = planted(tree, fault, options.verbose)
        missed += how == ""
        lines.append("%-24s %-20s %-44s %s" % (fault.name, fault.area, how or "NOT CAUGHT", much))
        print(lines[-1], flush=True)
    lines.append("%d faults, %d not caught, %.0f s" % (len(chosen), missed, time.time() - begin))
    print(lines[-1])
    if options.table:
        with open(options.table, "w") as file:
            file.write("\n".join(lines) + "\n")
    return 1 if missed else 0


if __name__ == "__main__":
    sys.exit(main())
