#!/usr/bin/python3
"""Writes one HTML page with charts, tables and image comparisons. The page is a single file without network access.

    tools/strobe_figures/report.py OUT [DESTINATION]        default of DESTINATION: OUT/report.html

OUT/report.json describes the page; its paths are relative to OUT:

    {"title", "subtitle", "sections": [{"id", "title", "text", "items": [ITEM, ...]}, ...]}

An ITEM has "kind", "id", "title", "text" (paragraphs separated by empty lines) and optionally "number", which replaces its
running number. Further members by kind:

    images   "images": [{"label", "file", "caption"}], "reference": an index or null, "crops": [[x, y, w, h], ...]
             .exr files are linear, others sRGB; all images of an item have one size; crops are in pixels
    chart    "xlabel", "ylabel", "xlog", "ylog", "marks": [{"x", "label"}] for vertical lines, and
             "series": [{"name", "points": [[x, y] or [x, y, low, high], ...], "labels": one per point,
             "integrator": sets color and marker, "variant": index of the dashes, 0 is solid,
             "front": true for the Pareto front, drawn as a wide pale line}]
    table    "columns": [{"name", "type": "number" or "text", "digits": after the decimal point}], "rows"; null is an empty
             cell
    picture  "file": .png, .svg or .jpg, embedded unchanged
"""
import argparse
import base64
import hashlib
import html
import json
import math
import mimetypes
import os
import re
import string
import sys
import zlib

import numpy as np
import OpenImageIO as oiio

if __package__:
    from .styles import palette_indices
else:
    from styles import palette_indices

HERE = os.path.dirname(os.path.abspath(__file__))
SCRIPTS = ("report.js", "report_chart.js", "report_pixels.js", "report_viewer.js")
LARGEST_HALF = 65504.0
NAMES = {"images": "Figure", "chart": "Figure", "picture": "Figure", "table": "Table"}


def source(name):
    """Returns the text of a file beside this module."""
    with open(os.path.join(HERE, name), encoding="utf-8") as file:
        return file.read()


def element(tag, content="", **attributes):
    """Returns the HTML of an element with HTML content. Attribute values are escaped; a trailing _ of attribute names is
    removed."""
    written = "".join(f' {name.rstrip("_").replace("_", "-")}="{html.escape(str(value))}"'
                      for name, value in attributes.items() if value is not None)
    return f"<{tag}{written}>{content}</{tag}>"


def paragraphs(text):
    """Returns the HTML of paragraphs separated by empty lines."""
    parts = (part.strip() for part in re.split(r"\n\s*\n", text or ""))
    return "".join(element("p", html.escape(part)) for part in parts if part)


def embedded(value):
    """Returns JSON as the content of a script element; < is escaped, so that no string ends the element."""
    return json.dumps(value, separators=(",", ":"), allow_nan=False).replace("<", "\\u003c")


def data_script(value):
    """Returns a script element with data of the page's scripts."""
    return element("script", embedded(value), type="application/json")


def need(condition, message):
    """Raises ValueError unless the condition holds."""
    if not condition:
        raise ValueError(message)


# Pixels

def load(path):
    """Returns the linear RGB pixels of an image file as a float32 array [height, width, 3]. Raises ValueError."""
    buf = oiio.ImageBuf(path)
    need(not buf.has_error, f"{path}: {buf.geterror()}")
    pixels = buf.get_pixels(oiio.FLOAT)
    need(pixels.shape[2] != 2, f"{path}: has two channels; expected one, three or four")
    pixels = pixels[:, :, :3] if pixels.shape[2] > 2 else np.repeat(pixels, 3, axis=2)
    if path.lower().endswith(".exr"):
        return pixels
    return np.where(pixels <= 0.04045, pixels / 12.92, ((pixels + 0.055) / 1.055) ** 2.4)


def packed(pixels):
    """Returns pixels as base64 of deflated half floats: differences to the left neighbor, all high bytes before all low
    bytes, which compresses two to four times better. Finite values are clamped to the range of half."""
    is_finite = np.isfinite(pixels)
    pixels = np.where(is_finite, np.clip(pixels, -LARGEST_HALF, LARGEST_HALF), pixels)
    bits = pixels.astype(np.float16).view(np.uint16)
    steps = np.diff(bits, axis=1, prepend=np.uint16(0))
    planes = (steps >> 8).astype(np.uint8).tobytes() + (steps & 255).astype(np.uint8).tobytes()
    return base64.b64encode(zlib.compress(planes, 6)).decode("ascii")


class Pixels:
    """The image files of a page. Each file is embedded once, also if several items show it."""

    def __init__(self, folder):
        self.folder = folder
        self.entries = {}  # (number, (width, height), count of pixels that are not finite) by file
        self.elements = []

    def add(self, file):
        """Adds a file. Returns its number, (width, height) and its count of pixels that are not finite."""
        if file not in self.entries:
            pixels = load(os.path.join(self.folder, file))
            height, width = pixels.shape[:2]
            number = len(self.elements)
            invalid = int((~np.isfinite(pixels).all(axis=2)).sum())
            self.entries[file] = number, (width, height), invalid
            self.elements.append(element("script", packed(pixels), type="text/plain", data_pixels=number,
                                         data_width=width, data_height=height))
        return self.entries[file]

    def scripts(self):
        """Returns the script elements that contain the pixels."""
        return "\n".join(self.elements)


