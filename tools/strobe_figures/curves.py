"""Curves of falling values over rising cost, read between their points along straight lines on logarithmic axes, and
what they say: which points no other beats, and what random seeds leave unsure."""

import numpy

SMALLEST = 1e-12  # stands for what measured as zero


def position(values, target, extend=False):
    """Where on the curve `target` is first reached: a point's index, or a fraction between two. 0 if the first value is
    there already; None if no value is, unless `extend` continues the last stretch, where that falls."""
    logs = numpy.log(numpy.maximum(values, SMALLEST))
    goal = numpy.log(max(target, SMALLEST))
    if logs[0] <= goal:
        return 0.0
    for i in range(1, len(logs)):
        if logs[i] <= goal:
            return i - 1 + float((logs[i - 1] - goal) / (logs[i - 1] - logs[i]))
    if extend and len(logs) > 1 and logs[-1] < logs[-2]:
        return len(logs) - 1 + float((logs[-1] - goal) / (logs[-2] - logs[-1]))
    return None


def at(values, place):
    """The value at a position, between two points or beyond the last."""
    logs = numpy.log(numpy.maximum(values, SMALLEST))
    if len(logs) == 1:
        return float(values[0])
    i = min(int(place), len(logs) - 2)
    return float(numpy.exp(logs[i] + (place - i) * (logs[i + 1] - logs[i])))


def seconds_to(seconds, errors, error, extend=False):
    """Seconds until the error is reached: those of the first point where that is good enough, which is too many rather
    than too few; None if the curve never gets there."""
    place = position(errors, error, extend)
    return None if place is None else at(seconds, place)


def error_after(seconds, errors, budget, extend=False):
    """The error that the seconds buy: the last point's where more was affordable, which is too large rather than too
    small, unless `extend` continues the last stretch; None if the first point takes longer."""
    if seconds[0] > budget:
        return None
    place = position([1 / s for s in seconds], 1 / budget, extend)
    return float(errors[-1]) if place is None else at(errors, place)


def front(points):
    """Those of the points (seconds, error, ...) that no other beats in both, by rising seconds."""
    best, kept = float("inf"), []
    for point in sorted(points, key=lambda p: (p[0], p[1])):
        if point[1] < best:
            best = point[1]
            kept.append(point)
    return kept


def interval(statistic, seeds, draws=400):
    """95 % of statistic(indices of seeds) where the seeds are drawn again (bootstrap). Where it is None it counts as
    below every number, and an end that falls there is None."""
    random = numpy.random.default_rng(seeds)
    drawn = [statistic(random.integers(0, seeds, seeds)) for _ in range(draws)]
    ordered = sorted(-numpy.inf if d is None else d for d in drawn)
    ends = ordered[int(0.025 * draws)], ordered[int(numpy.ceil(0.975 * draws)) - 1]
    return tuple(None if e == -numpy.inf else float(e) for e in ends)
