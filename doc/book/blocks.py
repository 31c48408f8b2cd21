"""Reads lines.txt and inputs.txt: blocks of a head and indented lines, and runs their lines."""
import dataclasses
import os
import pathlib
import shlex
import shutil
import subprocess

WORDS = ("see", "c++", "cost")


class Trouble(Exception):
    """What is wrong with the book, in words for whoever has to mend it."""


@dataclasses.dataclass
class Block:
    """A head `NAME: caption` and what stands under it."""
    name: str
    caption: str
    lines: list = dataclasses.field(default_factory=list)
    see: list = dataclasses.field(default_factory=list)
    cpp: list = dataclasses.field(default_factory=list)
    cost: list = dataclasses.field(default_factory=list)


def joined(text):
    """Numbered lines; those that end in a backslash go on in the next."""
    begin, whole = 0, ""
    for number, line in enumerate(text.splitlines(), 1):
        begin = begin or number
        if line.endswith("\\"):
            whole += line[:-1].rstrip() + " " if not whole else line[:-1].strip() + " "
            continue
        yield begin, whole + (line.strip() if whole else line)
        begin, whole = 0, ""


def read(file):
    blocks = {}
    block = None
    for number, line in joined(pathlib.Path(file).read_text()):
        where = f"{pathlib.Path(file).name}:{number}"
        if not line.strip() or line.startswith("#"):
            continue
        if not line.startswith(" "):
            name, colon, caption = line.partition(": ")
            if not colon or not caption.strip():
                raise Trouble(f"{where}: found {line!r}, expected NAME: caption")
            if name in blocks:
                raise Trouble(f"{where}: {name} is there twice")
            block = blocks[name] = Block(name, caption.strip())
            continue
        if block is None:
            raise Trouble(f"{where}: a line before the first NAME: caption")
        word, _, rest = line.strip().partition(" ")
        if word == "c++":
            block.cpp += rest.split()
        elif word == "cost":
            block.cost.append(rest.strip())
        elif word == "see":
            block.see.append(rest.strip())
        else:
            block.lines.append(line.strip())
    return blocks


@dataclasses.dataclass
class Result:
    """A line that was run: what it printed and the pictures that it left."""
    line: str
    printed: str
    picture: pathlib.Path = None


class Kitchen:
    """Runs lines where the inputs are, with the programs that the book is about first in the path."""

    def __init__(self, folder, programs, size, root, photos):
        self.folder = pathlib.Path(folder)
        self.inputs = self.folder / "inputs"
        self.inputs.mkdir(parents=True)
        tools = self.folder / "bin"
        tools.mkdir()
        for name, program in programs.items():
            (tools / name).symlink_to(pathlib.Path(program).resolve())
        self.environment = dict(os.environ, LC_ALL="C", PATH=f"{tools}:{os.environ['PATH']}")
        self.words = {"{w}": str(size[0]), "{h}": str(size[1]), "{root}": str(root), "{photos}": str(photos)}
        self.count = 0

    def filled(self, line):
        for word, value in self.words.items():
            line = line.replace(word, value)
        return line

    def place(self, name):
        """A folder of its own with the inputs in it."""
        place = self.folder / "run" / name
        place.mkdir(parents=True)
        for file in self.inputs.iterdir():
            (place / file.name).symlink_to(file)
        return place

    def run(self, line, place, where):
        line = self.filled(line)
        words = shlex.split(line)
        self.count += 1
        try:
            done = subprocess.run(words, cwd=place, env=self.environment, capture_output=True, timeout=120, text=True,
                                  errors="replace", check=False)
        except (OSError, subprocess.TimeoutExpired) as error:
            raise Trouble(f"{where}: {line}: {error}") from error
        if done.returncode != 0:
            raise Trouble(f"{where}: exit code {done.returncode}: {line}\n  {done.stderr.strip() or done.stdout.strip()}")
        return Result(line, (done.stdout + done.stderr).rstrip(), written(words, place))

    def make_inputs(self, blocks, data):
        """The files of inputs.txt, and how each is shown."""
        for file in sorted(pathlib.Path(data).iterdir()):
            shutil.copy(file, self.inputs / file.name)
        shown = {}
        for block in blocks.values():
            for line in block.lines + block.see:
                self.run(line, self.inputs, f"inputs.txt: {block.name}")
            if not (self.inputs / block.name).is_file():
                raise Trouble(f"inputs.txt: {block.name}: its lines do not make it")
            shown[block.name] = self.inputs / (block.name + ".jpg" if block.see else block.name)
        return shown


def written(words, place):
    """The file behind the last -o; of a sequence the first."""
    name = None
    for option, value in zip(words, words[1:]):
        if option.split(":")[0].lstrip("-") == "o" and option.startswith("-"):
            name = value
    if name is None:
        return None
    if "#" in name:
        files = sorted(place.glob(name.replace("#", "*")))
        return files[0] if files else None
    return place / name if (place / name).is_file() and not (place / name).is_symlink() else None
