"""Methods made from the registry: a new operation is here without a line of its own."""
import inspect
import keyword
import re
import textwrap

from . import _core
from .errors import UsageError
from .values import text_of, typed

_TYPES = {"number": "float", "integer": "int", "flag": "bool", "numbers": "Sequence[float]", "choice": "str",
          "text": "str"}


def python_name(name):
    """A name of the registry as an identifier."""
    name = re.sub(r"\W+", "_", name).strip("_")
    if name[:1].isdigit():
        name = "_" + name
    return name + "_" if keyword.iskeyword(name) else name


def _default_of(parameter):
    """The default as Python's value; None where there is none."""
    text, kind = parameter["default"], parameter["kind"]
    if text == "":
        return None
    try:
        if kind == "integer":
            return int(text)
        if kind == "number":
            return int(text) if text.lstrip("-").isdigit() else float(text)
        if kind == "flag":
            return text == "1"
        if kind == "numbers":
            return tuple(float(v) for v in text.split(","))
    except ValueError:
        pass
    return text


def _range_of(parameter):
    low, high = parameter["min"], parameter["max"]
    if low is not None and high is not None:
        return f"{low:.10g} to {high:.10g}"
    if low is not None:
        return f"at least {low:.10g}"
    return f"at most {high:.10g}" if high is not None else ""


def _counts_of(parameter):
    if parameter["kind"] != "numbers" and not parameter["numbers_too"]:
        return ""
    counts, least, most = parameter["counts"], parameter["min_count"], parameter["max_count"]
    if counts:
        return ", ".join(map(str, counts)) + " numbers"
    if least == most:
        return f"{least} number" + ("s" if least > 1 else "")
    return f"{least} to {most} numbers"


def annotation_of(parameter):
    """The type in a signature."""
    kind = parameter["kind"]
    text = _TYPES[kind]
    if kind == "numbers":
        text = "float | Sequence[float]"
    elif kind == "choice":
        words = ", ".join(repr(c) for c in parameter["choices"])
        text = f"Literal[{words}]" if words else "str"
        if parameter["numbers_too"]:
            text += " | Sequence[float]"
    elif kind == "text":
        text = "str | PathLike[str] | float | Sequence[float]"
    return text if parameter["required"] else text + " | None"


def parameters_of(row):
    """(Python's name, the registry's parameter) of each, positional ones first."""
    return [(python_name(p["name"]), p) for p in row["parameters"]]



def operands_of(row):
    """Names of the images beside the first; None: as many as the parameters say."""
    if row["images"] < 0:
        return None
    names = {1: (), 2: ("other",), 3: ("second", "third")}
    return names.get(row["images"], tuple(f"image{k}" for k in range(2, row["images"] + 1)))


def signature_of(row):
    """What inspect and editors show."""
    p = inspect.Parameter
    if row["generator"]:
        items = [p("size", p.POSITIONAL_OR_KEYWORD, annotation="Size"),
                 p("channels", p.POSITIONAL_OR_KEYWORD, default=3, annotation="int")]
    else:
        items = [p("self", p.POSITIONAL_ONLY)]
        operands = operands_of(row)
        if operands is None:
            items.append(p("images_and_values", p.VAR_POSITIONAL, annotation="object"))
        else:
            items += [p(name, p.POSITIONAL_ONLY, annotation="Image") for name in operands]
    several = not row["generator"] and operands_of(row) is None
    for name, parameter in parameters_of(row):
        kind = p.POSITIONAL_OR_KEYWORD if parameter["positional"] and not several else p.KEYWORD_ONLY
        default = p.empty if parameter["required"] and not several else _default_of(parameter)
        items.append(p(name, kind, default=default, annotation=annotation_of(parameter)))
    return inspect.Signature(items)


def _call_of(row, values):
    """A call in Python for values of an example."""
    known = dict((p["name"], (name, p)) for name, p in parameters_of(row))
    words = []
    for name, text in values:
        own, parameter = known.get(name, (python_name(name), None))
        kind = parameter["kind"] if parameter else "text"
        if kind in ("number", "integer"):
            shown = text
        elif kind == "flag":
            shown = "False" if text == "0" else "True"
        elif kind == "numbers":
            shown = f"[{text.replace(',', ', ')}]" if "," in text else text
        else:
            shown = repr(text)
        words.append(shown if parameter and parameter["positional"] else f"{own}={shown}")
    return words


def example_of(row, index=0):
    """An example of the registry as a call."""
    words = _call_of(row, _core.split_example(row["name"], row["examples"][index]))
    name = python_name(row["name"])
    if row["generator"]:
        return f"ts.{name}((640, 480), {', '.join(['3'] + words)})"
    others = operands_of(row)
    if others is None:
        count = _core.check(row["name"], _core.split_example(row["name"], row["examples"][index]))
        return f"ts.{name}({', '.join([f'image{k + 1}' for k in range(count)] + words)})"
    return f"image.{name}({', '.join([*others, *words])})"


