"""Values of parameters: Python's become the registry's kinds, and the text that its one parser checks."""
import numbers
import os

from .errors import UsageError

_KINDS = {"number": "a number", "integer": "a whole number", "flag": "True or False",
          "numbers": "a list of numbers", "choice": "a word", "text": "text"}


def _shown(value):
    text = repr(value)
    return text if len(text) <= 60 else text[:57] + "..."


def _refuse(row, parameter, value):
    subject = row["name"] if parameter["positional"] else f"{row['name']}:{parameter['name']}"
    raise UsageError(subject, f"found {_shown(value)}, expected {_KINDS[parameter['kind']]}")


def _number(value):
    """A float or int; None for what is no number."""
    if isinstance(value, (bool, str, bytes)):
        return None
    if isinstance(value, numbers.Integral):
        return int(value)
    if isinstance(value, numbers.Real):
        return float(value)
    if getattr(value, "shape", None) == () and hasattr(value, "item"):
        return _number(value.item())
    return None


def _numbers(value):
    """Floats and ints of a sequence; None where one of them is no number."""
    one = _number(value)
    if one is not None:
        return [one]
    if isinstance(value, (str, bytes, dict)) or not hasattr(value, "__iter__"):
        return None
    if hasattr(value, "ravel"):
        value = value.ravel()
    found = [_number(v) for v in value]
    return None if None in found else found


def typed(row, parameter, value):
    """The value as its kind has it in a graph's JSON: a number, True, a list, text."""
    kind = parameter["kind"]
    if isinstance(value, os.PathLike):
        value = os.fspath(value)
    elif getattr(value, "shape", None) == () and hasattr(value, "item"):
        value = value.item()  # NumPy's scalars
    if kind in ("number", "integer"):
        found = _number(value)
        if found is not None and kind == "integer" and isinstance(found, float) and found.is_integer():
            found = int(found)
        if found is not None and (kind == "number" or isinstance(found, int)):
            return found
    elif kind == "flag":
        if isinstance(value, bool) or (_number(value) is not None and value in (0, 1)):
            return bool(value)
    elif kind == "numbers":
        found = _numbers(value)
        if found is not None:
            return found
    elif kind == "choice":
        if isinstance(value, str):
            return value
        if parameter["numbers_too"]:
            found = _numbers(value)
            if found is not None:
                return found
        elif _number(value) is not None:
            return text_of(_number(value))
    elif isinstance(value, str):
        return value
    elif _number(value) is not None:
        return text_of(_number(value))
    elif isinstance(value, (list, tuple)) or hasattr(value, "ravel"):
        # Rows of text that hold numbers, such as sizes and corners, take them as numbers too.
        parts = [v if isinstance(v, str) else text_of(v) if _number(v) is not None else None for v in
                 (value.ravel() if hasattr(value, "ravel") else value)]
        if None not in parts:
            name = parameter["name"]
            if len(parts) == 2 and name == "+X+Y":
                return "".join(part if part[0] == "-" else "+" + part for part in parts)
            pair = len(parts) == 2 and (name == "GEOM" or "WxH" in name + parameter["help"])
            return ("x" if pair else ",").join(parts)
    _refuse(row, parameter, value)
    return None


def text_of(value):
    """A typed value as the registry's parser reads it, every bit of it."""
    if isinstance(value, bool):
        return "1" if value else "0"
    if isinstance(value, str):
        return value
    if isinstance(value, (list, tuple)):
        return ",".join(text_of(v) for v in value)
    number = _number(value)
    return str(number) if isinstance(number, int) else repr(number)
