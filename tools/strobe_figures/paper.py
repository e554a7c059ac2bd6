"""The figures of "Multisampling and Motion Blur in a Ray Tracer" (Kumar and Gifford), with the paper's numbers."""

import csv
import os

import numpy

from . import images, items
from .charts import pyplot
from .items import columns
from .methods import (CACHE_BEHIND_MUTEX, CACHE_PER_THREAD, CACHE_PER_TILE, MSAA, MSAA_CACHE, MSAA_CACHE_1_BIN,
                      SUPERSAMPLE)

MOVING = ("anim-killeroos-moving", "moving-pair")
SEEDS_OF_FIGURE_3B = 16  # the counts of two pixels vary between seeds


def heat(shades, maximum):
    """Returns the paper's colors of a heat map: blue for one shade or less, red for `maximum`."""
    x = numpy.clip((shades - 1) / (maximum - 1), 0, 1)[..., None]
    stops = numpy.array([[0, 0, 1], [0, 1, 1], [0, 1, 0], [1, 1, 0], [1, 0, 0]], dtype=float)
    position = x * 4
    low = numpy.minimum(position.astype(int), 3)
    fraction = position - low
    return stops[low[..., 0]] * (1 - fraction) + stops[low[..., 0] + 1] * fraction


def save_heat(context, name, shades, maximum):
    """Writes a heat map as PNG. Returns its path relative to the output folder."""
    path = context.path("pictures", name + ".png")
    images.write_png(path, heat(shades, maximum))
    return os.path.relpath(path, context.out)


def relative(context, result):
    """Returns the path of a render relative to the output folder."""
    return os.path.relpath(result.path, context.out)


def of_method(settings, method):
    """Returns settings with the integrator and the parameters of a method."""
    return settings.with_changes(integrator=method.integrator, defines=method.defines)


def figure_1(context):
    """Bunny close-up: supersample and msaa at 8 samples per pixel."""
    subject = context.named("bunny", "still")
    settings = context.settings(subject, spp=8, resolution=context.size_of(subject, 2, 1), layers=("shades",))
    pictures, rows = [], []
    covered = 1
    for method in (SUPERSAMPLE, MSAA):
        result = context.run(of_method(settings, method))
        if method == SUPERSAMPLE:
            covered = 1 - result.stats["missed"] / result.stats["visibilitySamples"]
        rows.append([method.name, result.shades_per_pixel, result.shades_per_pixel / covered])
        pictures.append({"label": method.name, "file": relative(context, result),
                         "caption": "%.2f shades per pixel" % result.shades_per_pixel})
    width, height = settings.resolution
    names = ["integrator", "shades/px", "shades per covered px"]
    context.write_csv("figure-1", names, rows)
    text = ("Paper: 8 shades per pixel for supersample, fewer than 1.4 for msaa, and a slight difference in the highlights. "
            "These images have %d x %d pixels. A covered pixel is one that sees a surface." % (width, height))
    if subject.of_paper:
        text += (" At the scene's own 640 x 480, msaa takes 1.06 shades per pixel and 1.38 per covered pixel; larger images "
                 "take fewer.")
    crop = [int(width * .3), int(height * .25), int(width * .25), int(height * .3)]
    number = "Paper Figure 1"
    return [items.images("figure-1", "%s: supersample and msaa" % subject.name, text, pictures, 0, [crop], number),
            items.table("figure-1-table", "Shades per pixel", columns(*names), rows, number=number + ", table")]


def figure_2(context):
    """The moving pair: supersample and msaa-cache, with render times."""
    subject = context.named(*MOVING)
    settings = context.settings(subject, spp=64, resolution=context.size_of(subject, 4, 1))
    pictures, seconds, rows = [], {}, []
    for method in (SUPERSAMPLE, MSAA_CACHE, MSAA_CACHE_1_BIN, CACHE_PER_THREAD, CACHE_BEHIND_MUTEX):
        result, seconds[method] = context.timed(of_method(settings, method))
        speedup = seconds[SUPERSAMPLE] / seconds[method]
        rows.append([method.name, seconds[method], speedup, result.shades_per_pixel])
        pictures.append({"label": method.name, "file": relative(context, result),
                         "caption": "%.2f s, speed-up %.1f" % (seconds[method], speedup)})
    names = ["method", "seconds", "speed-up", "shades/px"]
    context.write_csv("figure-2", names, rows)
    number = "Paper Figure 2"
    return [items.images("figure-2", "%s: supersample and msaa-cache" % subject.name,
                         "Paper: 78.3 s for supersample, 20.0 s for msaa-cache, a speed-up of 3.9. Here: 64 samples per "
                         "pixel, medians of three renders.", pictures, 0, number=number),
            items.table("figure-2-table", "Render times", columns(*names), rows, number=number + ", table")]


