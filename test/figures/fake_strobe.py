#!/usr/bin/python3
"""Stands in for strobe where tools/figures is tested: writes a small picture and statistics, and counts its calls in the
file FAKE_CALLS. At call FAKE_FAILS_AT it refuses; at call FAKE_KILLS_AT it kills the script that called it."""
import json
import os
import signal
import sys

import numpy
import OpenImageIO


def option(name, default=""):
    return sys.argv[sys.argv.index(name) + 1] if name in sys.argv else default


def count_call():
    with open(os.environ["FAKE_CALLS"], "a+") as file:
        file.write(" ".join(sys.argv[1:]) + "\n")
        file.seek(0)
        return str(len(file.readlines()))


def main():
    if "--version" in sys.argv:
        print("strobe of straw")
        return 0
    call = count_call()
    if call == os.environ.get("FAKE_FAILS_AT"):
        print("straw.scene:3:7: no such shape: 'sphree'", file=sys.stderr)
        return 2
    if call == os.environ.get("FAKE_KILLS_AT"):
        os.kill(os.getppid(), signal.SIGKILL)
        return 1
    width, height = (int(n) for n in option("--resolution", "8x6").split("x"))
    pixels = numpy.random.default_rng(int(option("--seed"))).random((height, width, 3), dtype=numpy.float32)
    picture = OpenImageIO.ImageBuf(OpenImageIO.ImageSpec(width, height, 3, "float"))
    picture.set_pixels(OpenImageIO.ROI(), pixels)
    picture.write(option("-o"))
    with open(option("--stats"), "w") as file:
        json.dump({"seconds": {"render": 0.5}, "shadesPerPixel": 2.0}, file)
    return 0


sys.exit(main())
