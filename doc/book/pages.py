"""The pages of the book as HTML."""
import html
import json
import re

import markdown

FAMILIES = {"Operations: arithmetic": "Arithmetic", "Operations: color": "Colour", "Operations: curve": "Curves",
            "Operations: ocio": "Colour management", "Operations: filter": "Filters", "Operations: accumulate": "Accumulation",
            "Operations: geometry": "Geometry", "Operations: lookup": "Look-up tables", "Operations: composite": "Compositing",
            "Operations: noise": "Noise on positions", "Operations: channels": "Channels", "Operations: flow": "Vector fields",
            "Operations: shade": "Fog, shadow, solid textures", "Operations: environment": "Environment and light",
            "Operations: bump": "Bump maps", "Operations: volume": "Volumes", "Operations: grade": "Grading",
            "Operations: lens": "Lenses and film", "Operations: restore": "Noise and bands taken away",
            "Operations: generate": "Fills and noise"}


def family(row):
    return FAMILIES.get(row["group"], row["group"].removeprefix("Operations: ").capitalize())


def address(row):
    return "op/" + re.sub(r"[^a-z0-9_]+", "-", row["name"].lower()) + ".html"


def escaped(text):
    return html.escape(text, False)


def attribute(text):
    return html.escape(text, True)


def words_in_code(text):
    """Help text: paragraphs; --commands and key= words as code."""
    paragraphs = []
    for paragraph in text.split("\n"):
        marked = escaped(paragraph)
        marked = re.sub(r"(?<![\w/&;-])(--[a-z][\w-]*(?::[a-z][\w=:,.-]*[\w])?|[a-z][a-z0-9_]*=(?:[\w.,-]*\w)?)(?![\w])",
                        r"<code>\1</code>", marked)
        paragraphs.append(f"<p>{marked}</p>")
    return "\n".join(paragraphs)


class Shell:
    """What is around every page."""

    def __init__(self, version):
        self.version = version

    def page(self, url, title, body, description=""):
        up = "../" * url.count("/")
        return f"""<!DOCTYPE html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<meta name="color-scheme" content="light dark">
<title>{escaped(title)} - Tessera</title>
<meta name="description" content="{attribute(description or title)}">
<link rel="stylesheet" href="{up}book.css">
</head>
<body>
<header><nav>
<a class="home" href="{up}index.html">Tessera</a>
<a href="{up}index.html#operations">Operations</a>
<a href="{up}index.html#recipes">Recipes</a>
<a href="{up}index.html#background">Background</a>
<span class="search"><input id="search" type="search" placeholder="Search, or press /" aria-label="Search"
 autocomplete="off" data-root="{up}"><ul id="found" hidden></ul></span>
</nav></header>
<main>
{body}
</main>
<footer>{escaped(self.version)}. Every line on these pages was run to make its picture.</footer>
<script src="{up}search-index.js"></script>
<script src="{up}search.js"></script>
</body>
</html>
"""


def command(line):
    """A line as it was run, its commands on a line each where it is long."""
    return f"<pre class=\"line\">{escaped(line)}</pre>"


def figure(source, caption, size="", kind=""):
    return (f'<figure class="{kind}"><img src="{attribute(source)}" alt="{attribute(caption)}" loading="lazy"{size}>'
            f"<figcaption>{escaped(caption)}</figcaption></figure>")


def parameters(row):
    rows = [(p["name"], p, "argument") for p in row["arguments"]] + [(f":{p['name']}=", p, "") for p in row["modifiers"]]
    if not rows:
        return ""
    text = '<h2 id="parameters">Arguments and modifiers</h2>\n<div class="wide"><table class="parameters"><thead><tr>'
    text += "<th>name</th><th>meaning</th><th>values</th><th>default</th></tr></thead><tbody>"
    for name, p, kind in rows:
        allowed = p["allowed"]
        if p["default"]:  # it has a column of its own
            allowed = re.sub(r"(^D|; d)efault " + re.escape(p["default"]) + r"(?=[.;])", "", allowed, count=1).lstrip("; ")
        allowed = "" if allowed == "." else allowed[:1].upper() + allowed[1:]
        if p["choices"]:
            allowed = re.sub(r"^One of [^.;]*[.;]? ?", "", allowed)
            choices = "<code>" + "</code> <code>".join(escaped(c) for c in p["choices"]) + "</code>"
            allowed = choices + (f"<br>{escaped(allowed)}" if allowed else "")
        else:
            allowed = escaped(allowed or p["type"])
        default = f"<code>{escaped(p['default'])}</code>" if p["default"] else ("required" if kind else "")
        text += (f'<tr id="p-{attribute(p["name"])}"><td><code>{escaped(name)}</code></td><td>{escaped(p["help"])}</td>'
                 f"<td>{allowed}</td><td>{default}</td></tr>")
    return text + "</tbody></table></div>\n"


def comment_text(text):
    """A `///` comment in the little markup that they use."""
    return markdown.inline(re.sub(r"[@\\](?:file|brief)\b", "", text).strip(), lambda target: None)


def api(names, declarations, links):
    if not names:
        return ""
    text = '<h2 id="cpp">From C++</h2>\n'
    for name in names:
        last = None
        for d in declarations[name]:
            if d.comment and d.comment != last:
                text += f"<p>{comment_text(d.comment)}</p>\n"
            last = d.comment
            link = f' <a href="{attribute(links[name])}">API page</a>' if name in links else ""
            text += f'<p class="header"><code>#include "{escaped(d.header)}"</code>{link}</p>\n'
            text += f"<pre>{escaped(d.code)}</pre>\n"
    return text