def docstring_of(row):
    """What it does, what it takes, how exact it is, an example."""
    lines = [row["summary"] + ".", ""]
    lines += textwrap.fill(row["help"], 100).splitlines() if row["help"] else []
    if row["generator"]:
        lines += ["", "size: (width, height), or the window (x0, y0, x1, y1); channels: 1 to 1024."]
    elif row["images"] < 0:
        lines += ["", "Images come before values; how many there are depends on the values. Also a function: ts." +
                  python_name(row["name"]) + "."]
    for name, p in parameters_of(row):
        facts = [fact for fact in (
            _counts_of(p), _range_of(p), "one of " + ", ".join(p["choices"]) if p["choices"] else "",
            f"default {p['default']}" if p["default"] else "", p["use"]) if fact]
        lines += ["" if name == parameters_of(row)[0][0] else None,
                  textwrap.fill(f"{name}: {p['help']}" + (f" ({'; '.join(facts)})" if facts else ""), 100,
                                subsequent_indent="    ")]
    lines += ["", textwrap.fill(f"Error at most {row['bound']}; u is 2**-24.", 100)]
    if row["examples"]:
        lines += ["", ">>> " + example_of(row)]
    return "\n".join(line for line in lines if line is not None)


def _bound(row, arguments, keywords):
    """Values by the registry's names, typed; what is None is left out."""
    values = {}
    parameters = parameters_of(row)
    positional = [p for _, p in parameters if p["positional"]]
    if len(arguments) > len(positional):
        names = ", ".join(p["name"] for p in positional) or "none"
        raise UsageError(row["name"], f"found {len(arguments)} values without names, expected {len(positional)} "
                                      f"({names}); others go by their names")
    for parameter, value in zip(positional, arguments):
        if value is not None:
            values[parameter["name"]] = typed(row, parameter, value)
    known, others = {}, {}
    for name, parameter in parameters:
        known[name] = known[parameter["name"]] = parameter
    for name, parameter in parameters:
        known.setdefault(name.lower(), parameter)
        for word in parameter["other_names"]:
            others.setdefault(word, []).append(parameter)
    for name, value in keywords.items():
        parameter = known.get(name)
        if parameter is None and name in others:
            # Where two share a word, numbers are for the list of numbers, and words for the other.
            fitting = [p for p in others[name] if (p["kind"] in ("choice", "text")) == isinstance(value, str)]
            parameter = (fitting or others[name])[0]
        if parameter is None:
            names = [n for n, _ in parameters]
            near = _core.nearest(name, names)
            raise UsageError(row["name"], f'found no parameter "{name}"' + (
                f"; did you mean {near}?" if near else f", expected {', '.join(names) or 'none'}"))
        if parameter["name"] in values:
            raise UsageError(row["name"], f"found {name} twice, expected it once")
        if value is not None:
            values[parameter["name"]] = typed(row, parameter, value)
    return values


def _texts(values):
    return [(name, text_of(value)) for name, value in values.items()]


def _applied(row, arguments, keywords, base, made):
    """Images first, then values."""
    count = 0
    while count < len(arguments) and isinstance(arguments[count], base):
        count += 1
    for other in arguments[count:]:
        if isinstance(other, base):
            raise UsageError(row["name"], "found an image behind a value, expected images first")
    values = _bound(row, arguments[count:], keywords)
    return made(row["name"], arguments[:count], values, _texts(values))


def make_method(row, base, made):
    """The method of images for an operation. `base`: what images are instances of; `made(name, images, values,
    texts)` makes the result."""

    def method(self, *arguments, **keywords):
        return _applied(row, (self, *arguments), keywords, base, made)

    return _dressed(method, row, signature_of(row), "Image.")


def make_function(row, base, made):
    """The function for an operation that takes as many images as its values say, none maybe."""

    def function(*images_and_values, **keywords):
        return _applied(row, images_and_values, keywords, base, made)

    signature = signature_of(row)
    return _dressed(function, row, signature.replace(parameters=list(signature.parameters.values())[1:]))


def make_generator(row, made):
    """The function for a generator. `made(name, window, channels, values, texts)` makes the image."""

    def function(size, channels=3, *arguments, **keywords):
        try:
            numbers = [int(v) for v in size]
        except (TypeError, ValueError):
            numbers = []
        if len(numbers) not in (2, 4):
            raise UsageError(row["name"], f"found a size of {size!r}, expected (width, height) or (x0, y0, x1, y1)")
        window = [0, 0, *numbers] if len(numbers) == 2 else numbers
        values = _bound(row, arguments, keywords)
        return made(row["name"], window, int(channels), values, _texts(values))

    return _dressed(function, row, signature_of(row))


def _dressed(function, row, signature, owner=""):
    function.__name__ = python_name(row["name"])
    function.__qualname__ = owner + function.__name__
    function.__module__ = "tessera"
    function.__doc__ = docstring_of(row)
    function.__signature__ = signature
    return function


ROWS = _core.operations()
BY_NAME = {row["name"]: row for row in ROWS}
