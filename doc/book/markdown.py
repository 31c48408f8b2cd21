"""The part of Markdown that the repository's pages use, as HTML."""
import html
import re


def slug(text):
    return re.sub(r"[^a-z0-9]+", "-", re.sub(r"[`*_]", "", text.lower())).strip("-") or "section"


def inline(text, link=lambda target: target):
    """Code, links, bold and italics; link(target) is the new target, None for one that the book has no page of."""
    kept = []

    def keep(markup):
        kept.append(markup)
        return f"\0{len(kept) - 1}\0"

    text = re.sub(r"(`+)(.+?)\1", lambda m: keep(f"<code>{html.escape(m[2].strip(), False)}</code>"), text)
    text = re.sub(r"\\([\\`*_{}\[\]()#+\-.!|<>])", lambda m: keep(html.escape(m[1], False)), text)
    text = html.escape(text, False)

    def image(match):
        target = link(match[2])
        return keep(f'<img src="{html.escape(target)}" alt="{match[1]}" loading="lazy">') if target else ""

    def anchor(match):
        target = link(match[2])
        return f'{keep(f"<a href={chr(34)}{html.escape(target)}{chr(34)}>")}{match[1]}{keep("</a>")}' if target else match[1]

    text = re.sub(r"!\[([^\]]*)\]\(([^)\s]+)\)", image, text)
    text = re.sub(r"\[([^\]]+)\]\(([^)\s]+)\)", anchor, text)
    text = re.sub(r"\*\*(?=\S)(.+?)(?<=\S)\*\*", r"<strong>\1</strong>", text)
    text = re.sub(r"(?<![\w*])\*(?=[^\s*])([^*]+?)(?<=[^\s*])\*(?![\w*])", r"<em>\1</em>", text)
    while "\0" in text:
        text = re.sub("\0(\\d+)\0", lambda m: kept[int(m[1])], text)
    return text


def cells(row):
    row = row.strip()
    row = row[1:] if row.startswith("|") else row
    row = row[:-1] if row.endswith("|") and not row.endswith("\\|") else row
    return [c.strip() for c in re.split(r"(?<!\\)\|", row)]


def table(rows, link):
    head = cells(rows[0])
    text = '<div class="wide"><table>'
    if any(head):
        text += "<thead><tr>" + "".join(f"<th>{inline(c, link)}</th>" for c in head) + "</tr></thead>"
    text += "<tbody>"
    for row in rows[2:]:
        text += "<tr>" + "".join(f"<td>{inline(c, link)}</td>" for c in cells(row)) + "</tr>"
    return text + "</tbody></table></div>\n"


def list_of(lines, link):
    """Items, with what is indented below them."""
    ordered = re.match(r"\d+\. ", lines[0]) is not None
    items = []
    for line in lines:
        match = re.match(r"(?:[-*]|\d+\.) +(.*)", line)
        if match:
            items.append([match[1]])
        else:
            items[-1].append(re.sub(r"^ {1,3}", "", line))
    tag = "ol" if ordered else "ul"
    body = ""
    for item in items:
        if len(item) > 1 and any(re.match(r" *(?:[-*]|\d+\.) ", i) for i in item[1:]):
            first = next(i for i, l in enumerate(item) if i and re.match(r" *(?:[-*]|\d+\.) ", l))
            rest = [re.sub(r"^ +", "", l) if re.match(r" *(?:[-*]|\d+\.) ", l) else "  " + l.strip() for l in item[first:]]
            body += f"<li>{inline(' '.join(item[:first]), link)}{list_of(rest, link)}</li>"
        else:
            body += f"<li>{inline(' '.join(i.strip() for i in item), link)}</li>"
    return f"<{tag}>{body}</{tag}>\n"


def render(text, link=lambda target: target, fence=None):
    """(HTML, title, [headings]); fence(language, lines) may give a fenced block's own HTML."""
    lines = re.sub(r"<!--.*?-->", "", text, flags=re.S).splitlines()
    out, title, headings, at = [], "", [], 0
    starts = r"(#{1,6} |```|\||(?:[-*]|\d+\.) |>|    )"
    while at < len(lines):
        line = lines[at]
        if not line.strip():
            at += 1
        elif line.startswith("```"):
            language, body = line[3:].strip(), []
            at += 1
            while at < len(lines) and not lines[at].startswith("```"):
                body.append(lines[at])
                at += 1
            at += 1
            own = fence(language, body) if fence else None
            out.append(own or f"<pre>{html.escape(chr(10).join(body), False)}</pre>\n")
        elif line.startswith("    "):
            body = []
            while at < len(lines) and (lines[at].startswith("    ") or not lines[at].strip()):
                body.append(lines[at][4:])
                at += 1
            out.append(f"<pre>{html.escape(chr(10).join(body).rstrip(), False)}</pre>\n")
        elif re.match(r"#{1,6} ", line):
            marks, _, words = line.partition(" ")
            name = slug(words)
            headings.append((len(marks), words.strip(), name))
            title = title or words.strip()
            out.append(f'<h{len(marks)} id="{name}">{inline(words.strip(), link)}</h{len(marks)}>\n')
            at += 1
        elif line.startswith("|") and at + 1 < len(lines) and re.match(r"\|[\s:|-]+$", lines[at + 1]):
            body = []
            while at < len(lines) and lines[at].startswith("|"):
                body.append(lines[at])
                at += 1
            out.append(table(body, link))
        elif re.match(r"(?:[-*]|\d+\.) ", line):
            body = []
            while at < len(lines) and (re.match(r"(?:[-*]|\d+\.) |  ", lines[at])):
                body.append(lines[at])
                at += 1
            out.append(list_of(body, link))
        elif line.startswith(">"):
            body = []
            while at < len(lines) and lines[at].startswith(">"):
                body.append(lines[at][1:].strip())
                at += 1
            out.append(f"<blockquote>{inline(' '.join(body), link)}</blockquote>\n")
        else:
            body = []
            while at < len(lines) and lines[at].strip() and (not body or not re.match(starts, lines[at])):
                body.append(lines[at].strip())
                at += 1
            out.append(f"<p>{inline(' '.join(body), link)}</p>\n")
    return "".join(out), re.sub(r"[`*]", "", title), headings
