"""What every figure is made from: the scenes that are there, runs, references, and where results go."""

import csv
import dataclasses
import os
import sys
import time

import numpy

from . import images
from .runs import Runs, Settings

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))


@dataclasses.dataclass(frozen=True)
class Subject:
    """A scene that is charted."""

    name: str
    path: str
    size: tuple  # pixels at full size
    of_paper: bool = False
    moving: bool = True


def subject(name, size, folder="", of_paper=False, moving=True):
    return Subject(name, os.path.join(ROOT, "scenes", folder, name + ".scene"), size, of_paper, moving)


PAPER_SUBJECTS = [
    subject("bunny", (640, 480), "paper", True, False),
    subject("killeroo-simple", (700, 700), "paper", True, False),
    subject("anim-killeroos-moving", (600, 600), "paper", True),
    subject("anim-moving-reflection", (500, 500), "paper", True),
]
OWN_SUBJECTS = [
    subject("moving-pair", (480, 480)),
    subject("moving-reflection", (480, 480)),
    subject("still", (480, 480), moving=False),
]


@dataclasses.dataclass
class Reference:
    """A picture taken for the truth, and the mean square of its own noise (clamped values, comparable pixels)."""

    image: numpy.ndarray
    variance: float
    relative_variance: float
    keep: numpy.ndarray  # the comparable pixels
    unsure: float = 0  # the share of pixels left out because the picture is not sure there


class TooNoisy(Exception):
    """A reference whose noise is not well below what is measured against it."""


class Skipped(Exception):
    """A figure for which this machine lacks something; the text says what."""


class Context:
    def __init__(self, out, program, scenes, quick, threads=0):
        self.out, self.quick, self.threads = out, quick, threads
        self.started = time.time()
        self.runs = Runs(os.path.join(out, "runs"), program, scenes, self._tell)
        self.scenes = scenes
        self.have_paper = os.path.isdir(os.path.join(scenes, "pbrt-v2"))
        self.doing = ""

    def _tell(self, settings):
        print("    %5.0f s  %s %s %d spp seed %d %s" %
              (time.time() - self.started, os.path.basename(settings.scene), settings.integrator, settings.spp,
               settings.seed, " ".join(settings.defines)), file=sys.stderr, flush=True)

    def pick(self, for_quick, for_full):
        return for_quick if self.quick else for_full

    def paper_subjects(self):
        """The paper's scenes, or in their absence our own that resemble them."""
        return PAPER_SUBJECTS if self.have_paper else OWN_SUBJECTS

    def named(self, name, own):
        """A scene of the paper, or our own that stands in for it where its data is missing."""
        wanted = name if self.have_paper else own
        return next(s for s in PAPER_SUBJECTS + OWN_SUBJECTS if s.name == wanted)

    def size_of(self, subject, quick_divisor=4, full_divisor=1):
        divisor = self.pick(quick_divisor, full_divisor)
        return tuple(max(1, n // divisor) for n in subject.size)

    def settings(self, subject, **changes):
        return Settings(scene=subject.path, threads=self.threads).having(**changes)

    def run(self, settings):
        return self.runs.get(settings)

    def timed(self, settings, repeats=3):
        """The result, and the median seconds of `repeats` runs."""
        results = [self.run(settings.having(repeat=i)) for i in range(repeats)]
        return results[0], float(numpy.median([r.seconds for r in results]))

    def seeds(self, settings, count, first=1):
        return [self.run(settings.having(seed=first + i)) for i in range(count)]

    def reference(self, settings, spp, parts=4, sure=numpy.inf):
        """Of what `settings` estimate: supersample of other seeds; the spread of its parts is its noise. Pixels whose own
        standard error is beyond `sure` are left out."""
        plain = settings.having(integrator="supersample", defines=_of_shading(settings.defines), spp=spp // parts,
                                layers=(), repeat=0)
        pictures = [self.run(plain.having(seed=900001 + i)).image for i in range(parts)]
        stack = numpy.stack(pictures).astype(numpy.float64)
        clamped = images.clamp(stack)
        mean = stack.mean(axis=0)
        spread = clamped.var(axis=0, ddof=1) / parts
        relative = spread / (images.clamp(mean) + 0.01) ** 2
        keep = images.comparable(mean)
        certain = numpy.sqrt(spread).max(axis=2) <= sure
        unsure = 1 - float(certain[keep].mean())
        keep &= certain
        return Reference(mean, float(spread[keep].mean()), float(relative[keep].mean()), keep, unsure)

    def check(self, reference, smallest_mean_square):
        """Refuses a reference that decides what it should measure: a third of its error at most may be its own."""
        if reference.variance > smallest_mean_square / 9:
            raise TooNoisy("the reference's noise, RMSE %.2g, is not well below the smallest error charted, %.2g" %
                           (reference.variance ** 0.5, max(smallest_mean_square, 0) ** 0.5))

    def path(self, *names):
        path = os.path.join(self.out, *names)
        os.makedirs(os.path.dirname(path), exist_ok=True)
        return path

    def write_csv(self, name, columns, rows):
        with open(self.path("csv", name + ".csv"), "w", newline="") as file:
            writer = csv.writer(file, lineterminator="\n")
            writer.writerow(columns)
            writer.writerows(rows)


def _of_shading(defines):
    """Those parameters that say what is estimated, not how it is shared."""
    return tuple(d for d in defines if d.split("=")[0] in ("maxdepth", "strategy"))
