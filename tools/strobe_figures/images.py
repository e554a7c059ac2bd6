"""Image files, and measures of the error of images."""

import numpy
import OpenImageIO


def read(path, channels=("R", "G", "B")):
    """Returns the named channels of an image file as a float array [height, width, channel]. Raises OSError."""
    buffer = OpenImageIO.ImageBuf(path)
    if buffer.has_error:
        raise OSError("%s: %s" % (path, buffer.geterror()))
    names = list(buffer.spec().channelnames)
    pixels = buffer.get_pixels(OpenImageIO.FLOAT)
    return numpy.stack([pixels[:, :, names.index(c)] for c in channels], axis=-1)


def write_png(path, image):
    """Writes an 8-bit PNG of display values in [0,1], clamped, without conversion. Raises OSError."""
    image = numpy.ascontiguousarray(numpy.clip(image, 0, 1), dtype=numpy.float32)
    height, width, channels = image.shape
    buffer = OpenImageIO.ImageBuf(OpenImageIO.ImageSpec(width, height, channels, "uint8"))
    buffer.set_pixels(OpenImageIO.ROI(), image)
    if not buffer.write(path):
        raise OSError(buffer.geterror())


def write_exr(path, image):
    """Writes a 32-bit float EXR of linear red, green and blue. Raises OSError."""
    image = numpy.ascontiguousarray(image, dtype=numpy.float32)
    height, width, channels = image.shape
    buffer = OpenImageIO.ImageBuf(OpenImageIO.ImageSpec(width, height, channels, "float"))
    buffer.set_pixels(OpenImageIO.ROI(), image)
    if not buffer.write(path):
        raise OSError(buffer.geterror())


def srgb(linear):
    """Returns linear values clamped to [0,1] and encoded with the sRGB transfer function."""
    x = numpy.clip(linear, 0, 1)
    return numpy.where(x <= 0.0031308, 12.92 * x, 1.055 * numpy.power(x, 1 / 2.4) - 0.055)


def clamp(image):
    """Returns values clamped to [0,1], the range of a display."""
    return numpy.clip(image, 0, 1)


def comparable_pixels(reference, bright=2.0):
    """Returns a mask of the pixels whose error is measured. It excludes pixels that are, or adjoin, a pixel where the
    reference is brighter than `bright`: at the edge of a light source a sample is 0 or hundreds, and clamping to the range
    of a display biases every integrator there."""
    excluded = reference.max(axis=2) > bright
    rows = excluded.copy()
    rows[1:] |= excluded[:-1]
    rows[:-1] |= excluded[1:]
    dilated = rows.copy()
    dilated[:, 1:] |= rows[:, :-1]
    dilated[:, :-1] |= rows[:, 1:]
    return ~dilated


def ssim(image, reference):
    """Returns the structural similarity of two images encoded as sRGB."""
    from skimage.metrics import structural_similarity

    a = srgb(image)
    b = srgb(reference)
    try:
        return float(structural_similarity(a, b, data_range=1, channel_axis=2))
    except TypeError:  # before scikit-image 0.19
        return float(structural_similarity(a, b, data_range=1, multichannel=True))


class ErrorEstimate:
    """The error of images x with independent seeds against a reference r: mean square error, squared bias and variance of
    clamped values over the reference's comparable pixels.

    With `relative`, the error is (x - r)² / (r + 0.01)². The squared bias is the mean square error less the variance and
    less the reference's own noise; as an estimate it may be slightly negative.
    """

    def __init__(self, images, reference, relative=False):
        stack = numpy.stack([clamp(image)[reference.mask] for image in images]).astype(numpy.float64)
        expected = clamp(reference.image)[reference.mask].astype(numpy.float64)
        weight = 1 / (expected + 0.01) ** 2 if relative else numpy.ones_like(expected)
        noise = reference.relative_variance if relative else reference.variance
        #: The mean square error of each image, less the reference's noise.
        self.mean_squares = ((stack - expected) ** 2 * weight).mean(axis=(1, 2)) - noise
        self.mean_square = max(float(self.mean_squares.mean()), 0.0)
        self.variance = float("nan")
        if len(images) > 1:
            self.variance = float((stack.var(axis=0, ddof=1) * weight).mean())
        self.bias_square = self.mean_square - self.variance

    @property
    def rmse(self):
        """The root mean square error."""
        return self.mean_square ** 0.5

    @property
    def bias(self):
        """The root of the absolute squared bias, with the sign of the squared bias."""
        return float(numpy.sign(self.bias_square) * abs(self.bias_square) ** 0.5)

    @property
    def noise(self):
        """The standard deviation of one image."""
        return self.variance ** 0.5

    def interval(self):
        """Returns the ends of the 95 % confidence interval of the RMSE, by a normal approximation over the seeds."""
        if len(self.mean_squares) < 2:
            return self.rmse, self.rmse
        spread = 1.96 * self.mean_squares.std(ddof=1) / len(self.mean_squares) ** 0.5
        return max(self.mean_square - spread, 0) ** 0.5, (self.mean_square + spread) ** 0.5
