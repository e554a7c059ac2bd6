"""Beside another renderer: Blender's Cycles on the Killeroo scenes with diffuse materials, each against its own truth."""

import glob
import hashlib
import json
import os
import re
import shutil
import subprocess
import tempfile

import numpy

from . import curves, images
from .context import Reference, Skipped
from .pareto import BASELINES, Line, Measured, chart, curves_of, split_of
from .sharing import columns

LINES = BASELINES + (Line("msaa-cache", "msaa-cache"), Line("msaa-cache, 1 time bin", "msaa-cache", ("timebins=1",)),
                     Line("msaa-cache, blocks of 0.5", "msaa-cache", ("blocksize=0.5",)),
                     Line("indirect-cache, blocks of 2, 1 light sample", "indirect-cache", ("blocksize=2", "lightsamples=1"), 4),
                     Line("indirect-cache, 1 light sample", "indirect-cache", ("lightsamples=1",), 4))
CYCLES = Line("Blender's Cycles", "cycles")
SCENES = (("killeroo-simple", False), ("anim-killeroos-moving", True))
NAMES = ["scene", "line", "spp", "seconds", "RMSE", "low", "high", "reference's noise"]
COMPARED = ["scene", "line", "Cycles' spp", "its RMSE", "its seconds", "seconds", "times faster", "low", "high"]


class Picture:
    def __init__(self, path, seconds):
        self.image, self.seconds = images.read(path), seconds


class Cycles:
    """Finished renders of peers/cycles_killeroo.py in a folder, by what was asked."""

    def __init__(self, context):
        self.context, self.blender = context, shutil.which("blender")
        self.script = os.path.join(context.scenes, "..", "peers", "cycles_killeroo.py")
        if not self.blender:
            raise Skipped("Blender is not installed")
        if not os.path.exists(self.script):
            raise Skipped("no %s" % os.path.normpath(self.script))
        with open(self.script) as file:
            self.source = file.read()

    def picture(self, moving, spp, seed, size):
        """Its pixels, and the seconds that Blender prints: of the render, without starting and without reading the scene."""
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

    def _render(self, stem, words, seed):
        """The script knows no seed; ours is put where it sets up sampling."""
        anchor = "c.use_denoising=False"
        if self.source.count(anchor) != 1:
            raise Skipped("%s is not the script that this was written for" % self.script)
        text = "source = %r\n__file__ = %r\nexec(compile(source, __file__, 'exec'))\n" % (
            self.source.replace(anchor, anchor + "; c.seed=%d" % seed), os.path.abspath(self.script))
        with tempfile.NamedTemporaryFile("w", suffix=".py") as wrapper:
            wrapper.write(text)
            wrapper.flush()
            done = subprocess.run([self.blender, "-b", "-P", wrapper.name, "--"] + words, capture_output=True, text=True)
        found = re.search(r"^ Time: (?:(\d+):)?(\d+):(\d+\.\d+)", done.stdout, re.MULTILINE)
        written = glob.glob(stem + "*.exr")
        if done.returncode or not found or not written:
            raise Skipped("Blender failed: " + (done.stderr or done.stdout).strip()[-300:])
        return 3600 * int(found[1] or 0) + 60 * int(found[2]) + float(found[3])


def cycles_curve(context, cycles, moving, size):
    """The line of Cycles, as those of `curves_of`, and its own truth."""
    parts = [cycles.picture(moving, context.pick(512, 1024), 1001 + i, size).image for i in range(context.pick(2, 4))]
    spread = images.clamp(numpy.stack(parts)).astype(float).var(axis=0, ddof=1) / len(parts)
    mean = numpy.mean(parts, axis=0)
    keep = images.comparable(mean)
    truth = Reference(mean, float(spread[keep].mean()), float((spread / (images.clamp(mean) + .01) ** 2)[keep].mean()), keep)
    measured = []
    for spp in context.pick((16, 64), (1, 4, 16, 64, 256)):
        pictures = [cycles.picture(moving, spp, 1 + i, size) for i in range(context.pick(2, 4))]
        split, squares = split_of([p.image for p in pictures], truth, False)
        measured.append(Measured(CYCLES, spp, numpy.array([p.seconds for p in pictures]), squares, split, split, 0.0, 0.0))
    context.check(truth, min(m.split["mean_square"] for m in measured))
    return measured, truth


