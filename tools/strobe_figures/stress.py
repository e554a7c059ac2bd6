#!/usr/bin/python3
"""Measures how integrators err as the number of a stress scene is turned: a table for docs/stress.md.

Usage: stress.py STROBE SCENE… [--samples N] [--seeds N] [--values V…]     (for /usr/bin/python3: numpy, OpenImageIO)

Every value is rendered with several seeds. Errors are root mean squares over pixels and channels, of radiance cut at 1,
against supersample with 8 times the samples; what the truth itself errs by is taken off.
    rmse    of one picture
    bias    of the mean of the seeds' pictures, beyond what their scatter explains
    shades  per pixel
"""

import argparse
import json
import os
import subprocess
import sys
import tempfile

import numpy
import OpenImageIO as oiio

sys.dont_write_bytecode = True
from sweeps import read_sweep, scene_with  # noqa: E402

METHODS = {
    "supersample": ("supersample",),
    "msaa": ("msaa",),
    "msaa-cache": ("msaa-cache",),
    "blocks of 4": ("msaa-cache", "blocksize=4"),
    "4 time bins": ("msaa-cache", "timebins=4"),
}


def pixels(path):
    file = oiio.ImageInput.open(path)  # not an ImageBuf: those are cached by name
    image = numpy.asarray(file.read_image(oiio.FLOAT), dtype=float)[..., :3]
    file.close()
    return image


def render(strobe, text, method, samples, seed):
    """The picture, and its shades per pixel."""
    with tempfile.TemporaryDirectory(prefix="strobe-stress-") as folder:
        scene, out, stats = (os.path.join(folder, name) for name in ("s.scene", "s.exr", "s.json"))
        with open(scene, "w", encoding="utf-8") as file:
            file.write(text)
        integrator, *defines = METHODS[method]
        subprocess.run([strobe, scene, "--integrator", integrator, *(a for d in defines for a in ("-D", d)), "--spp",
                        str(samples), "--seed", str(seed), "--threads", "1", "--quiet", "-o", out, "--stats", stats],
                       check=True)
        with open(stats, encoding="utf-8") as file:
            return pixels(out), json.load(file)["shadesPerPixel"]


def several(strobe, text, method, samples, seeds):
    """The pictures of some seeds, and the mean of their shades per pixel."""
    pictures, shades = zip(*(render(strobe, text, method, samples, seed) for seed in seeds))
    return numpy.array(pictures), numpy.mean(shades)


def cut(image):
    return numpy.clip(image, 0, 1)


def noise2(pictures):
    """The mean squared error of the mean of the pictures that their scatter explains."""
    return cut(pictures).var(axis=0, ddof=1).mean() / len(pictures)


def errors(pictures, truth):
    """rmse and bias."""
    right, wrong2 = cut(truth.mean(axis=0)), noise2(truth)
    rmse2 = ((cut(pictures) - right) ** 2).mean() - wrong2
    bias2 = ((cut(pictures.mean(axis=0)) - right) ** 2).mean() - wrong2 - noise2(pictures)
    return max(rmse2, 0) ** 0.5, max(bias2, 0) ** 0.5


def measure(options, scene):
    sweep = read_sweep(scene)
    name = os.path.splitext(os.path.basename(scene))[0]
    print(f"\n### {name}\n| {sweep.name}{f' ({sweep.unit})' if sweep.unit else ''} | " +
          " | ".join(f"{m}: rmse | bias | shades" for m in METHODS) + " |")
    print("|---" * (1 + 3 * len(METHODS)) + "|")
    for value in options.values or sweep.values:
        text, cells = scene_with(scene, value), []
        truth, _ = several(options.strobe, text, "supersample", 8 * options.samples, range(100, 100 + options.seeds))
        for method in METHODS:
            pictures, shades = several(options.strobe, text, method, options.samples, range(options.seeds))
            cells.append("{:.4f} | {:.4f} | {:.2f}".format(*errors(pictures, truth), shades))
        print(f"| {value:g} | " + " | ".join(cells) + " |", flush=True)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("strobe")
    parser.add_argument("scenes", nargs="+")
    parser.add_argument("--samples", type=int, default=16, help="samples per pixel")
    parser.add_argument("--seeds", type=int, default=4)
    parser.add_argument("--values", type=float, nargs="*", help="instead of the scene's own")
    options = parser.parse_args()
    for scene in options.scenes:
        measure(options, scene)


if __name__ == "__main__":
    main()
