#!/usr/bin/env python3
"""Makes the book: a folder of HTML pages, one for every command, from the tool, its lines and the public headers.

usage: build.py --tool TESSERA --scene SCENE --out DIR [--size WxH] [--bench JSON]... [--doxygen DIR]

--scene is the built samples/scene. The lines are those of lines.txt, run on the inputs of inputs.txt; a command without
one is shown by its row's first example. Without --bench the costs are those of README's table. Needs the standard
library and Debian's mate-backgrounds. Exit code 1, and no book, where a line fails, a command has none, or a link leads
nowhere.
"""
import argparse
import concurrent.futures
import json
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile
import time

import blocks
import check
import costs
import headers
import markdown
import pages
import recipes
from blocks import Trouble

HERE = pathlib.Path(__file__).resolve().parent
ROOT = HERE.parent.parent
PHOTOS = "/usr/share/backgrounds/mate"


def is_operation(row):
    return row["group"].startswith("Operations: ") or row["group"] == "Patterns"


def with_examples(rows, lines, declarations):
    """`lines` and, for each command that has none there, the first example of its row on photographs."""
    photographs = ["photo.jpg", "flower.jpg", "grass.jpg"]
    lines = dict(lines)
    for row in rows:
        name = row["name"].removeprefix("pattern ")
        if row["name"] in lines or not row["lines"] or row["takes"] > len(photographs):
            continue
        line = row["lines"][0].replace(" 512x512 ", " {w}x{h} ")
        for file, photograph in zip(["in.exr", "a.exr", "b.exr", "c.exr"], photographs[:1] + photographs):
            line = re.sub(rf" {file}(?= |$)", f" {photograph}", line)
        function = "".join(part.capitalize() for part in re.split("[-_]", name))
        lines[row["name"]] = blocks.Block(row["name"], row["summary"], [line.replace(" -o out.exr", " -d uint8 -o out.jpg")],
                                          cpp=[function] if function in declarations and is_operation(row) else [])
    return lines


def validate(rows, lines, declarations):
    """Raises Trouble with everything that lines.txt lacks or has too much."""
    names = {r["name"] for r in rows}
    shown = with_examples(rows, lines, declarations)
    faults = [f"no line for {r['name']}: add a block `{r['name']}: caption` with a line that shows it"
              for r in rows if not shown.get(r["name"]) or not shown[r["name"]].lines]
    faults += [f"{name}: no such command" for name in lines if name not in names]
    for name, block in lines.items():
        faults += [f"{name}: c++ {n}: no such declaration in include/tessera" for n in block.cpp if n not in declarations]
        word = ("--" if not name.startswith("pattern ") else "--pattern ") + name.removeprefix("pattern ")
        row = next((r for r in rows if r["name"] == name), None)
        if row and is_operation(row):
            faults += [f"{name}: a line without {word}: {line}" for line in block.lines
                       if not re.search(rf"(^|[\s\"']){re.escape(word)}(?![\w-])", line)]
            if not block.cpp and name != "volume":
                faults.append(f"{name}: no `c++ NAME`: say which declaration its page shows")
    if faults:
        raise Trouble("lines.txt: " + "\nlines.txt: ".join(faults))


