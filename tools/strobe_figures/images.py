"""Reads EXR files, and measures how far pictures are from each other."""

import numpy
import OpenImageIO


def read(path, channels=("R", "G", "B")):
    """Float array of height, width, channel."""
    buffer = OpenImageIO.ImageBuf(path)
    if buffer.has_error:
        raise OSError("%s: %s" % (path, buffer.geterror()))
    names = list(buffer.spec().channelnames)
    pixels = buffer.get_pixels(OpenImageIO.FLOAT)
    return numpy.stack([pixels[:, :, names.index(c)] for c in channels], axis=-1)


def write_png(path, image):
    """8-bit PNG of values in [0,1], as they are."""
    image = numpy.ascontiguousarray(numpy.clip(image, 0, 1), dtype=numpy.float32)
    height, width, channels = image.shape
    buffer = OpenImageIO.ImageBuf(OpenImageIO.ImageSpec(width, height, channels, "uint8"))
    buffer.set_pixels(OpenImageIO.ROI(), image)
    if not buffer.write(path):
        raise OSError(buffer.geterror())


def srgb(linear):
    """The sRGB transfer function on values clamped to [0,1]."""
    x = numpy.clip(linear, 0, 1)
    return numpy.where(x <= 0.0031308, 12.92 * x, 1.055 * numpy.power(x, 1 / 2.4) - 0.055)


def clamp(image):
    """What a screen can show: the edges of bright lights would decide every mean otherwise."""
    return numpy.clip(image, 0, 1)


def mean_square(image, truth):
    """Of values clamped to [0,1]."""
    return float(numpy.mean((clamp(image) - clamp(truth)) ** 2, dtype=numpy.float64))


def rmse(image, truth):
    return mean_square(image, truth) ** 0.5


def relative_mean_square(image, truth):
    """(x - r)² / (r + 0.01)², of values clamped to [0,1]."""
    x, r = clamp(image), clamp(truth)
    return float(numpy.mean(((x - r) / (r + 0.01)) ** 2, dtype=numpy.float64))


def ssim(image, truth):
    """Structural similarity of the pictures as shown (sRGB)."""
    from skimage.metrics import structural_similarity

    a, b = srgb(image), srgb(truth)
    try:
        return float(structural_similarity(a, b, data_range=1, channel_axis=2))
    except TypeError:  # before scikit-image 0.19
        return float(structural_similarity(a, b, data_range=1, multichannel=True))


def split(pictures, truth, truth_variance=0.0, relative=False):
    """Of pictures with independent seeds: (mean square error, squared bias, variance), of clamped values.

    The squared bias is what is left of the mean picture's error when its own noise and that of the truth (the mean
    square `truth_variance`) are taken off; it may come out slightly below zero.
    """
    stack = numpy.stack([clamp(p) for p in pictures]).astype(numpy.float64)
    r = clamp(truth).astype(numpy.float64)
    weight = 1 / (r + 0.01) ** 2 if relative else numpy.ones_like(r)
    total = float(numpy.mean((stack - r) ** 2 * weight)) - truth_variance
    if len(pictures) < 2:
        return total, float("nan"), float("nan")
    variance = float(numpy.mean(stack.var(axis=0, ddof=1) * weight))
    return total, total - variance, variance
