#!/usr/bin/env python3
"""Looks for dead links, dead anchors and pages that search does not know in a built book.

usage: check.py DIR
"""
import html.parser
import json
import pathlib
import re
import sys
import urllib.parse


class Page(html.parser.HTMLParser):
    """The ids of a page and where it links to."""

    def __init__(self, text):
        super().__init__()
        self.ids, self.links, self.open = [], [], []
        self.title = ""
        self.feed(text)

    def handle_starttag(self, tag, attrs):
        attributes = dict(attrs)
        if "id" in attributes:
            self.ids.append(attributes["id"])
        for key in ("href", "src"):
            if attributes.get(key) is not None:
                self.links.append(attributes[key])
        if tag not in ("meta", "link", "img", "input", "br", "wbr"):
            self.open.append(tag)

    def handle_endtag(self, tag):
        if self.open and self.open[-1] == tag:
            self.open.pop()
        else:
            self.open.append("/" + tag)  # never closed again, so that it is told


def faults(folder):
    folder = pathlib.Path(folder)
    found, pages = [], {}
    for file in sorted(folder.rglob("*.html")):
        pages[file] = Page(file.read_text())
    for file, page in pages.items():
        name = file.relative_to(folder)
        found += [f"{name}: tags that do not match: {page.open}"] if page.open else []
        found += [f"{name}: id {i} is there twice" for i in sorted({i for i in page.ids if page.ids.count(i) > 1})]
        for link in page.links:
            if re.match(r"[a-z]+:", link):
                continue
            path, _, anchor = link.partition("#")
            target = (file.parent / urllib.parse.unquote(path)).resolve() if path else file.resolve()
            if not target.is_file():
                found.append(f"{name}: dead link {link}")
            elif anchor and target.suffix == ".html":
                there = next((p for f, p in pages.items() if f.resolve() == target), None)
                there = there or Page(target.read_text(errors="replace"))
                if anchor not in there.ids and f'name="{anchor}"' not in target.read_text(errors="replace"):
                    found.append(f"{name}: dead anchor {link}")
    text = (folder / "search-index.js").read_text()
    entries = json.loads(text[text.index("["):text.rindex("]") + 1])
    urls = [e["u"] for e in entries]
    found += [f"search-index.js: {u} is there twice" for u in sorted({u for u in urls if urls.count(u) > 1})]
    found += [f"search-index.js: {u}: no such page" for u in urls if not (folder / u).is_file()]
    found += [f"search-index.js: {f.relative_to(folder)} is missing" for f in pages
              if str(f.relative_to(folder)) not in urls and f.name != "index.html"]
    return found


if __name__ == "__main__":
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    told = faults(sys.argv[1])
    print("\n".join(told) or "no dead link")
    sys.exit(1 if told else 0)
