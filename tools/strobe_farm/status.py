"""How far a render is: in words, and as a image."""

import os
import statistics
import subprocess
import sys
import threading
import time

from . import worker
from .plan import FarmError, frame_text

SLOW = 1.5  # times the median of the slices
SECONDS_BETWEEN_LINES, SECONDS_BETWEEN_PICTURES = 2, 20


def duration(seconds):
    """Returns a time in words."""
    if seconds < 100:
        return "%.2g s" % seconds
    return "%d min" % (seconds / 60) if seconds < 6000 else "%.1f hours" % (seconds / 3600)


class Slice:
    """What is known of a slice."""

    def __init__(self, plan, frame, number):
        self.number, self.is_done = number, os.path.exists(plan.part(frame, number))
        state = plan.state(plan.unit(frame, number))
        self.where = state.get("node") or state.get("host", "")
        self.progress = 1 if self.is_done else state.get("progress", 0)
        self.is_running = bool(state) and not self.is_done and not state.get("stopped")
        self.kills = state.get("kills", 0)
        self.elapsed = state.get("end", time.time()) - state.get("begin", time.time())
        self.total = self.elapsed / self.progress if self.progress > 0 else self.elapsed  # so far, if it has not said more

    def line(self, median):
        """Returns a line about a running or slow slice; empty if there is nothing to say."""
        is_slow = median > 0 and self.total > SLOW * median
        if not self.is_running and not is_slow:
            return ""
        text = "  slice %d: %3d %% on %s, %s" % (self.number, 100 * self.progress, self.where, duration(self.elapsed))
        if is_slow:
            text += "; slow: %.1f times the median" % (self.total / median)
        return text + ("; killed %d times" % self.kills if self.kills else "")


def frame_lines(plan, frame):
    """Returns the lines of a frame that is being rendered, and its progress."""
    slices = [Slice(plan, frame, n) for n in range(1, plan.tasks + 1)]
    done = sum(s.is_done for s in slices)
    running = sum(s.is_running for s in slices)
    progress = sum(s.progress for s in slices) / len(slices)
    if progress == 0 and running == 0:
        return [], 0
    times = [s.total for s in slices if s.progress > 0]
    median = statistics.median(times) if len(times) > 1 else 0
    head = "%s: %d of %d slices are finished, %d run, %d wait" % (
        "image" if frame is None else "frame %d" % frame, done, plan.tasks, running, plan.tasks - done - running)
    return [head, *filter(None, (s.line(median) for s in slices))], progress


def text(plan, engine):
    """Returns the progress of a render."""
    finished, lines, progress = plan.finished(), [], 0
    for frame in plan.frames:
        if frame not in finished:
            more, part = frame_lines(plan, frame)
            lines += more
            progress += part
    total = (len(finished) + progress) / len(plan.frames)
    lines.insert(0, "%s: %d %%, %d of %d images are finished" % (plan.name, 100 * total, len(finished), len(plan.frames)))
    jobs = engine.jobs(plan) if hasattr(engine, "jobs") else []
    if jobs:
        lines.append("jobs: " + "; ".join(jobs[:20]) + (" ..." if len(jobs) > 20 else ""))
    failure = plan.failure()
    return "\n".join([*lines, *(["failed: " + failure] if failure else [])])


def write_image(plan):
    """Writes the unfinished image of the first frame that has samples. Returns its name; None if there are none."""
    for frame in plan.frames:
        files = [file for n in range(1, plan.tasks + 1)
                 for file in ([plan.part(frame, n)] if os.path.exists(plan.part(frame, n))
                              else plan.attempts(frame, n, ".part.checkpoint")[:1])]
        if plan.is_finished(frame) or not files:
            continue
        image = plan.unfinished_image()
        done = subprocess.run([plan.strobe[0], "merge", "--allow-missing", *files, *plan.merge, "-q", "-o", image],
                              cwd=plan.directory, stdin=subprocess.DEVNULL, capture_output=True, check=False)
        if done.returncode == 0:  # else a part was removed meanwhile
            return image if frame is None else "%s (frame %s)" % (image, frame_text(frame))
    return None


def watch(plan, engine):
    """Prints the progress and writes the unfinished image, until the render has ended. Returns an exit code."""
    with Watcher(plan, engine) as watcher:
        while os.path.isdir(plan.folder) and plan.failure() is None:
            time.sleep(.2)
            if watcher.is_stuck():
                raise FarmError("no job is left, but slices are missing; their messages are in " + plan.path("logs"))
    failure = plan.failure()
    if failure is not None:
        raise FarmError(failure)
    print("finished: " + ", ".join(plan.outputs))
    return worker.DONE


class Watcher:
    """Prints the progress and writes the unfinished image, from a thread of its own."""

    def __init__(self, plan, engine):
        self.plan, self.engine = plan, engine
        self.end, self.stuck = threading.Event(), 0
        self.thread = threading.Thread(target=self.run, daemon=True)

    def __enter__(self):
        self.thread.start()
        return self

    def __exit__(self, *_):
        self.end.set()
        self.thread.join()

    def is_stuck(self):
        """Whether the engine had no jobs for some time."""
        return self.stuck > 3

    def run(self):
        """Prints what has changed."""
        last, next_image = "", 0
        while not self.end.wait(0 if not last else SECONDS_BETWEEN_LINES) and os.path.isdir(self.plan.folder):
            try:
                now = text(self.plan, self.engine)
                self.stuck = 0 if not self.engine.DETACHED or self.engine.jobs(self.plan) else self.stuck + 1
            except FarmError as error:  # the controller is away
                now = str(error)
            if now != last:
                print(now, file=sys.stderr, flush=True)
            last = now
            if time.monotonic() > next_image:
                image = write_image(self.plan)
                if image:
                    print("unfinished image: " + image, file=sys.stderr, flush=True)
                    next_image = time.monotonic() + SECONDS_BETWEEN_PICTURES