def figure_3a(context):
    """Heat maps of msaa's shades: a static scene and the same scene in motion."""
    subject = context.named(*MOVING)
    settings = context.settings(subject, integrator="msaa", spp=64, resolution=context.size_of(subject, 2, 1),
                                layers=("shades",))
    pictures, rows = [], []
    for label, changed in (("static", settings.with_changes(frame_time="0.5")), ("moving", settings)):
        shades = context.run(changed).layer("shades")
        pictures.append({"label": label, "file": save_heat(context, "figure-3a-" + label, shades, 64),
                         "caption": "%.2f shades per pixel, maximum %d" % (shades.mean(), shades.max())})
        rows.append([label, float(shades.mean()), float(shades.max())])
    context.write_csv("figure-3a", ["shutter", "shades/px", "maximum"], rows)
    return [items.images("figure-3a", "Shades of msaa, static and moving",
                         "Blue: one shade per pixel; red: 64. Paper: msaa saves no shades where objects move fast.", pictures,
                         number="Paper Figure 3a")]


def read_samples(file_name):
    """Reads the sample table of a render of two pixels. Returns the samples with a hit, the shaded samples, and the
    shaded samples by triangle."""
    with open(file_name) as file:
        samples = [s for s in csv.DictReader(file) if s["primitive"] != ""]
    shaded = [s for s in samples if int(s["shades"])]
    triangles = {}
    for s in shaded:
        triangles.setdefault((s["instance"], s["geometry"], s["primitive"]), []).append(s)
    return samples, shaded, triangles


def draw_samples(path, samples, shaded, triangles):
    """Draws the samples of two pixels on the film as PNG."""
    def mark(axes, points, size, color, label, **options):
        axes.plot([float(s["film_x"]) for s in points], [float(s["film_y"]) for s in points], "x", color=color,
                  markersize=size, label=label, **options)

    figure, axes = pyplot.subplots(figsize=(7.2, 3.9), layout="constrained")
    repeated = [s for group in triangles.values() if len(group) > 1 for s in group]
    mark(axes, samples, 5, "#1f5fbf", "visibility samples")
    mark(axes, shaded, 8, "#d02020", "shades")
    mark(axes, repeated, 13, "#d02020", "same triangle shaded in both pixels", markeredgewidth=3)
    pixel_columns = sorted({int(s["x"]) for s in samples})
    for edge in [pixel_columns[0], pixel_columns[-1], pixel_columns[-1] + 1]:
        axes.axvline(edge, color="black", linewidth=0.8)
    axes.set_aspect("equal")
    axes.set_xlabel("film x (pixels)")
    axes.set_ylabel("film y (pixels)")
    axes.legend(fontsize=7, loc="upper left", bbox_to_anchor=(1, 1))
    figure.savefig(path, dpi=110)
    pyplot.close(figure)


def figure_3b(context):
    """Two neighboring pixels: visibility samples, shades, and triangles shaded in both.

    Counts many seeds and draws the first with a triangle shaded in both pixels.
    """
    subject = context.named(*MOVING)
    width, height = context.size_of(subject, 2, 2)
    x = int(width * .27)
    y = int(height * .47)
    crop = ((x - .5) / width, (x + 1.5) / width, (y - .5) / height, (y + .5) / height)
    settings = context.settings(subject, integrator="msaa", spp=16, resolution=(width, height), crop=crop, samples=True)
    tables = [read_samples(run.samples) for run in context.run_seeds(settings, SEEDS_OF_FIGURE_3B)]
    rows = [[len(samples), len(shaded), len(triangles), len(shaded) - len(triangles)]
            for samples, shaded, triangles in tables]
    context.write_csv("figure-3b", ["samples", "shades", "triangles", "overshade"], rows)
    drawn = next((i for i, row in enumerate(rows) if row[3]), 0)
    path = context.path("pictures", "figure-3b.png")
    draw_samples(path, *tables[drawn])
    samples, shades, triangles, overshade = rows[drawn]
    total = [sum(column) for column in zip(*rows)]
    return [{"kind": "picture", "id": "figure-3b", "number": "Paper Figure 3b",
             "title": "Overshading in two neighboring pixels",
             "text": "msaa at 16 samples per pixel: %d samples hit %d triangles and take %d shades. Shades that repeat a shade "
                     "of the other pixel at another time: %d; over %d seeds: %d of %d." %
                     (samples, triangles, shades, overshade, len(rows), total[3], total[1]),
             "file": os.path.relpath(path, context.out)}]


