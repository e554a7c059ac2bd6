"""Curves of error over seconds: values between measured points, the Pareto front, and bootstrap intervals.

Values between points are interpolated linearly on logarithmic axes.
"""

import numpy

SMALLEST = 1e-12  # replaces measured zeros, which have no logarithm


def position(values, target, extend=False):
    """Returns the position on a falling curve where it first reaches `target`: the index of a point, with a fraction
    between two points. Returns 0 if the first value is small enough, and None if no value is. With `extend`, the last
    segment is continued beyond the last point if it falls."""
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


def value_at(values, position):
    """Returns the value at a position, which may lie between two points or beyond the last."""
    logs = numpy.log(numpy.maximum(values, SMALLEST))
    if len(logs) == 1:
        return float(values[0])
    i = min(int(position), len(logs) - 2)
    return float(numpy.exp(logs[i] + (position - i) * (logs[i + 1] - logs[i])))


def seconds_to(seconds, errors, error, extend=False):
    """Returns the seconds until a curve reaches an error, or None if it does not. If the first point is below the
    error, its seconds are returned, which is an upper bound."""
    reached = position(errors, error, extend)
    return None if reached is None else value_at(seconds, reached)


def error_after(seconds, errors, budget, extend=False):
    """Returns the error of a curve after `budget` seconds, or None if the first point takes longer. Beyond the last
    point, its error is returned, which is an upper bound, unless `extend` continues the last segment."""
    if seconds[0] > budget:
        return None
    reached = position([1 / s for s in seconds], 1 / budget, extend)
    return float(errors[-1]) if reached is None else value_at(errors, reached)


def pareto_front(lines):
    """Returns the points (seconds, error, ...) of `lines` that no line passes below, by rising seconds."""
    split = [([p[0] for p in line], [p[1] for p in line]) for line in lines]

    def is_dominated(point):
        errors = (error_after(*line, point[0]) for line in split)
        return any(error is not None and error < point[1] * (1 - 1e-9) for error in errors)

    front = []
    for point in sorted((p for line in lines for p in line if not is_dominated(p)), key=lambda p: p[:2]):
        if not front or point[1] < front[-1][1]:
            front.append(point)
    return front


def bootstrap_interval(statistic, seeds, undefined=-numpy.inf, draws=400):
    """Returns the 95 % bootstrap interval of statistic(seed indices) over `seeds` seeds. A statistic of None counts as
    `undefined`; an end of the interval that is infinite is None."""
    random = numpy.random.default_rng(seeds)
    values = [statistic(random.integers(0, seeds, seeds)) for _ in range(draws)]
    ordered = sorted(undefined if v is None else v for v in values)
    ends = ordered[int(0.025 * draws)], ordered[int(numpy.ceil(0.975 * draws)) - 1]
    return tuple(float(e) if numpy.isfinite(e) else None for e in ends)
