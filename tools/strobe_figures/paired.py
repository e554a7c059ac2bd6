"""Paired comparison of two integrators at equal time: errors against two references, and ratios over seeds with a bound."""

import dataclasses

import numpy
from scipy import stats

from . import images

ERRORS = {"clipped": "radiance clipped to 1", "radiance": "radiance", "relative": "relative error"}
RELATIVE_OFFSET = 0.01  # is added to the squared reference that relative errors are divided by
LEVEL = 0.95  # confidence of the one-sided bounds


class References:
    """Two independent references of one image, and a third that relative errors are divided by.

    An error is the mean product of the differences from both. Their noise is independent, so the expected value of the product
    is the square of the difference from the true image. The divisor is independent of both, because a divisor of the same noise
    biases the mean.
    """

    def __init__(self, first, second, divisor):
        self._pairs = {"radiance": (first, second), "clipped": (images.clamp(first), images.clamp(second))}
        self._pairs["relative"] = self._pairs["radiance"]
        self._weight = 1 / (divisor ** 2 + RELATIVE_OFFSET)

    def _mean(self, name, product):
        return float((product * self._weight if name == "relative" else product).mean())

    def mean_squares(self, image):
        """Returns {name: mean square error} of an image. A value near the noise of the references may be negative."""
        image = image.astype(numpy.float64)
        errors = {}
        for name, (first, second) in self._pairs.items():
            values = images.clamp(image) if name == "clipped" else image
            errors[name] = self._mean(name, (values - first) * (values - second))
        return errors

    def noise(self):
        """Returns {name: variance of the mean of both references}."""
        return {name: self._mean(name, (first - second) ** 2) / 4 for name, (first, second) in self._pairs.items()}


@dataclasses.dataclass(frozen=True)
class Ratio:
    """The error of an integrator over that of supersample in the same time: the geometric mean over seeds, and its upper
    bound."""

    value: float
    upper: float

    @property
    def is_better(self):
        """Whether the bound proves a gain."""
        return self.upper < 1


def geometric_mean(values):
    """Returns the geometric mean of positive values."""
    return float(numpy.exp(numpy.log(values).mean()))


def samples_in(time, samples, times):
    """Returns the number of samples that take a time, given the times of two or more numbers of samples in ascending order.
    Times are linear between two of them, and beyond the first and the last: loading takes a part that does not grow."""
    i = min(max(int(numpy.searchsorted(times, time)) - 1, 0), len(times) - 2)
    if not times[i + 1] > times[i]:  # noise of short times
        return float(samples[i])
    found = samples[i] + (time - times[i]) / (times[i + 1] - times[i]) * (samples[i + 1] - samples[i])
    return float(max(found, samples[0] / 2))


def error_with(count, samples, errors):
    """Returns the error with a number of samples, given those with two or more numbers of samples in ascending order: a power
    law between two of them, and beyond the first and the last. Returns NaN if one of both errors is not positive."""
    i = min(max(int(numpy.searchsorted(samples, count)) - 1, 0), len(samples) - 2)
    if not min(errors[i], errors[i + 1]) > 0:
        return float("nan")
    power = numpy.log(errors[i + 1] / errors[i]) / numpy.log(samples[i + 1] / samples[i])
    return float(errors[i] * (count / samples[i]) ** power)


def ratio_of(errors, base_errors):
    """Returns the Ratio of paired errors, one pair per seed, or None if an error is not positive: then it is smaller than the
    noise of the references. The bound is that of a one-sided paired t-test of the logarithms."""
    errors, base_errors = numpy.asarray(errors), numpy.asarray(base_errors)
    if not (numpy.isfinite(errors).all() and numpy.isfinite(base_errors).all() and min(errors.min(), base_errors.min()) > 0):
        return None
    logs = numpy.log(errors / base_errors)
    spread = stats.t.ppf(LEVEL, len(logs) - 1) * logs.std(ddof=1) / len(logs) ** 0.5
    return Ratio(float(numpy.exp(logs.mean())), float(numpy.exp(logs.mean() + spread)))