def figure_4(context):
    """Heat maps of msaa-cache with one cache per task, for task sizes 4, 128 and 512."""
    subject = context.named(*MOVING)
    size = context.size_of(subject, 2, 1)
    settings = of_method(context.settings(subject, spp=64, resolution=size, layers=("shades",)), CACHE_PER_TILE)
    pictures, rows = [], []
    for tile in (4, 128, 512):
        shades = context.run(settings.with_changes(tile=tile)).layer("shades")
        pictures.append({"label": "%d pixels" % tile, "file": save_heat(context, "figure-4-%d" % tile, shades, 16),
                         "caption": "%.2f shades per pixel" % shades.mean()})
        rows.append([tile, float(shades.mean())])
    context.write_csv("figure-4", ["task size", "shades/px"], rows)
    return [items.images("figure-4", "Shades of msaa-cache by task size",
                         "Each task has a cache of its own (scope=tile), as in the paper when every running task has its own "
                         "thread. Blue: one shade per pixel; red: 16. Paper: smaller tasks repeat more shades.", pictures,
                         number="Paper Figure 4")]


def figure_5(context):
    """Render time and shades by task size, 4 to 1024 pixels."""
    subject = context.named(*MOVING)
    settings = context.settings(subject, spp=context.pick(16, 64), resolution=context.size_of(subject, 2, 1))
    series, rows = [], []
    for method in (CACHE_PER_TILE, CACHE_PER_THREAD, MSAA_CACHE_1_BIN):
        points = []
        for tile in (4, 16, 64, 128, 256, 512, 1024):
            result, seconds = context.timed(of_method(settings, method).with_changes(tile=tile), 1)
            points.append([tile, seconds])
            rows.append([method.name, tile, seconds, result.shades_per_pixel])
        series.append({"name": method.name, "points": points, **method.style()})
    names = ["method", "task size", "seconds", "shades/px"]
    context.write_csv("figure-5", names, rows)
    number = "Paper Figure 5"
    axes = {"xlabel": "task size (pixels)", "ylabel": "seconds", "xlog": True, "ylog": False}
    return [items.chart("figure-5", "Render time by task size",
                        "Paper: larger tasks share more shades and are faster, until there are too few tasks for the threads; "
                        "256 is best there. The default cache, which all threads share, does not depend on the task size.",
                        axes, series, number=number),
            items.table("figure-5-table", "Render times and shades", columns(*names), rows, number=number + ", table")]


def figure_6(context):
    """Speed-up at 64 samples per pixel on the four scenes, with direct light and paths of depth 5."""
    methods = (MSAA, MSAA_CACHE, MSAA_CACHE_1_BIN, CACHE_PER_THREAD)
    rows = []
    for subject in context.paper_subjects():
        for shading in ("directlighting", "path"):
            settings = context.settings(subject, spp=64, shading=shading, resolution=context.size_of(subject, 4, 1))
            _, base = context.timed(settings, 1)
            row = [subject.name, "direct" if shading == "directlighting" else "depth 5", base]
            for method in methods:
                _, seconds = context.timed(of_method(settings, method), 1)
                row.append(base / seconds)
            rows.append(row)
    names = ["scene", "light", "supersample (s)"] + [m.name for m in methods]
    context.write_csv("figure-6", names, rows)
    return [items.table("figure-6", "Speed-up at 64 samples per pixel", columns(*names, text=2), rows,
                        "Speed-up over supersample with the same samples per pixel and the same light samples. The errors "
                        "differ; the section on speed against accuracy compares at equal error. The paper's bars have no "
                        "numbers.", "Paper Figure 6")]