class Book:
    """Everything that the pages are made of, and where they go."""

    def __init__(self, options, work):
        self.options, self.out = options, pathlib.Path(options.out)
        listed = subprocess.run([options.tool, "--list-commands:format=json"], capture_output=True, text=True, check=True)
        self.rows = json.loads(listed.stdout)
        version = subprocess.run([options.tool, "--version"], capture_output=True, text=True, check=True).stdout
        self.shell = pages.Shell(version.splitlines()[0])
        self.declarations = headers.read(ROOT / "include")
        lines = blocks.read(options.lines)
        validate(self.rows, lines, self.declarations)
        self.lines = with_examples(self.rows, lines, self.declarations)
        self.costs = costs.Costs(ROOT / "README.md", options.bench)
        self.size = tuple(int(n) for n in options.size.split("x"))
        self.kitchen = blocks.Kitchen(work, {"tessera": options.tool, "scene": options.scene}, self.size, ROOT, PHOTOS)
        self.entries, self.pictures, self.count = [], {}, 0
        self.links = {}
        for name, target in headers.doxygen_links(options.doxygen).items():
            self.links[name] = os.path.relpath(pathlib.Path(options.doxygen) / target, self.out / "op")

    def write(self, url, title, body, entry=None, description=""):
        file = self.out / url
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(self.shell.page(url, title, body, description))
        self.count += 1
        if entry is not None:
            self.entries.append({"t": title, "u": url, **entry})

    def keep(self, picture, name):
        """A picture's place in the book, seen from its root."""
        place = self.out / "pictures" / (name + picture.suffix)
        place.parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(picture, place)
        return str(place.relative_to(self.out))

    def make_inputs(self):
        self.inputs = blocks.read(HERE / "inputs.txt")
        shown = self.kitchen.make_inputs(self.inputs, HERE / "data")
        self.shown = {name: self.keep(file, "inputs/" + name.removesuffix(file.suffix)) for name, file in shown.items()}
        self.write("inputs.html", "The inputs", pages.inputs(self.inputs, self.shown, self.kitchen.filled),
                   {"k": "inputs", "s": "The files that the lines read", "p": "", "h": ""})

    def run_lines(self):
        """[(line, printed, before, after)] for every command; two lines at a time."""
        jobs = []
        with concurrent.futures.ThreadPoolExecutor(self.options.jobs) as pool:
            for name, block in self.lines.items():
                if self.options.only and name not in self.options.only:
                    continue
                for index, line in enumerate(block.lines):
                    place = self.kitchen.place(f"{name.replace(' ', '-')}-{index}")
                    jobs.append((name, index, pool.submit(self.kitchen.run, line, place, f"lines.txt: {name}")))
            faults = [str(j.exception()) for _, _, j in jobs if j.exception() is not None]
        if faults:
            raise Trouble("\n".join(faults))
        shots = {}
        for name, index, job in jobs:
            result = job.result()
            row = next(r for r in self.rows if r["name"] == name)
            after = None
            if result.picture is not None and result.picture.suffix in (".jpg", ".png"):
                after = self.keep(result.picture, f"{name.replace(' ', '-')}-{index}")
                self.pictures.setdefault(name, after)
            elif is_operation(row):
                raise Trouble(f"lines.txt: {name}: this line left no .jpg or .png: {result.line}")
            words = dict.fromkeys(result.line.split())
            before = [(w, "../" + self.shown[w]) for w in words if w in self.shown]
            shots.setdefault(name, []).append((result.line, result.printed, before, after and "../" + after))
        return shots

    def operations(self, shots):
        for row in self.rows:
            block = self.lines.get(row["name"])
            related = [r for r in self.rows if r["group"] == row["group"] and r is not row]
            found = self.costs.find(row["name"], block.cost if block else [])
            body = pages.operation(row, block, shots.get(row["name"], []), related, self.declarations, self.links, found)
            params = " ".join(p["name"] + " " + " ".join(p["choices"]) for p in row["arguments"] + row["modifiers"])
            self.write(pages.address(row), row["name"], body,
                       {"k": pages.family(row), "s": row["summary"], "p": params, "h": row["help"]}, row["summary"])

    def documents(self):
        """The repository's own pages, and the links among them."""
        files = [f for f in sorted((ROOT / "doc").rglob("*.md")) if HERE not in f.parents]
        known = {f: "doc/" + str(f.relative_to(ROOT / "doc").with_suffix(".html")) for f in files}
        listed = []
        for file, url in known.items():
            def link(target, file=file, url=url):
                if re.match(r"[a-z]+:", target):
                    return target
                path, hash_, anchor = target.partition("#")
                if not path:
                    return target
                there = known.get((file.parent / path).resolve())
                if there is None and path.endswith((".svg", ".png", ".jpg")):
                    there = self.keep(file.parent / path, "doc/" + pathlib.Path(path).stem)
                return os.path.relpath(there, os.path.dirname(url)) + hash_ + anchor if there else None
            body, title, _ = markdown.render(file.read_text(), link)
            plain = re.sub(r"<[^>]+>", " ", body)
            self.write(url, title, body, {"k": "background", "s": "", "p": "", "h": " ".join(plain.split())})
            listed.append((url, title))
        return sorted(listed, key=lambda e: ("maths" in e[0], not e[0].endswith("README.html"), e[1]))

    def build(self):
        self.make_inputs()
        shots = self.run_lines()
        self.operations(shots)
        made = recipes.build(self, HERE / "recipes")
        background = self.documents()
        self.write("index.html", "Image operations", pages.start(
            self.rows, self.pictures, made, background, f"{self.size[0]} x {self.size[1]} pixels"))
        for file in ("book.css", "search.js"):
            shutil.copy(HERE / file, self.out / file)
        (self.out / "search-index.js").write_text(pages.search_index(self.entries))


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--tool", required=True)
    parser.add_argument("--scene", required=True)
    parser.add_argument("--out", required=True)
    parser.add_argument("--size", default="480x300")
    parser.add_argument("--bench", action="append", default=[])
    parser.add_argument("--doxygen")
    parser.add_argument("--only", action="append", help="run the lines of this command alone, to try them")
    parser.add_argument("--lines", default=HERE / "lines.txt")
    parser.add_argument("--jobs", type=int, default=2)
    options = parser.parse_args()
    begin = time.time()
    out = pathlib.Path(options.out)
    if out.exists() and not (out / "book.css").exists() and any(out.iterdir()):
        sys.exit(f"build.py: error: --out: {out} holds something else, expected a new folder or an earlier book")
    final, options.out = out, out.with_name(out.name + ".new")  # the old book stays until the new one is whole
    try:
        with tempfile.TemporaryDirectory(prefix="book") as work:
            if not pathlib.Path(PHOTOS).is_dir():
                raise Trouble(f"{PHOTOS}: no such folder (the Debian package mate-backgrounds has it)")
            shutil.rmtree(options.out, ignore_errors=True)
            options.out.mkdir(parents=True)
            book = Book(options, work)
            book.build()
            faults = check.faults(options.out)
            if faults:
                raise Trouble("\n".join(faults))
            shutil.rmtree(final, ignore_errors=True)
            options.out.rename(final)
    except Trouble as trouble:
        shutil.rmtree(options.out, ignore_errors=True)
        sys.exit(f"build.py: error: {trouble}")
    print(f"{final}/index.html: {book.count} pages, {book.kitchen.count} lines run, {time.time() - begin:.0f} s")


if __name__ == "__main__":
    main()
