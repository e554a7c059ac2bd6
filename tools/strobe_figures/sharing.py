"""Effects of sharing: shades per pixel, bias by block size, and all settings of msaa-cache on one moving scene."""

import re

import numpy

from . import images, items
from .items import columns
from .methods import MSAA, MSAA_CACHE, SUPERSAMPLE, Method


def refined_killeroo(context, subject, levels):
    """Returns the scene's text with the Killeroo subdivided `levels` times."""
    with open(subject.path) as file:
        text = file.read()
    with open(context.scenes + "/pbrt-v2/geometry/killeroo.pbrt") as file:
        geometry = file.read()
    refined = re.sub(r'("integer nlevels"\s*\[?\s*)1', r"\g<1>%d" % levels, geometry)
    return re.sub(r'Include "[^"]*killeroo.pbrt"', lambda m: refined, text)


def moving_bunny(subject):
    """Returns the scene's text with the Bunny moving sideways by 40 pixels at full size while the shutter is open."""
    with open(subject.path) as file:
        text = file.read()
    return text.replace('Material "measured"',
                        'ActiveTransform EndTime\nTranslate .02 0 0\nActiveTransform All\nMaterial "measured"')


def counted_scenes(context):
    """Returns (name, subject, scene text or "") of the scenes whose shades are counted."""
    if not context.have_paper:
        return [(s.name, s, "") for s in context.paper_subjects()]
    bunny = context.named("bunny", "")
    killeroo = context.named("killeroo-simple", "")
    return [("bunny", bunny, ""), ("bunny, moving", bunny, moving_bunny(bunny)), ("killeroo-simple", killeroo, ""),
            ("killeroo-simple, nlevels 3", killeroo, refined_killeroo(context, killeroo, 3)),
            ("anim-killeroos-moving", context.named("anim-killeroos-moving", ""), "")]


def shade_counts(context):
    """Shades per pixel of supersample, msaa and msaa-cache, static and moving."""
    methods = (SUPERSAMPLE, MSAA,
               Method("msaa-cache, 1 time bin, 1 px", "msaa-cache", ("blocksize=1", "timebins=1")),
               Method("msaa-cache, 1 time bin, 2 px", "msaa-cache", ("blocksize=2", "timebins=1")),
               Method("msaa-cache, 4 time bins, 1 px (default)", "msaa-cache"))
    rows = []
    for name, subject, text in counted_scenes(context):
        for spp in context.pick((8, 16), (8, 16, 64)):
            settings = context.settings(subject, spp=spp, text=text, resolution=context.size_of(subject))
            results = [context.run(settings.with_changes(integrator=m.integrator, defines=m.defines)) for m in methods]
            rows.append([name, spp] + [result.shades_per_pixel for result in results])
    names = ["scene", "samples"] + [m.name for m in methods]
    context.write_csv("shade-counts", names, rows)
    return [items.table("shade-counts", "Shades per pixel", columns(*names), rows,
                        "Visibility samples without a hit are not shaded. A static scene has one time bin.")]


def bias_by_block(context):
    """Bias of msaa-cache by scene and block size."""
    sizes = (4, 2, 1, 0.5, 0.25)
    seeds = context.pick(4, 16)
    rows, series = [], []
    for subject in context.paper_subjects():
        settings = context.settings(subject, integrator="msaa-cache", spp=16, resolution=context.size_of(subject, 8, 4))
        reference = context.reference(settings, context.pick(512, 2048), renders=8)
        points = []
        for size in sizes:
            results = context.run_seeds(settings.with_changes(defines=("blocksize=%g" % size, "shades=4")), seeds)
            pictures = [r.image for r in results]
            error = images.ErrorEstimate(pictures, reference)
            low, high = _bias_interval(pictures, reference)
            beyond = _percent_beyond_bound(pictures, reference, results[0].stats["bias"]["reachPixels"])
            rows.append([subject.name, size, error.bias, low, high, error.noise, error.rmse,
                         results[0].shades_per_pixel, beyond])
            points.append([size, max(error.bias, 1e-6), max(low, 1e-6), max(high, 1e-6)])
        series.append({"name": subject.name, "points": points})
    names = ["scene", "block (px)", "bias", "bias, low", "bias, high", "noise", "RMSE", "shades/px",
             "pixels beyond the bound (%)"]
    context.write_csv("bias-by-block", names, rows)
    text = ("Bias: root mean square over comparable pixels of the difference between the mean image and the reference, "
            "without the noise of both; with a 95 % interval over seeds. Bound: the variation of the reference within the "
            "integrator's reach around a pixel. A pixel is beyond the bound if its difference exceeds the variation by more "
            "than four standard errors.")
    axes = {"xlabel": "block size (pixels)", "ylabel": "bias (RMS)", "xlog": True, "ylog": True}
    return [items.chart("bias-chart", "Bias of msaa-cache by block size", text, axes, series),
            items.table("bias-by-block", "Bias of msaa-cache by scene and block size", columns(*names), rows)]


