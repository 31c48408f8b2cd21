"""Recipes: Markdown pages whose ```sh blocks are run, in order, in a folder with the inputs."""
import html
import pathlib
import re

import blocks
import markdown
from blocks import Trouble


def run_block(book, place, where, lines):
    """The block as it was run, and what it printed."""
    shown, printed = [], []
    for _, line in blocks.joined("\n".join(lines)):
        if line.strip() and not line.startswith("#"):
            result = book.kitchen.run(line, place, where)
            printed += [result.printed] if result.printed else []
    for line in lines:
        text = html.escape(book.kitchen.filled(line), False)
        shown.append(f'<span class="remark">{text}</span>' if line.startswith("#") else text)
    text = '<pre class="line">' + "\n".join(shown) + "</pre>\n"
    return text + (f'<pre class="printed">{html.escape(chr(10).join(printed), False)}</pre>\n' if printed else "")


def build(book, folder):
    """Writes every page; gives (url, title, summary, picture) for the start page."""
    made = []
    commands = {r["name"].removeprefix("pattern "): r["name"] for r in book.rows}
    for file in sorted(pathlib.Path(folder).glob("*.md")):
        place = book.kitchen.place("recipe-" + file.stem)
        first = []

        def link(target, file=file, place=place, first=first):
            if re.match(r"[a-z]+:", target) or target.startswith("#"):
                return target
            if target.startswith("--"):  # a command's page
                name = commands.get(target[2:])
                if name is None:
                    raise Trouble(f"{file.name}: links to {target}, which is no command")
                return "../op/" + re.sub(r"[^a-z0-9_]+", "-", name) + ".html"
            if (place / target).is_file():
                if (place / target).is_symlink():
                    picture = book.shown.get(target)
                    if picture is None:
                        raise Trouble(f"{file.name}: {target} is an input that is not shown")
                else:
                    picture = book.keep(place / target, f"recipes/{file.stem}/{pathlib.Path(target).stem}")
                    first.append(picture)
                return "../" + picture
            return target

        def fence(language, lines, file=file, place=place):
            return run_block(book, place, f"recipes/{file.name}", lines) if language == "sh" else None

        body, title, _ = markdown.render(file.read_text(), link, fence)
        body = re.sub(r"<p>((?:<img [^>]*>\s*)+)</p>", r'<div class="pictures">\1</div>', body)
        body = re.sub(r'<img src="([^"]*)" alt="([^"]*)" loading="lazy">(?=(?:\s*<img|\s*</div>|<figure))',
                      r'<figure><img src="\1" alt="\2" loading="lazy"><figcaption>\2</figcaption></figure>', body)
        plain = re.sub(r"<[^>]+>", " ", body)
        summary = re.search(r"<p>(.*?)</p>", body, re.S)
        summary = html.unescape(re.sub(r"<[^>]+>", "", summary[1])) if summary else ""
        summary = re.split(r"(?<=[.:])\s", summary)[0].rstrip(".:")
        url = f"recipe/{file.stem}.html"
        book.write(url, title, body, {"k": "recipe", "s": summary, "p": "", "h": html.unescape(" ".join(plain.split()))})
        made.append((url, title, summary, first[-1] if first else None))
    return made
