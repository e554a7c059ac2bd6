"""The command line of tools/farm."""

import argparse
import json
import os
import re
import secrets
import shutil
import subprocess
import sys
import tempfile

from . import local, parallel, slurm, status, worker
from .plan import FarmError, Plan, folder_of, read_json, remove

ENGINES = {"slurm": slurm, "parallel": parallel, "local": local}
TOOLS = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))
PROGRAM = [os.path.realpath(sys.argv[0])]  # which tasks run
EXAMPLES = """
examples:
  farm slurm room.scene -o room.exr --tasks 16 -- --cpus-per-task 8 --partition fast
  farm slurm walk.scene --frames 0:99 -o out/walk.####.exr --tasks 4 --watch
  farm parallel room.scene -o room.exr --tasks 16 -- -S host1,host2
  farm local room.scene -o room.exr --tasks 4 -- -j 2
  farm --status -o room.exr
The same command continues a render that was cancelled or has failed. See docs/farm.md."""
# Options of strobe that `strobe merge` takes, too, and the number of their values.
MERGE_OPTIONS = {"--exr": 1, "--view": 1, "--display": 1, "--look": 1, "--exposure": 1, "--plugin": 1, "--strict": 0}
QUIET = ("-q", "--quiet")  # hides the progress, which the status shows
REFUSED = {"--slice": "is given to each task", "--sample-range": "renders slices of samples; --tasks gives slices",
           "--checkpoint": "is --save here", "--resume": "is given to each task",
           **dict.fromkeys(("--time-limit", "--noise-target", "--reference", "--curve", "--heatmap", "--samples", "--pixel",
                            "--stats", "--no-output", "--write-interval", "--display-server"), "does not go with slices")}


def parser():
    """Returns the parser of the program's own options. Other options are those of strobe."""
    p = argparse.ArgumentParser(
        prog="farm", allow_abbrev=False, formatter_class=argparse.RawDescriptionHelpFormatter, epilog=EXAMPLES,
        usage="farm ENGINE SCENE... -o OUTPUT --tasks N [strobe options] [-- engine options]\n"
              "       farm --status|--watch|--cancel -o OUTPUT",
        description="Renders a image or the frames of a sequence in slices: with the engine slurm (options of sbatch), "
                    "parallel (options of GNU parallel) or local (-j N processes of this machine).")
    p.add_argument("-o", "--output", action="append", default=[], metavar="FILE", help="image; may be repeated")
    p.add_argument("--tasks", type=int, metavar="N", help="slices of a frame [16]")
    p.add_argument("--frames", metavar="LIST", help="frames of a sequence, as of strobe")
    p.add_argument("--save", type=float, default=60, metavar="SECONDS", help="interval of checkpoints [60]")
    p.add_argument("--strobe", metavar="PROGRAM", help="strobe, at the same path on all machines")
    p.add_argument("--dry-run", action="store_true", help="check the scene, and say what a slice takes; submit nothing")
    p.add_argument("--restart", action="store_true", help="remove the slices of an earlier render")
    p.add_argument("--watch", action="store_true", help="show the progress, and write the unfinished image, until the end")
    p.add_argument("--status", action="store_true", help="show the progress")
    p.add_argument("--cancel", action="store_true", help="end the tasks; finished samples are kept")
    return p


def find_strobe(given):
    """Returns the path of the program."""
    beside = os.path.join(os.path.dirname(PROGRAM[0]), "strobe")  # of an installation
    built = os.path.join(os.path.dirname(TOOLS), "build", "release", "strobe")
    path = shutil.which(given) if given else next(filter(None, map(shutil.which, (beside, built, "strobe"))), None)
    if path is None:
        raise FarmError("%s is not there" % given if given else "strobe is not there: build it, or give --strobe")
    return os.path.abspath(path)


def merge_options(words):
    """Returns the options of strobe that its merge takes, too."""
    options, words = [], iter(words)
    for word in words:
        name = word.split("=")[0]
        if name in MERGE_OPTIONS:
            options.append(word)
            if MERGE_OPTIONS[name] and "=" not in word:
                options.append(next(words, ""))
    return options


def check_words(words):
    """Throws FarmError if options of strobe do not go with slices."""
    for word in words:
        reason = REFUSED.get(word.split("=")[0])
        if reason:
            raise FarmError("%s %s" % (word, reason))


def dry_run(plan, frames):
    """Checks the scene and the outputs. Returns what strobe's --stats says."""
    with tempfile.TemporaryDirectory() as folder:
        stats = os.path.join(folder, "scene.json")
        command = [*plan.strobe, *(["--frames=" + frames] if frames else []), "--dry-run", "--stats", stats]
        for output in plan.outputs:
            command += ["-o", output]
        done = subprocess.run(command, stdin=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True, check=False)
        if done.returncode:
            raise FarmError("the scene cannot be rendered:\n" + done.stderr.strip())
        sys.stderr.writelines(line + "\n" for line in done.stderr.split("\n") if line.startswith("warning: "))
        return read_json(stats)


