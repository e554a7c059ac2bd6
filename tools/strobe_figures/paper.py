"""The figures of "Multisampling and Motion Blur in a Ray Tracer", numbered as there, and what the text says of them."""

import csv
import os

import numpy

from . import images
from .sharing import columns

MOVING = ("anim-killeroos-moving", "moving-pair")


def heat(shades, most):
    """The paper's colors: blue is one shade or less, red is `most`."""
    x = numpy.clip((shades - 1) / (most - 1), 0, 1)[..., None]
    stops = numpy.array([[0, 0, 1], [0, 1, 1], [0, 1, 0], [1, 1, 0], [1, 0, 0]], dtype=float)
    at = x * 4
    low = numpy.minimum(at.astype(int), 3)
    return stops[low[..., 0]] * (1 - (at - low)) + stops[low[..., 0] + 1] * (at - low)


def save_heat(context, name, shades, most):
    path = context.path("pictures", name + ".png")
    images.write_png(path, heat(shades, most))
    return os.path.relpath(path, context.out)


def relative(context, result):
    return os.path.relpath(result.path, context.out)


def figure_1(context):
    """Bunny close-up: supersample against msaa at 8 samples."""
    subject = context.named("bunny", "still")
    settings = context.settings(subject, spp=8, resolution=context.size_of(subject, 2, 1), layers=("shades",))
    pictures, rows = [], []
    for integrator in ("supersample", "msaa"):
        result = context.run(settings.having(integrator=integrator))
        seen = 1 - result.stats["missed"] / result.stats["visibilitySamples"] if integrator == "supersample" else seen
        rows.append([integrator, result.shades_per_pixel, result.shades_per_pixel / seen])
        pictures.append({"label": integrator, "file": relative(context, result),
                         "caption": "%.2f shades per pixel" % result.shades_per_pixel})
    width, height = settings.resolution
    names = ["integrator", "shades/px", "shades per covered px"]
    context.write_csv("figure-1", names, rows)
    text = ("The paper: 8 shades per pixel against less than 1.4, a slight difference in the highlights. Here at %d x %d, "
            "of the pixels that see a surface; at the scene's own 640 x 480 it is 1.06 per pixel and 1.38 per covered "
            "pixel, and less the larger the picture is." % (width, height))
    return [{"kind": "images", "id": "figure-1", "title": "Figure 1: Bunny, supersample and msaa", "text": text,
             "images": pictures, "reference": 0,
             "crops": [[int(width * .3), int(height * .25), int(width * .25), int(height * .3)]]},
            {"kind": "table", "id": "figure-1-table", "title": "Figure 1: shades", "text": "",
             "columns": columns(*names), "rows": rows}]


def figure_2(context):
    """The moving pair: supersample against msaa-cache, with both times."""
    subject = context.named(*MOVING)
    settings = context.settings(subject, spp=64, resolution=context.size_of(subject, 4, 1))
    pictures, seconds, rows = [], {}, []
    ways = [("supersample", "supersample", ()), ("msaa-cache", "msaa-cache", ()),
            ("msaa-cache, one time bin", "msaa-cache", ("timebins=1",)),
            ("as in the paper", "msaa-cache", ("scope=thread",)), ("behind one mutex", "msaa-cache", ("scope=mutex",))]
    for label, integrator, defines in ways:
        result, seconds[label] = context.timed(settings.having(integrator=integrator, defines=defines))
        ratio = seconds["supersample"] / seconds[label]
        rows.append([label, seconds[label], ratio, result.shades_per_pixel])
        pictures.append({"label": label, "file": relative(context, result),
                         "caption": "%.2f s, %.1fx" % (seconds[label], ratio)})
    names = ["integrator", "seconds", "speed-up", "shades/px"]
    context.write_csv("figure-2", names, rows)
    return [{"kind": "images", "id": "figure-2", "title": "Figure 2: " + subject.name,
             "text": "The paper: 78.3 s against 20.0 s, 3.9x. Medians of three runs, 64 samples per pixel.",
             "images": pictures, "reference": 0},
            {"kind": "table", "id": "figure-2-table", "title": "Figure 2: times", "text": "",
             "columns": columns(*names), "rows": rows}]


