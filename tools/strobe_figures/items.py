"""Items of the report: dictionaries whose members report.py documents."""


def columns(*names, text=1):
    """Returns the columns of a table. The first `text` columns hold text, the others numbers with three digits."""
    return [{"name": name, "type": "text"} if i < text else {"name": name, "type": "number", "digits": 3}
            for i, name in enumerate(names)]


def table(name, title, head, rows, text="", number=None):
    """Returns a table. `number` replaces the running number, for figures of the paper."""
    return {"kind": "table", "id": name, "number": number, "title": title, "text": text, "columns": head, "rows": rows}


def paragraph(text):
    """Returns text at the beginning of a section. command.py adds it to the text of the section."""
    return {"kind": "paragraph", "text": text}


def picture(name, title, text, file, number=None):
    """Returns an embedded image file; `file` is a path relative to the output folder."""
    return {"kind": "picture", "id": name, "number": number, "title": title, "text": text, "file": file}


def images(name, title, text, pictures, reference=None, crops=(), number=None):
    """Returns a comparison of images; `reference` is the index of the reference image."""
    return {"kind": "images", "id": name, "number": number, "title": title, "text": text, "images": pictures,
            "reference": reference, "crops": list(crops)}


def chart(name, title, text, axes, series, marks=(), number=None):
    """Returns a chart. `axes`: {"xlabel", "ylabel", "xlog", "ylog"}."""
    return {"kind": "chart", "id": name, "number": number, "title": title, "text": text, **axes, "series": series,
            "marks": list(marks)}
