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


def write_exr(path, image):
    """32-bit float EXR of linear red, green and blue."""
    image = numpy.ascontiguousarray(image, dtype=numpy.float32)
    height, width, channels = image.shape
    buffer = OpenImageIO.ImageBuf(OpenImageIO.ImageSpec(width, height, channels, "float"))
    buffer.set_pixels(OpenImageIO.ROI(), image)
    if not buffer.write(path):
        raise OSError(buffer.geterror())


def srgb(linear):
    """The sRGB transfer function on values clamped to [0,1]."""
    x = numpy.clip(linear, 0, 1)
    return numpy.where(x <= 0.0031308, 12.92 * x, 1.055 * numpy.power(x, 1 / 2.4) - 0.055)


def clamp(image):
    """What a screen can show."""
    return numpy.clip(image, 0, 1)


def comparable(truth, bright=2.0):
    """Pixels that no light's rim touches: there a picture of few samples is 0 or hundreds, and clamping it, as screens
    do, makes every integrator look biased. Left out are pixels beside one where the truth is brighter than `bright`."""
    rim = truth.max(axis=2) > bright
    grown = rim.copy()
    grown[1:] |= rim[:-1]
    grown[:-1] |= rim[1:]
    across = grown.copy()
    across[:, 1:] |= grown[:, :-1]
    across[:, :-1] |= grown[:, 1:]
    return ~across


def ssim(image, truth):
    """Structural similarity of the pictures as shown (sRGB)."""
    from skimage.metrics import structural_similarity

    a, b = srgb(image), srgb(truth)
    try:
        return float(structural_similarity(a, b, data_range=1, channel_axis=2))
    except TypeError:  # before scikit-image 0.19
        return float(structural_similarity(a, b, data_range=1, multichannel=True))


class Split:
    """The error of pictures with independent seeds against a reference: mean square, bias squared and variance, of
    clamped values over the comparable pixels; `relative`: of (x - r)² / (r + 0.01)².

    The squared bias is what is left of the mean square error when the variance is taken off, and the reference's own
    noise; it may come out slightly below zero. `interval()` draws seeds again (bootstrap).
    """

    def __init__(self, pictures, reference, relative=False):
        keep = reference.keep
        stack = numpy.stack([clamp(p)[keep] for p in pictures]).astype(numpy.float64)
        truth = clamp(reference.image)[keep].astype(numpy.float64)
        weight = 1 / (truth + 0.01) ** 2 if relative else numpy.ones_like(truth)
        self._noise = reference.relative_variance if relative else reference.variance
        self._errors = ((stack - truth) ** 2 * weight).mean(axis=(1, 2))
        self.mean_square = max(float(self._errors.mean()) - self._noise, 0.0)
        many = len(pictures) > 1
        self.variance = float((stack.var(axis=0, ddof=1) * weight).mean()) if many else float("nan")
        self.bias_square = self.mean_square - self.variance

    @property
    def of_seeds(self):
        """The mean square error of each picture, without the reference's noise."""
        return self._errors - self._noise

    @property
    def rmse(self):
        return self.mean_square ** 0.5

    @property
    def bias(self):
        """The root, with the sign of what is under it."""
        return float(numpy.sign(self.bias_square) * abs(self.bias_square) ** 0.5)

    @property
    def noise(self):
        return self.variance ** 0.5

    def interval(self):
        """95 % of the RMSE, for the mean of these many seeds."""
        if len(self._errors) < 2:
            return self.rmse, self.rmse
        spread = 1.96 * self._errors.std(ddof=1) / len(self._errors) ** 0.5
        return max(self.mean_square - spread, 0) ** 0.5, (self.mean_square + spread) ** 0.5
