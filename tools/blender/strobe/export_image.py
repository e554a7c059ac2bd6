"""Image files of textures. Files on disk are used as they are; packed, generated and split images are written once."""
import hashlib
import os

import bpy
import numpy as np

from . import exr

READABLE = {".png", ".jpg", ".jpeg", ".exr", ".hdr", ".tif", ".tiff", ".tga", ".bmp"}
CHANNELS = {"Red": 0, "Green": 1, "Blue": 2, "Alpha": 3}


def is_color(image):
    """Returns whether the values of an image of bytes are encoded as sRGB."""
    return image.colorspace_settings.name not in ("Non-Color", "Raw", "Linear", "Generic Data")


def image_file(image, folder, channel=None):
    """Returns (path, encoding) of an image, or None if it has no pixels. `channel`: one of CHANNELS, or None for RGB."""
    path = bpy.path.abspath(image.filepath, library=image.library)
    if image.source == "FILE" and not image.packed_file and not image.is_dirty and channel is None:
        if os.path.splitext(path)[1].lower() in READABLE and os.path.isfile(path):
            return path, "sRGB" if is_color(image) else "linear"
    if not image.has_data and not image.packed_file and image.source == "FILE" and not os.path.isfile(path):
        return None
    if not image.size[0] or not image.size[1]:
        return None
    return _written(image, folder, channel), "linear"


def _written(image, folder, channel):
    """Writes linear values of an image to an EXR file named by its content. Returns its path."""
    pixels = np.empty(image.size[0] * image.size[1] * image.channels, np.float32)
    image.pixels.foreach_get(pixels)
    digest = hashlib.blake2b(pixels, digest_size=12)
    digest.update(f"{channel} {is_color(image)} {image.size[0]}".encode())
    path = os.path.join(folder, digest.hexdigest() + ".exr")
    if os.path.exists(path):
        return path
    rows = pixels.reshape(image.size[1], image.size[0], image.channels)[::-1]
    color, alpha = rows[..., :3], rows[..., 3] if image.channels == 4 else np.ones(rows.shape[:2], np.float32)
    if color.shape[2] < 3:
        color = np.repeat(rows[..., :1], 3, 2)
    if is_color(image) and not image.is_float:
        color = np.where(color <= 0.04045, color / 12.92, ((color + 0.055) / 1.055) ** 2.4).astype(np.float32)
    if channel:
        plane = alpha if channel == "Alpha" else color[..., CHANNELS[channel]]
        color = np.repeat(plane[..., None], 3, 2)
    exr.write(path, {"R": color[..., 0], "G": color[..., 1], "B": color[..., 2]})
    return path
