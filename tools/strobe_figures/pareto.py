"""Speed against accuracy: the error of each method over its render time, for increasing sample counts."""

import dataclasses
import functools

import numpy

from . import curves, images, items
from .context import TooNoisy
from .items import columns
from .methods import (ADAPTIVE_CACHE_1_LIGHT, BASELINES, CACHE_PER_THREAD, INDIRECT_CACHE_1_LIGHT, MSAA, MSAA_CACHE,
                      MSAA_CACHE_1_BIN, MSAA_CACHE_4_SHADES, MSAA_CACHE_HALF_BLOCKS, SUPERSAMPLE, Method)

METHODS = (*BASELINES, MSAA, MSAA_CACHE, MSAA_CACHE_1_BIN, MSAA_CACHE_HALF_BLOCKS, MSAA_CACHE_4_SHADES,
           INDIRECT_CACHE_1_LIGHT, ADAPTIVE_CACHE_1_LIGHT, CACHE_PER_THREAD)
SMALL = ("These images have an eighth of the scene's width and height, so a block of one pixel covers eight times its width "
         "on the surface. This is a disadvantage for shared shading; use --full for conclusions.")
MAX_ERROR = 0.01  # largest standard error of a reference pixel, if the reference as a whole is too noisy
MEASURES = {"rmse": "RMSE", "relative": "relative RMSE", "dissimilarity": "1 - SSIM"}


@dataclasses.dataclass
class Measured:
    """A method at one sample count: values per seed, and error estimates over all seeds."""

    method: Method
    spp: int
    seconds: numpy.ndarray  # per seed
    squares: numpy.ndarray  # mean square error per seed
    error: dict  # mean_square, bias_square, variance; low and high: 95 % interval of the RMSE
    relative: dict  # the same members, of the relative error
    dissimilarity: float  # 1 - SSIM
    shades: float  # per pixel

    @property
    def median(self):
        """The median of the seconds."""
        return float(numpy.median(self.seconds))

    @property
    def rmse(self):
        """The root mean square error."""
        return self.error["mean_square"] ** 0.5

    def point(self, measure):
        """Returns [seconds, error, low, high] for a chart."""
        if measure == "dissimilarity":
            return [self.median, self.dissimilarity]
        error = self.error if measure == "rmse" else self.relative
        return [self.median, error["mean_square"] ** 0.5, error["low"], error["high"]]


def estimate(pictures, reference, relative):
    """Returns the error of images as the members of Measured.error, and the mean square error of each image."""
    result = images.ErrorEstimate(pictures, reference, relative)
    low, high = result.interval()
    return {"mean_square": result.mean_square, "bias_square": result.bias_square, "variance": result.variance,
            "low": low, "high": high}, result.mean_squares


def sample_counts(context, method):
    """Returns the sample counts of a method. Faster methods take more samples, so that all curves span about the same
    seconds."""
    shades_each = ("supersample", "indirect-cache", "adaptive-cache")
    factor = method.sample_factor or (1 if method == SUPERSAMPLE else 2 if method.integrator in shades_each else 4)
    return tuple(factor * n for n in context.pick((2, 8, 32), (1, 4, 16, 64)))


def seeds_of(context):
    """Returns the number of seeds of each measurement."""
    return context.pick(3, 4)


def reference_samples(context):
    """Returns the samples per pixel of a reference."""
    return context.pick(1024, 4096)


def settings_of(settings, method, spp):
    """Returns settings with a method at a sample count."""
    return settings.with_changes(integrator=method.integrator, defines=method.defines, spp=spp)


def measure(context, settings, method, spp, reference):
    """Returns the Measured of a method at a sample count."""
    results = context.run_seeds(settings_of(settings, method, spp), seeds_of(context))
    pictures = [r.image for r in results]
    error, squares = estimate(pictures, reference, False)
    relative, _ = estimate(pictures, reference, True)
    dissimilarity = 1 - float(numpy.mean([images.ssim(p, reference.image) for p in pictures]))
    return Measured(method, spp, numpy.array([r.seconds for r in results]), squares, error, relative, dissimilarity,
                    results[0].shades_per_pixel)


def measure_curves(context, settings, methods, max_error=numpy.inf):
    """Returns a list of Measured by increasing samples for each method, and the reference, without pixels whose standard
    error exceeds `max_error`. Curves end where their errors are below three times that of the reference. Raises TooNoisy
    if fewer than two points of a curve are left."""
    for seed in range(seeds_of(context)):  # seeds outermost: a disturbance by other programs affects all methods alike
        for method in methods:
            for spp in sample_counts(context, method):
                context.run_seeds(settings_of(settings, method, spp), 1, 1 + seed)
    reference = context.reference(settings, reference_samples(context), max_error=max_error)
    measured = {method: [measure(context, settings, method, n, reference) for n in sample_counts(context, method)]
                for method in methods}
    context.check_noise(reference, min(m.error["mean_square"] for curve in measured.values() for m in curve[:2]))
    known = {method: [m for m in curve if m.error["mean_square"] >= 9 * reference.variance]
             for method, curve in measured.items()}
    return known, reference


