#!/usr/bin/python3
"""Makes one page of the figures in a folder: charts, tables and pictures that can be compared, in a single file that
needs nothing from a network.

    tools/strobe_figures/report.py OUT [DESTINATION]        DESTINATION: OUT/report.html when not given

OUT/report.json says what is on the page; paths in it are relative to OUT:

    {"title", "subtitle", "sections": [{"id", "title", "text", "items": [ITEM, ...]}, ...]}

An ITEM has "kind", "id", "title" and "text" (paragraphs part at empty lines), and by kind:

    images   "images": [{"label", "file", "caption"}], "reference": an index or null, "crops": [[x, y, w, h], ...]
             .exr files are linear, others sRGB; all of one item have one size; crops are in pixels
    chart    "xlabel", "ylabel", "xlog", "ylog", "marks": [{"x", "label"}], and
             "series": [{"name", "points": [[x, y] or [x, y, low, high], ...], "labels": one per point,
             "dashed": another kind of method, "front": the line that bounds the others, drawn wide and pale}]
    table    "columns": [{"name", "type": "number" or "text", "digits": after the point}], "rows"; null is an empty cell
    picture  "file": .png, .svg or .jpg, shown as it is
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

HERE = os.path.dirname(os.path.abspath(__file__))
SCRIPTS = ("report.js", "report_chart.js", "report_pixels.js", "report_viewer.js")
LARGEST_HALF = 65504.0
NAMES = {"images": "Figure", "chart": "Figure", "picture": "Figure", "table": "Table"}


def source(name):
    with open(os.path.join(HERE, name), encoding="utf-8") as file:
        return file.read()


def element(tag, content="", **attributes):
    """HTML of an element around HTML; attributes are text and are escaped. A trailing _ of their names is dropped."""
    written = "".join(f' {name.rstrip("_").replace("_", "-")}="{html.escape(str(value))}"'
                      for name, value in attributes.items() if value is not None)
    return f"<{tag}{written}>{content}</{tag}>"


def paragraphs(text):
    parts = (part.strip() for part in re.split(r"\n\s*\n", text or ""))
    return "".join(element("p", html.escape(part)) for part in parts if part)


def embedded(value):
    """JSON as the content of a script element, which no string in it can end."""
    return json.dumps(value, separators=(",", ":"), allow_nan=False).replace("<", "\\u003c")


def data_script(value):
    return element("script", embedded(value), type="application/json")


def need(condition, message):
    if not condition:
        raise ValueError(message)


# Pixels

def load(path):
    """Linear RGB of an image file, as float32 rows x columns x 3."""
    buf = oiio.ImageBuf(path)
    need(not buf.has_error, f"{path}: {buf.geterror()}")
    pixels = buf.get_pixels(oiio.FLOAT)
    need(pixels.shape[2] != 2, f"{path}: has two channels, not one, three or four")
    pixels = pixels[:, :, :3] if pixels.shape[2] > 2 else np.repeat(pixels, 3, axis=2)
    if path.lower().endswith(".exr"):
        return pixels
    return np.where(pixels <= 0.04045, pixels / 12.92, ((pixels + 0.055) / 1.055) ** 2.4)


def packed(pixels):
    """Half floats as differences to the left neighbor, high bytes before low bytes, deflated, base64: two to four
    times smaller than as they are. Finite values that no half can hold become the largest half."""
    finite = np.isfinite(pixels)
    pixels = np.where(finite, np.clip(pixels, -LARGEST_HALF, LARGEST_HALF), pixels)
    bits = pixels.astype(np.float16).view(np.uint16)
    steps = np.diff(bits, axis=1, prepend=np.uint16(0))
    planes = (steps >> 8).astype(np.uint8).tobytes() + (steps & 255).astype(np.uint8).tobytes()
    return base64.b64encode(zlib.compress(planes, 6)).decode("ascii")


class Pixels:
    """The image files of a page, each kept once however many items show it."""

    def __init__(self, folder):
        self.folder = folder
        self.entries = {}
        self.written = []

    def add(self, file):
        """Number, (width, height) and count of pixels that are not finite."""
        if file not in self.entries:
            pixels = load(os.path.join(self.folder, file))
            height, width = pixels.shape[:2]
            number = len(self.written)
            broken = int((~np.isfinite(pixels).all(axis=2)).sum())
            self.entries[file] = number, (width, height), broken
            self.written.append(element("script", packed(pixels), type="text/plain", data_pixels=number,
                                          data_width=width, data_height=height))
        return self.entries[file]

    def scripts(self):
        return "\n".join(self.written)


# Items: each function returns the HTML of what the item shows

def images_item(item, pixels):
    shown, sizes = [], set()
    need(item.get("images"), "has no images")
    for image in item["images"]:
        number, size, broken = pixels.add(image["file"])
        sizes.add(size)
        notes = [image.get("caption"), f"pixels that are not finite, in magenta: {broken}" if broken else None]
        shown.append({"label": image["label"], "caption": " · ".join(filter(None, notes)), "pixels": number})
    need(len(sizes) == 1, f"images of different sizes: {sorted(sizes)}")
    width, height = sizes.pop()
    crops = item.get("crops") or []
    for x, y, w, h in crops:
        need(0 <= x and 0 <= y and w > 0 and h > 0 and x + w <= width and y + h <= height,
             f"crop {[x, y, w, h]} is not inside {width} x {height} pixels")
    reference = item.get("reference")
    need(reference is None or 0 <= reference < len(shown), f"there is no image {reference} to be the reference")
    return data_script({"title": item["title"], "width": width, "height": height, "images": shown,
                        "reference": reference, "crops": crops})


def finite(value):
    return isinstance(value, (int, float)) and math.isfinite(value)


def drawable(point, item):
    """Whether a point has a place on the axes, and if so the point, its band null unless both ends are numbers."""
    x, y, low, high = (list(point) + [None, None])[:4]
    here = finite(x) and finite(y) and not (item.get("xlog") and x <= 0) and not (item.get("ylog") and y <= 0)
    return [x, y, low, high] if finite(low) and finite(high) else [x, y, None, None], here


def chart_item(item, _):
    chart = {key: item.get(key) for key in ("title", "xlabel", "ylabel", "xlog", "ylog")}
    chart["marks"] = item.get("marks") or []
    chart["series"], rows, lost = [], [], 0
    for series in item["series"]:
        labels = series.get("labels") or [""] * len(series["points"])
        need(len(labels) == len(series["points"]),
             f"series '{series['name']}' has {len(labels)} labels for {len(series['points'])} points")
        points = [(*drawable(point, item), label) for point, label in zip(series["points"], labels)]
        kept = [(point, label) for point, here, label in points if here]
        lost += len(points) - len(kept)
        rows += [[series["name"], label, *(v if finite(v) else None for v in point)] for point, _, label in points]
        chart["series"].append({"name": series["name"], "dashed": bool(series.get("dashed")),
                                "front": bool(series.get("front")), "points": [point for point, _ in kept],
                                "labels": [label for _, label in kept]})
    need(any(series["points"] for series in chart["series"]), "has no point that its axes can show")
    columns = [{"name": name, "type": "text"} for name in ("Series", "Point")]
    columns += [{"name": name, "type": "number"} for name in (item["xlabel"], item["ylabel"], "low", "high")]
    note = f"Points without a place on these axes, which are therefore not drawn: {lost}." if lost else ""
    data = element("details", element("summary", "Values") + table({"columns": columns, "rows": rows}), class_="values")
    return data_script(chart) + (element("p", note, class_="note") if note else "") + data


def cell(value, column, first):
    tag, scope = ("th", "row") if first else ("td", None)
    if column.get("type") != "number":
        return element(tag, html.escape("" if value is None else str(value)), scope=scope)
    need(value is None or isinstance(value, (int, float)), f"{value!r} in column '{column['name']}' is no number")
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
    columns = item["columns"]
    need(all(len(row) == len(columns) for row in item["rows"]), f"has a row without exactly {len(columns)} cells")
    heads = [element("th", element("button", html.escape(column["name"]), type="button"), scope="col",
                     aria_sort="none", class_="number" if column.get("type") == "number" else None)
             for column in columns]
    rows = [element("tr", "".join(cell(value, column, i == 0) for i, (value, column) in enumerate(zip(row, columns))))
            for row in item["rows"]]
    return element("div", element("table", element("thead", element("tr", "".join(heads))) +
                                  element("tbody", "\n".join(rows))), class_="scroll")


def picture_item(item, pixels):
    path = os.path.join(pixels.folder, item["file"])
    with open(path, "rb") as file:
        content = base64.b64encode(file.read()).decode("ascii")
    kind = mimetypes.guess_type(path)[0]
    need(kind in ("image/png", "image/svg+xml", "image/jpeg"), f"{item['file']} is neither .png, .svg nor .jpg")
    return f'<img src="data:{kind};base64,{content}" alt="{html.escape(item["title"])}">'


KINDS = {"images": images_item, "chart": chart_item, "picture": picture_item, "table": lambda item, _: table(item)}


# The page

class Page:
    """Gathers the HTML of the sections, the entries of the contents and the numbers of figures and tables."""

    def __init__(self, folder):
        self.pixels = Pixels(folder)
        self.ids = {"content", "contents-title"}
        self.counts = {"Figure": 0, "Table": 0}

    def claim(self, name):
        need(re.fullmatch(r"[A-Za-z0-9][\w.-]*", name), f"'{name}' can't be an id: letters, digits and .-_ can")
        need(name not in self.ids, f"the id '{name}' is taken")
        self.ids.add(name)

    def item(self, item):
        """(HTML, entry of the contents)"""
        kind = item["kind"]
        need(kind in KINDS, f"'{kind}' is none of the kinds {', '.join(KINDS)}")
        self.claim(item["id"])
        self.counts[NAMES[kind]] += 1
        number = f"{NAMES[kind]} {self.counts[NAMES[kind]]}"
        title = html.escape(item["title"])
        head = element("h3", element("span", number, class_="count") + " " + title, id=item["id"] + ":title")
        caption = element("figcaption", head + paragraphs(item.get("text")))
        shown = element("figure", caption + KINDS[kind](item, self.pixels), class_="item " + kind, id=item["id"],
                        aria_labelledby=item["id"] + ":title")
        return shown, element("li", element("a", f"{number} {title}", href="#" + item["id"]))

    def section(self, section):
        self.claim(section["id"])
        shown, entries = [], []
        for item in section["items"]:
            try:
                figure, entry = self.item(item)
            except (ValueError, KeyError, TypeError, OSError) as error:
                fault = f"lacks {error}" if isinstance(error, KeyError) else error
                raise ValueError(f"item '{item.get('id', '?')}' of section '{section['id']}': {fault}") from error
            shown.append(figure)
            entries.append(entry)
        title = html.escape(section["title"])
        heading = element("h2", title, id=section["id"] + ":title")
        body = element("section", heading + paragraphs(section.get("text")) + "\n".join(shown), id=section["id"],
                       aria_labelledby=section["id"] + ":title")
        link = element("a", title, href="#" + section["id"])
        return body, element("li", link + (element("ul", "".join(entries)) if entries else ""))


def digest(text):
    return "sha256-" + base64.b64encode(hashlib.sha256(text.encode("utf-8")).digest()).decode("ascii")


def write_report(out_folder, destination=None):
    """Writes the page for out_folder/report.json to destination (out_folder/report.html when None); returns its path.
    Throws ValueError, which names the item, when report.json asks for what can't be shown."""
    with open(os.path.join(out_folder, "report.json"), encoding="utf-8") as file:
        report = json.load(file)
    page = Page(out_folder)
    bodies, entries = zip(*(page.section(section) for section in report["sections"]))
    script = "\n".join(source(name) for name in SCRIPTS)
    style = source("report.css")
    written = string.Template(source("report_template.html")).substitute(
        title=html.escape(report["title"]), subtitle=html.escape(report.get("subtitle") or ""),
        contents=element("ol", "".join(entries)), sections="\n".join(bodies), pixels=page.pixels.scripts(),
        style=style, script=script, style_digest=digest(style), script_digest=digest(script))
    destination = destination or os.path.join(out_folder, "report.html")
    with open(destination, "w", encoding="utf-8", newline="\n") as file:
        file.write(written)
    return destination


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("out", help="the folder with report.json")
    parser.add_argument("destination", nargs="?", help="the page; OUT/report.html when not given")
    args = parser.parse_args()
    try:
        destination = write_report(args.out, args.destination)
    except (ValueError, OSError) as error:
        sys.exit(f"report: {error}")
    print(f"{destination}: {os.path.getsize(destination) / 1e6:.1f} MB")


if __name__ == "__main__":
    main()
