"""The public headers' declarations with their comments, by name."""
import dataclasses
import pathlib
import re


@dataclasses.dataclass
class Declaration:
    """One overload, or one type."""
    name: str
    header: str
    comment: str
    code: str


def depth(text):
    """Open braces and parentheses of a line, comments aside."""
    text = re.sub(r'"(\\.|[^"\\])*"', '""', text.split("//")[0])
    return sum(text.count(c) for c in "({") - sum(text.count(c) for c in ")}")


def name_of(code):
    bare = re.sub(r"///?.*", "", code)
    match = re.match(r"\s*(?:template\s*<[^>]*>\s*)?(?:struct|class|enum class|enum)\s+(?:TESSERA_API\s+)?(\w+)", bare)
    if match:
        return match.group(1)
    match = re.match(r"\s*using\s+(\w+)\s*=", bare)
    if match:
        return match.group(1)
    match = re.match(r"[^(=;]*?\b(\w+)\(", bare, re.S)
    return match.group(1) if match else None


def declarations(text, header):
    """Every declaration at namespace level; one without a comment shares that of the one directly above."""
    lines = text.splitlines()
    comment, at = [], 0
    while at < len(lines):
        line = lines[at]
        stripped = line.strip()
        if stripped.startswith("///"):
            comment = []
            while at < len(lines) and lines[at].strip().startswith("///"):
                comment.append(lines[at].strip()[3:].strip())
                at += 1
            if any("@file" in c for c in comment):
                comment = []
            continue
        if not stripped:
            comment = []
        if not stripped or re.match(r"(#|//|namespace\b|\}|TESSERA_API_)", stripped) or line.startswith(" "):
            at += 1
            continue
        code, open_ = [], 0
        while at < len(lines):
            code.append(lines[at])
            open_ += depth(lines[at])
            at += 1
            if open_ <= 0 and re.search(r"[;}]\s*(//.*)?$", code[-1]):
                break
        name = name_of("\n".join(code))
        if name:
            yield Declaration(name, header, " ".join(comment), "\n".join(code))


def read(include):
    """{name: [Declaration]} of all headers below a folder."""
    found = {}
    include = pathlib.Path(include)
    for file in sorted(include.rglob("*.h")):
        if file.name == "c.h":
            continue
        for declaration in declarations(file.read_text(), str(file.relative_to(include))):
            found.setdefault(declaration.name, []).append(declaration)
    return found


def doxygen_links(folder):
    """{name: page#anchor} from a folder of Doxygen's pages, empty where there is none."""
    links = {}
    if folder is None or not pathlib.Path(folder).is_dir():
        return links
    for page in sorted(pathlib.Path(folder).glob("*_8h.html")):
        text = page.read_text(errors="replace")
        for target, name in re.findall(r'<a class="el" href="([^"]+)">(?:tessera::)?(\w+)</a>', text):
            links.setdefault(name, target)
    return links