# Items: each function returns the HTML below the caption

def images_item(item, pixels):
    """Returns the data of an image comparison."""
    shown, sizes = [], set()
    need(item.get("images"), "has no images")
    for image in item["images"]:
        number, size, invalid = pixels.add(image["file"])
        sizes.add(size)
        notes = [image.get("caption"), f"{invalid} pixels are not finite (magenta)" if invalid else None]
        shown.append({"label": image["label"], "caption": " · ".join(filter(None, notes)), "pixels": number})
    need(len(sizes) == 1, f"has images of different sizes: {sorted(sizes)}")
    width, height = sizes.pop()
    crops = item.get("crops") or []
    for x, y, w, h in crops:
        need(0 <= x and 0 <= y and w > 0 and h > 0 and x + w <= width and y + h <= height,
             f"has a crop {[x, y, w, h]} outside of {width} x {height} pixels")
    reference = item.get("reference")
    need(reference is None or 0 <= reference < len(shown), f"has no image {reference} for the reference")
    return data_script({"title": item["title"], "width": width, "height": height, "images": shown,
                        "reference": reference, "crops": crops})


def finite(value):
    """Returns whether a value is a finite number."""
    return isinstance(value, (int, float)) and math.isfinite(value)


def drawable(point, item):
    """Returns [x, y, low, high] of a point and whether the axes can show it. low and high are None unless both are finite."""
    x, y, low, high = (list(point) + [None, None])[:4]
    is_shown = finite(x) and finite(y) and not (item.get("xlog") and x <= 0) and not (item.get("ylog") and y <= 0)
    return [x, y, low, high] if finite(low) and finite(high) else [x, y, None, None], is_shown


def chart_item(item, _):
    """Returns the data of a chart, and a table of its values."""
    chart = {key: item.get(key) for key in ("title", "xlabel", "ylabel", "xlog", "ylog")}
    chart["marks"] = item.get("marks") or []
    chart["series"] = []
    rows, omitted = [], 0
    for series, index in zip(item["series"], palette_indices(item["series"])):
        labels = series.get("labels") or [""] * len(series["points"])
        need(len(labels) == len(series["points"]),
             f"series '{series['name']}' has {len(labels)} labels for {len(series['points'])} points")
        points = [(*drawable(point, item), label) for point, label in zip(series["points"], labels)]
        shown = [(point, label) for point, is_shown, label in points if is_shown]
        omitted += len(points) - len(shown)
        rows += [[series["name"], label, *(v if finite(v) else None for v in point)] for point, _, label in points]
        chart["series"].append({"name": series["name"], "palette": index, "variant": series.get("variant", 0),
                                "front": bool(series.get("front")), "points": [point for point, _ in shown],
                                "labels": [label for _, label in shown]})
    need(any(series["points"] for series in chart["series"]), "has no point that its axes can show")
    columns = [{"name": name, "type": "text"} for name in ("Series", "Point")]
    columns += [{"name": name, "type": "number"} for name in (item["xlabel"], item["ylabel"], "low", "high")]
    note = f"Points that the axes cannot show: {omitted}." if omitted else ""
    values = element("details", element("summary", "Values") + table({"columns": columns, "rows": rows}), class_="values")
    return data_script(chart) + (element("p", note, class_="note") if note else "") + values


def cell(value, column, first):
    """Returns the HTML of a table cell; the first cell of a row is its heading."""
    tag, scope = ("th", "row") if first else ("td", None)
    if column.get("type") != "number":
        return element(tag, html.escape("" if value is None else str(value)), scope=scope)
    need(value is None or isinstance(value, (int, float)), f"has {value!r} in column '{column['name']}', expected a number")
    digits = column.get("digits")
    if value is None:
        text = "–"
    elif digits is None or not math.isfinite(value):
        text = f"{value:.6g}"
    else:
        text = f"{value:.{digits}f}"
    return element(tag, text.replace("-", "−"), scope=scope, class_="number",
                   data_value="" if value is None else value)


def table(item):
    """Returns the HTML of a table whose columns can be sorted."""
    columns = item["columns"]
    need(all(len(row) == len(columns) for row in item["rows"]), f"has a row without {len(columns)} cells")
    heads = [element("th", element("button", html.escape(column["name"]), type="button"), scope="col",
                     aria_sort="none", class_="number" if column.get("type") == "number" else None)
             for column in columns]
    rows = [element("tr", "".join(cell(value, column, i == 0) for i, (value, column) in enumerate(zip(row, columns))))
            for row in item["rows"]]
    return element("div", element("table", element("thead", element("tr", "".join(heads))) +
                                  element("tbody", "\n".join(rows))), class_="scroll")


