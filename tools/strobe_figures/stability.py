"""Where the methods fail: the scenes of scenes/stress turned from easy to hard, and how the work is cut."""

import glob
import os

import numpy

from . import images
from .context import ROOT, Subject, TooNoisy
from .pareto import Line
from .sharing import columns
from .sweeps import read_sweep, scene_with

BASE = Line("supersample", "supersample")
METHODS = (BASE, Line("msaa", "msaa"), Line("msaa-cache", "msaa-cache"),
           Line("msaa-cache, blocks of 0.25", "msaa-cache", ("blocksize=0.25",)))
INDIRECT = Line("indirect-cache", "indirect-cache")
SAMPLES = 16
NAMES = ["scene", "turned", "value", "line", "integrator", "parameters", "seconds", "RMSE", "low", "high", "bias²",
         "variance", "shades/px", "worth", "reference's noise"]


class Case:
    """One method at one value of a sweep."""

    def __init__(self, results, context, truth):
        self.error = images.Split([r.image for r in results], truth)
        self.seconds = float(numpy.median([r.seconds for r in results]))
        self.shades = results[0].shades_per_pixel
        self.picture = os.path.relpath(results[0].path, context.out)

    @property
    def cost(self):
        """Seconds times mean square error: what unbiased sampling leaves the same, however many samples it takes."""
        return self.seconds * self.error.mean_square

    def worth(self, base):
        """How many times sooner it had its error than supersample would have. Below 1: not worth it."""
        return base.cost / self.cost if self.cost > 0 else float("inf")


