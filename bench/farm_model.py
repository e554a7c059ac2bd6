#!/usr/bin/python3
"""Prints how long a frame takes on many nodes, from costs that bench/farm.py, bench/farm_slurm.py and `strobe merge` have shown.

    seconds = start of the first task + starts of the others + loading + pixels of the slowest slice + reading and merging parts
"""
import argparse

FIRST_TASK, NEXT_TASK = 2.4, .008  # seconds until Slurm's first task, and between starts
SLOWEST = 1.1  # slice over the mean
PROCESSORS = 8  # of a node
PER_PART = .0005  # seconds of a merge for each file
NETWORK = 100e6  # bytes per second, to read parts
FRAMES = {  # CPU seconds of 1920x1080 pixels with 1024 samples, seconds to load, CPU seconds to merge, bytes of all parts
    "moving-pair, supersample": (675, .03, 1.8, 39e6),
    "room, supersample": (5400, .5, 1.8, 39e6),
    "room, adaptive-cache": (5400, .9, 10, 440e6),
    "room, supersample, five layers": (5400, .5, 3.5, 90e6),
}


def seconds(frame, nodes, tree=False):
    """Returns the seconds to the image, and those of each step by name. `tree`: merges of parts run at once on many nodes."""
    work, load, merge, size = FRAMES[frame]
    per_merge = nodes ** .5 if tree else nodes
    steps = {
        "pixels": SLOWEST * work / PROCESSORS / nodes,
        "loading": load,
        "Slurm": FIRST_TASK + NEXT_TASK * nodes,
        "merge": merge * (2 if tree else 1) + PER_PART * per_merge * (2 if tree else 1),
        "reading parts": size / NETWORK * (1.1 if tree else 1),
    }
    return sum(steps.values()), steps


def main():
    """Prints a table of Markdown."""
    argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter).parse_args()
    counts = (1, 10, 100, 1000, 10000)
    print("| frame | " + " | ".join("%d node%s" % (n, "s" if n > 1 else "") for n in counts) + " |")
    print("|---" * (len(counts) + 1) + "|")
    for frame in FRAMES:
        cells = []
        for n in counts:
            total, steps = seconds(frame, n)
            most = max(steps, key=steps.get)
            cells.append("%.3g s (%s)" % (total, most))
        print("| %s | %s |" % (frame, " | ".join(cells)))


if __name__ == "__main__":
    main()