def advice(plan, scene):
    """Returns what a slice takes, in words."""
    estimate = scene["estimate"]
    seconds = estimate["threadSeconds"] / plan.tasks
    size = estimate["memory"] + 76 * scene["resolution"][0] * scene["resolution"][1]  # sums of a part
    return ("%d slices of about %s of one processor each, and %.2g s to load; about %d MB of memory"
            % (len(plan.frames) * plan.tasks, status.duration(seconds), estimate["load"], size // 10 ** 6 + 1))


def prepare(plan, scene, restart):
    """Writes the plan. Parts of an earlier run of the same render stay. Throws FarmError if there is another render."""
    if os.path.isdir(plan.folder):
        before, content = read_json(plan.path("plan.json")), read_json(plan.path("scene.json"))
        if before is not None:
            before = Plan(**before, folder=plan.folder)
            if ENGINES[before.engine].is_active(before):
                raise FarmError("%s: it is being rendered; --cancel ends it" % plan.folder)
            if not restart and not (before.is_same_render(plan) and content["content"] == scene["content"]
                                    and content["version"] == scene["version"]):
                raise FarmError("%s: there are parts of another render; --restart removes them" % plan.folder)
        if restart:
            plan.remove()
        else:
            remove(plan.path("failed"))
            shutil.rmtree(plan.path("finished"), ignore_errors=True)
    plan.save()
    with open(plan.path("scene.json"), "w", encoding="utf-8") as file:
        json.dump(scene, file)


def submit(engine, options, words, engine_words):
    """Checks, plans and starts a render. Returns an exit code."""
    if not options.output:
        raise FarmError("-o is missing")
    check_words(words)
    directory = os.getcwd()
    stem = re.sub(r"\W+", "-", os.path.splitext(os.path.basename(options.output[0]))[0]).strip("-")
    plan = Plan(name="strobe-%s-%s" % (stem, secrets.token_hex(3)), engine=engine,
                strobe=[find_strobe(options.strobe), *(w for w in words if w not in QUIET)],
                merge=merge_options(words), outputs=options.output, directory=directory, frames=[None],
                tasks=16 if options.tasks is None else options.tasks, checkpoint=options.save,
                folder=os.path.abspath(folder_of(options.output[0])))
    if plan.tasks < 1:
        raise FarmError("--tasks must be at least 1")
    scene = dry_run(plan, options.frames)
    if "frames" in scene:
        finished = set(scene["frames"]["finished"])
        plan.frames = [frame for frame in scene["frames"]["all"] if frame not in finished]
        print("%d frames, of which %d are finished" % (len(scene["frames"]["all"]), len(finished)))
    if plan.frames:
        print(advice(plan, scene), flush=True)
    if options.dry_run or not plan.frames:
        return worker.DONE
    prepare(plan, scene, options.restart)
    code = start(plan, ENGINES[engine], engine_words, options.watch)
    if code != worker.DONE and plan.failure():
        raise FarmError(plan.failure())
    return code


def start(plan, engine, words, watches):
    """Starts the slices that are missing. Returns an exit code."""
    missing = [(f, [n for n in range(1, plan.tasks + 1) if not os.path.exists(plan.part(f, n))]) for f in plan.frames]
    if watches and not engine.DETACHED:
        with status.Watcher(plan, engine):
            return engine.submit(plan, missing, words, PROGRAM)
    try:
        code = engine.submit(plan, missing, words, PROGRAM)
    except FarmError:
        if engine.DETACHED:  # some jobs may have been accepted
            engine.cancel(plan)
        if not os.listdir(plan.path("parts")):
            plan.remove()
        raise
    return status.watch(plan, engine) if watches and code == worker.DONE else code


def control(options):
    """Shows or ends a render. Returns an exit code."""
    if not options.output:
        raise FarmError("-o OUTPUT says which render is meant")
    folder = os.path.abspath(folder_of(options.output[0]))
    if not os.path.isdir(folder):
        raise FarmError("%s: there is no render; it is finished, or was never submitted" % folder)
    plan = Plan.load(folder)
    engine = ENGINES[plan.engine]
    if options.cancel:
        engine.cancel(plan)
        print("cancelled; the command that started the render continues it")
        return worker.DONE
    if options.watch:
        return status.watch(plan, engine)
    print(status.text(plan, engine))
    return worker.DONE if plan.failure() is None else worker.FAILED


def work(words):
    """Runs a worker: --task FOLDER FRAME SLICE [THREADS], or --merge FOLDER FRAME."""
    plan = Plan.load(words[1])
    frame = None if words[2] == "still" else int(words[2])
    code = (worker.render_slice(plan, frame, int(words[3]), *words[4:]) if words[0] == "--task"
            else worker.merge_frame(plan, frame))
    if plan.engine == "slurm":
        slurm.after_worker(plan, code)
    return code


def run(words):
    """Runs a command line. Returns an exit code."""
    if words[:1] in (["--task"], ["--merge"]):
        return work(words)
    end = words.index("--") if "--" in words else len(words)
    own, engine_words = words[:end], words[end + 1:]
    engine = own.pop(0) if own[:1] and own[0] in ENGINES else None
    options, rest = parser().parse_known_args(own)
    if engine is None:
        if options.status or options.cancel or options.watch:
            return control(options)
        raise FarmError("the first word is an engine: " + ", ".join(ENGINES))
    if options.status or options.cancel:
        return control(options)
    return submit(engine, options, rest, engine_words)


def main():
    """Runs the program. Returns its exit code."""
    try:
        return run(sys.argv[1:])
    except FarmError as error:
        sys.stderr.write("farm: %s\n" % error)
        return worker.FAILED
    except KeyboardInterrupt:
        return 130
