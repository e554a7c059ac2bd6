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


def front(lines):
    """Of lines of points (seconds, error, ...), by rising seconds: those that no line passes below."""
    split = [([p[0] for p in line], [p[1] for p in line]) for line in lines]

    def beaten(point):
        bought = (error_after(*line, point[0]) for line in split)
        return any(error is not None and error < point[1] * (1 - 1e-9) for error in bought)

    kept = []
    for point in sorted((p for line in lines for p in line if not beaten(p)), key=lambda p: p[:2]):
        if not kept or point[1] < kept[-1][1]:
            kept.append(point)
    return kept


def interval(statistic, seeds, never=-numpy.inf, draws=400):
    """95 % of statistic(indices of seeds) where the seeds are drawn again (bootstrap). Where it is None it counts as
    `never`, and an end that falls there is None."""
    random = numpy.random.default_rng(seeds)
    drawn = [statistic(random.integers(0, seeds, seeds)) for _ in range(draws)]
    ordered = sorted(never if d is None else d for d in drawn)
    ends = ordered[int(0.025 * draws)], ordered[int(numpy.ceil(0.975 * draws)) - 1]
    return tuple(float(e) if numpy.isfinite(e) else None for e in ends)
