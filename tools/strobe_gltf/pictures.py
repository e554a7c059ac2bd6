"""Differences of two images, and sheets that show them."""
import numpy as np
import OpenImageIO as oiio
from PIL import Image, ImageDraw

BLOCK = 10
GAIN = 10  # factor of displayed differences: black and white are -5 % and +5 % of the mean


def load(path):
    """Returns the RGB pixels of an image file. Raises RuntimeError."""
    buf = oiio.ImageBuf(path)
    if buf.has_error:
        raise RuntimeError(f"{path}: {buf.geterror()}")
    return buf.get_pixels(oiio.FLOAT)[:, :, :3].astype(np.float64)


def blocks(image, size=BLOCK):
    """Returns the means of blocks of pixels, by channel."""
    h, w = (n // size * size for n in image.shape[:2])
    return image[:h, :w].reshape(h // size, size, w // size, size, 3).mean((1, 3))


def differences(image, reference):
    """Returns the difference of the means of each block and channel, over the mean of the reference."""
    return (blocks(image) - blocks(reference)) / reference.mean()


def statistics(image, reference):
    """Returns the maximum and the root mean square of the differences, and the relative difference of the means."""
    d = differences(image, reference)
    return float(np.abs(d).max()), float(np.sqrt((d ** 2).mean())), float(image.mean() / reference.mean() - 1)


def encoded(image, exposure=1.0):
    """Returns an image as sRGB bytes."""
    x = np.clip(image * exposure, 0, 1)
    return (np.where(x <= 0.0031308, 12.92 * x, 1.055 * x ** (1 / 2.4) - 0.055) * 255 + 0.5).astype(np.uint8)


def difference_image(image, reference):
    """Returns 0.5 + GAIN * difference as bytes, by block."""
    d = differences(image, reference)
    gray = np.clip(0.5 + GAIN * d, 0, 1).repeat(BLOCK, 0).repeat(BLOCK, 1)
    out = np.full(image.shape, 0.5)
    out[:gray.shape[0], :gray.shape[1]] = gray
    return (out * 255).astype(np.uint8)


def row(image, reference, title):
    """Returns reference, image and their difference side by side, below a title."""
    exposure = 0.9 / max(np.percentile(reference, 98), 1e-9)
    columns = [encoded(reference, exposure), encoded(image, exposure), difference_image(image, reference)]
    body = np.concatenate(columns, 1)
    sheet = Image.new("RGB", (body.shape[1], body.shape[0] + 14), "white")
    sheet.paste(Image.fromarray(body), (0, 14))
    ImageDraw.Draw(sheet).text((3, 1), title, fill="black")
    return sheet


def stacked(rows, columns=1):
    """Returns a sheet of rows in one or more columns."""
    width = max(r.width for r in rows)
    height = max(r.height for r in rows)
    lines = -(-len(rows) // columns)
    sheet = Image.new("RGB", (width * columns, height * lines), "white")
    for i, r in enumerate(rows):
        sheet.paste(r, (i % columns * width, i // columns * height))
    return sheet
