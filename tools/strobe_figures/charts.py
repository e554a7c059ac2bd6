"""Draws chart items as PNG and SVG files. The report draws the same items with report_chart.js."""

import matplotlib

matplotlib.use("Agg")
from matplotlib import pyplot  # noqa: E402

from .styles import COLORS, DASHES, MARKERS, palette_indices  # noqa: E402


def draw(item, stem):
    """Writes stem.png and stem.svg of an item of kind "chart"."""
    figure, axes = pyplot.subplots(figsize=(7.2, 4.8), layout="constrained")
    for series, index in zip(item["series"], palette_indices(item["series"])):
        if series["points"]:
            _draw_series(axes, series, index)
    for mark in item.get("marks", []):
        axes.axvline(mark["x"], color="#888888", linewidth=0.8, linestyle=":")
        axes.annotate(mark["label"], (mark["x"], 1), xycoords=("data", "axes fraction"), rotation=90, fontsize=7,
                      va="top", ha="right", color="#666666")
    axes.set_xscale("log" if item.get("xlog") else "linear")
    axes.set_yscale("log" if item.get("ylog") else "linear")
    axes.set_xlabel(item["xlabel"])
    axes.set_ylabel(item["ylabel"])
    axes.set_title(": ".join(filter(None, (item.get("number"), item["title"]))), fontsize=10)
    axes.grid(True, which="both", linewidth=0.3, alpha=0.6)
    axes.legend(fontsize=7, handlelength=4)
    figure.savefig(stem + ".png", dpi=110)
    figure.savefig(stem + ".svg")
    pyplot.close(figure)


def _draw_series(axes, series, index):
    points = series["points"]
    x = [p[0] for p in points]
    y = [p[1] for p in points]
    if series.get("front"):
        axes.plot(x, y, color="#999999", linewidth=6, alpha=0.4, zorder=0, label=series["name"])
        return
    variant = series.get("variant", 0)
    axes.plot(x, y, color=COLORS[index], linestyle=(0, DASHES[variant]) if variant else "-", marker=MARKERS[index],
              markersize=4.5, markerfacecolor="white" if variant else COLORS[index], linewidth=1.2, label=series["name"])
    if all(len(p) >= 4 for p in points):
        axes.fill_between(x, [p[2] for p in points], [p[3] for p in points], color=COLORS[index], alpha=0.15, linewidth=0)
