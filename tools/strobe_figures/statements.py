"""What the paper says beside what was measured here: reads the CSV files of the paper's figures."""

import csv
import os

from .runs import Failed

HOLDS, NOT = "holds", "does not hold"


def rows_of(context, name):
    path = context.path("csv", name + ".csv")
    if not os.path.exists(path):
        raise Failed("the statements are read from %s.csv, which is not there: make that figure first" % name)
    with open(path, newline="") as file:
        return [{k: _number(v) for k, v in row.items()} for row in csv.DictReader(file)]


def _number(text):
    try:
        return float(text)
    except ValueError:
        return text


def by(rows, key, value="seconds"):
    return {row[key]: row[value] for row in rows}


def shades(context):
    covered = by(rows_of(context, "figure-1"), "integrator", "shades per covered px")
    here = "%.2f shades against %.2f, of pixels that see a surface" % (covered["supersample"], covered["msaa"])
    if covered["msaa"] < 1.4:
        return here, HOLDS, ""
    return here, NOT, ("A pixel of this smaller picture holds more triangles, and each asks for a shade; "
                       "at the scene's own size it holds.")


def pair(context):
    seconds = by(rows_of(context, "figure-2"), "integrator")
    ratios = {name: seconds["supersample"] / s for name, s in seconds.items()}
    here = "%.1f s; msaa-cache %.1fx, with one time bin %.1fx, the paper's way %.1fx" % (
        seconds["supersample"], ratios["msaa-cache"], ratios["msaa-cache, one time bin"], ratios["as in the paper"])
    best = max(ratios.values())
    return here, HOLDS if best >= 3.9 else NOT, ("Four time bins, the default, shade four times as often and halve the error. "
                                                 "In small pictures blocks hold fewer samples. The paper's shades are also "
                                                 "dearer beside its rays than ours are.")


def motion(context):
    counts = by(rows_of(context, "figure-3a"), "shutter", "shades/px")
    return ("%.2f shades per pixel still, %.2f moving" % (counts["still"], counts["moving"]),
            HOLDS if counts["moving"] > 1.5 * counts["still"] else NOT, "")


def overshade(context):
    rows = rows_of(context, "figure-3b")
    shades, triangles, again = (sum(row[name] for row in rows) for name in ("shades", "triangles", "overshade"))
    return ("%d shades for %d triangles in two pixels, over %d seeds: %d shaded again" % (shades, triangles, len(rows), again),
            HOLDS if again > 0 else NOT, "")


def tasks(context):
    counts = [row["shades/px"] for row in rows_of(context, "figure-4")]
    return ("%.2f, %.2f, %.2f shades per pixel for tasks of 4, 128, 512" % tuple(counts),
            HOLDS if counts[0] > counts[1] > counts[2] else NOT, "")


def task_times(context):
    rows = [r for r in rows_of(context, "figure-5") if r["cache"] == "scope=tile"]
    best = min(rows, key=lambda r: r["seconds"])
    slows = rows[-1]["seconds"] > 1.1 * best["seconds"]
    here = "%.2f s at 4 pixels, least %.2f s at %d, %.2f s at %d" % (
        rows[0]["seconds"], best["seconds"], best["task size"], rows[-1]["seconds"], rows[-1]["task size"])
    falls = best["seconds"] < .9 * rows[0]["seconds"]
    return here, HOLDS if falls and slows else NOT, (
        "" if slows else "Few threads, and tasks no larger than the picture: they seldom wait for one another.")


def mutex(context):
    seconds = by(rows_of(context, "figure-2"), "integrator")
    ratio = seconds["behind one mutex"] / seconds["as in the paper"]
    return ("%.1f times the seconds of a cache for each thread" % ratio, HOLDS if ratio > 1.5 else NOT,
            "With few threads little is waited for, and rays, which are most of the work here, are traced without the lock." if ratio <= 1.5
            else "")


def most(context):
    rows = rows_of(context, "figure-6")
    ways = ("msaa-cache", "msaa-cache, one time bin", "as in the paper")
    best = {(r["scene"], r["light"]): max(r[w] for w in ways) for r in rows}
    scene, light = max(best, key=best.get)
    if "bunny" not in by(rows, "scene", "light"):
        return "%s, %s: %.1fx" % (scene, light, best[scene, light]), "not measured", "Bunny's data is missing."
    return ("%s, %s: %.1fx; bunny: %s" % (scene, light, best[scene, light],
                                           ", ".join("%.1fx (%s)" % (v, k[1]) for k, v in best.items() if k[0] == "bunny")),
            HOLDS if scene == "bunny" else NOT, "" if scene == "bunny" else
            "Half of Bunny's samples meet nothing, and what is traced costs as much whoever shades; where more is shaded, more "
            "is saved.")


STATEMENTS = [
    ("1", "8 shades per pixel against fewer than 1.4, at a slight difference in the highlights", shades),
    ("2", "78.3 s against 20.0 s: 3.9x", pair),
    ("3a", "msaa does not save shades where things move fast", motion),
    ("3b", "neighboring pixels shade again what moves from one to the other", overshade),
    ("4", "the smaller the task, the more is shaded again", tasks),
    ("5", "larger tasks are faster, until they are too few for the threads", task_times),
    ("text", "one cache behind a mutex is dramatically slower", mutex),
    ("6", "the greatest speed-up is Bunny's", most),
]


def statements(context):
    """The paper's statements beside what was measured here."""
    rows = [[figure, said, *of(context)] for figure, said, of in STATEMENTS]
    names = ["figure", "the paper", "here", "verdict", "why"]
    context.write_csv("statements", names, rows)
    return [{"kind": "table", "id": "statements", "title": "What the paper says, and what was measured",
             "text": "Verdicts are computed from this run's numbers.",
             "columns": [{"name": n, "type": "text"} for n in names], "rows": rows}]
