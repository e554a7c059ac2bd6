"""Failure thresholds: parameter sweeps of the scenes in scenes/stress, and the influence of cache size, tiles and threads."""

import glob
import os

import numpy

from . import images, items
from .context import ROOT, Subject, TooNoisy
from .items import columns
from .methods import ADAPTIVE_CACHE, INDIRECT_CACHE, MSAA, MSAA_CACHE, MSAA_CACHE_QUARTER_BLOCKS, SUPERSAMPLE
from .sweeps import read_sweep, scene_with

METHODS = (SUPERSAMPLE, MSAA, MSAA_CACHE, MSAA_CACHE_QUARTER_BLOCKS, ADAPTIVE_CACHE)
SAMPLES = 16
NAMES = ["scene", "sweep", "value", "method", "integrator", "parameters", "seconds", "RMSE", "low", "high", "bias²",
         "variance", "shades/px", "relative efficiency", "reference noise"]


class Case:
    """The measurements of one method at one value of a sweep."""

    def __init__(self, results, context, reference):
        self.error = images.ErrorEstimate([r.image for r in results], reference)
        self.seconds = float(numpy.median([r.seconds for r in results]))
        self.shades = results[0].shades_per_pixel
        self.picture = os.path.relpath(results[0].path, context.out)

    @property
    def cost(self):
        """Seconds times mean square error, the inverse of the efficiency. Independent of the sample count for independent,
        unbiased samples."""
        return self.seconds * self.error.mean_square

    def relative_efficiency(self, base):
        """Returns the efficiency over that of `base`. Above 1, the method reaches its error sooner than `base`."""
        return base.cost / self.cost if self.cost > 0 else float("inf")


