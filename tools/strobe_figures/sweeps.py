"""Parameter sweeps of scenes. A comment in the scene marks the line of the parameter:

    "float shutterclose" 16        # sweep blur length (px): 0 1 2 4 8 16 32 64

The swept number is the first on the line outside of quotes. It is the default and must be one of the values. strobe
ignores the comment: the file renders with the default.
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
    """A swept parameter: its name, its unit ("" if none), its values in the order of the file, and the value in the
    file."""

    name: str
    unit: str
    values: tuple
    default: float


def read_sweep(scene_path):
    """Returns the sweep of a scene. Raises ValueError with the file name if the scene has not exactly one valid sweep."""
    with open(scene_path, encoding="utf-8") as file:
        return _find(scene_path, file.read())[0]


def scene_with(scene_path, value):
    """Returns the text of the scene with the swept number replaced by `value`. Names of files that exist beside the scene
    become absolute paths, so the text may be written to any folder. Raises ValueError as read_sweep does."""
    with open(scene_path, encoding="utf-8") as file:
        text = file.read()
    _, begin, end = _find(scene_path, text)
    folder = os.path.dirname(os.path.abspath(scene_path))

    def absolute(match):
        beside = os.path.join(folder, match[0][1:-1])
        return f'"{beside}"' if match[0].startswith('"') and os.path.isfile(beside) else match[0]

    return _STRING_OR_COMMENT.sub(absolute, f"{text[:begin]}{value:.9g}{text[end:]}")


def _find(path, text):
    """Returns the sweep, and the offsets in the text where its number begins and ends."""
    sweeps = []
    offset = 0
    for row, line in enumerate(text.splitlines(keepends=True), start=1):
        mark = _MARK.search(_comment(line).rstrip())
        if mark:
            sweeps.append((*_parse(f"{path}:{row}", line, mark), offset))
        offset += len(line)
    if len(sweeps) != 1:
        raise ValueError(f"{path}: {len(sweeps)} lines have a comment '# sweep name (unit): values', expected one")
    sweep, span, line_offset = sweeps[0]
    return sweep, line_offset + span[0], line_offset + span[1]


def _comment(line):
    """Returns the comment of a line with its #, or an empty string."""
    return next((m[0] for m in _STRING_OR_COMMENT.finditer(line) if m[0].startswith("#")), "")


def _parse(location, line, mark):
    """Returns the sweep of a marked line and the span of its number in the line."""
    number = next((m for m in _NUMBER.finditer(line) if m["number"]), None)
    if not number:
        raise ValueError(f"{location}: the line has no number outside of quotes to sweep")
    try:
        values = tuple(float(v) for v in mark["values"].split())
    except ValueError as error:
        raise ValueError(f"{location}: the values of a sweep must be numbers: {error}") from None
    default = float(number["number"])
    if default not in values:
        raise ValueError(f"{location}: the swept number {number['number']} is not one of the values")
    return Sweep(mark["name"], mark["unit"] or "", values, default), number.span("number")
