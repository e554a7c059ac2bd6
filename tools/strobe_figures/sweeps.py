"""Scenes with one number to turn. A scene that has something to turn marks the line:

    "float shutterclose" 16        # sweep blur length (px): 0 1 2 4 8 16 32 64

The number that is turned is the first on the line that does not stand in quotes; it is the default, and one of the
values. To strobe the mark is a comment: the file renders as it is.
"""

import os
import re
from dataclasses import dataclass

_MARK = re.compile(r"#\s*sweep\s+(?P<name>[^:(]*[^:(\s])\s*(?:\((?P<unit>[^)]*)\))?\s*:(?P<values>.*)$")
_STRING = r'"(?:\\.|[^"\\])*"'
_NUMBER = re.compile(_STRING + r"|#.*|(?<![\w.])(?P<number>[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)(?![\w.])")
_STRING_OR_COMMENT = re.compile(_STRING + r"|#.*")


@dataclass(frozen=True)
class Sweep:
    """What is turned, in which unit ("" if it has none), through which values in the file's order, and what it is in
    the file."""

    name: str
    unit: str
    values: tuple
    default: float


def read_sweep(scene_path):
    """The sweep of a scene. Raises ValueError, which names the file and what is wrong, if there is not exactly one."""
    with open(scene_path, encoding="utf-8") as file:
        return _find(scene_path, file.read())[0]


def scene_with(scene_path, value):
    """The text of the scene with the number turned to `value`. It may be put anywhere: files beside the scene are
    named by their absolute paths."""
    with open(scene_path, encoding="utf-8") as file:
        text = file.read()
    _, begin, end = _find(scene_path, text)
    folder = os.path.dirname(os.path.abspath(scene_path))

    def absolute(match):
        beside = os.path.join(folder, match[0][1:-1])
        return f'"{beside}"' if match[0].startswith('"') and os.path.isfile(beside) else match[0]

    return _STRING_OR_COMMENT.sub(absolute, f"{text[:begin]}{value:.9g}{text[end:]}")


def _find(path, text):
    """The sweep, and where in the text its number begins and ends."""
    found, at = [], 0
    for row, line in enumerate(text.splitlines(keepends=True), start=1):
        mark = _MARK.search(_comment(line).rstrip())
        if mark:
            found.append((*_parse(f"{path}:{row}", line, mark), at))
        at += len(line)
    if len(found) != 1:
        raise ValueError(f"{path}: {len(found)} lines are marked '# sweep name (unit): values'; it must be one")
    sweep, span, at = found[0]
    return sweep, at + span[0], at + span[1]


def _comment(line):
    return next((m[0] for m in _STRING_OR_COMMENT.finditer(line) if m[0].startswith("#")), "")


def _parse(where, line, mark):
    number = next((m for m in _NUMBER.finditer(line) if m["number"]), None)
    if not number:
        raise ValueError(f"{where}: there is no number to turn on this line")
    try:
        values = tuple(float(v) for v in mark["values"].split())
    except ValueError as error:
        raise ValueError(f"{where}: the values of a sweep are numbers: {error}") from None
    default = float(number["number"])
    if default not in values:
        raise ValueError(f"{where}: {number['number']}, which is turned, is not one of the values")
    return Sweep(mark["name"], mark["unit"] or "", values, default), number.span("number")
