#!/usr/bin/python3
"""Measures the light tree beside `all` and `one`: at equal error, by the number of lights, and with moving lights.

Usage: many_lights.py {equal,few,scaling,motion,stress} [--strobe PROGRAM] [--lamps N...] [--kinds KIND...] [--largest N]
                      [--chart FILE]

The scene has a floor with 64 balls under lamps at random positions: points, `white` points (the others have random colors),
spots, disks (which face the floor), spheres, `string` (one mesh of small squares), and `sheet` (one wavy mesh high above the
floor). "moving" lamps fly in random directions. Seconds are CPU seconds of one thread for rendering, without parsing and
building the scene; they include building the tree. Errors are the RMSE of pixels below 2 against a reference of 4096 samples
per pixel. "all@1" is the error that `all` has with one sample per pixel (for meshes, which are one light, with 64). Seconds to
an error are interpolated in the logarithms of errors and seconds. Beyond the measured samples they are extrapolated, with the
error falling with the square root of the seconds: ~ from a larger error, < from a smaller one.

equal    seconds to the error all@1, and to a quarter of it
scaling  seconds per camera sample, seconds to the error .01, and seconds of building the tree, from 1 to --largest lights
motion   errors at equal seconds with bounds that are swept, linear and split
few      seconds of `all` and `tree` to all@1 with few lamps: where the default switches
stress   errors with 16 samples per pixel for each value of the sweeps in scenes/stress that test the choice of lights
"""
import argparse
import math
import os
import random
import sys
import tempfile

import numpy

ROOT = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))
sys.path.insert(0, os.path.join(ROOT, "tools"))
sys.path.insert(0, os.path.join(ROOT, "tools", "strobe_figures"))
from strobe_figures.images import read  # noqa: E402
from sweeps import read_sweep, scene_with  # noqa: E402

STRATEGIES = ("all", "one", "tree")
STRESS = ("lamp-behind-wall", "far-and-near", "spot-near-miss")

HEAD = """Film "image" "integer xresolution" {width} "integer yresolution" {height}
Sampler "sobol" "integer pixelsamples" 1
Integrator "supersample"
Integrator "directlighting"
LookAt 0 7 -13  0 0 0  0 1 0
TransformTimes 0 1
Camera "perspective" "float fov" 60
WorldBegin
Material "matte" "rgb Kd" [.5 .5 .5]
Shape "trianglemesh" "integer indices" [0 1 2 0 2 3] "point P" [-20 0 -20 20 0 -20 20 0 20 -20 0 20]
"""
BALL = 'AttributeBegin Translate %g .3 %g Shape "sphere" "float radius" .3 AttributeEnd\n'
MESH = 'AreaLightSource "diffuse" "rgb L" [%g %g %g] Shape "trianglemesh" "integer indices" [%s] "point P" [%s]\n'
MOVE = "ActiveTransform EndTime Translate %g 0 %g ActiveTransform All "


def lamp(kind, color, p, radius, u):
    """Returns the statement of one lamp."""
    if kind in ("point", "white"):
        return 'LightSource "point" "rgb I" [%g %g %g] "point from" [%g %g %g]' % (*color, *p)
    if kind == "spot":
        return 'LightSource "spot" "rgb I" [%g %g %g] "point from" [%g %g %g] "point to" [%g 0 %g] "float coneangle" 40' % (
            *(6 * c for c in color), *p, p[0] + u[0], p[2] + u[1])
    area = 'Translate %g %g %g Rotate 90 1 0 0 AreaLightSource "diffuse" "rgb L" [%g %g %g] Shape "%s" "float radius" %g'
    scale = 1 / radius**2 / (math.pi if kind == "sphere" else 1)
    return area % (*p, *(c * scale for c in color), kind, radius)