def figure_3a(context):
    """Heat maps of msaa: a still scene and the same one moving."""
    subject = context.named(*MOVING)
    settings = context.settings(subject, integrator="msaa", spp=64, resolution=context.size_of(subject, 2, 1),
                                layers=("shades",))
    pictures, rows = [], []
    for label, one in (("still", settings.having(frame_time="0.5")), ("moving", settings)):
        result = context.run(one)
        shades = result.layer("shades")
        pictures.append({"label": label, "file": save_heat(context, "figure-3a-" + label, shades, 64),
                         "caption": "%.2f shades per pixel, at most %d" % (shades.mean(), shades.max())})
        rows.append([label, float(shades.mean()), float(shades.max())])
    names = ["shutter", "shades/px", "most"]
    context.write_csv("figure-3a", names, rows)
    return [{"kind": "images", "id": "figure-3a", "title": "Figure 3a: shades of msaa, still and moving",
             "text": "Blue is one shade per pixel, red is 64. The paper's statement: msaa fails to save shading where "
                     "things move.", "images": pictures, "reference": None}]


SEEDS_OF_3B = 16  # of two pixels each: what one of them shows is chance


def shaded_again(file_name):
    """The samples of a run of two pixels that met something, those that were shaded, and these by triangle."""
    with open(file_name) as file:
        samples = [s for s in csv.DictReader(file) if s["primitive"] != ""]
    shaded = [s for s in samples if int(s["asked"])]
    places = {}
    for s in shaded:
        places.setdefault((s["instance"], s["geometry"], s["primitive"]), []).append(s)
    return samples, shaded, places


def figure_3b(context):
    """Two neighboring pixels: visibility samples, shades, and triangles shaded twice. Counted with many seeds; the first
    that shows something is drawn."""
    from matplotlib import pyplot
    from . import charts  # noqa: F401  (chooses a backend without a screen)

    subject = context.named(*MOVING)
    width, height = context.size_of(subject, 2, 2)
    x, y = (int(width * .27), int(height * .47))
    crop = ((x - .5) / width, (x + 1.5) / width, (y - .5) / height, (y + .5) / height)
    settings = context.settings(subject, integrator="msaa", spp=16, resolution=(width, height), crop=crop, samples=True)
    results = [shaded_again(run.samples) for run in context.seeds(settings, SEEDS_OF_3B)]
    rows = [[len(samples), len(shaded), len(places), len(shaded) - len(places)] for samples, shaded, places in results]
    context.write_csv("figure-3b", ["samples", "shades", "triangles", "overshade"], rows)
    drawn = next((i for i, row in enumerate(rows) if row[3]), 0)
    samples, shaded, places = results[drawn]
    figure, axes = pyplot.subplots(figsize=(7.2, 3.9), layout="constrained")
    axes.plot([float(s["film_x"]) for s in samples], [float(s["film_y"]) for s in samples], "x", color="#1f5fbf",
              markersize=5, label="visibility samples")
    twice = [s for group in places.values() if len(group) > 1 for s in group]
    axes.plot([float(s["film_x"]) for s in shaded], [float(s["film_y"]) for s in shaded], "x", color="#d02020",
              markersize=8, label="shades")
    axes.plot([float(s["film_x"]) for s in twice], [float(s["film_y"]) for s in twice], "x", color="#d02020",
              markersize=13, markeredgewidth=3, label="the same triangle shaded in both")
    columns_of = sorted({int(s["x"]) for s in samples})
    for edge in [columns_of[0], columns_of[-1], columns_of[-1] + 1]:
        axes.axvline(edge, color="black", linewidth=0.8)
    axes.set_aspect("equal")
    axes.legend(fontsize=7, loc="upper left", bbox_to_anchor=(1, 1))
    path = context.path("pictures", "figure-3b.png")
    figure.savefig(path, dpi=110)
    pyplot.close(figure)
    total = [sum(column) for column in zip(*rows)]
    return [{"kind": "picture", "id": "figure-3b", "title": "Figure 3b: overshading in two neighboring pixels",
             "text": "msaa, 16 samples each: %d samples met %d triangles and made %d shades; %d of them shade again what "
                     "the other pixel has shaded, at another time. With %d seeds, %d of %d." %
                     (rows[drawn][0], rows[drawn][2], rows[drawn][1], rows[drawn][3], len(rows), total[3], total[1]),
             "file": os.path.relpath(path, context.out)}]


