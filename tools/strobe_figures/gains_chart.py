"""The chart of gains: a row per scene, and a mark per integrator and sample count."""

from matplotlib import ticker

from .charts import pyplot
from .styles import COLORS, MARKERS, palette_indices

ROW = 0.36  # inches
LEFT, RIGHT, TOP, BOTTOM = 1.9, 0.2, 0.65, 0.62  # margins in inches; BOTTOM without the legend
LEGEND_LINE = 0.16  # inches
FIRST_SIZE, SIZE_STEP = 3.2, 1.5  # points, of the mark of the smallest sample count, and for each larger one
SPREAD = 0.62  # height of the marks of a row, in rows


def rows_of(cells):
    """Returns {scene name: row} in the order of the cells."""
    return {name: i for i, name in enumerate(dict.fromkeys(c.scene.name for c in cells))}


def offset(index, count):
    """Returns the offset of a sample count within a row, in rows."""
    return 0 if count == 1 else SPREAD * (index / (count - 1) - 0.5)


def draw(stem, title, cells, lights):
    """Writes stem.png and stem.svg. `lights` maps the shaders to the titles of the panels."""
    panels = [light for light in lights if any(c.light == light for c in cells)]
    rows = rows_of(cells)
    figure, axes = _new_figure(len(panels), len(rows), len({c.spp for c in cells}))
    for panel, light in zip(axes[0], panels):
        of_light = [c for c in cells if c.light == light]
        _draw_panel(panel, of_light, rows)
        panel.set_title(lights[light], fontsize=9)
    _name_rows(axes[0][0], cells, rows)
    handles, names = axes[0][0].get_legend_handles_labels()
    figure.legend(handles, names, fontsize=7, loc="lower center", ncols=len({c.method for c in cells}))
    figure.suptitle(title, fontsize=10)
    figure.savefig(stem + ".png", dpi=110)
    figure.savefig(stem + ".svg")
    pyplot.close(figure)


def _new_figure(panels, rows, legend_lines):
    """Returns a figure whose rows have a fixed height, and its axes."""
    bottom = BOTTOM + LEGEND_LINE * legend_lines
    width, height = LEFT + RIGHT + 4.6 * panels, TOP + bottom + ROW * rows
    figure, axes = pyplot.subplots(1, panels, sharey=True, squeeze=False, figsize=(width, height))
    figure.subplots_adjust(LEFT / width, bottom / height, 1 - RIGHT / width, 1 - TOP / height, 0.08)
    return figure, axes


def _name_rows(axes, cells, rows):
    groups = {c.scene.name: c.scene.group for c in cells}
    axes.set_yticks(list(rows.values()), list(rows), fontsize=8)
    axes.set_ylim(len(rows) - 0.5, -0.5)
    names = list(rows)
    for panel in axes.figure.axes:
        for above, below in zip(names, names[1:]):
            wide = 1.0 if groups[above] != groups[below] else 0.3
            panel.axhline(rows[below] - 0.5, color="#999999", linewidth=wide, alpha=0.8, zorder=0)


def _draw_panel(axes, cells, rows):
    samples = sorted({c.spp for c in cells})
    methods = list(dict.fromkeys(c.method for c in cells))
    indices = palette_indices([m.style() for m in methods])
    for method, index in zip(methods, indices):
        of_method = [c for c in cells if c.method == method and c.ratio]
        _draw_lines(axes, of_method, rows, samples, COLORS[index])
        for i, spp in enumerate(samples):
            points = [(c.ratio, rows[c.scene.name] + offset(i, len(samples))) for c in of_method if c.spp == spp]
            _draw_marks(axes, points, COLORS[index], MARKERS[index], FIRST_SIZE + SIZE_STEP * i,
                        "%s, %d spp" % (method.integrator, spp))
    axes.axvline(1, color="black", linewidth=1.0, zorder=1)
    axes.set_xscale("log")
    low, high = axes.get_xlim()
    axes.xaxis.set_major_locator(ticker.LogLocator(subs=(1, 2, 5) if high < 300 * low else (1,)))
    axes.xaxis.set_major_formatter("{x:g}")
    axes.xaxis.set_minor_formatter(ticker.NullFormatter())
    axes.tick_params(axis="x", labelsize=8)
    axes.set_xlabel("error, over that of supersample in the same time", fontsize=9)
    axes.grid(True, axis="x", which="both", linewidth=0.3, alpha=0.6)
    axes.tick_params(axis="y", length=0)


def _draw_lines(axes, cells, rows, samples, color):
    """Connects the marks of a scene by increasing samples."""
    for name, row in rows.items():
        points = [(c.ratio.value, row + offset(samples.index(c.spp), len(samples))) for c in cells if c.scene.name == name]
        axes.plot([p[0] for p in points], [p[1] for p in points], color=color, linewidth=0.6, alpha=0.6)


def _draw_marks(axes, points, color, marker, size, label):
    for ratio, y in points:
        axes.plot([ratio.value, ratio.upper], [y, y], color=color, linewidth=0.9, alpha=0.5)
    axes.plot([r.value for r, _ in points], [y for _, y in points], linestyle="", marker=marker, markersize=size,
              color=color, markeredgewidth=0, label=label)
