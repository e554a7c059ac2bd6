"""Speed against accuracy: the error of each way to share shades over the seconds it takes."""

import dataclasses
import functools

import numpy

from . import curves, images
from .context import TooNoisy
from .sharing import columns


@dataclasses.dataclass(frozen=True)
class Line:
    """An integrator with its parameters: one curve of a chart."""

    name: str
    integrator: str
    defines: tuple = ()
    further: int = 0  # how many times as many samples as the first line, at each step; 0: as its kind


BASELINES = (Line("supersample", "supersample"),
             Line("supersample, 1 light sample", "supersample", ("lightsamples=1",)))
SHARING = (Line("msaa", "msaa"),
           Line("msaa-cache", "msaa-cache"),
           Line("msaa-cache, 1 time bin", "msaa-cache", ("timebins=1",)),
           Line("msaa-cache, blocks of 0.5", "msaa-cache", ("blocksize=0.5",)),
           Line("msaa-cache, 4 shades", "msaa-cache", ("shades=4",)),
           Line("indirect-cache, 1 light sample", "indirect-cache", ("lightsamples=1",)),
           Line("as in the paper", "msaa-cache", ("scope=thread",)))
LINES = BASELINES + SHARING
SMALL = ("These pictures have an eighth of the width and height. A block of a pixel is eight times as wide in the scene as in "
         "the full picture, which counts against sharing: judge it by --full.")
SURE = 0.01  # the standard error of a pixel of the reference, where it as a whole is too noisy
MEASURES = {"rmse": "RMSE", "relative": "relative RMSE", "unlike": "1 - SSIM"}


@dataclasses.dataclass
class Measured:
    """A line at a sample count: numbers of each seed, and the splits of their mean."""

    line: Line
    spp: int
    seconds: numpy.ndarray
    squares: numpy.ndarray  # mean square errors
    split: dict  # mean_square, bias_square, variance, low, high (of the root); the same of relative errors
    relative: dict
    unlike: float  # 1 - SSIM
    shades: float  # per pixel

    @property
    def median(self):
        return float(numpy.median(self.seconds))

    @property
    def rmse(self):
        return self.split["mean_square"] ** 0.5

    def point(self, measure):
        """[seconds, error, low, high] for a chart."""
        if measure == "unlike":
            return [self.median, self.unlike]
        split = self.split if measure == "rmse" else self.relative
        return [self.median, split["mean_square"] ** 0.5, split["low"], split["high"]]


def split_of(pictures, truth, relative):
    split = images.Split(pictures, truth, relative)
    low, high = split.interval()
    return {"mean_square": split.mean_square, "bias_square": split.bias_square, "variance": split.variance,
            "low": low, "high": high}, split.of_seeds


def ladder(context, line):
    """Samples per pixel. The cheaper go further, so that the curves span about the same seconds."""
    further = line.further or (1 if line == BASELINES[0] else
                               2 if line.integrator in ("supersample", "indirect-cache") else 4)
    return tuple(further * n for n in context.pick((2, 8, 32), (1, 4, 16, 64)))


def seeds_of(context):
    return context.pick(3, 4)


def reference_samples(context):
    return context.pick(1024, 2048)


def of_line(settings, line, spp):
    return settings.having(integrator=line.integrator, defines=line.defines, spp=spp)


def measure(context, settings, line, spp, truth):
    results = context.seeds(of_line(settings, line, spp), seeds_of(context))
    pictures = [r.image for r in results]
    split, squares = split_of(pictures, truth, False)
    relative, _ = split_of(pictures, truth, True)
    unlike = 1 - float(numpy.mean([images.ssim(p, truth.image) for p in pictures]))
    return Measured(line, spp, numpy.array([r.seconds for r in results]), squares, split, relative, unlike,
                    results[0].shades_per_pixel)


