"""Comparison with Blender Cycles on the Killeroo scenes with diffuse materials, each renderer against its own reference."""

import glob
import hashlib
import json
import os
import re
import shutil
import subprocess
import tempfile

import numpy

from . import curves, images, items
from .context import Reference, Skipped, mean_and_variance
from .items import columns
from .methods import ADAPTIVE_CACHE_1_LIGHT, BASELINES, CYCLES, MSAA_CACHE, MSAA_CACHE_1_BIN, MSAA_CACHE_HALF_BLOCKS, Method
from .pareto import Measured, chart, estimate, measure_curves

METHODS = (*BASELINES, MSAA_CACHE, MSAA_CACHE_1_BIN, MSAA_CACHE_HALF_BLOCKS,
           Method("indirect-cache, blocks of 2 px, 1 light sample", "indirect-cache", ("blocksize=2", "lightsamples=1"), 4),
           Method("indirect-cache, 1 light sample", "indirect-cache", ("lightsamples=1",), 4), ADAPTIVE_CACHE_1_LIGHT)
SCENES = (("killeroo-simple", False), ("anim-killeroos-moving", True))
NAMES = ["scene", "method", "spp", "seconds", "RMSE", "low", "high", "reference noise"]
COMPARED = ["scene", "method", "Cycles spp", "Cycles RMSE", "Cycles seconds", "seconds", "speed-up", "low", "high"]


class Picture:
    """An image and the seconds of its render."""

    def __init__(self, path, seconds):
        self.image = images.read(path)
        self.seconds = seconds


class Cycles:
    """Finished renders of peers/cycles_killeroo.py by Blender, keyed by script and settings."""

    def __init__(self, context):
        """Raises Skipped if Blender or the script is missing."""
        self.context = context
        self.blender = shutil.which("blender")
        self.script = os.path.join(context.scenes, "..", "peers", "cycles_killeroo.py")
        if not self.blender:
            raise Skipped("Blender is not installed")
        if not os.path.exists(self.script):
            raise Skipped("%s does not exist" % os.path.normpath(self.script))
        with open(self.script) as file:
            self.source = file.read()

    def picture(self, moving, spp, seed, size):
        """Returns a render of `size` pixels a side, with the seconds that Blender prints: of rendering, without starting
        Blender and reading the scene. Raises Skipped."""
        threads = self.context.threads or os.cpu_count()
        key = hashlib.sha256(json.dumps([self.source, moving, spp, seed, size, threads]).encode()).hexdigest()[:16]
        stem = os.path.join(self.context.runs.folder, "cycles-" + key)
        if not os.path.exists(stem + ".json"):
            seconds = self._render(stem, ["%d" % moving, "%d" % spp, stem + ".exr", "%d" % size, "%d" % threads], seed)
            with open(stem + ".part", "w") as file:
                json.dump({"seconds": seconds}, file)
            os.replace(stem + ".part", stem + ".json")
        with open(stem + ".json") as file:
            return Picture(stem + ".exr", json.load(file)["seconds"])

    def _render(self, stem, arguments, seed):
        """Returns the seconds of a render. The script has no option for the seed, so a line that sets it is inserted."""
        anchor = "c.use_denoising=False"
        if self.source.count(anchor) != 1:
            raise Skipped("%s has changed: it no longer contains '%s' once" % (self.script, anchor))
        text = "source = %r\n__file__ = %r\nexec(compile(source, __file__, 'exec'))\n" % (
            self.source.replace(anchor, anchor + "; c.seed=%d" % seed), os.path.abspath(self.script))
        with tempfile.NamedTemporaryFile("w", suffix=".py") as wrapper:
            wrapper.write(text)
            wrapper.flush()
            done = subprocess.run([self.blender, "-b", "-P", wrapper.name, "--"] + arguments, capture_output=True, text=True)
        match = re.search(r"^ Time: (?:(\d+):)?(\d+):(\d+\.\d+)", done.stdout, re.MULTILINE)
        written = glob.glob(stem + "*.exr")
        if done.returncode or not match or not written:
            raise Skipped("Blender failed: " + (done.stderr or done.stdout).strip()[-300:])
        return 3600 * int(match[1] or 0) + 60 * int(match[2]) + float(match[3])