def _bias_interval(pictures, reference):
    """Returns the 95 % interval of the bias from random halves of the seeds, whose spread is larger by the root of two."""
    generator = numpy.random.default_rng(1)
    draws = []
    for _ in range(40):
        half = generator.choice(len(pictures), max(2, len(pictures) // 2), replace=False)
        draws.append(images.ErrorEstimate([pictures[i] for i in half], reference).bias_square)
    middle = numpy.mean(draws)
    spread = 1.96 * numpy.std(draws) / 2 ** 0.5
    return [float(numpy.sign(x) * abs(x) ** 0.5) for x in (middle - spread, middle + spread)]


def _percent_beyond_bound(pictures, reference, reach):
    """Returns the percentage of pixels whose difference from the reference exceeds the reference's variation within `reach`
    pixels by more than four standard errors."""
    stack = images.clamp(numpy.stack(pictures)).astype(numpy.float64)
    expected = images.clamp(reference.image)
    error = numpy.sqrt(stack.var(axis=0, ddof=1) / len(pictures) + reference.variance)
    low, high = _extremes(expected, int(numpy.ceil(reach)) + 1)
    difference = stack.mean(axis=0) - expected
    variation = numpy.maximum(high - expected, expected - low)
    return 100 * float(numpy.mean((numpy.abs(difference) > variation + 4 * error)[reference.mask]))


def _extremes(image, radius):
    """Returns the minimum and the maximum within `radius` pixels along both axes, for each pixel and channel."""
    low = image.copy()
    high = image.copy()
    for axis in (0, 1):
        row_low = low.copy()
        row_high = high.copy()
        for step in range(1, min(radius, image.shape[axis] - 1) + 1):
            for sign in (-1, 1):
                source = [slice(None)] * 3
                target = [slice(None)] * 3
                source[axis] = slice(step, None) if sign > 0 else slice(None, -step)
                target[axis] = slice(None, -step) if sign > 0 else slice(step, None)
                source, target = tuple(source), tuple(target)
                low[target] = numpy.minimum(low[target], row_low[source])
                high[target] = numpy.maximum(high[target], row_high[source])
    return low, high


def all_settings(context):
    """Speed-up and error of msaa-cache by scope, blocksize, shades and timebins on one moving scene."""
    subject = context.named("anim-killeroos-moving", "moving-pair")
    settings = context.settings(subject, spp=64, resolution=context.size_of(subject, 6, 2))
    reference = context.reference(settings, context.pick(1024, 2048))
    seeds = 2
    _, base_seconds = context.timed(settings.with_changes(seed=1), 1)
    base = images.ErrorEstimate([r.image for r in context.run_seeds(settings, seeds)], reference)
    rows = [["supersample", "", 0, 1, base_seconds, 1.0, 64.0, base.rmse, base.bias]]
    smallest = base.mean_square
    for scope, bins in (("shared", 1), ("shared", 4), ("thread", 1), ("mutex", 1), ("tile", 1)):
        for size in context.pick((2, 1), (2, 1, 0.5)):
            for shades in context.pick((1, 4), (1, 4, 16)):
                defines = ("blocksize=%g" % size, "shades=%d" % shades, "scope=" + scope, "timebins=%d" % bins)
                changed = settings.with_changes(integrator=MSAA_CACHE.integrator, defines=defines)
                result, seconds = context.timed(changed.with_changes(seed=1), 1)  # also the first seed of the error
                error = images.ErrorEstimate([r.image for r in context.run_seeds(changed, seeds)], reference)
                smallest = min(smallest, error.mean_square)
                rows.append([scope, "%g px" % size, shades, bins, seconds, base_seconds / seconds,
                             result.shades_per_pixel, error.rmse, error.bias])
    context.check_noise(reference, smallest)
    names = ["scope", "block", "shades", "time bins", "seconds", "speed-up", "shades/px", "RMSE", "bias"]
    context.write_csv("all-settings", names, rows)
    return [items.table("all-settings", "All settings of msaa-cache on " + subject.name, columns(*names, text=2), rows,
                        "64 visibility samples per pixel. The speed-up is over supersample. The RMSE is of values clamped to "
                        "[0,1], against a supersample reference.")]
