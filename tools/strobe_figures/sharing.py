"""Tables of what sharing does: shades per pixel, bias by block size, and all settings on one moving scene."""

import re

import numpy

from . import images

NUMBER = {"type": "number", "digits": 3}


def columns(*names, text=1):
    return [dict(name=n, type="text") if i < text else dict(NUMBER, name=n) for i, n in enumerate(names)]


def killeroo_finer(context, subject, levels):
    """The scene's text with the Killeroo refined `levels` times; beside it nothing changes."""
    with open(subject.path) as file:
        text = file.read()
    with open(context.scenes + "/pbrt-v2/geometry/killeroo.pbrt") as file:
        geometry = file.read()
    finer = re.sub(r'("integer nlevels"\s*\[?\s*)1', r"\g<1>%d" % levels, geometry)
    return re.sub(r'Include "[^"]*killeroo.pbrt"', lambda m: finer, text)


def bunny_moving(context, subject):
    """The Bunny carried 40 pixels (at full size) to the side while the shutter is open."""
    with open(subject.path) as file:
        text = file.read()
    return text.replace('Material "measured"',
                        'ActiveTransform EndTime\nTranslate .02 0 0\nActiveTransform All\nMaterial "measured"')


def shade_counts(context):
    """Shades per pixel, static and moving, for the three integrators."""
    subjects = []
    if context.have_paper:
        bunny, killeroo = context.named("bunny", ""), context.named("killeroo-simple", "")
        subjects = [("bunny", bunny, ""), ("bunny, moving", bunny, bunny_moving(context, bunny)),
                    ("killeroo-simple", killeroo, ""),
                    ("killeroo-simple, nlevels 3", killeroo, killeroo_finer(context, killeroo, 3)),
                    ("anim-killeroos-moving", context.named("anim-killeroos-moving", ""), "")]
    else:
        subjects = [(s.name, s, "") for s in context.paper_subjects()]
    ways = [("supersample", "supersample", ()), ("msaa", "msaa", ()),
            ("one time bin, 1 px", "msaa-cache", ("blocksize=1", "timebins=1")),
            ("one time bin, 2 px", "msaa-cache", ("blocksize=2", "timebins=1")),
            ("four, 1 px (default)", "msaa-cache", ())]
    rows = []
    for name, subject, text in subjects:
        for spp in context.pick((8, 16), (8, 16, 64)):
            settings = context.settings(subject, spp=spp, text=text, resolution=context.size_of(subject))
            row = [name, spp]
            for _, integrator, defines in ways:
                row.append(context.run(settings.having(integrator=integrator, defines=defines)).shades_per_pixel)
            rows.append(row)
    names = ["scene", "samples"] + [w[0] for w in ways]
    context.write_csv("shade-counts", names, rows)
    return [{"kind": "table", "id": "shade-counts", "title": "Shades per pixel",
             "text": "Surface points shaded per pixel; msaa-cache in the last three columns. Samples that met nothing shade nothing; "
                     "a still scene has one time bin.",
             "columns": columns(*names), "rows": rows}]


def bias_by_block(context):
    """Bias of msaa-cache against the truth, by scene and block size."""
    sizes = (4, 2, 1, 0.5, 0.25)
    seeds = context.pick(4, 16)
    rows, series = [], []
    for subject in context.paper_subjects():
        settings = context.settings(subject, integrator="msaa-cache", spp=16, resolution=context.size_of(subject, 8, 4))
        truth = context.reference(settings, context.pick(512, 2048), parts=8)
        points = []
        for size in sizes:
            one = settings.having(defines=("blocksize=%g" % size, "shades=4"))
            results = context.seeds(one, seeds)
            pictures = [r.image for r in results]
            error = images.Split(pictures, truth)
            low, high = _interval(pictures, truth)
            beyond = _beyond_variation(pictures, truth, results[0].stats["bias"]["reachPixels"])
            rows.append([subject.name, size, error.bias, low, high, error.noise, error.rmse,
                         results[0].shades_per_pixel, beyond])
            points.append([size, max(error.bias, 1e-6), max(low, 1e-6), max(high, 1e-6)])
        series.append({"name": subject.name, "points": points})
    names = ["scene", "block (px)", "bias", "bias, low", "bias, high", "noise", "RMSE", "shades/px",
             "pixels beyond the bound (%)"]
    context.write_csv("bias-by-block", names, rows)
    text = ("Bias: root mean square over pixels (rims of lights left out) of the mean picture's departure from the truth, its own noise and that "
            "of the truth taken off; with a 95 % interval over seeds. The bound: a pixel departs by no more than the "
            "picture varies within the integrator's reach around it; beyond it are the pixels that do by more than "
            "four standard errors.")
    return [{"kind": "chart", "id": "bias-chart", "title": "Bias of msaa-cache by block size", "text": text,
             "xlabel": "block size (pixels)", "ylabel": "bias (RMS)", "xlog": True, "ylog": True, "series": series},
            {"kind": "table", "id": "bias-by-block", "title": "Bias by scene and block size", "text": "",
             "columns": columns(*names), "rows": rows}]


