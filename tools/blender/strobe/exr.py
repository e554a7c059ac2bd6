"""Reads and writes uncompressed scanline EXR files of 32-bit floats."""
import struct

import numpy as np


def _text(data, at):
    """Returns a string that ends with a zero byte, and the position after it."""
    end = data.index(b"\0", at)
    return data[at:end].decode(), end + 1


def _header(data):
    """Returns {attribute: bytes} of a single-part file and the position after its header."""
    at, attributes = 8, {}
    while data[at]:
        name, at = _text(data, at)
        _, at = _text(data, at)
        size, = struct.unpack_from("<i", data, at)
        attributes[name] = data[at + 4:at + 4 + size]
        at += 4 + size
    return attributes, at + 1


def _channels(chlist):
    """Returns the names of the channels in the order of the file. Raises ValueError if one is not float."""
    at, names = 0, []
    while chlist[at]:
        name, at = _text(chlist, at)
        if struct.unpack_from("<i", chlist, at)[0] != 2:
            raise ValueError(f"channel {name} is not float")
        names.append(name)
        at += 16
    return names


def read(path):
    """Returns ({channel: array of rows from bottom to top}, {attribute: bytes}). Raises OSError and ValueError."""
    with open(path, "rb") as file:
        data = file.read()
    attributes, at = _header(data)
    if data[:4] != b"\x76\x2f\x31\x01" or attributes["compression"] != b"\0":
        raise ValueError(f"{path}: not an uncompressed EXR file")
    names = _channels(attributes["channels"])
    x0, y0, x1, y1 = struct.unpack("<4i", attributes["dataWindow"])
    width, height = x1 - x0 + 1, y1 - y0 + 1
    row = 2 + len(names) * width
    values = np.frombuffer(data, "<f4", height * row, at + 8 * height).reshape(height, row)
    pixels = values[:, 2:].reshape(height, len(names), width)[::-1]
    return {name: pixels[:, i] for i, name in enumerate(names)}, attributes


def write(path, channels):
    """Writes {channel: array of rows from top to bottom}."""
    names = sorted(channels)
    height, width = channels[names[0]].shape
    chlist = b"".join(n.encode() + b"\0" + struct.pack("<iiii", 2, 0, 1, 1) for n in names) + b"\0"
    window = struct.pack("<4i", 0, 0, width - 1, height - 1)
    header = b"\x76\x2f\x31\x01\x02\0\0\0"
    for name, kind, value in (("channels", "chlist", chlist), ("compression", "compression", b"\0"),
                              ("dataWindow", "box2i", window), ("displayWindow", "box2i", window),
                              ("lineOrder", "lineOrder", b"\0"), ("pixelAspectRatio", "float", struct.pack("<f", 1)),
                              ("screenWindowCenter", "v2f", bytes(8)), ("screenWindowWidth", "float", struct.pack("<f", 1))):
        header += name.encode() + b"\0" + kind.encode() + b"\0" + struct.pack("<i", len(value)) + value
    header += b"\0"
    size = 4 * len(names) * width
    rows = np.empty(height, [("y", "<i4"), ("size", "<i4"), ("values", "<f4", (len(names), width))])
    rows["y"], rows["size"] = np.arange(height), size
    rows["values"] = np.stack([channels[name] for name in names], 1)
    with open(path, "wb") as file:
        file.write(header)
        file.write((len(header) + 8 * height + (8 + size) * np.arange(height, dtype="<u8")).tobytes())
        file.write(rows.tobytes())
