#!/usr/bin/python3
"""Measures renders in slices (--slice) beside renders by one process, in CPU seconds.

For each scene and integrator: the seconds of all slices over those of one process; the part of it that each slice needs
before its first pixel (loading, and the pilot of adaptive-cache); rays and shades of all slices over those of one process;
the slowest slice over the mean; the seconds of `strobe merge` over those of one process; and the bytes of the parts. The
merged image must equal that of one process to the bit.
"""
import argparse
import json
import os
import resource
import subprocess
import sys
import tempfile

ROOT = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))
sys.path.insert(0, os.path.join(ROOT, "test", "cli"))
sys.dont_write_bytecode = True
from exr import Exr  # noqa: E402


def seconds(command, runs=1):
    """Runs a command. Returns its CPU seconds, the least of some runs."""
    least = float("inf")
    for _ in range(runs):
        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        subprocess.run(command, check=True)
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
        least = min(least, after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime)
    return least


def work(stats):
    """Returns the rays and the shades in a file of --stats."""
    with open(stats, encoding="utf-8") as file:
        content = json.load(file)
    return content["rays"]["total"], content["shades"]


def pixels(file):
    """Returns the pixels of an EXR."""
    return Exr(file).pixels()


def measure(strobe, scene, options, slices, folder):
    """Returns the figures of a scene in slices, as a line."""
    base = [strobe, scene, *options, "-q", "-t", "1"]
    one, whole, merged = (os.path.join(folder, name) for name in ("one.exr", "whole", "merged.exr"))
    load = seconds([*base, "--crop", "0", ".001", "0", ".001", "-o", whole + ".part"], runs=3)
    parts = [os.path.join(folder, "%d.part" % i) for i in range(1, slices + 1)]
    stats = [part + ".json" for part in parts]

    def render(i):
        return seconds([*base, "--slice", "%d/%d" % (i + 1, slices), "-o", parts[i], "--stats", stats[i]])

    each = list(map(render, range(slices // 2)))
    alone = seconds([*base, "-o", one, "--stats", whole])  # in the middle, since the speed of machines drifts
    each += map(render, range(slices // 2, slices))
    merge = seconds([strobe, "merge", "-q", *parts, "-o", merged])
    assert pixels(one) == pixels(merged), "the bits differ"
    mean, size = sum(each) / slices, sum(map(os.path.getsize, parts)) / 1e6
    rays, shades = (sum(counts) / of_one for counts, of_one in zip(zip(*map(work, stats)), work(whole)))
    return "%.1f | %.3f | %.3f | %.3f | %.3f | %.3f | %.3f | %.4f | %.1f" % (
        alone, sum(each) / alone, slices * load / alone, rays, shades, max(each) / mean, (max(each) - load) / (mean - load),
        merge / alone, size)


def main():
    """Prints a line per scene and integrator."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--strobe", default=os.path.join(ROOT, "build", "release", "strobe"))
    parser.add_argument("--slices", type=int, default=16)
    parser.add_argument("--integrator", action="append", default=[], help="name, and its options after spaces")
    parser.add_argument("scenes", nargs="+", metavar="SCENE[:OPTIONS]", help="a scene, and options separated by spaces")
    args = parser.parse_args()
    print("scene | integrator | CPU seconds | slices / one | of it before pixels | rays | shades | slowest / mean | of pixels alone | merge / one | MB of parts")
    for entry in args.scenes:
        scene, _, options = entry.partition(":")
        for integrator in args.integrator or ["supersample"]:
            words = ["--integrator", *integrator.split(), *options.split()]
            with tempfile.TemporaryDirectory(dir="/tmp") as folder:
                figures = measure(args.strobe, scene, words, args.slices, folder)
            print(os.path.basename(scene), integrator, figures, sep=" | ", flush=True)


if __name__ == "__main__":
    main()
