"""Gains: mean square error of the integrators that share indirect light, over that of supersample in the same CPU time."""

import dataclasses
import glob
import os

import numpy

from . import gains_chart, items
from .context import PAPER_SUBJECTS, ROOT, Skipped
from .items import columns
from .methods import ADAPTIVE_CACHE_1_LIGHT, INDIRECT_CACHE_1_LIGHT, SUPERSAMPLE_1_LIGHT
from .paired import ERRORS, Ratio, References, error_with, geometric_mean, ratio_of, samples_in
from .sweeps import read_sweep, scene_with

METHODS = (ADAPTIVE_CACHE_1_LIGHT, INDIRECT_CACHE_1_LIGHT)
LIGHTS = {"path": "paths of depth 5", "directlighting": "direct light"}
DEPTH = ("maxdepth=5",)
FIRST_REFERENCE_SEED = 900101
SIZES = (96, 72), (200, 150)  # of the images with --quick and --full
NOISY = 1 / 9  # of the smaller error of a cell: larger noise of the references is reported
LOSS = 1.05  # a cell whose bound is above this ratio may be a loss
NAMES = ["scene", "light", "integrator", "parameters", "spp", "error", "seeds", "ratio", "upper bound", "MSE ratio",
         "seconds ratio", "MSE", "supersample MSE", "supersample seconds", "reference noise", "supersample spp"]


@dataclasses.dataclass(frozen=True)
class Scene:
    """A scene that gains are measured on. `text` replaces the content of the file."""

    name: str
    path: str
    group: str  # paper, own or stress
    text: str = ""

    @property
    def file_name(self):
        """The name of the file without its extension."""
        return os.path.splitext(os.path.basename(self.path))[0]


@dataclasses.dataclass(frozen=True)
class Cell:
    """The comparison of one integrator with supersample, by one error, at one sample count of one scene."""

    scene: Scene
    light: str
    method: object
    spp: int
    error: str
    ratio: Ratio  # None if the error is smaller than the noise of the references
    numbers: tuple  # the columns of NAMES behind the bound


def stress_scenes(context, path):
    """Yields a stress scene: with --quick at its default value, with --full at both ends of its sweep."""
    name = os.path.splitext(os.path.basename(path))[0]
    if context.quick:
        yield Scene(name, path, "stress")
        return
    values = read_sweep(path).values
    for value in (values[0], values[-1]):
        yield Scene("%s %g" % (name, value), path, "stress", scene_with(path, value))


def scenes_of(context):
    """Returns all scenes: the paper's if their data exists, our own, and the stress scenes. Raises Skipped if none remains."""
    paper = [Scene(s.name, s.path, "paper") for s in PAPER_SUBJECTS] if context.have_paper else []
    own = [Scene(os.path.splitext(os.path.basename(path))[0], path, "own")
           for path in sorted(glob.glob(os.path.join(ROOT, "scenes", "[!.]*.scene")))]
    stress = [scene for path in sorted(glob.glob(os.path.join(ROOT, "scenes", "stress", "[!.]*.scene")))
              for scene in stress_scenes(context, path)]
    only = context.only_scenes
    chosen = [s for s in paper + own + stress if not only or s.name in only or s.file_name in only]
    if not chosen:
        raise Skipped("no scene is named %s" % " or ".join(only))
    return chosen


def settings_of(context, scene, light):
    """Returns the settings of a scene. Stress scenes keep their size with --full, because their sweeps are in pixels."""
    size = context.pick(*SIZES) if context.quick or scene.group != "stress" else ()
    return context.settings(scene, text=scene.text, shading=light, resolution=size)


def with_method(settings, method):
    """Returns settings with a method and the depth of the paths."""
    return settings.with_changes(integrator=method.integrator, defines=method.defines + DEPTH)


