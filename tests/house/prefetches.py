#!/usr/bin/env python3
"""Finds stages straight over memory in the library's objects that ask for nothing ahead: g++ drops calls of what it takes for
functions without effects, and nothing but the time tells.

usage: prefetches.py BUILD [OBJECT...]   the objects instead of those whose sources include base/prefetch.h

Of every object whose source calls base::PrefetchAhead there has to be an instruction that asks for memory; of every
FusedStage and PairStage, target by target, one in its functions.
"""
import pathlib
import re
import subprocess
import sys

FUNCTION = re.compile(r"^[0-9a-f]+ <(.*)>:$")
STAGE = re.compile(r"(?:Fused|Pair)Stage<.*?>(?=::(?:Run|InChunks|Direct)\b)")
ASKS = re.compile(r"\t(?:prefetch|prfm)")


def objects_that_include(build):
    """Each object of the library and its source, where that includes base/prefetch.h."""
    deps = subprocess.run(["ninja", "-t", "deps"], cwd=build, capture_output=True, text=True, check=True).stdout
    for entry in deps.split("\n\n"):
        lines = entry.split("\n")
        name = lines[0].split(":")[0]
        if "tessera_core.dir" in name and name.endswith(".o") and "base/prefetch.h" in entry:
            yield build / name, next(pathlib.Path(build, line.strip()) for line in lines[1:] if line.endswith(".cc"))


def silent_parts(path, calls):
    """What of an object asks for no memory."""
    found, here = {}, None
    if calls:
        found["the object"] = False
    dump = subprocess.run(["objdump", "-dC", "--no-show-raw-insn", path], capture_output=True, text=True, check=True).stdout
    for line in dump.split("\n"):
        if function := FUNCTION.match(line):
            stage = STAGE.search(function[1])
            here = stage and stage[0]
            if here:
                found.setdefault(here, False)
        elif ASKS.search(line):
            found["the object"] = True
            if here:
                found[here] = True
    return [part for part, asks in found.items() if not asks]


def main():
    build = pathlib.Path(sys.argv[1])
    objects = [(pathlib.Path(p), None) for p in sys.argv[2:]] or list(objects_that_include(build))
    if not objects:
        sys.exit(f"prefetches.py: found no object that includes base/prefetch.h in {build}, expected a build by ninja")
    silent = 0
    for path, source in objects:
        for part in silent_parts(path, source is None or "PrefetchAhead" in source.read_text()):
            silent += 1
            print(f"{path.name}: {part} asks for no memory")
    print(f"{len(objects)} objects, {silent} silent")
    return silent > 0


if __name__ == "__main__":
    sys.exit(main())
