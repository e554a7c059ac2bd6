"""A reader of OpenEXR files with one part, scan lines and 32-bit floats, uncompressed or compressed by zip."""
import struct
import zlib


def _string(data, offset):
    """Returns a zero-terminated string and the offset after it."""
    end = data.index(b"\0", offset)
    return data[offset:end].decode(), end + 1


def _unpack(block, size):
    if len(block) == size:  # data that would not shrink are stored uncompressed
        return block
    delta = bytearray(zlib.decompress(block))
    for i in range(1, len(delta)):
        delta[i] = (delta[i - 1] + delta[i] - 128) & 255
    half = (len(delta) + 1) // 2
    out = bytearray(len(delta))
    out[0::2], out[1::2] = delta[:half], delta[half:]
    return bytes(out)


class Exr:
    """An image.

    attributes: by name; int, float and string are decoded, other types are bytes.
    window, display: data and display window as x0, y0, x1, y1, inclusive. rows: bytes by y."""

    def __init__(self, path):
        with open(path, "rb") as file:
            data = file.read()
        assert data[:4] == b"\x76\x2f\x31\x01", "not an EXR file"
        assert struct.unpack_from("<I", data, 4)[0] & 0x1A00 == 0, "tiles, deep data or several parts"
        self.attributes, offset = {}, 8
        while data[offset]:
            name, offset = _string(data, offset)
            kind, offset = _string(data, offset)
            size, = struct.unpack_from("<i", data, offset)
            raw = data[offset + 4 : offset + 4 + size]
            offset += 4 + size
            decode = {"int": "<i", "float": "<f"}.get(kind)
            self.attributes[name] = struct.unpack(decode, raw)[0] if decode else raw.decode() if kind == "string" else raw
        self.window = struct.unpack("<4i", self.attributes["dataWindow"])
        self.display = struct.unpack("<4i", self.attributes["displayWindow"])
        self._read_channels()
        self._read_rows(data, offset + 1)

    def _read_channels(self):
        raw, offset, self.channels = self.attributes["channels"], 0, []
        while raw[offset]:
            name, offset = _string(raw, offset)
            assert struct.unpack_from("<i", raw, offset)[0] == 2, "not 32-bit floats"
            offset += 16
            self.channels.append(name)

    def _read_rows(self, data, table):
        """`table`: position of the table of offsets of the chunks."""
        lines = {0: 1, 2: 1, 3: 16}[self.attributes["compression"][0]]
        x0, y0, x1, y1 = self.window
        self.width, self.height = x1 - x0 + 1, y1 - y0 + 1
        row_bytes = 4 * self.width * len(self.channels)
        self.rows = {}
        for k in range(-(-self.height // lines)):
            offset, = struct.unpack_from("<Q", data, table + 8 * k)
            y, size = struct.unpack_from("<ii", data, offset)
            count = min(lines, y1 + 1 - y)
            block = _unpack(data[offset + 8 : offset + 8 + size], row_bytes * count)
            for i in range(count):
                self.rows[y + i] = block[i * row_bytes : (i + 1) * row_bytes]

    def value(self, channel, x, y):
        """Returns the value of a channel at frame coordinates."""
        offset = 4 * (self.width * self.channels.index(channel) + x - self.window[0])
        return struct.unpack_from("<f", self.rows[y], offset)[0]

    def pixel(self, x, y):
        """Returns R, G and B at frame coordinates."""
        return tuple(self.value(c, x, y) for c in "RGB")

    def pixels(self):
        """Returns R, G and B of all pixels by frame coordinates, row by row."""
        x0, y0, x1, y1 = self.window
        return {(x, y): self.pixel(x, y) for y in range(y0, y1 + 1) for x in range(x0, x1 + 1)}