def string(count, radiance, rng):
    """Returns a mesh of about `count` triangles: small squares at random positions that face the floor."""
    indices, points = [], []
    size = 3 / math.sqrt(count)
    for i in range(max(1, count // 2)):
        x, y, z = rng.uniform(-12, 12), rng.uniform(.8, 3), rng.uniform(-12, 12)
        points += ["%g %g %g" % (x + dx * size, y, z + dz * size) for dx, dz in ((-1, -1), (1, -1), (1, 1), (-1, 1))]
        indices += ["%d %d %d %d %d %d" % tuple(4 * i + k for k in (0, 1, 2, 0, 2, 3))]
    return MESH % (*[radiance] * 3, " ".join(indices), " ".join(points))


def sheet(count):
    """Returns a wavy mesh of about `count` triangles above the floor."""
    side = max(1, round(math.sqrt(count / 2)))
    at = lambda i: i / side * 24 - 12  # noqa: E731
    points = ["%g %g %g" % (at(i), 9 + .8 * math.sin(at(i) * 1.3) * math.cos(at(j) * 1.1), at(j))
              for j in range(side + 1) for i in range(side + 1)]
    corners = [j * (side + 1) + i for j in range(side) for i in range(side)]
    indices = ["%d %d %d %d %d %d" % (a, a + 1, a + side + 2, a, a + side + 2, a + side + 1) for a in corners]
    return MESH % (1, 1, 1, " ".join(indices), " ".join(points))


def scene(kind, count, moving, width=80, height=60):
    """Returns the text of a scene with `count` lamps or, in a mesh, triangles."""
    rng = random.Random(1)
    parts = [HEAD.format(width=width, height=height)]
    if kind in ("string", "sheet"):
        motion = MOVE % (6, 0) if moving else ""
        mesh = string(count, 4, rng) if kind == "string" else sheet(count)
        parts.append("AttributeBegin " + motion + mesh + "AttributeEnd\n")
    for _ in range(0 if kind in ("string", "sheet") else count):
        p = (rng.uniform(-12, 12), rng.uniform(.8, 3), rng.uniform(-12, 12))
        color = [30 / count * rng.uniform(.3, 1.7) for _ in range(3)]
        if kind == "white":
            color = color[:1] * 3
        move = MOVE % (rng.uniform(-8, 8), rng.uniform(-8, 8)) if moving else ""
        radius = min(.3, 3 / math.sqrt(count))
        u = (rng.uniform(-2, 2), rng.uniform(-2, 2))
        parts.append("AttributeBegin " + move + lamp(kind, color, p, radius, u) + " AttributeEnd\n")
    parts += [BALL % (i * 2.5 - 8.75, j * 2.5 - 8.75) for i in range(8) for j in range(8)]
    return "".join(parts)


class Bench:
    """Renders scenes in a temporary folder."""

    def __init__(self, strobe, folder):
        self.strobe, self.folder, self.runs, self.loads = strobe, folder, 0, {}

    def write(self, *args):
        """Writes a scene and returns its path."""
        path = os.path.join(self.folder, "-".join(map(str, args)) + ".scene")
        with open(path, "w", encoding="utf-8") as file:
            file.write(scene(*args))
        return path

    def render(self, path, strategy, spp, *defines, seed=0, threads=1):
        """Returns the image and the CPU seconds of rendering. Those of one pixel are subtracted, as those of loading."""
        if path not in self.loads:
            crop = ("--threads", "1", "--crop", "0", ".01", "0", ".01")
            self.loads[path] = min(self.run(path, "one", 1, *crop)[1] for _ in range(2))
        defines = [s for d in defines for s in ("-D", d)]
        image, seconds = self.run(path, strategy, spp, *defines, "--seed", str(seed), "--threads", str(threads))
        return image, max(seconds - self.loads[path], 1e-3)

    def run(self, path, strategy, spp, *options):
        """Returns the image and the CPU seconds."""
        self.runs += 1
        out = os.path.join(self.folder, "%d.exr" % self.runs)  # a new name: OpenImageIO caches files
        command = [self.strobe, path, "--quiet", "--spp", str(spp), "-o", out, "-D", "strategy=" + strategy, *options]
        child = os.posix_spawn(self.strobe, command, os.environ)
        _, status, usage = os.wait4(child, 0)
        if status != 0:
            sys.exit("many_lights.py: " + " ".join(command) + " failed")
        image = read(out)
        os.remove(out)
        return image, usage.ru_utime + usage.ru_stime

    def error(self, image, reference):
        """Returns the RMSE of the pixels whose reference is at most 2."""
        mask = reference.max(axis=2) < 2
        return float(numpy.sqrt(numpy.mean((image - reference)[mask] ** 2)))

    def curve(self, path, strategy, reference, target, most=1024, seconds=10, first=1, defines=()):
        """Returns (spp, error, seconds) for doubled numbers of samples, until the error is at most the target."""
        points, spp = [], first
        while not points or (points[-1][1] > target and spp <= most and points[-1][2] < seconds):
            image, cost = self.render(path, strategy, spp, *defines)
            points.append((spp, self.error(image, reference), cost))
            spp *= 2
        return points


def seconds_to(points, target):
    """Returns the seconds to an error, and "~" if they are extrapolated."""
    for (_, e0, t0), (_, e1, t1) in zip(points, points[1:]):
        if e1 <= target < e0:
            f = math.log(e0 / target) / math.log(e0 / e1)
            return math.exp((1 - f) * math.log(t0) + f * math.log(t1)), ""
    _, error, cost = points[0] if points[0][1] <= target else points[-1]
    return cost * (error / target) ** 2, "~" if error > target else "<"


def measure_equal(bench, args):
    print("| lamps | error | all | one | tree | gain |\n|---|---|---|---|---|---|")
    for count in args.lamps or (1000, 10000):
        for kind in args.kinds:
            for moving in (False, True):
                path = bench.write(kind, count, moving)
                reference = bench.render(path, "tree", 4096, seed=99, threads=2)[0]
                # One sample of a mesh is that of one triangle, not of all lamps.
                spp = 64 if kind in ("string", "sheet") else 1
                target = bench.error(bench.render(path, "all", spp)[0], reference)
                curves = {s: bench.curve(path, s, reference, target / 4) for s in ("all", "one", "tree")}
                for goal in (target, target / 4):
                    times = {s: seconds_to(c, goal) for s, c in curves.items()}
                    cells = ["%s%.3g" % (mark, t) for t, mark in times.values()]
                    gain = min(times["all"][0], times["one"][0]) / times["tree"][0]
                    print("| %d %s, %s | %.2g | %s | %.1f |" % (count, kind, "moving" if moving else "still", goal,
                                                             " | ".join(cells), gain), flush=True)


def measure_few(bench, args):
    print("| lamps | all@1 | all | tree | all / tree |\n|---|---|---|---|---|")
    for kind in args.kinds:
        for count in args.lamps or (8, 32, 64, 128, 256, 512):
            path = bench.write(kind, count, False)
            reference = bench.render(path, "tree", 4096, seed=99, threads=2)[0]
            image, cost = bench.render(path, "all", 1)
            target = bench.error(image, reference)
            time, _ = seconds_to(bench.curve(path, "tree", reference, target), target)
            print("| %d %s | %.2g | %.3g | %.3g | %.2f |" % (count, kind, target, cost, time, cost / time), flush=True)


def measure_scaling(bench, args):
    print("| lights | strategy | µs per camera sample | seconds to .01 | tree: building seconds |\n|---|---|---|---|---|")
    spp = 16
    for kind in args.kinds:
        count = 1
        while count <= args.largest:
            path = bench.write(kind, count, False)
            reference = bench.render(path, "tree", 1024, seed=99, threads=2)[0]
            small = bench.write(kind, count, False, 8, 6)
            build = max(0, min(bench.render(small, "tree", 1)[1] for _ in range(2)) - bench.render(small, "one", 1)[1])
            for strategy in ("all", "one", "tree"):
                if strategy == "all" and count > 10000 and kind not in ("string", "sheet"):
                    continue
                first = 1 if strategy == "all" else spp
                points = bench.curve(path, strategy, reference, .01, most=256, seconds=20, first=first)
                start = build if strategy == "tree" else 0
                points = [(n, e, max(t - start, 1e-3)) for n, e, t in points]
                time, mark = seconds_to(points, .01)
                time, each = time + start, points[0][2]
                print("| %d %s | %s | %.3g | %s%.3g | %s |" % (
                    count, kind, strategy, 1e6 * each / (4800 * points[0][0]), mark, time,
                    "%.3g" % build if strategy == "tree" else ""), flush=True)
            count *= 10


def error_after(points, seconds):
    """Returns the error after `seconds`, interpolated in logarithms; None outside of the measured seconds."""
    for (_, e0, t0), (_, e1, t1) in zip(points, points[1:]):
        if t0 <= seconds <= t1:
            f = math.log(seconds / t0) / math.log(t1 / t0)
            return math.exp((1 - f) * math.log(e0) + f * math.log(e1))
    return None


def measure_motion(bench, args):
    times = (.05, .1, .3, 1, 3)
    print("| lamps | bounds | " + " | ".join("%g s" % t for t in times) + " |\n" + "|---" * (2 + len(times)) + "|")
    for kind in args.kinds:
        for count in args.lamps or (1000,):
            path = bench.write(kind, count, True)
            reference = bench.render(path, "tree", 4096, seed=99, threads=2)[0]
            for bounds in ("swept", "linear", "split"):
                points = bench.curve(path, "tree", reference, 0, seconds=times[-1], defines=("lightmotion=" + bounds,))
                errors = [error_after(points, t) for t in times]
                print("| %d %s | %s | %s |" % (count, kind, bounds,
                                             " | ".join("%.2g" % e if e else "" for e in errors)), flush=True)


def measure_stress(bench, args):
    print("| scene | value | all | one | tree |\n|---|---|---|---|---|")
    curves = {}
    for name in STRESS:
        source = os.path.join(ROOT, "scenes/stress", name + ".scene")
        sweep = read_sweep(source)
        errors = {s: [] for s in STRATEGIES}
        for value in sweep.values:
            path = os.path.join(bench.folder, "%s-%g.scene" % (name, value))
            with open(path, "w", encoding="utf-8") as file:
                file.write(scene_with(source, value))
            reference = bench.render(path, "all", 256, seed=99, threads=2)[0]
            for s in STRATEGIES:
                errors[s].append(bench.error(bench.render(path, s, 16)[0], reference))
            print("| %s | %g | %s |" % (name, value, " | ".join("%.4f" % errors[s][-1] for s in STRATEGIES)), flush=True)
        curves[name] = (sweep, errors)
    if args.chart:
        draw_stress(curves, args.chart)


def draw_stress(curves, path):
    """Writes a chart of errors over the values of the sweeps, as PNG."""
    import matplotlib
    matplotlib.use("Agg")
    from matplotlib import pyplot
    figure, axes = pyplot.subplots(1, len(curves), figsize=(4 * len(curves), 3.4), constrained_layout=True)
    for ax, (name, (sweep, errors)) in zip(axes, curves.items()):
        for (strategy, values), style in zip(errors.items(), ("s-", "^-", "o-")):
            ax.plot(sweep.values, values, style, markersize=4, label=strategy)
        label = "%s (%s)" % (sweep.name, sweep.unit) if sweep.unit else sweep.name
        ax.set(xscale="log", yscale="log", title=name, xlabel=label)
        ticks = []
        for value in sorted(sweep.values):
            if not ticks or value >= 1.5 * ticks[-1]:  # labels of nearer ticks overlap
                ticks.append(value)
        ax.set_xticks(ticks, labels=["%g" % t for t in ticks])
        ax.set_xticks([], minor=True)
        if sweep.values[0] > sweep.values[-1]:
            ax.invert_xaxis()
        ax.grid(alpha=.3)
    axes[0].set_ylabel("RMSE, 16 samples per pixel")
    axes[0].legend()
    figure.savefig(path, dpi=110)


def main():
    """Runs the command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("what", choices=("equal", "few", "scaling", "motion", "stress"))
    parser.add_argument("--strobe", default=os.path.join(ROOT, "build/release/strobe"))
    parser.add_argument("--lamps", type=int, nargs="+", help="numbers of lamps")
    parser.add_argument("--kinds", nargs="+", choices=("point", "white", "spot", "disk", "sphere", "string", "sheet"))
    parser.add_argument("--largest", type=int, default=10**6, help="largest number of lights of `scaling` (default: 1000000)")
    parser.add_argument("--chart", help="write a chart of `stress` to this PNG file")
    args = parser.parse_args()
    args.kinds = args.kinds or {"equal": ("point", "white", "disk", "string", "sheet"), "few": ("point", "disk"),
                                "scaling": ("point", "string"), "motion": ("point", "disk"), "stress": ()}[args.what]
    with tempfile.TemporaryDirectory() as folder:
        bench = Bench(os.path.abspath(args.strobe), folder)
        globals()["measure_" + args.what](bench, args)


if __name__ == "__main__":
    main()
