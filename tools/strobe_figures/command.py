"""The command line of tools/figures."""

import argparse
import json
import os
import platform
import subprocess
import sys
import time
import traceback

from . import advice, charts, paper, pareto, peers, sharing, stability, statements
from .report import write_report as write_page
from .context import ROOT, Context, Skipped, TooNoisy
from .runs import Failed

# Section, name, function: what is made, in this order.
FIGURES = [
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
SECTIONS = {"accuracy": "Speed against accuracy", "paper": "The paper's figures", "sharing": "What sharing does",
            "stability": "Where it breaks", "advice": "What to use"}


def parse():
    parser = argparse.ArgumentParser(description=__doc__)
    size = parser.add_mutually_exclusive_group()
    size.add_argument("--quick", action="store_true", help="small pictures, minutes (the default)")
    size.add_argument("--full", action="store_true", help="larger pictures, hours")
    parser.add_argument("--only", action="append", metavar="NAME", default=[], help="a figure or a section; again for more")
    parser.add_argument("--list", action="store_true", help="names of all figures")
    parser.add_argument("-o", "--out", default="", help="folder (default: out/figures-quick or out/figures-full)")
    parser.add_argument("--strobe", default=os.path.join(ROOT, "build", "release", "strobe"), help="the program")
    parser.add_argument("--threads", type=int, default=0, help="of strobe; 0: one per core")
    arguments = parser.parse_args()
    known = {name for _, name, _ in FIGURES} | set(SECTIONS)
    for name in arguments.only:
        if name not in known:
            parser.error("unknown figure %r (known: %s)" % (name, ", ".join(sorted(known))))
    return arguments


def scenes_folder():
    given = os.environ.get("STROBE_SCENES")
    return os.path.abspath(given or os.path.join(ROOT, "..", "shared", "scenes"))


def chosen(arguments):
    only = set(arguments.only)
    return [f for f in FIGURES if not only or f[0] in only or f[1] in only]


def main():
    arguments = parse()
    if arguments.list:
        for section, name, make in FIGURES:
            print("%-20s %-10s %s" % (name, section, (make.__doc__ or "").strip().splitlines()[0]))
        return 0
    if not os.path.exists(arguments.strobe):
        print("no program at %s: run tools/demo first, or give --strobe" % arguments.strobe, file=sys.stderr)
        return 1
    quick = not arguments.full
    out = os.path.abspath(arguments.out or os.path.join(ROOT, "out", "figures-quick" if quick else "figures-full"))
    context = Context(out, os.path.abspath(arguments.strobe), scenes_folder(), quick, arguments.threads)
    if not context.have_paper:
        print("no scenes of the paper in %s (tools/fetch-scenes gets them): our own stand in" % context.scenes,
              file=sys.stderr)
    failed = make_all(context, chosen(arguments))
    page = write_report(context) or "no page, for nothing is there to show"
    print("%d runs made, %d reused; %s" % (context.runs.made, context.runs.reused, page))
    return 1 if failed else 0


def make_all(context, figures):
    """Makes figures one by one; their items are kept as JSON, so that a report shows what earlier calls made."""
    failed = []
    for i, (section, name, make) in enumerate(figures):
        spent = time.time() - context.started
        left = spent / i * (len(figures) - i) if i else 0
        print("[%d/%d] %s (%.0f s so far%s)" % (i + 1, len(figures), name, spent,
                                                ", about %.0f s left" % left if left else ""), file=sys.stderr)
        start = time.time()
        try:
            items = make(context)
            for item in items:
                if item["kind"] == "chart":
                    charts.draw(item, context.path("charts", item["id"]))
        except Skipped as reason:
            print("%s: skipped: %s" % (name, reason), file=sys.stderr)
            continue
        except (Failed, TooNoisy) as error:
            print("%s: %s" % (name, error), file=sys.stderr)
            failed.append(name)
            continue
        except Exception:  # a fault of ours must not cost the other figures
            traceback.print_exc()
            failed.append(name)
            continue
        with open(context.path("items", name + ".json"), "w") as file:
            json.dump({"section": section, "items": items, "seconds": time.time() - start}, file)
    return failed


def write_report(context):
    """The path of the page with everything made so far; None if there is nothing."""
    sections = []
    for section, title in SECTIONS.items():
        items = []
        for of_section, name, _ in FIGURES:
            path = context.path("items", name + ".json")
            if of_section == section and os.path.exists(path):
                with open(path) as file:
                    items += json.load(file)["items"]
        if items:
            sections.append({"id": section, "title": title, "text": "", "items": items})
    if not sections:
        return None
    version = subprocess.run([context.runs.program, "--version"], capture_output=True, text=True).stdout.strip()
    subtitle = "%s, %s, %d threads, %s; %s pictures" % (version, platform.machine(), context.threads or os.cpu_count(),
                                                        time.strftime("%Y-%m-%d"), "small" if context.quick else "full")
    with open(context.path("report.json"), "w") as file:
        json.dump({"title": "strobe: speed against accuracy", "subtitle": subtitle, "sections": sections}, file)
    return write_page(context.out)
