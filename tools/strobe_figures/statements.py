"""The paper's statements and what was measured, computed from the CSV files of the paper's figures."""

import csv
import os

from . import items
from .methods import CACHE_BEHIND_MUTEX, CACHE_PER_THREAD, CACHE_PER_TILE, MSAA_CACHE, MSAA_CACHE_1_BIN
from .runs import Failed

HOLDS = "holds"
FAILS = "does not hold"


def rows_of(context, name):
    """Returns the rows of csv/NAME.csv as dictionaries, with numbers as floats. Raises Failed if it does not exist."""
    path = context.path("csv", name + ".csv")
    if not os.path.exists(path):
        raise Failed("the statements are checked against %s.csv, which does not exist: make that figure first" % name)
    with open(path, newline="") as file:
        return [{k: _number(v) for k, v in row.items()} for row in csv.DictReader(file)]


def _number(text):
    try:
        return float(text)
    except ValueError:
        return text


def by(rows, key, value="seconds"):
    """Returns {row[key]: row[value]}."""
    return {row[key]: row[value] for row in rows}


def verdict(holds):
    """Returns the verdict as text."""
    return HOLDS if holds else FAILS


# Each function returns (measurement, verdict, reason for a difference) of one statement.


def msaa_shades(context):
    """Figure 1: shades per pixel of msaa."""
    covered = by(rows_of(context, "figure-1"), "integrator", "shades per covered px")
    measured = "%.2f and %.2f shades per covered pixel" % (covered["supersample"], covered["msaa"])
    holds = covered["msaa"] < 1.4
    return measured, verdict(holds), "" if holds else (
        "A pixel of this smaller image contains more triangles, and each takes a shade. At the scene's own size the statement "
        "holds.")


def cache_speedup(context):
    """Figure 2: speed-up of msaa-cache on the moving pair."""
    seconds = by(rows_of(context, "figure-2"), "method")
    ratios = {name: seconds["supersample"] / s for name, s in seconds.items()}
    methods = (MSAA_CACHE, MSAA_CACHE_1_BIN, CACHE_PER_THREAD)
    measured = "supersample: %.1f s. Speed-up: %s" % (
        seconds["supersample"], "; ".join("%s: %.1f" % (m.name, ratios[m.name]) for m in methods))
    return measured, verdict(max(ratios.values()) >= 3.9), (
        "Four time bins, the default, take four times the shades and halve the error. In small images a block holds fewer "
        "samples. In the paper's renderer, a shade costs more relative to a ray.")


def motion_shades(context):
    """Figure 3a: shades of msaa in motion."""
    counts = by(rows_of(context, "figure-3a"), "shutter", "shades/px")
    return ("%.2f shades per pixel static, %.2f moving" % (counts["static"], counts["moving"]),
            verdict(counts["moving"] > 1.5 * counts["static"]), "")


def overshading(context):
    """Figure 3b: triangles shaded in two neighboring pixels."""
    rows = rows_of(context, "figure-3b")
    shades, triangles, overshade = (sum(row[name] for row in rows) for name in ("shades", "triangles", "overshade"))
    return ("%d shades of %d triangles in two pixels, over %d seeds; %d repeat a shade of the other pixel" %
            (shades, triangles, len(rows), overshade), verdict(overshade > 0), "")


def task_shades(context):
    """Figure 4: shades by task size."""
    counts = [row["shades/px"] for row in rows_of(context, "figure-4")]
    return ("%.2f, %.2f and %.2f shades per pixel with tasks of 4, 128 and 512 pixels" % tuple(counts),
            verdict(counts[0] > counts[1] > counts[2]), "")


def task_times(context):
    """Figure 5: render time by task size."""
    rows = [r for r in rows_of(context, "figure-5") if r["method"] == CACHE_PER_TILE.name]
    best = min(rows, key=lambda r: r["seconds"])
    falls = best["seconds"] < .9 * rows[0]["seconds"]
    rises = rows[-1]["seconds"] > 1.1 * best["seconds"]
    measured = "%.2f s with tasks of %d pixels, minimum %.2f s with %d, %.2f s with %d" % (
        rows[0]["seconds"], rows[0]["task size"], best["seconds"], best["task size"], rows[-1]["seconds"],
        rows[-1]["task size"])
    return measured, verdict(falls and rises), "" if rises else (
        "With few threads, and tasks no larger than the image, threads seldom wait for each other.")


def mutex(context):
    """Text: render time with a cache behind a mutex."""
    seconds = by(rows_of(context, "figure-2"), "method")
    ratio = seconds[CACHE_BEHIND_MUTEX.name] / seconds[CACHE_PER_THREAD.name]
    return ("%.1f times the seconds of a cache per thread" % ratio, verdict(ratio > 1.5), "" if ratio > 1.5 else
            "Few threads seldom wait for the mutex, and rays, most of the render time, are traced without it.")


def largest_speedup(context):
    """Figure 6: the scene with the largest speed-up."""
    rows = rows_of(context, "figure-6")
    methods = (MSAA_CACHE, MSAA_CACHE_1_BIN, CACHE_PER_THREAD)
    best = {(r["scene"], r["light"]): max(r[m.name] for m in methods) for r in rows}
    scene, light = max(best, key=best.get)
    if "bunny" not in by(rows, "scene", "light"):
        return "%s, %s: %.1f" % (scene, light, best[scene, light]), "not measured", "The data of the Bunny is missing."
    of_bunny = ", ".join("%.1f (%s)" % (v, k[1]) for k, v in best.items() if k[0] == "bunny")
    return ("%s, %s: %.1f; bunny: %s" % (scene, light, best[scene, light], of_bunny), verdict(scene == "bunny"),
            "" if scene == "bunny" else
            "Half of the Bunny's visibility samples hit nothing, and tracing costs the same with every integrator. Scenes with "
            "more shades gain more.")


STATEMENTS = [
    ("1", "8 shades per pixel for supersample, fewer than 1.4 for msaa, with a slight difference in the highlights",
     msaa_shades),
    ("2", "78.3 s for supersample, 20.0 s for msaa-cache: a speed-up of 3.9", cache_speedup),
    ("3a", "msaa saves no shades where objects move fast", motion_shades),
    ("3b", "neighboring pixels repeat shades of objects that move from one to the other", overshading),
    ("4", "smaller tasks repeat more shades", task_shades),
    ("5", "larger tasks are faster, until there are too few for the threads", task_times),
    ("text", "one cache behind a mutex is much slower", mutex),
    ("6", "the Bunny has the largest speed-up", largest_speedup),
]


def statements(context):
    """The paper's statements, and what was measured."""
    rows = [[figure, statement, *check(context)] for figure, statement, check in STATEMENTS]
    names = ["figure", "paper", "measured", "verdict", "reason"]
    context.write_csv("statements", names, rows)
    return [items.table("statements", "Statements of the paper, and measurements", items.columns(*names, text=len(names)), rows,
                        "The verdicts are computed from the measurements of this report.")]