def curves_of(context, settings, lines, sure=numpy.inf):
    """A list of Measured, by rising samples, for each line, and the truth they are compared with, where it is sure."""
    for seed in range(seeds_of(context)):  # every line is timed in each: a busy hour spoils a seed of all, not one line
        for line in lines:
            for spp in ladder(context, line):
                context.seeds(of_line(settings, line, spp), 1, 1 + seed)
    truth = context.reference(settings, reference_samples(context), sure=sure)
    measured = {line: [measure(context, settings, line, n, truth) for n in ladder(context, line)] for line in lines}
    context.check(truth, min(m.split["mean_square"] for of in measured.values() for m in of))
    return measured, truth


def lines_of(subject, shading):
    """At rest one time bin is the default; without indirect light indirect-cache is supersample."""
    return [line for line in LINES if (subject.moving or "timebins=1" not in line.defines) and
            (shading == "path" or line.integrator != "indirect-cache")]


def size_of(context, subject, shading):
    return context.size_of(subject, 8, 3 if shading == "path" else 2)


def chart(name, title, text, measured, what):
    series = []
    for line, of in measured.items():
        series.append({"name": line.name, "points": [m.point(what) for m in of], "labels": ["%d spp" % m.spp for m in of],
                       "dashed": line.name == "as in the paper"})
    best = curves.front([[(*m.point(what)[:2], "%s, %d spp" % (m.line.name, m.spp)) for m in of]
                         for of in measured.values()])
    series.append({"name": "least error for the time", "front": True, "points": [list(p[:2]) for p in best],
                   "labels": [p[2] for p in best]})
    return {"kind": "chart", "id": name, "title": title, "text": text, "xlabel": "seconds", "ylabel": MEASURES[what],
            "xlog": True, "ylog": True, "series": series}


def drawn(of, seeds):
    """Seconds and RMSE along a curve, had only these seeds been rendered."""
    return ([float(numpy.median(m.seconds[seeds])) for m in of],
            [max(float(m.squares[seeds].mean()), 0.0) ** 0.5 for m in of])


def beside(measured, line, seeds, of_curve):
    """Of a line and of the better baseline, which alone is extrapolated: of_curve(seconds, errors, extend); None if either
    has none."""
    base = [of_curve(*drawn(measured[b], seeds), True) for b in BASELINES]
    own, best = of_curve(*drawn(measured[line], seeds), False), min((b for b in base if b is not None), default=None)
    return None if own is None or best is None else (own, best)


def faster(measured, line, rung, seeds):
    """How many times sooner than the better baseline a line has supersample's error at a rung; None: never."""
    error = drawn(measured[BASELINES[0]], seeds)[1][rung]
    pair = beside(measured, line, seeds, lambda *curve: curves.seconds_to(*curve[:2], error, extend=curve[2]))
    return pair and pair[1] / pair[0]


def error_ratio(measured, line, rung, seeds):
    """A line's error over the better baseline's, in the seconds that supersample takes at a rung; None: it takes longer."""
    budget = drawn(measured[BASELINES[0]], seeds)[0][rung]
    pair = beside(measured, line, seeds, lambda *curve: curves.error_after(*curve[:2], budget, extend=curve[2]))
    return pair and pair[0] / pair[1]


def remark(of, error):
    """Why a curve does not reach an error."""
    last = of[-1]
    bias = max(last.split["bias_square"], 0) ** 0.5
    return "bias %.2g" % bias if bias >= error else "not with %d samples" % last.spp


