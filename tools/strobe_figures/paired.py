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
    """Error times time of an integrator over supersample's: the geometric mean over seeds, and its upper bound."""

    value: float
    upper: float

    @property
    def is_better(self):
        """Whether the bound proves a gain."""
        return self.upper < 1


def geometric_mean(values):
    """Returns the geometric mean of positive values."""
    return float(numpy.exp(numpy.log(values).mean()))


def ratio_of(costs, base_costs):
    """Returns the Ratio of paired costs, one pair per seed, or None if a cost is not positive: then the error is smaller than
    the noise of the references. The bound is that of a one-sided paired t-test of the logarithms."""
    costs, base_costs = numpy.asarray(costs), numpy.asarray(base_costs)
    if not (numpy.isfinite(costs).all() and numpy.isfinite(base_costs).all() and min(costs.min(), base_costs.min()) > 0):
        return None
    logs = numpy.log(costs / base_costs)
    spread = stats.t.ppf(LEVEL, len(logs) - 1) * logs.std(ddof=1) / len(logs) ** 0.5
    return Ratio(float(numpy.exp(logs.mean())), float(numpy.exp(logs.mean() + spread)))