def lines_of(context, moving):
    lines = context.pick((*BASELINES, LINES[2], LINES[-1]), LINES)
    return [line for line in lines if moving or "timebins=1" not in line.defines]


def all_diffuse(subject):
    """The scene's text with plastic made matte: the work that Cycles' scene is."""
    with open(subject.path) as file:
        return file.read().replace('Material "plastic"', 'Material "matte"').replace(
            '"rgb Ks" [.5 .5 .5] "float roughness" .025', "").replace('"rgb Ks" [.3 .3 .3]', "").replace(
            '"float roughness" .15', "")


def beside_cycles(context):
    """Blender's Cycles on the two Killeroo scenes (small figures: the moving one), all diffuse, paths of depth 5."""
    if not context.have_paper:
        raise Skipped("the paper's scenes are missing")
    cycles = Cycles(context)
    items, rows, compared = [], [], []
    for name, moving in context.pick(SCENES[1:], SCENES):
        subject = context.named(name, "")
        width, height = context.size_of(subject, 5, 2)
        settings = context.settings(subject, shading="path", resolution=(width, height), text=all_diffuse(subject))
        measured, truth = curves_of(context, settings, lines_of(context, moving))
        other, other_truth = cycles_curve(context, cycles, moving, width)
        compared += [[name] + row for row in sooner(measured, other)]
        measured[CYCLES] = other
        for line, of in measured.items():
            noise = (other_truth if line == CYCLES else truth).variance ** .5
            rows += [[name, line.name, m.spp, m.median, m.rmse, m.split["low"], m.split["high"], noise] for m in of]
        items.append(chart("cycles-" + name, "%s, all diffuse, paths of depth 5, beside Cycles" % name,
                           "%d x %d pixels. Each renderer against its own truth. Cycles' seconds are those that Blender "
                           "prints, with its BVH's building; strobe's are of rendering, to which come those of building, "
                           "some %.2f s here." % (width, height, building(context, settings)), measured, "rmse"))
    context.write_csv("beside-cycles", NAMES, rows)
    context.write_csv("beside-cycles-compared", COMPARED, compared)
    head = columns(*COMPARED, text=2)
    head[2]["digits"], head[3]["digits"] = 0, 4
    return items + [{"kind": "table", "id": "beside-cycles", "title": "Beside Cycles at equal error", "columns": head,
                     "rows": compared, "text": "Seconds until a line has the RMSE that Cycles has with so many samples; "
                     "intervals from drawing the seeds again. Empty: it never has it."}]


def building(context, settings):
    """Seconds from the scene's file to its BVH."""
    times = context.run(settings.having(spp=1, seed=1)).stats["seconds"]
    return times.get("parse", 0) + times.get("build", 0)


def sooner(measured, other):
    """Rows of the table of equal error."""
    for peer in other[-3:]:
        for line, of in measured.items():
            def ratio(seeds, of=of, peer=peer):
                seeds = [s for s in seeds if s < len(of[0].seconds) and s < len(peer.seconds)] or [0]
                error = max(float(peer.squares[seeds].mean()), 0) ** .5
                errors = [max(float(m.squares[seeds].mean()), 0) ** .5 for m in of]
                seconds = curves.seconds_to([float(numpy.median(m.seconds[seeds])) for m in of], errors, error,
                                            extend=line in BASELINES)
                return seconds and float(numpy.median(peer.seconds[seeds])) / seconds
            count = min(len(of[0].seconds), len(peer.seconds))
            times = ratio(list(range(count)))
            low, high = curves.interval(ratio, count)
            yield [line.name, peer.spp, peer.rmse, peer.median, times and peer.median / times, times, low, high]