def values_of(context, sweep):
    """All, or in small figures the ends and the middle."""
    middle = sweep.values[len(sweep.values) // 2]
    few = {sweep.values[0], middle, sweep.values[-1]}
    return [v for v in sweep.values if not context.quick or v in few]


def methods_of(path):
    """indirect-cache is supersample where light is direct."""
    with open(path, encoding="utf-8") as file:
        return METHODS + (INDIRECT,) if 'Integrator "path"' in file.read() else METHODS


def by_seed(context, settings, methods):
    """{method: results}. All methods are timed for a seed before the next: a busy hour spoils a seed, not a method."""
    results = {method: [] for method in methods}
    for seed in range(context.pick(2, 4)):
        for method, of in results.items():
            of.append(context.run(settings.having(integrator=method.integrator, defines=method.defines, seed=1 + seed)))
    return results


def turned(context, path, sweep):
    """{value: ({method: Case}, truth)} in the sweep's order, and the values for which there is no truth."""
    subject = Subject(os.path.splitext(os.path.basename(path))[0], path, ())
    found, without = {}, []
    for value in values_of(context, sweep):
        settings = context.settings(subject, spp=SAMPLES, text=scene_with(path, value))
        truth = context.reference(settings, context.pick(256, 1024), parts=context.pick(2, 4))
        cases = {m: Case(results, context, truth) for m, results in by_seed(context, settings, methods_of(path)).items()}
        try:
            context.check(truth, min(c.error.mean_square for c in cases.values()))
            found[value] = cases, truth
        except TooNoisy:
            without.append(value)
    if not found:
        raise TooNoisy("%s has no truth at any value" % subject.name)
    return found, without


def ends(found, method):
    """The first value from which on supersample does better until the end; None if the method is worth it there."""
    first = None
    for value, (cases, _) in found.items():
        if cases[method].worth(cases[BASE]) < 1:
            first = value if first is None else first
        else:
            first = None
    return first


def spoken(found, method):
    """Where a method is worth it, in words."""
    good = [v for v, (cases, _) in found.items() if cases[method].worth(cases[BASE]) >= 1]
    if not good:
        return "nowhere"
    if len(good) == len(found):
        return "everywhere"
    return "at " + ", ".join("%g" % v for v in good)


def chart(name, sweep, found, without):
    values, methods = list(found), list(found[next(iter(found))][0])
    unit = " (%s)" % sweep.unit if sweep.unit else ""
    series = [{"name": m.name, "points": [[v, found[v][0][m].error.rmse, *found[v][0][m].error.interval()]
                                          for v in values]} for m in methods]
    stops = {}
    for method in methods[1:]:
        stop = ends(found, method)
        if stop is not None and stop != values[0]:
            stops.setdefault(stop, []).append(method.name)
    text = "Better than supersample in the same time: %s. Dotted: from there on the named are worse." % "; ".join(
        "%s %s" % (m.name, spoken(found, m)) for m in methods[1:])
    if without:
        text += " Left out, because no truth could be rendered that is sure enough: %s." % ", ".join("%g" % v for v in without)
    return {"kind": "chart", "id": "stress-" + name, "title": "%s: error by %s" % (name, sweep.name), "text": text,
            "xlabel": sweep.name + unit, "ylabel": "RMSE at %d samples" % SAMPLES,
            "xlog": min(values) > 0 and max(values) > 8 * min(values), "ylog": True, "series": series,
            "marks": [{"x": x, "label": ", ".join(names)} for x, names in stops.items()]}


def worst(picture, truth, width, height):
    """[x, y, width, height] of where a picture errs most."""
    wrong = ((images.clamp(picture) - images.clamp(truth)) ** 2).sum(axis=2)
    sums = numpy.pad(wrong.cumsum(axis=0).cumsum(axis=1), ((1, 0), (1, 0)))
    inside = sums[height:, width:] - sums[:-height, width:] - sums[height:, :-width] + sums[:-height, :-width]
    y, x = numpy.unravel_index(inside.argmax(), inside.shape)
    return [int(x), int(y), width, height]


def far_end(context, name, sweep, found):
    """What it looks like where it is hardest; the worst comes first, and so is what a page shows beside the truth."""
    value = list(found)[-1]
    cases, truth = found[value]
    path = context.path("pictures", "stress-%s-truth.exr" % name)
    images.write_exr(path, truth.image)
    crops = [worst(images.read(context.path(cases[m].picture)), truth.image, 40, 30) for m in METHODS[1:3]]
    pictures = [{"label": m.name, "file": c.picture,
                 "caption": "RMSE %.4f, %.2f shades per pixel, %.2f s" % (c.error.rmse, c.shades, c.seconds)}
                for m, c in sorted(cases.items(), key=lambda case: -case[1].error.rmse)]
    pictures.append({"label": "truth", "file": os.path.relpath(path, context.out), "caption": "supersample, other seeds"})
    return {"kind": "images", "id": "stress-%s-pictures" % name, "title": "%s at %s %g" % (name, sweep.name, value),
            "text": "%d samples per pixel. The frames show where msaa and where msaa-cache err most." % SAMPLES,
            "images": pictures, "reference": len(pictures) - 1, "crops": crops}


def csv_rows(name, sweep, found):
    for value, (cases, truth) in found.items():
        for method, case in cases.items():
            yield [name, sweep.name, value, method.name, method.integrator, " ".join(method.defines), case.seconds,
                   case.error.rmse, *case.error.interval(), case.error.bias_square, case.error.variance, case.shades,
                   case.worth(cases[BASE]), truth.variance ** 0.5]


def table_rows(name, sweep, found):
    first, last = (found[v][0] for v in (list(found)[0], list(found)[-1]))
    for m in first:
        yield [name, m.name, "%g … %g" % (list(found)[0], list(found)[-1]), first[m].error.rmse, last[m].error.rmse,
               last[m].error.bias, first[m].seconds, last[m].seconds, first[m].worth(first[BASE]), last[m].worth(last[BASE]),
               "" if m == BASE else spoken(found, m)]


def stress(context):
    """Every scene of scenes/stress turned until sharing fails, and whether it is worth it there."""
    items, numbers, rows = [], [], []
    for path in sorted(glob.glob(os.path.join(ROOT, "scenes", "stress", "[!.]*.scene"))):
        sweep, name = read_sweep(path), os.path.splitext(os.path.basename(path))[0]
        found, without = turned(context, path, sweep)
        items += [chart(name, sweep, found, without), far_end(context, name, sweep, found)]
        numbers += csv_rows(name, sweep, found)
        rows += table_rows(name, sweep, found)
    context.write_csv("stress", NAMES, numbers)
    head = columns("scene", "line", "range", "RMSE at first", "at last", "bias at last", "seconds at first", "seconds at last",
                   "worth at first", "worth at last", "worth it", text=3)
    for column in head[3:6]:
        column["digits"] = 4
    head[-1]["type"] = "text"
    text = ("At %d samples per pixel. What a method is worth: supersample's seconds times its mean square error, over the "
            "method's own. Below 1, supersample with the method's seconds would err less. Supersample is taken to gain as "
            "much from time as independent samples do; it gains more, so sharing looks better here than it is." % SAMPLES)
    return [{"kind": "table", "id": "stress-table", "title": "Where sharing is worth its error", "text": text,
             "columns": head, "rows": rows}] + items


WAYS = [("as it is", {}, ())]
WAYS += [("cache-mb", {}, ("cache-mb=" + size,)) for size in ("unbounded", "4", "1", "0.25", "0.0625", "0.004", "0")]
WAYS += [("tile", {"tile": size}, ()) for size in (4, 16, 64, 256)]
WAYS += [("threads", {"threads": count}, ()) for count in (1, 2, 4, 8)]


def work_and_memory(context):
    """Cache memory, tiles and threads: what they cost, and that they leave the picture as it is."""
    subject = Subject("moving-shadow", os.path.join(ROOT, "scenes", "stress", "moving-shadow.scene"), ())
    settings = context.settings(subject, integrator="msaa-cache", spp=context.pick(SAMPLES, 64))
    rows, expected, repeats = [], context.run(settings).image, context.pick(3, 5)
    for repeat in range(repeats):  # all ways in turn, for the same reason as above
        for _, changes, defines in WAYS:
            context.run(settings.having(defines=defines, repeat=repeat, **changes))
    for way, changes, defines in WAYS:
        result, seconds = context.timed(settings.having(defines=defines, **changes), repeats)
        value = str(next(iter(changes.values()))) if changes else defines[0].split("=")[1] if defines else ""
        same = numpy.array_equal(result.image, expected)
        rows.append([way, value, seconds, result.shades_per_pixel, "the same bits" if same else "other bits"])
    names = ["turned", "value", "seconds", "shades/px", "picture"]
    context.write_csv("work-and-memory", names, rows)
    head = columns(*names, text=2)
    head[-1]["type"] = "text"
    return [{"kind": "table", "id": "work-and-memory", "title": "Cache memory, tiles and threads",
             "text": "msaa-cache on moving-shadow, %d samples per pixel." % settings.spp, "columns": head, "rows": rows}]