def references_of(context, settings):
    """Returns the references of a scene, rendered with supersample. The divisor of relative errors has fewer samples."""
    samples = context.pick(1024, 4096)
    single = with_method(settings, SUPERSAMPLE_1_LIGHT).with_changes(spp=samples)
    results = context.run_seeds(single, 2, FIRST_REFERENCE_SEED)
    results += context.run_seeds(single.with_changes(spp=samples // 4), 1, FIRST_REFERENCE_SEED + 2)
    return References(*(r.image.astype(numpy.float64) for r in results))


def seeds_of(context):
    """Returns the number of paired seeds."""
    return context.pick(4, 16)


def run_in_turns(context, settings):
    """Returns {method: results by seed}. The integrators take turns, and each seed begins with another one: a disturbance by
    other programs affects all alike."""
    turns = (SUPERSAMPLE_1_LIGHT, *METHODS)
    results = {method: [] for method in turns}
    for seed in range(seeds_of(context)):
        for i in range(len(turns)):
            method = turns[(seed + i) % len(turns)]
            results[method].append(context.run(with_method(settings, method).with_changes(seed=1 + seed)))
    return results


def measured(results, references):
    """Returns the CPU seconds of results, and {error: mean square errors}, as arrays over seeds."""
    errors = [references.mean_squares(r.image) for r in results]
    return numpy.array([r.cpu_seconds for r in results]), {name: numpy.array([e[name] for e in errors]) for name in ERRORS}


def numbers_of(own, base, noise, samples):
    """Returns the columns behind the bound of own and base (seconds, errors) as arrays over seeds. `samples`: those of
    supersample in the same time, by seed."""
    mean, base_mean = float(own[1].mean()), float(base[1].mean())
    seconds = geometric_mean(own[0] / base[0])
    return (mean / base_mean if base_mean > 0 else None, seconds, mean, base_mean, float(numpy.median(base[0])), noise,
            geometric_mean(samples))


def cells_of(context, scene, light):
    """Returns the cells of a scene."""
    settings = settings_of(context, scene, light)
    references = references_of(context, settings)
    noise = references.noise()
    values = {}
    for spp in context.pick((4, 16, 64), (4, 16, 64, 256)):
        results = run_in_turns(context, settings.with_changes(spp=spp))
        values[spp] = {method: measured(of_method, references) for method, of_method in results.items()}
    cells = []
    for spp in values:
        for method in METHODS:
            samples = samples_of_same_time(values, spp, method)
            for name in ERRORS:
                own, base = (of_error(values, spp, m, name) for m in (method, SUPERSAMPLE_1_LIGHT))
                ratio = ratio_of(own[1], base_errors_with(values, samples, name))
                numbers = numbers_of(own, base, noise[name], samples)
                cells.append(Cell(scene, light, method, spp, name, ratio, numbers))
    return cells


def of_error(values, spp, method, name):
    """Returns the seconds and the errors of a method, over seeds."""
    seconds, errors = values[spp][method]
    return seconds, errors[name]


def samples_of_same_time(values, spp, method):
    """Returns, by seed, the number of samples with which supersample takes the CPU time of a method. The times of a seed are
    relative: those of supersample with other numbers of samples are medians."""
    samples = list(values)
    medians = [float(numpy.median(values[n][SUPERSAMPLE_1_LIGHT][0])) for n in samples]
    own, base = values[spp][method][0], values[spp][SUPERSAMPLE_1_LIGHT][0]
    return [samples_in(ratio * medians[samples.index(spp)], samples, medians) for ratio in own / base]


def base_errors_with(values, samples, name):
    """Returns, by seed, the errors of supersample with numbers of samples between the measured ones."""
    measured_samples = list(values)
    by_samples = [values[n][SUPERSAMPLE_1_LIGHT][1][name] for n in measured_samples]
    return [error_with(count, measured_samples, [errors[seed] for errors in by_samples])
            for seed, count in enumerate(samples)]


def is_noisy(cell):
    """Returns whether the noise of the references exceeds a ninth of the smaller error of a cell, as in Context.check_noise."""
    _, _, error, base_error, _, noise, _ = cell.numbers
    return noise > NOISY * min(error, base_error)


def csv_row(cell, seeds):
    """Returns the row of a cell in the CSV file."""
    ratio = (cell.ratio.value, cell.ratio.upper) if cell.ratio else ("", "")
    return [cell.scene.name, LIGHTS[cell.light], cell.method.integrator, " ".join(cell.method.defines), cell.spp,
            ERRORS[cell.error], seeds, *ratio, *cell.numbers]


def chosen(cells, **members):
    """Returns the cells with given members."""
    return [c for c in cells if all(getattr(c, name) == value for name, value in members.items())]


def summary(cells):
    """Returns (cells with a ratio, cells that are better, cells that may be a loss, geometric mean or None) of cells."""
    ratios = [c.ratio for c in cells if c.ratio]
    mean = geometric_mean([r.value for r in ratios]) if ratios else None
    return len(ratios), sum(r.is_better for r in ratios), sum(r.upper > LOSS for r in ratios), mean


def recommended(cells):
    """Returns the method with the smallest geometric mean of the ratios of cells, if it is below 1, else supersample."""
    means = {method: summary(chosen(cells, method=method))[3] for method in METHODS}
    best = min((m for m in METHODS if means[m] is not None), key=means.get, default=None)
    return best if best and means[best] < 1 else SUPERSAMPLE_1_LIGHT


def verdict(cells, light):
    """Returns the sentences that recommend an integrator for a light, computed from the errors of clipped radiance."""
    clipped = chosen(cells, light=light, error="clipped")
    sentences = ["%s: use %s." % (LIGHTS[light].capitalize(), recommended(clipped).integrator)]
    for method in METHODS:
        count, better, losses, mean = summary(chosen(clipped, method=method))
        if count:
            sentences.append("%s is better than supersample in %d of %d cells, geometric mean %.2f; cells with a bound above "
                             "%g: %d." % (method.integrator, better, count, mean, LOSS, losses))
    return " ".join(sentences)


EXPLANATION = """A cell is a scene at a sample count. Its ratio is the mean square error of an integrator over that of
supersample in the same CPU time, both with one light sample: below 1 the integrator has the smaller error. An integrator is
better in a cell if the upper bound of the ratio (95 %, one-sided) is below 1.""".replace("\n", " ")
TABLE_TEXT = """Ratios of mean square errors over those of supersample in the same CPU time. These follow from its errors with
fewer and with more samples, by a power law between two numbers of samples, and beyond the last. The ratio of a cell is the
geometric mean over %d seeds; its bound is that of a paired t-test.

Errors are mean products of the differences from two independent references, so that their noise drops out. The relative error
is divided by the square of a third reference, plus 0.01. Seconds are those of whole processes, with loading and building.

Not measured: the error is smaller than the noise of the references. Noisy references: their noise exceeds a ninth of the
smaller error. Clipping turns it into a bias that both integrators share. csv/gains.csv contains all cells."""
SMALL = """ In these small images fewer pixels share, and loading hides the additional time of sharing; use --full for
conclusions."""


def table_rows(cells):
    """Yields the rows of the table: a row by light, integrator and error."""
    for light in LIGHTS:
        for method in METHODS:
            for name in ERRORS:
                row = chosen(cells, light=light, method=method, error=name)
                count, better, losses, mean = summary(row)
                values = [c.ratio.value for c in row if c.ratio]
                if row:
                    yield [light, method.integrator, name, count, better, losses, mean, min(values, default=None),
                           max(values, default=None), len(row) - count, sum(map(is_noisy, row))]


def table(context, cells, seeds):
    """Returns the table of gains."""
    head = columns("shader", "integrator", "error", "cells", "better", "bound above %g" % LOSS, "geometric mean", "least",
                   "greatest", "not measured", "noisy references", text=3)
    for i in (3, 4, 5, 9, 10):
        head[i]["digits"] = 0
    text = TABLE_TEXT % seeds + context.pick(SMALL, "")
    return items.table("gains-table", "Gains over supersample at equal time", head, list(table_rows(cells)), text)


def chart(context, cells, name):
    """Draws the chart of an error and returns its item."""
    title = "Error over supersample's at equal time, %s" % ERRORS[name]
    stem = context.path("charts", "gains-" + name)
    drawn = [c for c in cells if c.error == name]
    gains_chart.draw(stem, title, drawn, LIGHTS)
    text = ("Below 1 (left of the line), the integrator is better. Marks grow with the samples per pixel; a whisker ends at "
            "the upper bound.")
    return items.picture("gains-" + name, title, text, os.path.relpath(stem + ".svg", context.out))


def gains(context):
    """Error over supersample's at equal time: adaptive-cache and indirect-cache on all scenes."""
    scenes = scenes_of(context)
    cells = []
    for light in context.pick(("path",), tuple(LIGHTS)):
        for scene in scenes:
            cells += cells_of(context, scene, light)
    seeds = seeds_of(context)
    context.write_csv("gains", NAMES, [csv_row(c, seeds) for c in cells])
    texts = [verdict(cells, light) for light in LIGHTS if chosen(cells, light=light)]
    first, *others = (chart(context, cells, name) for name in ERRORS)
    return [items.paragraph("\n\n".join(texts)), items.paragraph(EXPLANATION), first, table(context, cells, seeds), *others]
