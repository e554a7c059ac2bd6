"""Noise and wall seconds of Cycles and strobe in Blender, from the call of the render operator to its end.

    blender -b --python timing_main.py -- FOLDER WIDTH HEIGHT REFERENCE SAMPLES SCENE...

SAMPLES: sample counts, separated by commas. REFERENCE: those of an image by supersample, for the error of strobe. The noise
is the standard deviation of a pixel, from two images with different seeds, divided by the mean of the image. It does not
include bias; the error against the reference does.
"""
import os
import sys
import time

sys.path.insert(0, os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
sys.dont_write_bytecode = True
import bpy  # noqa: E402
import numpy as np  # noqa: E402

from strobe_blender import blender_main, scenes  # noqa: E402
from strobe_gltf import kit  # noqa: E402


def picture(path, seed):
    """Renders with a seed. Returns (pixels, seconds)."""
    scene = bpy.context.scene
    scene.cycles.seed = scene.strobe.seed = seed
    scene.render.filepath = path
    start = time.perf_counter()
    bpy.ops.render.render(write_still=True)
    seconds = time.perf_counter() - start
    image = bpy.data.images.load(path)
    pixels = np.array(image.pixels[:])
    bpy.data.images.remove(image)
    return pixels, seconds


def measure(name, engine, integrator, samples, folder, reference=None):
    """Prints one row of the table."""
    scene = bpy.context.scene
    scene.render.engine, scene.cycles.samples, scene.strobe.samples = engine, samples, samples
    scene.strobe.integrator = integrator
    (a, first), (b, second) = (picture(os.path.join(folder, f"{name}{seed}.exr"), seed) for seed in (1, 2))
    noise = np.sqrt(((a - b) ** 2).mean() / 2) / a.mean()
    who = engine if engine == "CYCLES" else f"strobe {integrator}"
    error = "" if reference is None else f"{100 * np.sqrt(((a - reference) ** 2).mean()) / a.mean():.2f} %"
    print(f"ROW | {name} | {who} | {samples} | {100 * noise:.2f} % | {error} | {min(first, second):.2f} |", flush=True)


def main(folder, width, height, reference, samples, *names):
    """Measures the scenes."""
    for name in names:
        kit.reset((int(width), int(height)))
        blender_main.settings(getattr(scenes, name)(), 1)
        scene = bpy.context.scene
        scene.render.engine, scene.strobe.samples = "STROBE", int(reference)
        long, _ = picture(os.path.join(folder, f"{name}-reference.exr"), 9)
        for count in map(int, samples.split(",")):
            measure(name, "CYCLES", "supersample", count, folder)
            for integrator in ("supersample", "adaptive-cache"):
                measure(name, "STROBE", integrator, count, folder, long)


main(*sys.argv[sys.argv.index("--") + 1:])
