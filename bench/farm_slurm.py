#!/usr/bin/python3
"""Measures what Slurm and tools/farm add to a render, with a cluster of this machine (test/tools/slurm_cluster.py).

For 16, 64 and 256 slices of a small image: the seconds of the submission, the wall seconds from there to the image, the
seconds between the starts of tasks, and from the last slice to the start of the merge.
"""
import argparse
import glob
import json
import os
import subprocess
import sys
import tempfile
import time

ROOT = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))
sys.dont_write_bytecode = True
sys.path.insert(0, os.path.join(ROOT, "test", "tools"))
from slurm_cluster import SlurmCluster, missing_programs  # noqa: E402

SCENE = """Film "image" "integer xresolution" 160 "integer yresolution" 120
Sampler "sobol" "integer pixelsamples" 1
WorldBegin
LightSource "infinite"
Translate 0 0 4
Shape "sphere"
"""


def measure(cluster, strobe, tasks):
    """Returns the figures of a render of so many slices."""
    with tempfile.TemporaryDirectory(prefix="strobe-farm-", dir="/tmp") as folder:
        with open(os.path.join(folder, "s.scene"), "w", encoding="utf-8") as file:
            file.write(SCENE)
        begin = time.time()
        subprocess.run([os.path.join(ROOT, "tools", "farm"), "slurm", "s.scene", "-o", "s.exr", "--tasks", str(tasks), "--strobe", strobe],
                       cwd=folder, env=cluster.environment, check=True, stdout=subprocess.DEVNULL)
        submitted = time.time()
        begins, ends, merge = {}, {}, None
        while not os.path.exists(os.path.join(folder, "s.exr")) or os.path.isdir(os.path.join(folder, "s.exr.farm")):
            for file in glob.glob(os.path.join(folder, "s.exr.farm/state/*.json")):
                try:
                    with open(file, encoding="utf-8") as text:
                        state = json.load(text)
                except (OSError, ValueError):
                    continue
                name = os.path.basename(file)
                if name == "still.json":
                    merge = state["begin"]
                    continue
                begins[name] = state["begin"]
                ends[name] = state.get("end", state["begin"])
            time.sleep(.02)
        done = time.time()
    starts = sorted(begins.values())
    return (submitted - begin, done - submitted, (starts[-1] - starts[0]) / (len(starts) - 1), (merge or done) - max(ends.values()))


def main():
    """Prints a line per number of slices."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--strobe", default=os.path.join(ROOT, "build", "release", "strobe"))
    args = parser.parse_args()
    if missing_programs():
        sys.exit("Slurm is missing: " + ", ".join(missing_programs()))
    print("slices | submission, s | to the image, s | between starts of tasks, s | last slice to merge, s")
    with SlurmCluster(processors=2) as cluster:
        for tasks in (16, 64, 256):
            print(tasks, *("%.3f" % value for value in measure(cluster, os.path.abspath(args.strobe), tasks)), sep=" | ", flush=True)


if __name__ == "__main__":
    main()
