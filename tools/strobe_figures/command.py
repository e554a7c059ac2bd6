"""The command line of tools/figures."""

import argparse
import json
import os
import platform
import subprocess
import sys
import time
import traceback

from . import advice, charts, gains, paper, pareto, peers, sharing, stability, statements
from .report import write_report as write_page
from .context import ROOT, Context, Skipped, TooNoisy
from .runs import Failed

# (section, name, function) of all figures, in the order of the report.
FIGURES = [
    ("gains", "gains", gains.gains),
    ("accuracy", "accuracy-direct", pareto.accuracy_direct),
    ("accuracy", "accuracy-paths", pareto.accuracy_paths),
    ("accuracy", "beside-cycles", peers.beside_cycles),
    ("paper", "figure-1", paper.figure_1),
    ("paper", "figure-2", paper.figure_2),
    ("paper", "figure-3a", paper.figure_3a),
    ("paper", "figure-3b", paper.figure_3b),
    ("paper", "figure-4", paper.figure_4),
    ("paper", "figure-5", paper.figure_5),
    ("paper", "figure-6", paper.figure_6),
    ("paper", "statements", statements.statements),
    ("sharing", "shade-counts", sharing.shade_counts),
    ("sharing", "bias-by-block", sharing.bias_by_block),
    ("sharing", "all-settings", sharing.all_settings),
    ("stability", "stress", stability.stress),
    ("stability", "work-and-memory", stability.work_and_memory),
    ("advice", "what-to-use", advice.what_to_use),
]
SECTIONS = {"gains": "Which integrator to use", "accuracy": "Speed against accuracy", "paper": "The paper's figures",
            "sharing": "Effects of sharing", "stability": "Failure thresholds", "advice": "Recommended methods"}
DESCRIPTION = """Renders the figures of strobe: gains over supersample, speed against accuracy, the paper's figures, effects
of sharing, failure thresholds, and recommended methods. Writes CSV files, charts and report.html. Finished renders are
kept; started again, the program continues where it stopped. The paper's scenes are read from $STROBE_SCENES (default:
../shared/scenes beside the repository; see tools/fetch-scenes)."""


def parse():
    """Returns the command line arguments."""
    parser = argparse.ArgumentParser(prog="figures", description=DESCRIPTION)
    size = parser.add_mutually_exclusive_group()
    size.add_argument("--quick", action="store_true", help="small images and few samples; takes minutes (default)")
    size.add_argument("--full", action="store_true", help="larger images and more samples; takes hours")
    parser.add_argument("--only", action="append", metavar="NAME", default=[],
                        help="make one figure or section only; may be repeated")
    parser.add_argument("--scene", action="append", metavar="NAME", default=[],
                        help="measure this scene only, in the figure gains; may be repeated")
    parser.add_argument("--list", action="store_true", help="print the names of all figures and exit")
    parser.add_argument("-o", "--out", default="", help="output folder (default: out/figures-quick or out/figures-full)")
    parser.add_argument("--strobe", default=os.path.join(ROOT, "build", "release", "strobe"),
                        help="path of strobe (default: build/release/strobe)")
    parser.add_argument("--threads", type=int, default=0, help="threads of strobe; 0: one per core (default)")
    arguments = parser.parse_args()
    known = {name for _, name, _ in FIGURES} | set(SECTIONS)
    for name in arguments.only:
        if name not in known:
            parser.error("unknown figure %r (known: %s)" % (name, ", ".join(sorted(known))))
    return arguments


def scenes_folder():
    """Returns the folder that contains the paper's scenes."""
    folder = os.environ.get("STROBE_SCENES")
    return os.path.abspath(folder or os.path.join(ROOT, "..", "shared", "scenes"))


def chosen(arguments):
    """Returns the entries of FIGURES that the arguments select."""
    only = set(arguments.only)
    return [f for f in FIGURES if not only or f[0] in only or f[1] in only]


def main():
    """Makes the figures. Returns the exit code."""
    arguments = parse()
    if arguments.list:
        for section, name, make in FIGURES:
            print("%-20s %-10s %s" % (name, section, (make.__doc__ or "").strip().splitlines()[0]))
        return 0
    if not os.path.exists(arguments.strobe):
        print("figures: %s does not exist: run tools/demo first, or use --strobe" % arguments.strobe, file=sys.stderr)
        return 1
    quick = not arguments.full
    out = os.path.abspath(arguments.out or os.path.join(ROOT, "out", "figures-quick" if quick else "figures-full"))
    context = Context(out, os.path.abspath(arguments.strobe), scenes_folder(), quick, arguments.threads, arguments.scene)
    if not context.have_paper:
        print("figures: the paper's scenes are not in %s (see tools/fetch-scenes): our own scenes replace them" %
              context.scenes, file=sys.stderr)
    failed = make_all(context, chosen(arguments))
    page = write_report(context) or "no report, because there are no figures"
    print("%d renders, %d reused; %s" % (context.runs.rendered, context.runs.reused, page))
    return 1 if failed else 0


def make_all(context, figures):
    """Makes the figures and writes their items as JSON files, so that the report also contains the figures of earlier
    calls. Returns the names of the figures that failed."""
    failed = []
    for i, (section, name, make) in enumerate(figures):
        elapsed = time.time() - context.started
        remaining = elapsed / i * (len(figures) - i) if i else 0
        print("[%d/%d] %s (%.0f s elapsed%s)" % (i + 1, len(figures), name, elapsed,
                                                 ", about %.0f s remain" % remaining if remaining else ""), file=sys.stderr)
        start = time.time()
        try:
            items = make(context)
            draw_and_print(context, items)
        except Skipped as reason:
            print("%s: skipped: %s" % (name, reason), file=sys.stderr)
            continue
        except (Failed, TooNoisy) as error:
            print("%s: %s" % (name, error), file=sys.stderr)
            failed.append(name)
            continue
        except Exception:  # a bug in one figure must not prevent the others
            traceback.print_exc()
            failed.append(name)
            continue
        with open(context.path("items", name + ".json"), "w") as file:
            json.dump({"section": section, "items": items, "seconds": time.time() - start}, file)
    return failed


def draw_and_print(context, items):
    """Draws the charts of a figure and prints its paragraphs."""
    for item in items:
        if item["kind"] == "chart":
            charts.draw(item, context.path("charts", item["id"]))
        elif item["kind"] == "paragraph":
            print(item["text"])


def write_report(context):
    """Writes the report with all figures in the output folder. Returns its path, or None without figures."""
    sections = []
    for section, title in SECTIONS.items():
        items = []
        for of_section, name, _ in FIGURES:
            path = context.path("items", name + ".json")
            if of_section == section and os.path.exists(path):
                with open(path) as file:
                    items += json.load(file)["items"]
        if items:
            text = "\n\n".join(i["text"] for i in items if i["kind"] == "paragraph")
            items = [i for i in items if i["kind"] != "paragraph"]
            sections.append({"id": section, "title": title, "text": text, "items": items})
    if not sections:
        return None
    version = subprocess.run([context.runs.program, "--version"], capture_output=True, text=True).stdout.strip()
    subtitle = "%s, %s, %d threads, %s; %s" % (version, platform.machine(), context.threads or os.cpu_count(),
                                               time.strftime("%Y-%m-%d"), "--quick" if context.quick else "--full")
    with open(context.path("report.json"), "w") as file:
        json.dump({"title": "strobe: figures", "subtitle": subtitle, "sections": sections}, file)
    return write_page(context.out)
