"""Draws chart items as PNG and SVG files; the report draws the same items for itself."""

import matplotlib

matplotlib.use("Agg")
from matplotlib import pyplot  # noqa: E402

COLORS = ["#0072b2", "#d55e00", "#009e73", "#cc79a7", "#56b4e9", "#e69f00", "#444444", "#8172b2", "#8c6d31"]
MARKERS = "os^Dv<>PX"


def draw(item, stem):
    """Writes stem.png and stem.svg of an item of kind "chart"."""
    figure, axes = pyplot.subplots(figsize=(7.2, 4.8), layout="constrained")
    for i, series in enumerate(item["series"]):
        points = series["points"]
        if not points:
            continue
        x, y = [p[0] for p in points], [p[1] for p in points]
        color = COLORS[i % len(COLORS)]
        if series.get("front"):
            axes.plot(x, y, color="#999999", linewidth=6, alpha=0.4, zorder=0, label=series["name"])
            continue
        axes.plot(x, y, "--" if series.get("dashed") else "-", color=color, marker=MARKERS[i % len(MARKERS)],
                  markersize=4, linewidth=1.2, label=series["name"])
        if all(len(p) >= 4 for p in points):
            axes.fill_between(x, [p[2] for p in points], [p[3] for p in points], color=color, alpha=0.15, linewidth=0)
    for mark in item.get("marks", []):
        axes.axvline(mark["x"], color="#888888", linewidth=0.8, linestyle=":")
        axes.annotate(mark["label"], (mark["x"], 1), xycoords=("data", "axes fraction"), rotation=90, fontsize=7,
                      va="top", ha="right", color="#666666")
    axes.set_xscale("log" if item.get("xlog") else "linear")
    axes.set_yscale("log" if item.get("ylog") else "linear")
    axes.set_xlabel(item["xlabel"])
    axes.set_ylabel(item["ylabel"])
    axes.set_title(item["title"], fontsize=10)
    axes.grid(True, which="both", linewidth=0.3, alpha=0.6)
    axes.legend(fontsize=7)
    figure.savefig(stem + ".png", dpi=110)
    figure.savefig(stem + ".svg")
    pyplot.close(figure)
