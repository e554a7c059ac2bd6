"""Holds one picture against another, and shows both."""
import numpy as np
import OpenImageIO as oiio
from PIL import Image, ImageDraw

BLOCK = 10
GAIN = 10  # of the difference that is shown: black and white are 5 % of the mean off


def load(path):
    buf = oiio.ImageBuf(path)
    if buf.has_error:
        raise RuntimeError(f"{path}: {buf.geterror()}")
    return buf.get_pixels(oiio.FLOAT)[:, :, :3].astype(np.float64)


def blocks(image, size=BLOCK):
    h, w = (n // size * size for n in image.shape[:2])
    return image[:h, :w].reshape(h // size, size, w // size, size, 3).mean((1, 3))


def differences(image, reference):
    """By block and channel: (mean of the block − that of the reference) / mean of the reference over picture and
    channels."""
    return (blocks(image) - blocks(reference)) / reference.mean()


def figures(image, reference):
    """max and root mean square of the differences, and the ratio of the pictures' means less 1."""
    d = differences(image, reference)
    return float(np.abs(d).max()), float(np.sqrt((d ** 2).mean())), float(image.mean() / reference.mean() - 1)


def encoded(image, exposure=1.0):
    x = np.clip(image * exposure, 0, 1)
    return (np.where(x <= 0.0031308, 12.92 * x, 1.055 * x ** (1 / 2.4) - 0.055) * 255 + 0.5).astype(np.uint8)


def difference_picture(image, reference):
    d = differences(image, reference)
    gray = np.clip(0.5 + GAIN * d, 0, 1).repeat(BLOCK, 0).repeat(BLOCK, 1)
    out = np.full(image.shape, 0.5)
    out[:gray.shape[0], :gray.shape[1]] = gray
    return (out * 255).astype(np.uint8)


def row(image, reference, title):
    """Reference, image and their blocks' difference side by side, under a line of text."""
    exposure = 0.9 / max(np.percentile(reference, 98), 1e-9)
    parts = [encoded(reference, exposure), encoded(image, exposure), difference_picture(image, reference)]
    body = np.concatenate(parts, 1)
    sheet = Image.new("RGB", (body.shape[1], body.shape[0] + 14), "white")
    sheet.paste(Image.fromarray(body), (0, 14))
    ImageDraw.Draw(sheet).text((3, 1), title, fill="black")
    return sheet


def stacked(rows, columns=1):
    width, height = max(r.width for r in rows), max(r.height for r in rows)
    lines = -(-len(rows) // columns)
    sheet = Image.new("RGB", (width * columns, height * lines), "white")
    for i, r in enumerate(rows):
        sheet.paste(r, (i % columns * width, i // columns * height))
    return sheet
