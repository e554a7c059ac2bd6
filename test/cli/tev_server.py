"""A replacement of tev for tests: receives the messages CreateImage and UpdateImage. Implements the published protocol
independently of the code of strobe."""
import socket
import struct
import threading


class Reader:
    """Reads the fields of one message."""

    def __init__(self, data):
        self.data, self.offset = data, 0

    def number(self, kind):
        value, = struct.unpack_from("<" + kind, self.data, self.offset)
        self.offset += struct.calcsize(kind)
        return value

    def text(self):
        end = self.data.index(b"\0", self.offset)
        value = self.data[self.offset:end].decode()
        self.offset = end + 1
        return value


class Image:
    def __init__(self, width, height, channels):
        self.width, self.height, self.channels = width, height, channels
        self.planes = {c: [None] * (width * height) for c in channels}
        self.updates = 0

    def pixels(self):
        return list(zip(*(self.planes[c] for c in self.channels)))


class TevServer:
    """A server on an unused port, in a thread of its own.

    images: by name. errors: texts about invalid messages. `stop_after`: number of messages after which it stops reading;
    `die_after`: number of messages after which it closes the connection once."""

    def __init__(self, stop_after=None, die_after=None):
        self.images, self.errors, self.messages, self.connections = {}, [], 0, 0
        self.stop_after, self.die_after = stop_after, die_after
        self.ended = threading.Event()
        self.socket = socket.create_server(("127.0.0.1", 0))
        self.address = "127.0.0.1:%d" % self.socket.getsockname()[1]
        self.thread = threading.Thread(target=self.run, daemon=True)
        self.thread.start()

    def close(self):
        self.ended.set()
        self.socket.close()

    def run(self):
        while not self.ended.is_set():
            try:
                connection, _ = self.socket.accept()
            except OSError:
                return
            self.connections += 1
            with connection:
                self.serve(connection)

    def serve(self, connection):
        buffer = b""
        while True:
            if self.stop_after is not None and self.messages >= self.stop_after:
                self.ended.wait(60)
                return
            if self.die_after is not None and self.messages >= self.die_after:
                self.die_after = None
                return
            while len(buffer) < 4 or len(buffer) < struct.unpack_from("<I", buffer)[0]:
                try:
                    received = connection.recv(1 << 16)
                except OSError:
                    return
                if not received:
                    if buffer:
                        self.errors.append("%d bytes of an unfinished message" % len(buffer))
                    return
                buffer += received
            size, = struct.unpack_from("<I", buffer)
            try:
                self.handle(Reader(buffer[4:size]))
            except Exception as error:  # an invalid message
                self.errors.append(repr(error))
            buffer = buffer[size:]
            self.messages += 1

    def handle(self, message):
        kind, grab = message.number("b"), message.number("b")
        assert grab in (0, 1), grab
        name = message.text()
        if kind == 4:
            width, height, count = (message.number("i") for _ in range(3))
            self.images[name] = Image(width, height, [message.text() for _ in range(count)])
        elif kind == 6:
            self.update(self.images[name], message)
        else:
            raise AssertionError("type %d" % kind)
        assert message.offset == len(message.data), "%d bytes too many" % (len(message.data) - message.offset)

    @staticmethod
    def update(image, message):
        channels = [message.text() for _ in range(message.number("i"))]
        x, y, width, height = (message.number("i") for _ in range(4))
        assert 0 <= x and x + width <= image.width and 0 <= y and y + height <= image.height, (x, y, width, height)
        offsets = [message.number("q") for _ in channels]
        strides = [message.number("q") for _ in channels]
        n = width * height
        needed = max(o + (n - 1) * s + 1 for o, s in zip(offsets, strides))
        values = struct.unpack_from("<%df" % needed, message.data, message.offset)
        message.offset += 4 * needed
        for channel, offset, stride in zip(channels, offsets, strides):
            plane = image.planes[channel]
            for i in range(n):
                plane[(y + i // width) * image.width + x + i % width] = values[offset + i * stride]
        image.updates += 1