def values_of(context, sweep):
    """Returns the values of a sweep; with --quick, the first, the middle and the last."""
    if not context.quick:
        return list(sweep.values)
    few = {sweep.values[0], sweep.values[len(sweep.values) // 2], sweep.values[-1]}
    return [v for v in sweep.values if v in few]


def methods_of(path):
    """Returns the methods measured on a scene: indirect-cache only if it has indirect light, else it is supersample."""
    with open(path, encoding="utf-8") as file:
        return METHODS + (INDIRECT_CACHE,) if 'Integrator "path"' in file.read() else METHODS


def run_by_seed(context, settings, methods):
    """Returns {method: results}. Seeds are the outer loop: a disturbance by other programs affects all methods alike."""
    results = {method: [] for method in methods}
    for seed in range(context.pick(2, 4)):
        for method, of_method in results.items():
            of_method.append(context.run(settings.with_changes(integrator=method.integrator, defines=method.defines,
                                                               seed=1 + seed)))
    return results


def measure_sweep(context, path, sweep):
    """Returns {value: ({method: Case}, reference)} in the sweep's order, and the values whose reference is too noisy.
    Raises TooNoisy if all are."""
    subject = Subject(os.path.splitext(os.path.basename(path))[0], path, ())
    measured, excluded = {}, []
    for value in values_of(context, sweep):
        settings = context.settings(subject, spp=SAMPLES, text=scene_with(path, value))
        reference = context.reference(settings, context.pick(256, 1024), renders=context.pick(2, 4))
        cases = {m: Case(results, context, reference)
                 for m, results in run_by_seed(context, settings, methods_of(path)).items()}
        try:
            context.check_noise(reference, min(c.error.mean_square for c in cases.values()))
            measured[value] = cases, reference
        except TooNoisy:
            excluded.append(value)
    if not measured:
        raise TooNoisy("%s: the reference is too noisy at every value" % subject.name)
    return measured, excluded


def failure_threshold(measured, method):
    """Returns the first value from which supersample is more efficient up to the end of the sweep, or None."""
    threshold = None
    for value, (cases, _) in measured.items():
        if cases[method].relative_efficiency(cases[SUPERSAMPLE]) >= 1:
            threshold = None
        elif threshold is None:
            threshold = value
    return threshold


def efficient_values(measured, method):
    """Returns as text the values where a method is at least as efficient as supersample."""
    values = [v for v, (cases, _) in measured.items() if cases[method].relative_efficiency(cases[SUPERSAMPLE]) >= 1]
    if not values:
        return "nowhere"
    if len(values) == len(measured):
        return "everywhere"
    return "at " + ", ".join("%g" % v for v in values)


def sweep_chart(name, sweep, measured, excluded):
    """Returns the chart of the errors of all methods over the values of a sweep."""
    values = list(measured)
    methods = list(measured[values[0]][0])
    series = []
    for m in methods:
        errors = [measured[v][0][m].error for v in values]
        series.append({"name": m.name, "points": [[v, e.rmse, *e.interval()] for v, e in zip(values, errors)], **m.style()})
    thresholds = {}
    for method in methods[1:]:
        threshold = failure_threshold(measured, method)
        if threshold is not None and threshold != values[0]:
            thresholds.setdefault(threshold, []).append(method.name)
    text = "Values where a method is at least as efficient as supersample: %s." % "; ".join(
        "%s: %s" % (m.name, efficient_values(measured, m)) for m in methods[1:])
    if thresholds:
        text += " Dotted line: from this value on, supersample is more efficient than the named methods."
    if excluded:
        text += " Excluded, because the reference is too noisy: %s." % ", ".join("%g" % v for v in excluded)
    axes = {"xlabel": sweep.name + (" (%s)" % sweep.unit if sweep.unit else ""), "ylabel": "RMSE at %d spp" % SAMPLES,
            "xlog": min(values) > 0 and max(values) > 8 * min(values), "ylog": True}
    return items.chart("stress-" + name, "%s: error by %s" % (name, sweep.name), text, axes, series,
                       [{"x": x, "label": ", ".join(names)} for x, names in thresholds.items()])


def worst_crop(picture, reference, width, height):
    """Returns [x, y, width, height] of the crop with the largest square error."""
    squares = ((images.clamp(picture) - images.clamp(reference)) ** 2).sum(axis=2)
    sums = numpy.pad(squares.cumsum(axis=0).cumsum(axis=1), ((1, 0), (1, 0)))
    inside = sums[height:, width:] - sums[:-height, width:] - sums[height:, :-width] + sums[:-height, :-width]
    y, x = numpy.unravel_index(inside.argmax(), inside.shape)
    return [int(x), int(y), width, height]


def hardest_images(context, name, sweep, measured):
    """Returns the images at the last value of a sweep, the largest error first: the report shows the first image beside the
    reference."""
    value = list(measured)[-1]
    cases, reference = measured[value]
    path = context.path("pictures", "stress-%s-truth.exr" % name)
    images.write_exr(path, reference.image)
    crops = [worst_crop(images.read(context.path(cases[m].picture)), reference.image, 40, 30) for m in (MSAA, MSAA_CACHE)]
    pictures = [{"label": m.name, "file": c.picture,
                 "caption": "RMSE %.4f, %.2f shades per pixel, %.2f s" % (c.error.rmse, c.shades, c.seconds)}
                for m, c in sorted(cases.items(), key=lambda case: -case[1].error.rmse)]
    pictures.append({"label": "reference", "file": os.path.relpath(path, context.out), "caption": "supersample, other seeds"})
    text = "%d samples per pixel. The crops have the largest error of msaa and of msaa-cache." % SAMPLES
    return items.images("stress-%s-pictures" % name, "%s: images at %s = %g" % (name, sweep.name, value), text, pictures,
                        len(pictures) - 1, crops)


def csv_rows(name, sweep, measured):
    """Yields the rows of the CSV of all measurements."""
    for value, (cases, reference) in measured.items():
        for method, case in cases.items():
            yield [name, sweep.name, value, method.name, method.integrator, " ".join(method.defines), case.seconds,
                   case.error.rmse, *case.error.interval(), case.error.bias_square, case.error.variance, case.shades,
                   case.relative_efficiency(cases[SUPERSAMPLE]), reference.variance ** 0.5]


def table_rows(name, measured):
    """Yields the rows of the table of first and last values."""
    ends = list(measured)[0], list(measured)[-1]
    first, last = (measured[v][0] for v in ends)
    for m in first:
        yield [name, m.name, "%g … %g" % ends, first[m].error.rmse, last[m].error.rmse, last[m].error.bias,
               first[m].seconds, last[m].seconds, first[m].relative_efficiency(first[SUPERSAMPLE]),
               last[m].relative_efficiency(last[SUPERSAMPLE]), "" if m == SUPERSAMPLE else efficient_values(measured, m)]


def stress(context):
    """Sweeps of all scenes in scenes/stress: error and efficiency relative to supersample."""
    details, numbers, rows = [], [], []
    for path in sorted(glob.glob(os.path.join(ROOT, "scenes", "stress", "[!.]*.scene"))):
        sweep = read_sweep(path)
        name = os.path.splitext(os.path.basename(path))[0]
        measured, excluded = measure_sweep(context, path, sweep)
        details += [sweep_chart(name, sweep, measured, excluded), hardest_images(context, name, sweep, measured)]
        numbers += csv_rows(name, sweep, measured)
        rows += table_rows(name, measured)
    context.write_csv("stress", NAMES, numbers)
    head = columns("scene", "method", "range", "RMSE, first", "RMSE, last", "bias, last", "seconds, first", "seconds, last",
                   "efficiency, first", "efficiency, last", "efficiency ≥ 1", text=3)
    for column in head[3:6]:
        column["digits"] = 4
    head[-1]["type"] = "text"
    text = ("%d samples per pixel; first and last are values of the sweep. Efficiency: supersample's seconds times its mean "
            "square error, over the method's. Below 1, supersample has the smaller error in the same time. The comparison "
            "assumes that supersample's mean square error falls in proportion to time; it falls faster, which favors the "
            "methods that share." % SAMPLES)
    return [items.table("stress-table", "Efficiency relative to supersample", head, rows, text)] + details


# (option, value, changed settings, parameters) of the renders whose images are compared.
VARIATIONS = [("default", "", {}, ())]
VARIATIONS += [("cache-mb", size, {}, ("cache-mb=" + size,))
               for size in ("unbounded", "4", "1", "0.25", "0.0625", "0.004", "0")]
VARIATIONS += [("tile", str(size), {"tile": size}, ()) for size in (4, 16, 64, 256)]
VARIATIONS += [("threads", str(count), {"threads": count}, ()) for count in (1, 2, 4, 8)]


def work_and_memory(context):
    """Render time of msaa-cache by cache size, tile size and threads, and whether the image changes."""
    subject = Subject("moving-shadow", os.path.join(ROOT, "scenes", "stress", "moving-shadow.scene"), ())
    settings = context.settings(subject, integrator="msaa-cache", spp=context.pick(SAMPLES, 64))
    expected = context.run(settings).image
    repeats = context.pick(3, 5)
    for repeat in range(repeats):  # repeats outermost: a disturbance by other programs affects all variations alike
        for _, _, changes, defines in VARIATIONS:
            context.run(settings.with_changes(defines=defines, repeat=repeat, **changes))
    rows = []
    for option, value, changes, defines in VARIATIONS:
        result, seconds = context.timed(settings.with_changes(defines=defines, **changes), repeats)
        image = "identical" if numpy.array_equal(result.image, expected) else "different"
        rows.append([option, value, seconds, result.shades_per_pixel, image])
    names = ["option", "value", "seconds", "shades/px", "image"]
    context.write_csv("work-and-memory", names, rows)
    head = columns(*names, text=2)
    head[-1]["type"] = "text"
    return [items.table("work-and-memory", "Cache size, tile size and threads", head, rows,
                        "msaa-cache on moving-shadow, %d samples per pixel, medians of %d renders. Identical: equal to the bit "
                        "to the image with default options." % (settings.spp, repeats))]
