#!/usr/bin/python3
"""A fake strobe for the tests of tools/figures. Writes a random image and statistics, and appends its arguments to the file
$FAKE_CALLS. Call number $FAKE_FAILS_AT fails; call number $FAKE_KILLS_AT kills the calling script."""
import json
import os
import signal
import sys

import numpy
import OpenImageIO


def option(name, default=""):
    """Returns the value of a command line option."""
    return sys.argv[sys.argv.index(name) + 1] if name in sys.argv else default


def count_call():
    """Logs this call. Returns the number of calls so far, as text."""
    with open(os.environ["FAKE_CALLS"], "a+") as file:
        file.write(" ".join(sys.argv[1:]) + "\n")
        file.seek(0)
        return str(len(file.readlines()))


def main():
    if "--version" in sys.argv:
        print("fake strobe")
        return 0
    call = count_call()
    if call == os.environ.get("FAKE_FAILS_AT"):
        print("fake.scene:3:7: no such shape: 'sphree'", file=sys.stderr)
        return 2
    if call == os.environ.get("FAKE_KILLS_AT"):
        os.kill(os.getppid(), signal.SIGKILL)
        return 1
    width, height = (int(n) for n in option("--resolution", "8x6").split("x"))
    pixels = numpy.random.default_rng(int(option("--seed"))).random((height, width, 3), dtype=numpy.float32)
    image = OpenImageIO.ImageBuf(OpenImageIO.ImageSpec(width, height, 3, "float"))
    image.set_pixels(OpenImageIO.ROI(), pixels)
    image.write(option("-o"))
    with open(option("--stats"), "w") as file:
        json.dump({"seconds": {"render": 0.5}, "shadesPerPixel": 2.0}, file)
    return 0


sys.exit(main())