def _interval(pictures, truth):
    """95 % of the bias, from halves of the seeds (a half's spread is wider by the root of two)."""
    generator = numpy.random.default_rng(1)
    draws = []
    for _ in range(40):
        chosen = generator.choice(len(pictures), max(2, len(pictures) // 2), replace=False)
        draws.append(images.Split([pictures[i] for i in chosen], truth).bias_square)
    middle, spread = numpy.mean(draws), 1.96 * numpy.std(draws) / 2 ** 0.5
    return [float(numpy.sign(x) * abs(x) ** 0.5) for x in (middle - spread, middle + spread)]


def _beyond_variation(pictures, truth, reach):
    """Per cent of pixels whose bias exceeds the reference's variation within `reach` pixels by four errors."""
    stack = images.clamp(numpy.stack(pictures)).astype(numpy.float64)
    reference = images.clamp(truth.image)
    error = numpy.sqrt(stack.var(axis=0, ddof=1) / len(pictures) + truth.variance)
    low, high = _window(reference, int(numpy.ceil(reach)) + 1)
    bias = stack.mean(axis=0) - reference
    variation = numpy.maximum(high - reference, reference - low)
    return 100 * float(numpy.mean((numpy.abs(bias) > variation + 4 * error)[truth.keep]))


def _window(image, radius):
    """Least and greatest values within `radius` pixels, across and along."""
    low, high = image.copy(), image.copy()
    for axis in (0, 1):
        base_low, base_high = low.copy(), high.copy()
        for step in range(1, min(radius, image.shape[axis] - 1) + 1):
            for sign in (-1, 1):
                take = [slice(None)] * 3
                put = [slice(None)] * 3
                take[axis] = slice(step, None) if sign > 0 else slice(None, -step)
                put[axis] = slice(None, -step) if sign > 0 else slice(step, None)
                low[tuple(put)] = numpy.minimum(low[tuple(put)], base_low[tuple(take)])
                high[tuple(put)] = numpy.maximum(high[tuple(put)], base_high[tuple(take)])
    return low, high


def all_settings(context):
    """Speed-up and error of shades x blocksize x scope on one moving scene."""
    subject = context.named("anim-killeroos-moving", "moving-pair")
    settings = context.settings(subject, spp=64, resolution=context.size_of(subject, 6, 2))
    truth = context.reference(settings, context.pick(1024, 2048))
    repeats, seeds = 1, 2
    _, base_seconds = context.timed(settings.having(seed=1), repeats)
    base = images.Split([r.image for r in context.seeds(settings, seeds)], truth)
    rows = [["supersample", "", 0, 1, base_seconds, 1.0, 64.0, base.rmse, base.bias]]
    smallest = base.mean_square
    ways = [("shared", bins) for bins in (1, 4)] + [(scope, 1) for scope in ("thread", "mutex", "tile")]
    for scope, bins in ways:
        for size in context.pick((2, 1), (2, 1, 0.5)):
            for shades in context.pick((1, 4), (1, 4, 16)):
                defines = ("blocksize=%g" % size, "shades=%d" % shades, "scope=" + scope, "timebins=%d" % bins)
                one = settings.having(integrator="msaa-cache", defines=defines)
                result, seconds = context.timed(one.having(seed=1), repeats)  # also the first of the seeds
                error = images.Split([r.image for r in context.seeds(one, seeds)], truth)
                smallest = min(smallest, error.mean_square)
                rows.append([scope, "%g px" % size, shades, bins, seconds, base_seconds / seconds,
                             result.shades_per_pixel, error.rmse, error.bias])
    context.check(truth, smallest)
    names = ["scope", "block", "shades", "time bins", "seconds", "speed-up", "shades/px", "RMSE", "bias"]
    context.write_csv("all-settings", names, rows)
    return [{"kind": "table", "id": "all-settings", "title": "Every setting of msaa-cache on " + subject.name,
             "text": "64 visibility samples per pixel. Error: RMSE of values clamped to [0,1] against supersample.",
             "columns": columns(*names, text=2), "rows": rows}]
