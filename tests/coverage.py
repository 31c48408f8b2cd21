#!/usr/bin/env python3
"""Adds up which lines and branches of the library the tests have executed.

  cmake --preset coverage && cmake --build --preset coverage && ctest --test-dir build/coverage
  tests/coverage.py build/coverage [--uncovered]

A line per folder of src/ and include/, and the files with most lines that nothing has executed; --uncovered names these
lines. A line counts as executed when one of its copies is, in any instruction set or instance of a template; so does a way
out of a condition. The ways that exceptions take are not counted. What ends by a signal or by _exit leaves no counts, so that
handlers of signals and the sandbox's processes are missing.
"""
import argparse
import collections
import json
import os
import subprocess
import sys


def ranges(numbers):
    """3, 4, 5, 9 as 3-5 9."""
    text = []
    for n in sorted(numbers):
        if text and text[-1][1] == n - 1:
            text[-1][1] = n
        else:
            text.append([n, n])
    return " ".join(f"{a}-{b}" if b > a else f"{a}" for a, b in text)


def counts(build, root):
    """Of each source, the lines that there are and those that were executed; the same of branches, (line, number)."""
    lines, executed = collections.defaultdict(set), collections.defaultdict(set)
    branches, taken = collections.defaultdict(set), collections.defaultdict(set)
    for folder, _, names in os.walk(os.path.join(build, "src")):
        for name in names:
            if not name.endswith(".gcno"):
                continue
            result = subprocess.run(["gcov", "--json-format", "--branch-probabilities", "--stdout", os.path.join(folder, name)],
                                    cwd=build, capture_output=True, text=True)
            for text in result.stdout.splitlines():
                if not text.startswith("{"):
                    continue
                report = json.loads(text)
                for f in report["files"]:
                    path = os.path.realpath(os.path.join(report["current_working_directory"], f["file"]))
                    source = os.path.relpath(path, root)
                    if not source.startswith(("src/", "include/")):
                        continue
                    for line in f["lines"]:
                        number = line["line_number"]
                        lines[source].add(number)
                        if line["count"]:
                            executed[source].add(number)
                        ways = [b for b in line["branches"] if not b["throw"]]
                        if len(ways) < 2:  # the other is an exception's
                            continue
                        for i, way in enumerate(ways):
                            branches[source].add((number, i))
                            if way["count"]:
                                taken[source].add((number, i))
    return lines, executed, branches, taken


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("build")
    parser.add_argument("--uncovered", action="store_true")
    options = parser.parse_args()
    root = os.path.realpath(os.path.join(os.path.dirname(__file__), ".."))
    lines, executed, branches, taken = counts(os.path.abspath(options.build), root)
    if not lines:
        sys.exit("coverage.py: no counts below " + options.build)
    folders = collections.defaultdict(lambda: [0, 0, 0, 0])
    for source, own in lines.items():
        for folder in ("/".join(source.split("/")[:2]), "all"):
            for i, there in enumerate((own, executed[source], branches[source], taken[source])):
                folders[folder][i] += len(there)
    for folder, (there, done, ways, gone) in sorted(folders.items(), key=lambda item: (item[0] == "all", item[0])):
        print(f"{folder:24} {there:7} lines {100 * done / there:6.1f} %"
              + (f" {ways:7} branches {100 * gone / ways:6.1f} %" if ways else ""))
    missing = {s: own - executed[s] for s, own in lines.items() if own - executed[s]}
    print()
    for source, left in sorted(missing.items(), key=lambda item: -len(item[1]))[:None if options.uncovered else 20]:
        print(f"{source:48} {len(left):5} of {len(lines[source]):5}"
              + (f": {ranges(left)}" if options.uncovered else ""))


if __name__ == "__main__":
    main()