def methods_of(subject, shading):
    """Returns the methods that differ on a scene: a static scene has one time bin by default, and without indirect light
    indirect-cache is supersample."""
    return [method for method in METHODS if (subject.moving or "timebins=1" not in method.defines) and
            (shading == "path" or method.integrator != "indirect-cache")]


def size_of(context, subject, shading):
    """Returns (width, height) of the images of a scene."""
    return context.size_of(subject, 8, 3 if shading == "path" else 2)


def chart(name, title, text, measured, measure_name):
    """Returns the chart of an error over seconds, with the Pareto front of all methods."""
    series = []
    for method, curve in measured.items():
        series.append({"name": method.name, "points": [m.point(measure_name) for m in curve],
                       "labels": ["%d spp" % m.spp for m in curve], **method.style()})
    front = curves.pareto_front([[(*m.point(measure_name)[:2], "%s, %d spp" % (m.method.name, m.spp)) for m in curve]
                                 for curve in measured.values()])
    series.append({"name": "Pareto front", "front": True, "points": [list(p[:2]) for p in front],
                   "labels": [p[2] for p in front]})
    axes = {"xlabel": "seconds", "ylabel": MEASURES[measure_name], "xlog": True, "ylog": True}
    return items.chart(name, title, text, axes, series)


def resampled(curve, seeds):
    """Returns the seconds and the RMSEs along a curve, computed from some of the seeds."""
    return ([float(numpy.median(m.seconds[seeds])) for m in curve],
            [max(float(m.squares[seeds].mean()), 0.0) ** 0.5 for m in curve])


def compare(measured, method, seeds, evaluate):
    """Returns evaluate(seconds, errors, extend) of a method and the smaller of the baselines' values, or None if either
    is undefined. Only the baselines' curves are extrapolated."""
    baselines = [evaluate(*resampled(measured[b], seeds), True) for b in BASELINES]
    value = evaluate(*resampled(measured[method], seeds), False)
    baseline = min((b for b in baselines if b is not None), default=None)
    return None if value is None or baseline is None else (value, baseline)


def speedup(measured, method, level, seeds):
    """Returns the better baseline's seconds over a method's until the RMSE of supersample at sample count `level`, or None
    if the method does not reach it."""
    error = resampled(measured[SUPERSAMPLE], seeds)[1][level]
    pair = compare(measured, method, seeds, lambda *curve: curves.seconds_to(*curve[:2], error, extend=curve[2]))
    return pair and pair[1] / pair[0]


def error_ratio(measured, method, level, seeds):
    """Returns a method's RMSE over the better baseline's after the seconds of supersample at sample count `level`, or None
    if the method takes longer."""
    budget = resampled(measured[SUPERSAMPLE], seeds)[0][level]
    pair = compare(measured, method, seeds, lambda *curve: curves.error_after(*curve[:2], budget, extend=curve[2]))
    return pair and pair[0] / pair[1]


def reason_not_reached(curve, error):
    """Returns why a curve does not reach an error."""
    last = curve[-1]
    bias = max(last.error["bias_square"], 0) ** 0.5
    return "bias %.2g" % bias if bias >= error else "needs more than %d spp" % last.spp