def figure_4(context):
    """Heat maps of msaa-cache with a cache per task, for task sizes 4, 128 and 512."""
    subject = context.named(*MOVING)
    settings = context.settings(subject, integrator="msaa-cache", spp=64, resolution=context.size_of(subject, 1, 1)
                                if not context.quick else context.size_of(subject, 2), layers=("shades",))
    pictures, rows = [], []
    for tile in (4, 128, 512):
        result = context.run(settings.having(tile=tile, defines=("scope=tile",)))
        shades = result.layer("shades")
        pictures.append({"label": "%d pixels" % tile, "file": save_heat(context, "figure-4-%d" % tile, shades, 16),
                         "caption": "%.2f shades per pixel" % shades.mean()})
        rows.append([tile, float(shades.mean())])
    context.write_csv("figure-4", ["task size", "shades/px"], rows)
    return [{"kind": "images", "id": "figure-4", "title": "Figure 4: shades by task size",
             "text": "A cache of each task (scope=tile), as the paper's behaves on as many threads as there are tasks under "
                     "way. Blue is one shade per pixel, red is 16. The paper: the smaller the task, the more is shaded "
                     "again.", "images": pictures, "reference": None}]


def figure_5(context):
    """Time and shades against the task size, 4 to 1024."""
    subject = context.named(*MOVING)
    settings = context.settings(subject, integrator="msaa-cache", spp=context.pick(16, 64),
                                resolution=context.size_of(subject, 2, 1))
    series, rows = [], []
    for label, defines in (("scope=tile", ("scope=tile",)), ("scope=thread", ("scope=thread",)),
                           ("scope=shared", ("scope=shared", "timebins=1"))):
        points = []
        for tile in (4, 16, 64, 128, 256, 512, 1024):
            result, seconds = context.timed(settings.having(tile=tile, defines=defines), 1)
            points.append([tile, seconds])
            rows.append([label, tile, seconds, result.shades_per_pixel])
        series.append({"name": label, "points": points})
    names = ["cache", "task size", "seconds", "shades/px"]
    context.write_csv("figure-5", names, rows)
    return [{"kind": "chart", "id": "figure-5", "title": "Figure 5: time against task size",
             "text": "The paper: larger tasks share more, until too few are left for the threads; 256 is best there. A "
                     "cache that all threads share does not depend on the task.",
             "xlabel": "task size (pixels)", "ylabel": "seconds", "xlog": True, "ylog": False, "series": series},
            {"kind": "table", "id": "figure-5-table", "title": "Figure 5: times and shades", "text": "",
             "columns": columns(*names), "rows": rows}]


def figure_6(context):
    """Speed-up at 64 samples on the four scenes, direct lighting and paths of depth 5."""
    ways = [("msaa", "msaa", ()), ("msaa-cache", "msaa-cache", ()),
            ("msaa-cache, one time bin", "msaa-cache", ("timebins=1",)),
            ("as in the paper", "msaa-cache", ("scope=thread",))]
    rows = []
    for subject in context.paper_subjects():
        for shading in ("directlighting", "path"):
            settings = context.settings(subject, spp=64, shading=shading, resolution=context.size_of(subject, 4, 1))
            _, base = context.timed(settings, 1)
            row = [subject.name, "direct" if shading == "directlighting" else "depth 5", base]
            for _, integrator, defines in ways:
                _, seconds = context.timed(settings.having(integrator=integrator, defines=defines), 1)
                row.append(base / seconds)
            rows.append(row)
    names = ["scene", "light", "supersample (s)"] + [w[0] for w in ways]
    context.write_csv("figure-6", names, rows)
    return [{"kind": "table", "id": "figure-6", "title": "Figure 6: speed-up at 64 samples",
             "text": "Against supersample with the same samples and the same light samples, at unequal error: the "
                     "charts of speed against accuracy say what that is worth. The paper's bars carry no numbers.",
             "columns": columns(*names, text=2), "rows": rows}]
