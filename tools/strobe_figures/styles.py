"""Colors, markers and dashes of the curves, for charts as image files and in the report."""

# The integrators of the first palette entries; other series take the entries behind them in order.
INTEGRATORS = ("supersample", "msaa", "msaa-cache", "indirect-cache", "adaptive-cache", "cycles")
# The hues of report.css in the light theme (.s0, .s1, ...).
COLORS = ("#133d8b", "#9b1d0b", "#00732c", "#6a2b62", "#ae8400", "#8b7bee", "#666361", "#009bc0", "#c2487f", "#5d6d1e")
# The shapes of MARKERS in report_chart.js.
MARKERS = "os^DvPX<ph"
# On and off lengths in units of the line width, by variant; the same as stroke-dasharray in report.css.
DASHES = ((), (3, 1.5), (1, 1.5), (5, 2, 1, 2), (9, 2.5))


def palette_indices(series):
    """Returns the palette index of each series of a chart. A series without a known "integrator" takes the next index
    behind the integrators; a front takes the last index, which it does not show."""
    indices = []
    others = 0
    for entry in series:
        if entry.get("integrator") in INTEGRATORS:
            indices.append(INTEGRATORS.index(entry["integrator"]))
        elif entry.get("front"):
            indices.append(len(COLORS) - 1)
        else:
            free = len(COLORS) - len(INTEGRATORS)
            indices.append(len(INTEGRATORS) + others % free)
            others += 1
    return indices
