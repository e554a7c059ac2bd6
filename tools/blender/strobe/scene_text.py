"""Text of scene files: parameters, transforms, and the object that a line belongs to."""
import re

import numpy as np

MATRIX = "Transform [" + " ".join(["%.9g"] * 16) + "]"


def number(value):
    """Returns a float with the digits of a 32-bit float."""
    return f"{float(value):.9g}"


def numbers(values):
    """Returns a list in brackets."""
    return "[" + " ".join(number(v) for v in values) + "]"


def quoted(text):
    """Returns a string of the scene language."""
    escaped = text.replace("\\", "\\\\").replace('"', '\\"')
    return '"' + re.sub(r"[\x00-\x1f]", " ", escaped) + '"'


def parameter(kind, name, value):
    """Returns `"kind name" value`. A value is a string, a bool, a number, or a sequence of numbers or strings."""
    if isinstance(value, bool):
        text = "true" if value else "false"
    elif isinstance(value, str):
        text = quoted(value)
    elif np.isscalar(value):
        text = number(value)
    elif len(value) and isinstance(value[0], str):
        text = "[" + " ".join(quoted(v) for v in value) + "]"
    else:
        text = numbers(value)
    return f'"{kind} {name}" {text}'


def directive(word, plugin=None, parameters=()):
    """Returns one line. Parameters are (kind, name, value)."""
    words = [word] + ([quoted(plugin)] if plugin else []) + [parameter(*p) for p in parameters]
    return " ".join(words)


def matrix(value):
    """Returns a Transform of a 4x4 matrix of Blender."""
    return MATRIX % tuple(v for column in value.col for v in column)


def transform(keys):
    """Returns lines that set the current transform to one matrix, or to one per key."""
    if len(keys) == 1:
        return [matrix(keys[0])]
    lines = []
    for i, rows in enumerate(keys):
        lines += [f"ActiveTransform {i}", matrix(rows)]
    return lines + ["ActiveTransform All"]


def item_of_line(lines, line):
    """Returns the item that the last comment `# item: NAME` before a line names, or None. Lines count from 1."""
    for text in reversed(lines[:line]):
        if text.startswith("# item: "):
            return text[8:]
    return None
