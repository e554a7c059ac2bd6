"""The least of an OpenEXR reader: one part, scan lines, 32-bit floats, uncompressed or zip."""
import struct
import zlib


def _string(data, at):
    end = data.index(b"\0", at)
    return data[at:end].decode(), end + 1


def _unpack(block, size):
    if len(block) == size:  # what does not shrink is stored as it is
        return block
    delta = bytearray(zlib.decompress(block))
    for i in range(1, len(delta)):
        delta[i] = (delta[i - 1] + delta[i] - 128) & 255
    half = (len(delta) + 1) // 2
    out = bytearray(len(delta))
    out[0::2], out[1::2] = delta[:half], delta[half:]
    return bytes(out)


class Exr:
    """attributes: by name, decoded where the type is int, float or string. window: x0, y0, x1, y1, inclusive."""

    def __init__(self, path):
        with open(path, "rb") as file:
            data = file.read()
        assert data[:4] == b"\x76\x2f\x31\x01", "not an EXR file"
        assert struct.unpack_from("<I", data, 4)[0] & 0x1A00 == 0, "tiles, deep data or several parts"
        self.attributes, at = {}, 8
        while data[at]:
            name, at = _string(data, at)
            kind, at = _string(data, at)
            size, = struct.unpack_from("<i", data, at)
            raw = data[at + 4 : at + 4 + size]
            at += 4 + size
            decode = {"int": "<i", "float": "<f"}.get(kind)
            self.attributes[name] = struct.unpack(decode, raw)[0] if decode else raw.decode() if kind == "string" else raw
        self.window = struct.unpack("<4i", self.attributes["dataWindow"])
        self.display = struct.unpack("<4i", self.attributes["displayWindow"])
        self._read_channels()
        self._read_rows(data, at + 1)

    def _read_channels(self):
        raw, at, self.channels = self.attributes["channels"], 0, []
        while raw[at]:
            name, at = _string(raw, at)
            assert struct.unpack_from("<i", raw, at)[0] == 2, "not 32-bit floats"
            at += 16
            self.channels.append(name)

    def _read_rows(self, data, at):
        lines = {0: 1, 2: 1, 3: 16}[self.attributes["compression"][0]]
        x0, y0, x1, y1 = self.window
        self.width, self.height = x1 - x0 + 1, y1 - y0 + 1
        row_bytes = 4 * self.width * len(self.channels)
        self.rows = {}
        for k in range(-(-self.height // lines)):
            offset, = struct.unpack_from("<Q", data, at + 8 * k)
            y, size = struct.unpack_from("<ii", data, offset)
            count = min(lines, y1 + 1 - y)
            block = _unpack(data[offset + 8 : offset + 8 + size], row_bytes * count)
            for i in range(count):
                self.rows[y + i] = block[i * row_bytes : (i + 1) * row_bytes]

    def value(self, channel, x, y):
        """At frame coordinates."""
        at = 4 * (self.width * self.channels.index(channel) + x - self.window[0])
        return struct.unpack_from("<f", self.rows[y], at)[0]

    def pixel(self, x, y):
        """The values of R, G and B at frame coordinates."""
        return tuple(self.value(c, x, y) for c in "RGB")

    def pixels(self):
        x0, y0, x1, y1 = self.window
        return {(x, y): self.pixel(x, y) for y in range(y0, y1 + 1) for x in range(x0, x1 + 1)}
