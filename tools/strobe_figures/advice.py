"""Recommended methods, derived from the CSV files of other figures."""

import csv
import math
import os

from . import curves, items
from .items import columns
from .methods import BASELINES
from .runs import Failed

ERRORS = (0.02, 0.01, 0.005)


def read_rows(context, name):
    """Returns the rows of csv/NAME.csv as dictionaries. Raises Failed if it does not exist."""
    path = context.path("csv", name + ".csv")
    if not os.path.exists(path):
        raise Failed("the recommendations are computed from %s.csv, which does not exist: make that figure first" % name)
    with open(path, newline="") as file:
        return list(csv.DictReader(file))


def grouped(rows, *names):
    """Returns {values of the named columns: rows}."""
    groups = {}
    for row in rows:
        groups.setdefault(tuple(row[n] for n in names), []).append(row)
    return groups


def flags(row):
    """Returns the command line options of a row's method."""
    return " ".join(["--integrator " + row["integrator"]] + ["-D " + d for d in row["parameters"].split()])


def cost_of(curve, error):
    """Returns (seconds, samples per pixel) until a curve reaches an error, interpolated between the measured points, or
    None if it does not."""
    position = curves.position([float(r["RMSE"]) for r in curve], error)
    if position is None:
        return None
    return tuple(curves.value_at([float(r[n]) for r in curve], position) for n in ("seconds", "spp"))


def fastest(lines, error):
    """Returns (seconds, samples per pixel, row) of the curve that reaches an error first, or None."""
    costs = [(*cost, curve[0]) for curve in lines for cost in [cost_of(curve, error)] if cost]
    return min(costs, key=lambda c: c[0], default=None)


def rows_by_error(rows):
    """Yields the rows of the fastest method by scene and error."""
    for (scene, light), of_scene in grouped(rows, "scene", "light").items():
        lines = grouped(of_scene, "method")
        baselines = [lines[(b.name,)] for b in BASELINES]
        for error in ERRORS:
            best = fastest(lines.values(), error)
            base = fastest(baselines, error)
            if best is None:
                yield [scene, light, error, "not reached within the measured samples"] + [None] * 4
                continue
            yield [scene, light, error, flags(best[2]), math.ceil(best[1]), best[0], base and base[0],
                   base and base[0] / best[0]]


def rows_by_difficulty(rows):
    """Yields the rows of the most efficient method at the first and the last value of each sweep."""
    for (scene, sweep), of_scene in grouped(rows, "scene", "sweep").items():
        values = list(grouped(of_scene, "value").items())
        for (value,), methods in (values[0], values[-1]):
            best = max(methods, key=lambda r: float(r["relative efficiency"]))
            yield [scene, "%s %g" % (sweep, float(value)), flags(best), float(best["RMSE"]), float(best["seconds"]),
                   float(best["relative efficiency"])]


def what_to_use(context):
    """The fastest method by scene and error, and the most efficient method of each stress scene."""
    measured = read_rows(context, "accuracy-direct-light") + read_rows(context, "accuracy-paths-of-depth-5")
    by_error = list(rows_by_error(measured))
    by_difficulty = list(rows_by_difficulty(read_rows(context, "stress")))
    names = ["scene", "light", "RMSE", "fastest method", "--spp", "seconds", "supersample (s)", "speed-up"]
    stress_names = ["scene", "value", "most efficient method", "RMSE", "seconds", "relative efficiency"]
    context.write_csv("what-to-use", names, by_error)
    context.write_csv("what-to-use-under-stress", stress_names, by_difficulty)
    head = columns(*names, text=2)
    head[3]["type"] = "text"
    head[4]["digits"] = 0
    stress_head = columns(*stress_names, text=3)
    stress_head[3]["digits"] = 4
    return [items.table("what-to-use", "Fastest method by error", head, by_error,
                        "Interpolated from the curves of error over seconds. The speed-up is over the better of supersample "
                        "with the scene's light samples and with one light sample."),
            items.table("what-to-use-under-stress", "Most efficient method of each stress scene", stress_head, by_difficulty,
                        "The method with the smallest product of seconds and mean square error, at the easiest and the hardest "
                        "value of each sweep. Relative efficiency: supersample's product over the method's.")]