def picture_item(item, pixels):
    """Returns an embedded image file."""
    path = os.path.join(pixels.folder, item["file"])
    with open(path, "rb") as file:
        content = base64.b64encode(file.read()).decode("ascii")
    kind = mimetypes.guess_type(path)[0]
    need(kind in ("image/png", "image/svg+xml", "image/jpeg"), f"has a file {item['file']}, expected .png, .svg or .jpg")
    return f'<img src="data:{kind};base64,{content}" alt="{html.escape(item["title"])}">'


KINDS = {"images": images_item, "chart": chart_item, "picture": picture_item, "table": lambda item, _: table(item)}


# The page

class Page:
    """Collects sections, entries of the table of contents, and the numbers of figures and tables."""

    def __init__(self, folder):
        self.pixels = Pixels(folder)
        self.ids = {"content", "contents-title"}
        self.counts = {"Figure": 0, "Table": 0}

    def add_id(self, name):
        """Raises ValueError if an id is invalid or used twice."""
        need(re.fullmatch(r"[A-Za-z0-9][\w.-]*", name), f"has an invalid id '{name}'; use letters, digits, '.', '-' and '_'")
        need(name not in self.ids, f"has the id '{name}' of another item")
        self.ids.add(name)

    def number_of(self, item):
        """Returns the number of an item: its own, or the next of its kind."""
        need(not re.match(r"(Paper )?(Figure|Table) \d", item["title"]),
             f"has a number in its title '{item['title']}'; use the member 'number'")
        if item.get("number"):
            return item["number"]
        name = NAMES[item["kind"]]
        self.counts[name] += 1
        return f"{name} {self.counts[name]}"

    def item(self, item):
        """Returns the HTML of an item and its entry in the table of contents."""
        kind = item["kind"]
        need(kind in KINDS, f"has an unknown kind '{kind}' (known: {', '.join(KINDS)})")
        self.add_id(item["id"])
        number = html.escape(self.number_of(item))
        title = html.escape(item["title"])
        head = element("h3", element("span", number, class_="count") + " " + title, id=item["id"] + ":title")
        caption = element("figcaption", head + paragraphs(item.get("text")))
        shown = element("figure", caption + KINDS[kind](item, self.pixels), class_="item " + kind, id=item["id"],
                        aria_labelledby=item["id"] + ":title")
        return shown, element("li", element("a", f"{number} {title}", href="#" + item["id"]))

    def section(self, section):
        """Returns the HTML of a section and its entry in the table of contents. Raises ValueError, which names the item."""
        self.add_id(section["id"])
        shown, entries = [], []
        for item in section["items"]:
            try:
                figure, entry = self.item(item)
            except (ValueError, KeyError, TypeError, OSError) as error:
                problem = f"lacks {error}" if isinstance(error, KeyError) else error
                raise ValueError(f"item '{item.get('id', '?')}' of section '{section['id']}': {problem}") from error
            shown.append(figure)
            entries.append(entry)
        title = html.escape(section["title"])
        heading = element("h2", title, id=section["id"] + ":title")
        body = element("section", heading + paragraphs(section.get("text")) + "\n".join(shown), id=section["id"],
                       aria_labelledby=section["id"] + ":title")
        link = element("a", title, href="#" + section["id"])
        return body, element("li", link + (element("ul", "".join(entries)) if entries else ""))


def digest(text):
    """Returns the hash of an inline script or style for the Content-Security-Policy."""
    return "sha256-" + base64.b64encode(hashlib.sha256(text.encode("utf-8")).digest()).decode("ascii")


def write_report(out_folder, destination=None):
    """Writes the page of out_folder/report.json to `destination` (default: out_folder/report.html) and returns its path.
    Raises ValueError, which names the item, for invalid items, and OSError."""
    with open(os.path.join(out_folder, "report.json"), encoding="utf-8") as file:
        report = json.load(file)
    page = Page(out_folder)
    bodies, entries = zip(*(page.section(section) for section in report["sections"]))
    script = "\n".join(source(name) for name in SCRIPTS)
    style = source("report.css")
    page_html = string.Template(source("report_template.html")).substitute(
        title=html.escape(report["title"]), subtitle=html.escape(report.get("subtitle") or ""),
        contents=element("ol", "".join(entries)), sections="\n".join(bodies), pixels=page.pixels.scripts(),
        style=style, script=script, style_digest=digest(style), script_digest=digest(script))
    destination = destination or os.path.join(out_folder, "report.html")
    with open(destination, "w", encoding="utf-8", newline="\n") as file:
        file.write(page_html)
    return destination


def main():
    """Writes the page that the command line names."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("out", help="folder with report.json")
    parser.add_argument("destination", nargs="?", help="HTML file to write (default: OUT/report.html)")
    args = parser.parse_args()
    try:
        destination = write_report(args.out, args.destination)
    except (ValueError, OSError) as error:
        sys.exit(f"report: {error}")
    print(f"{destination}: {os.path.getsize(destination) / 1e6:.1f} MB")


if __name__ == "__main__":
    main()