def comparisons(measured):
    """Yields the rows of the comparison at equal error and equal time, for the middle and the last sample count of
    supersample."""
    base = measured[SUPERSAMPLE]
    every = numpy.arange(len(base[0].seconds))
    for level in (len(base) // 2, len(base) - 1):
        for method in (m for m in measured if m not in BASELINES):
            row = [method.name, base[level].spp, base[level].rmse]
            for statistic, undefined in ((speedup, -numpy.inf), (error_ratio, numpy.inf)):
                of_seeds = functools.partial(statistic, measured, method, level)
                row += [of_seeds(every), *curves.bootstrap_interval(of_seeds, len(every), undefined)]
            yield row + ["" if row[3] is not None else reason_not_reached(measured[method], base[level].rmse)]


NAMES = ["scene", "light", "method", "integrator", "parameters", "spp", "seconds", "min seconds", "max seconds", "RMSE",
         "low", "high", "bias²", "variance", "relMSE", "relative bias²", "relative variance", "1-SSIM", "shades/px", "seeds",
         "reference noise"]
COMPARED = ["scene", "method", "supersample spp", "supersample RMSE", "speed-up", "speed-up low", "speed-up high",
            "error ratio", "error ratio low", "error ratio high", "not reached because"]


def csv_rows(subject, light, measured, reference):
    """Yields the rows of the CSV of all measurements."""
    for curve in measured.values():
        for m in curve:
            yield [subject.name, light, m.method.name, m.method.integrator, " ".join(m.method.defines), m.spp, m.median,
                   m.seconds.min(), m.seconds.max(), m.rmse, m.error["low"], m.error["high"], m.error["bias_square"],
                   m.error["variance"], m.relative["mean_square"], m.relative["bias_square"], m.relative["variance"],
                   m.dissimilarity, m.shades, len(m.seconds), reference.variance ** 0.5]


def interval_text(low, high):
    """Returns an interval as text, with – for an undefined end."""
    return " … ".join("–" if end is None else "%.2f" % end for end in (low, high))


def comparison_table(context, name, light, compared, notes):
    """Returns the table of the comparison at equal error and equal time."""
    head = columns("scene", "method", "spp", "RMSE", "speed-up", "speed-up, 95 %", "error ratio", "error ratio, 95 %",
                   "not reached because", text=2)
    head[2]["digits"] = 0
    head[3]["digits"] = 4
    for i in (5, 7, 8):
        head[i]["type"] = "text"
    rows = [r[:5] + [interval_text(*r[5:7]), r[7], interval_text(*r[8:10]), r[10]] for r in compared]
    text = ("Columns spp and RMSE describe supersample. Speed-up: seconds of the better supersample curve over seconds of the "
            "method until that RMSE. Error ratio: RMSE of the method over RMSE of the better supersample curve after "
            "supersample's seconds; below 1 the method is better. Values between points are interpolated on logarithmic "
            "axes. Only the supersample curves are extrapolated: where a method's curve begins below the RMSE or ends before "
            "the time, its first or last point counts.\n\n"
            "The 95 %% intervals are bootstrap intervals over %d seeds, of errors and seconds. –: the RMSE is not reached, or "
            "the method takes longer.\n\n%s" % (seeds_of(context), " ".join([context.pick(SMALL, "")] + notes)))
    return items.table(name + "-compared", "Equal error and equal time, " + light, head, rows, text)


def measure_subject(context, subject, shading, notes):
    """Returns measure_curves() of a scene. If its reference is too noisy, excludes noisy pixels and adds a note."""
    settings = context.settings(subject, shading=shading, resolution=size_of(context, subject, shading))
    methods = methods_of(subject, shading)
    try:
        return measure_curves(context, settings, methods)
    except TooNoisy:
        measured, reference = measure_curves(context, settings, methods, MAX_ERROR)
    notes.append("%s: %.1f %% of the pixels are excluded, because the standard error of the reference of %d samples exceeds "
                 "%g there (rare, bright paths)."
                 % (subject.name, 100 * reference.excluded, reference_samples(context), MAX_ERROR))
    return measured, reference


def accuracy(context, shading, light):
    """Returns the charts of error over seconds of all scenes, and the table that compares them."""
    charts, numbers, compared, notes = [], [], [], []
    for subject in context.paper_subjects():
        try:
            measured, reference = measure_subject(context, subject, shading, notes)
        except TooNoisy as error:
            notes.append("%s is excluded: %s." % (subject.name, error))
            continue
        numbers += csv_rows(subject, light, measured, reference)
        compared += [[subject.name] + row for row in comparisons(measured)]
        for name in context.pick(("rmse",), MEASURES):
            chart_id = "-".join(("accuracy", light.replace(" ", "-"), subject.name) + (() if name == "rmse" else (name,)))
            title = "%s, %s: %s over seconds" % (subject.name, light, MEASURES[name])
            text = "%d x %d pixels." % size_of(context, subject, shading)
            charts.append(chart(chart_id, title, text, measured, name))
    if not numbers:
        raise TooNoisy(" ".join(notes))
    name = "accuracy-" + light.replace(" ", "-")
    context.write_csv(name, NAMES, numbers)
    context.write_csv(name + "-compared", COMPARED, compared)
    return charts + [comparison_table(context, name, light, compared, notes)]


def accuracy_direct(context):
    """Error over seconds with direct light, for increasing sample counts."""
    return accuracy(context, "directlighting", "direct light")


def accuracy_paths(context):
    """Error over seconds with paths of depth 5, for increasing sample counts."""
    return accuracy(context, "path", "paths of depth 5")