def comparisons(measured):
    """Rows of the tables of equal error and equal time, for the middle and the last rung of supersample."""
    base = measured[BASELINES[0]]
    every = numpy.arange(len(base[0].seconds))
    for rung in (len(base) // 2, len(base) - 1):
        for line in (line for line in measured if line not in BASELINES):
            row = [line.name, base[rung].spp, base[rung].rmse]
            for statistic, never in ((faster, -numpy.inf), (error_ratio, numpy.inf)):
                of = functools.partial(statistic, measured, line, rung)
                row += [of(every), *curves.interval(of, len(every), never)]
            yield row + ["" if row[3] is not None else remark(measured[line], base[rung].rmse)]


NAMES = ["scene", "light", "line", "integrator", "parameters", "spp", "seconds", "fastest", "slowest", "RMSE", "low", "high",
         "bias²", "variance", "relMSE", "relative bias²", "relative variance", "1-SSIM", "shades/px", "seeds",
         "reference's noise"]
COMPARED = ["scene", "line", "supersample's spp", "its RMSE", "times faster", "faster: low", "faster: high",
            "error ratio", "ratio: low", "ratio: high", "never because of"]


def csv_rows(subject, light, measured, truth):
    for of in measured.values():
        for m in of:
            yield [subject.name, light, m.line.name, m.line.integrator, " ".join(m.line.defines), m.spp, m.median,
                   m.seconds.min(), m.seconds.max(), m.rmse, m.split["low"], m.split["high"], m.split["bias_square"],
                   m.split["variance"], m.relative["mean_square"], m.relative["bias_square"], m.relative["variance"],
                   m.unlike, m.shades, len(m.seconds), truth.variance ** 0.5]


def between(low, high):
    return " … ".join("–" if end is None else "%.2f" % end for end in (low, high))


def accuracy(context, shading, light):
    items, numbers, compared, without = [], [], [], []
    for subject in context.paper_subjects():
        try:
            settings = context.settings(subject, shading=shading, resolution=size_of(context, subject, shading))
            lines = lines_of(subject, shading)
            try:
                measured, truth = curves_of(context, settings, lines)
            except TooNoisy:
                measured, truth = curves_of(context, settings, lines, SURE)
                without.append("Of %s, %.1f %% of the pixels are left out: there the reference itself, of %d samples, is "
                               "less sure than %g (rare, bright paths)."
                               % (subject.name, 100 * truth.unsure, reference_samples(context), SURE))
        except TooNoisy as error:
            without.append("%s is left out: %s." % (subject.name, error))
            continue
        numbers += csv_rows(subject, light, measured, truth)
        compared += [[subject.name] + row for row in comparisons(measured)]
        for what in context.pick(("rmse",), MEASURES):
            name = "-".join(("accuracy", light.replace(" ", "-"), subject.name) + (() if what == "rmse" else (what,)))
            title = "%s, %s: %s against seconds" % (subject.name, light, MEASURES[what])
            text = "%d x %d pixels." % size_of(context, subject, shading)
            items.append(chart(name, title, text, measured, what))
    if not numbers:
        raise TooNoisy(" ".join(without))
    name = "accuracy-" + light.replace(" ", "-")
    context.write_csv(name, NAMES, numbers)
    context.write_csv(name + "-compared", COMPARED, compared)
    head = columns("scene", "line", "spp", "RMSE", "faster", "95 %", "error", "95 %", "never because of", text=2)
    head[2]["digits"], head[3]["digits"] = 0, 4
    for i in (5, 7, 8):
        head[i]["type"] = "text"
    rows = [r[:5] + [between(*r[5:7]), r[7], between(*r[8:10]), r[10]] for r in compared]
    text = ("How many times sooner than the better of both supersample curves a line has the RMSE that supersample has "
            "with so many samples (faster), and the ratio of errors after the same seconds (below 1 is better). "
            "Where a curve begins better than that or ends sooner, its first or last point counts. Between points: straight "
            "lines on the logarithmic axes; of the sharing lines nothing is extrapolated.\n\n95 %% intervals from drawing the %d seeds, "
            "with their errors and their seconds, again. –: never, or that it takes longer.\n\n%s"
            % (seeds_of(context), " ".join([context.pick(SMALL, "")] + without)))
    return items + [{"kind": "table", "id": name + "-compared", "title": "Equal error and equal time, " + light,
                     "text": text, "columns": head, "rows": rows}]


def accuracy_direct(context):
    """Error against seconds under direct light, for ladders of sample counts."""
    return accuracy(context, "directlighting", "direct light")


def accuracy_paths(context):
    """Error against seconds for paths of depth 5, for ladders of sample counts."""
    return accuracy(context, "path", "paths of depth 5")