def cycles_curve(context, cycles, moving, size):
    """Returns a list of Measured of Cycles by increasing samples, and the reference of Cycles."""
    stack = [cycles.picture(moving, context.pick(512, 1024), 1001 + i, size).image for i in range(context.pick(2, 4))]
    mean, variance, relative = mean_and_variance(numpy.stack(stack))
    mask = images.comparable_pixels(mean)
    reference = Reference(mean, float(variance[mask].mean()), float(relative[mask].mean()), mask)
    measured = []
    for spp in context.pick((16, 64), (1, 4, 16, 64, 256)):
        pictures = [cycles.picture(moving, spp, 1 + i, size) for i in range(context.pick(2, 4))]
        error, squares = estimate([p.image for p in pictures], reference, False)
        measured.append(Measured(CYCLES, spp, numpy.array([p.seconds for p in pictures]), squares, error, error, 0.0, 0.0))
    context.check_noise(reference, min(m.error["mean_square"] for m in measured))
    return measured, reference


def methods_of(context, moving):
    """Returns the methods that are compared: fewer with --quick, and without time bins for a static scene."""
    methods = context.pick((*BASELINES, METHODS[2], *METHODS[-2:]), METHODS)
    return [method for method in methods if moving or "timebins=1" not in method.defines]


def all_diffuse(subject):
    """Returns the text of a Killeroo scene with plastic replaced by matte, as in the Cycles scene."""
    with open(subject.path) as file:
        return file.read().replace('Material "plastic"', 'Material "matte"').replace(
            '"rgb Ks" [.5 .5 .5] "float roughness" .025', "").replace('"rgb Ks" [.3 .3 .3]', "").replace(
            '"float roughness" .15', "")


def beside_cycles(context):
    """Blender Cycles on the two Killeroo scenes (--quick: the moving one), all diffuse, paths of depth 5."""
    if not context.have_paper:
        raise Skipped("the paper's scenes are missing")
    cycles = Cycles(context)
    charts, rows, compared = [], [], []
    for name, moving in context.pick(SCENES[1:], SCENES):
        subject = context.named(name, "")
        width, height = context.size_of(subject, 5, 2)
        settings = context.settings(subject, shading="path", resolution=(width, height), text=all_diffuse(subject))
        measured, reference = measure_curves(context, settings, methods_of(context, moving))
        cycles_measured, cycles_reference = cycles_curve(context, cycles, moving, width)
        compared += [[name] + row for row in comparisons(measured, cycles_measured)]
        measured[CYCLES] = cycles_measured
        for method, curve in measured.items():
            noise = (cycles_reference if method == CYCLES else reference).variance ** .5
            rows += [[name, method.name, m.spp, m.median, m.rmse, m.error["low"], m.error["high"], noise] for m in curve]
        text = ("%d x %d pixels. Each renderer is compared with its own reference. Blender prints the seconds of Cycles, "
                "which include building the BVH. The seconds of strobe exclude parsing and building, which take %.2f s."
                % (width, height, seconds_to_build(context, settings)))
        charts.append(chart("cycles-" + name, "%s, all diffuse, paths of depth 5: strobe and Cycles" % name, text, measured,
                            "rmse"))
    context.write_csv("beside-cycles", NAMES, rows)
    context.write_csv("beside-cycles-compared", COMPARED, compared)
    head = columns(*COMPARED, text=2)
    head[2]["digits"] = 0
    head[3]["digits"] = 4
    return charts + [items.table("beside-cycles", "strobe and Cycles at equal error", head, compared,
                                 "Seconds until a method reaches the RMSE of Cycles at a sample count. low and high: 95 % "
                                 "bootstrap interval of the speed-up. Empty: the RMSE is not reached.")]


def seconds_to_build(context, settings):
    """Returns the seconds of parsing the scene and building its BVH."""
    seconds = context.run(settings.with_changes(spp=1, seed=1)).stats["seconds"]
    return seconds.get("parse", 0) + seconds.get("build", 0)


def comparisons(measured, cycles_measured):
    """Yields the rows of the comparison at equal error, for the last three sample counts of Cycles."""
    for peer in cycles_measured[-3:]:
        for method, curve in measured.items():
            def speedup(seeds, method=method, curve=curve, peer=peer):
                seeds = [s for s in seeds if s < len(curve[0].seconds) and s < len(peer.seconds)] or [0]
                error = max(float(peer.squares[seeds].mean()), 0) ** .5
                errors = [max(float(m.squares[seeds].mean()), 0) ** .5 for m in curve]
                seconds = curves.seconds_to([float(numpy.median(m.seconds[seeds])) for m in curve], errors, error,
                                            extend=method in BASELINES)
                return seconds and float(numpy.median(peer.seconds[seeds])) / seconds
            count = min(len(curve[0].seconds), len(peer.seconds))
            ratio = speedup(list(range(count)))
            low, high = curves.bootstrap_interval(speedup, count)
            yield [method.name, peer.spp, peer.rmse, peer.median, ratio and peer.median / ratio, ratio, low, high]
