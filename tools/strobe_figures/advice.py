"""What to use, by what was measured: reads the CSV files of the other figures."""

import csv
import math
import os

from . import curves
from .pareto import BASELINES
from .runs import Failed
from .sharing import columns

WITHIN = (0.02, 0.01, 0.005)


def table_of(context, name):
    path = context.path("csv", name + ".csv")
    if not os.path.exists(path):
        raise Failed("what to use follows from %s.csv, which is not there: make that figure first" % name)
    with open(path, newline="") as file:
        return list(csv.DictReader(file))


def grouped(rows, *names):
    groups = {}
    for row in rows:
        groups.setdefault(tuple(row[n] for n in names), []).append(row)
    return groups


def flags(row):
    return " ".join(["--integrator " + row["integrator"]] + ["-D " + d for d in row["parameters"].split()])


def reach(curve, error):
    """(seconds, samples) until the error is reached, between the measured points; None if it is not."""
    place = curves.position([float(r["RMSE"]) for r in curve], error)
    if place is None:
        return None
    return tuple(curves.at([float(r[n]) for r in curve], place) for n in ("seconds", "spp"))


def fastest(lines, error):
    """(seconds, samples, row) of the line that has the error first; None if none has."""
    reached = [(*found, curve[0]) for curve in lines for found in [reach(curve, error)] if found]
    return min(reached, key=lambda r: r[0], default=None)


def by_error(rows):
    for (scene, light), of_scene in grouped(rows, "scene", "light").items():
        lines = grouped(of_scene, "line")
        plain = [lines[(b.name,)] for b in BASELINES]
        for error in WITHIN:
            best, base = fastest(lines.values(), error), fastest(plain, error)
            if best is None:
                yield [scene, light, error, "none within the samples measured"] + [None] * 4
                continue
            yield [scene, light, error, flags(best[2]), math.ceil(best[1]), best[0], base and base[0],
                   base and base[0] / best[0]]


def by_difficulty(rows):
    for (scene, turned), of_scene in grouped(rows, "scene", "turned").items():
        values = list(grouped(of_scene, "value").items())
        for (value,), lines in (values[0], values[-1]):
            best = max(lines, key=lambda r: float(r["worth"]))
            yield [scene, "%s %g" % (turned, float(value)), flags(best), float(best["RMSE"]), float(best["seconds"]),
                   float(best["worth"])]


def what_to_use(context):
    """The fastest way to an error, for each scene; and the most efficient way for each stress, easy and hard."""
    measured = table_of(context, "accuracy-direct-light") + table_of(context, "accuracy-paths-of-depth-5")
    by_scene, by_stress = list(by_error(measured)), list(by_difficulty(table_of(context, "stress")))
    names = ["scene", "light", "RMSE within", "fastest", "--spp", "seconds", "supersample (s)", "times faster"]
    stress_names = ["stress", "turned to", "most efficient", "RMSE", "seconds", "worth"]
    context.write_csv("what-to-use", names, by_scene)
    context.write_csv("what-to-use-under-stress", stress_names, by_stress)
    head, stress_head = columns(*names, text=2), columns(*stress_names, text=3)
    head[3]["type"], head[4]["digits"], stress_head[3]["digits"] = "text", 0, 4
    return [{"kind": "table", "id": "what-to-use", "title": "The fastest way to an error",
             "text": "From the curves of speed against accuracy, between their points along straight lines. The baseline is "
                     "the better of supersample with the scene's light samples and with one.",
             "columns": head, "rows": by_scene},
            {"kind": "table", "id": "what-to-use-under-stress", "title": "Under stress",
             "text": "The method with the least seconds times mean square error where a stress scene is easiest and where "
                     "it is hardest; worth: supersample's over its own.",
             "columns": stress_head, "rows": by_stress}]