def cost(found):
    text = '<h2 id="cost">Cost per pixel</h2>\n'
    if found is None:
        return text + ("<p>Not measured here. <code>bench/run.sh</code> measures every operation; its JSON files, given to "
                       "<code>build.py --bench</code>, stand here then.</p>\n")
    columns, rows, note = found
    text += '<div class="wide"><table><thead><tr>' + "".join(f"<th>{markdown.inline(c)}</th>" for c in columns)
    text += "</tr></thead><tbody>"
    for row in rows:
        text += "<tr>" + "".join(f"<td>{markdown.inline(c)}</td>" for c in row) + "</tr>"
    return text + f"</tbody></table></div>\n<p class=\"note\">{markdown.inline(note)}</p>\n"


def operation(row, block, shots, related, declarations, links, found):
    """A command's page; shots: (line, printed, [before], after) with pictures' places seen from the page."""
    text = f'<p class="family"><a href="../index.html#{markdown.slug(family(row))}">{escaped(family(row))}</a></p>\n'
    text += f"<h1>{escaped(row['name'])}</h1>\n<p class=\"summary\">{escaped(row['summary'])}</p>\n"
    text += f"<pre class=\"synopsis\">{escaped(row['synopsis']).replace(':', '<wbr>:')}</pre>\n"
    if block:
        text += f'<h2 id="lines">{escaped(block.caption[0].upper() + block.caption[1:])}</h2>\n'
    seen = None
    for line, printed, before, after in shots:
        text += command(line)
        pictures = [] if before == seen else [figure(p, name, kind="before") for name, p in before]
        seen = before
        if after:
            pictures.append(figure(after, "the result", kind="after"))
        if after and pictures:
            text += f'<div class="pictures">{"".join(pictures)}</div>\n'
        if printed:
            text += f'<pre class="printed">{escaped(printed)}</pre>\n'
    if row["help"]:
        text += f'<h2 id="help">What it does</h2>\n{words_in_code(row["help"])}\n'
    text += parameters(row)
    if row["accuracy"]:
        text += (f'<h2 id="bound">Error bound</h2>\n<p>{escaped(row["accuracy"])}</p>\n<p class="note">u = 2^-24, the rounding '
                 'of a float; the rest of the words are in <a href="../doc/accuracy.html">accuracy</a>.</p>\n')
        text += cost(found)
    text += api(block.cpp if block else [], declarations, links)
    if related:
        text += '<h2 id="related">Of the same family</h2>\n<p class="related">'
        text += " ".join(f'<a href="{attribute(address(r).removeprefix("op/"))}" title="{attribute(r["summary"])}">'
                         f"{escaped(r['name'].removeprefix('pattern '))}</a>" for r in related) + "</p>\n"
    return text


def card(url, name, summary, picture):
    shown = f'<img src="{attribute(picture)}" alt="" loading="lazy">' if picture else '<span class="blank"></span>'
    return (f'<a class="card" href="{attribute(url)}">{shown}<strong>{escaped(name)}</strong>'
            f"<span>{escaped(summary)}</span></a>")


def start(rows, pictures, recipes, background, size):
    """The start page: operations by family with their pictures, recipes, background."""
    text = """<h1>Image operations, page by page</h1>
<p class="summary">Every command and pattern with lines that run, what came out of them, its words, its error bound and
its C++ declaration.</p>
<p class="related">"""
    groups = {}
    for row in rows:
        groups.setdefault(family(row), []).append(row)
    order = [g for g in groups if g not in ("General", "Stack", "Reports", "Images")]
    order += [g for g in ("Images", "Stack", "Reports", "General") if g in groups]
    text += " ".join(f'<a href="#{markdown.slug(g)}">{escaped(g)}</a>' for g in order) + "</p>\n"
    if recipes:
        text += '<h2 id="recipes">Recipes</h2>\n<div class="cards">'
        text += "".join(card(url, title, summary, picture) for url, title, summary, picture in recipes) + "</div>\n"
    text += '<h2 id="operations">Operations</h2>\n'
    for group in order:
        text += f'<h3 id="{markdown.slug(group)}">{escaped(group)}</h3>\n'
        some = any(pictures.get(r["name"]) for r in groups[group])
        text += '<div class="cards">' if some else '<div class="cards bare">'
        for row in groups[group]:
            text += card(address(row), row["name"].removeprefix("pattern "), row["summary"], pictures.get(row["name"]))
        text += "</div>\n"
    text += '<h2 id="background">Background</h2>\n<ul>'
    text += "".join(f'<li><a href="{attribute(url)}">{escaped(title)}</a></li>' for url, title in background)
    text += f'<li><a href="inputs.html">The inputs of the lines</a></li></ul>\n<p class="note">Pictures here are {size}.</p>\n'
    return text


def inputs(blocks, shown, filled):
    text = "<h1>The inputs</h1>\n<p class=\"summary\">The files that the lines of these pages read, and how they are made.</p>\n"
    for block in blocks.values():
        text += f'<h2 id="{markdown.slug(block.name)}">{escaped(block.name)}</h2>\n<p>{escaped(block.caption)}</p>\n'
        text += "".join(command(filled(line)) for line in block.lines)
        text += f'<div class="pictures">{figure(shown[block.name], block.name)}</div>\n'
    return text


def search_index(entries):
    """entries: dicts of t(itle), u(rl), k(ind), s(ummary), p(arameters), h(elp)."""
    return "window.bookIndex = " + json.dumps(entries, ensure_ascii=False, separators=(",", ":")) + ";\n"
