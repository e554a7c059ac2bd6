"""Inputs and outputs that all figures share: scenes, renders, reference images and the output folder."""

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
    """A scene that figures render."""

    name: str
    path: str
    size: tuple  # pixels at full size
    of_paper: bool = False
    moving: bool = True


def _subject(name, size, folder="", of_paper=False, moving=True):
    return Subject(name, os.path.join(ROOT, "scenes", folder, name + ".scene"), size, of_paper, moving)


PAPER_SUBJECTS = [
    _subject("bunny", (640, 480), "paper", True, False),
    _subject("killeroo-simple", (700, 700), "paper", True, False),
    _subject("anim-killeroos-moving", (600, 600), "paper", True),
    _subject("anim-moving-reflection", (500, 500), "paper", True),
]
OWN_SUBJECTS = [
    _subject("moving-pair", (480, 480)),
    _subject("moving-reflection", (480, 480)),
    _subject("still", (480, 480), moving=False),
]


@dataclasses.dataclass
class Reference:
    """A reference image and the variance of its own noise, of clamped values over the comparable pixels."""

    image: numpy.ndarray
    variance: float
    relative_variance: float
    mask: numpy.ndarray  # the comparable pixels
    excluded: float = 0  # fraction of otherwise comparable pixels whose standard error is too large


class TooNoisy(Exception):
    """A reference image whose noise is too close to the errors measured against it."""


class Skipped(Exception):
    """A figure that needs data or a program that this machine lacks; the text names it."""


class Context:
    """The scenes, the renders and the output folder of one call of tools/figures."""

    def __init__(self, out, program, scenes, quick, threads=0, only_scenes=()):
        self.out = out
        self.quick = quick
        self.threads = threads
        self.only_scenes = tuple(only_scenes)  # of the figure gains; empty: all
        self.started = time.time()
        self.runs = Runs(os.path.join(out, "runs"), program, scenes, self._log_run)
        self.scenes = scenes
        self.have_paper = os.path.isdir(os.path.join(scenes, "pbrt-v2"))

    def _log_run(self, settings):
        print("    %5.0f s  %s %s %d spp seed %d %s" %
              (time.time() - self.started, os.path.basename(settings.scene), settings.integrator, settings.spp,
               settings.seed, " ".join(settings.defines)), file=sys.stderr, flush=True)

    def pick(self, for_quick, for_full):
        """Returns the first value with --quick, the second with --full."""
        return for_quick if self.quick else for_full

    def paper_subjects(self):
        """Returns the paper's scenes, or similar scenes of our own if the paper's data is missing."""
        return PAPER_SUBJECTS if self.have_paper else OWN_SUBJECTS

    def named(self, name, own):
        """Returns the paper's scene `name`, or our scene `own` if the paper's data is missing."""
        chosen = name if self.have_paper else own
        return next(s for s in PAPER_SUBJECTS + OWN_SUBJECTS if s.name == chosen)

    def size_of(self, subject, quick_divisor=4, full_divisor=1):
        """Returns (width, height) of a subject, divided as --quick or --full requires."""
        divisor = self.pick(quick_divisor, full_divisor)
        return tuple(max(1, n // divisor) for n in subject.size)

    def settings(self, subject, **changes):
        """Returns the settings of a render of a subject."""
        return Settings(scene=subject.path, threads=self.threads).with_changes(**changes)

    def run(self, settings):
        """Returns the result of a render, rendering it if necessary."""
        return self.runs.get(settings)

    def timed(self, settings, repeats=3):
        """Returns the result, and the median seconds of `repeats` renders."""
        results = [self.run(settings.with_changes(repeat=i)) for i in range(repeats)]
        return results[0], float(numpy.median([r.seconds for r in results]))

    def run_seeds(self, settings, count, first=1):
        """Returns the results of `count` renders with successive seeds."""
        return [self.run(settings.with_changes(seed=first + i)) for i in range(count)]

    def reference(self, settings, spp, renders=4, max_error=numpy.inf):
        """Returns the reference of `settings`: supersample at `spp` samples, as the mean of `renders` renders with seeds of
        their own, whose variance is the reference's noise. Pixels with a standard error above `max_error` are excluded."""
        single = settings.with_changes(integrator="supersample", defines=_shading_defines(settings.defines),
                                       spp=spp // renders, layers=(), repeat=0)
        stack = numpy.stack([self.run(single.with_changes(seed=900001 + i)).image for i in range(renders)])
        mean, variance, relative = mean_and_variance(stack)
        mask = images.comparable_pixels(mean)
        precise = numpy.sqrt(variance).max(axis=2) <= max_error
        excluded = 1 - float(precise[mask].mean())
        mask &= precise
        return Reference(mean, float(variance[mask].mean()), float(relative[mask].mean()), mask, excluded)

    def check_noise(self, reference, smallest_mean_square):
        """Raises TooNoisy if the reference's RMSE exceeds a third of the smallest error measured against it."""
        if reference.variance > smallest_mean_square / 9:
            raise TooNoisy("the noise of the reference (RMSE %.2g) exceeds a third of the smallest measured RMSE, %.2g" %
                           (reference.variance ** 0.5, max(smallest_mean_square, 0) ** 0.5))

    def path(self, *names):
        """Returns a path in the output folder, whose parent folder exists."""
        path = os.path.join(self.out, *names)
        os.makedirs(os.path.dirname(path), exist_ok=True)
        return path

    def write_csv(self, name, columns, rows):
        """Writes csv/NAME.csv in the output folder."""
        with open(self.path("csv", name + ".csv"), "w", newline="") as file:
            writer = csv.writer(file, lineterminator="\n")
            writer.writerow(columns)
            writer.writerows(rows)


def mean_and_variance(stack):
    """Returns the mean of independent images, the variance of the mean of their clamped values, and that variance over
    (mean + 0.01)²."""
    stack = stack.astype(numpy.float64)
    mean = stack.mean(axis=0)
    variance = images.clamp(stack).var(axis=0, ddof=1) / len(stack)
    return mean, variance, variance / (images.clamp(mean) + 0.01) ** 2


def _shading_defines(defines):
    """Returns the parameters that change the estimated radiance; the others only change how it is shared."""
    return tuple(d for d in defines if d.split("=")[0] in ("maxdepth", "strategy"))
