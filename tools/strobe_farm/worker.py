"""What runs on the machines: the render of one slice, and the merge of one frame."""

import os
import re
import shutil
import signal
import socket
import subprocess
import sys
import threading
import time

from .plan import ATTEMPTS, numbered, remove

# Exit codes. AGAIN: strobe was killed, or the time is over; run it again. STOPPED: the worker was told to end.
DONE, FAILED, AGAIN, STOPPED = 0, 1, 75, 76
TIME_IS_OVER = signal.SIGUSR1
STOPS = (signal.SIGTERM, signal.SIGINT, TIME_IS_OVER)
INTERRUPTED = 5  # exit code of strobe: the finished samples are saved


class Strobe:
    """A process of strobe whose messages go to a log, and its progress to the state of a unit."""

    def __init__(self, plan, unit, command):
        self.plan, self.unit, self.stop_signal, self.message = plan, unit, None, ""
        self.said = {"host": socket.gethostname(), "node": os.environ.get("SLURMD_NODENAME", ""), "begin": time.time(),
                     "progress": 0, "kills": plan.state(unit).get("kills", 0)}
        self.process = None
        for number in STOPS:
            signal.signal(number, self.stop)
        self.say()
        if self.stop_signal is None:
            self.process = subprocess.Popen(command, cwd=plan.directory, stdin=subprocess.DEVNULL,
                                            stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True, errors="replace")
            if self.stop_signal is not None:  # it arrived while the process was made
                self.process.terminate()

    def stop(self, number, _frame):
        """Lets strobe save its checkpoint and end."""
        self.stop_signal = number
        if self.process is not None:
            self.process.terminate()

    def say(self, **values):
        """Adds to the state."""
        self.said.update(values, time=time.time())
        self.plan.set_state(self.unit, **self.said)

    def read(self, log):
        """Copies messages to the log."""
        for line in self.process.stderr:
            log.write("%s %s" % (time.strftime("%H:%M:%S"), line))
            log.flush()
            progress = re.match(r"(\d+)%", line)
            if progress:
                self.say(progress=int(progress[1]) / 100)
            else:
                self.message += line

    def run(self):
        """Returns the exit code of strobe; negative: the signal that killed it; None: it was not started."""
        if self.process is None:
            return None
        with open(self.plan.path("logs", self.unit + ".log"), "a", encoding="utf-8") as log:
            reader = threading.Thread(target=self.read, args=(log,))
            reader.start()
            code = self.process.wait()
            reader.join()
            log.write("%s strobe ended with code %d on %s\n" % (time.strftime("%H:%M:%S"), code, self.said["host"]))
        if code != 0:
            sys.stderr.write(self.message)
        return code


def limits(plan, threads):
    """Returns the options of strobe for the processors and the memory of this task, unless the user has given them.

    `threads`: of the engine; None: those that Slurm has given to the task, if it is one of Slurm.
    """
    def is_given(*names):
        return any(word.startswith(names) for word in plan.strobe[1:])
    options = []
    threads = threads or os.environ.get("SLURM_CPUS_ON_NODE")
    if threads and not is_given("-t", "--threads"):
        options += ["--threads", threads]
    memory = os.environ.get("SLURM_MEM_PER_NODE", "")
    if memory.isdigit() and int(memory) >= 256 and not is_given("--max-memory"):
        options += ["--max-memory", "%dM" % (int(memory) * 19 // 20)]  # the rest: this program
    return options


def ended(plan, unit, strobe, code):
    """Returns the exit code of the worker for a render or a merge that was not finished."""
    if not os.path.isdir(plan.folder):  # others have finished the render
        return DONE
    if strobe.stop_signal is not None or code == INTERRUPTED:
        strobe.say(stopped=True)
        return AGAIN if strobe.stop_signal == TIME_IS_OVER else STOPPED
    kills = strobe.said["kills"] + 1
    strobe.say(kills=kills)
    if code < 0 and kills < ATTEMPTS:
        return AGAIN
    reason = "it was killed %d times (signal %d); too little memory?" % (kills, -code) if code < 0 else strobe.message
    plan.fail("%s on %s: %s" % (unit, strobe.said["host"], reason.strip()))
    return FAILED


def render_slice(plan, frame, number, threads=None):
    """Renders a slice, continuing from the newest checkpoint. Returns an exit code.

    Each attempt has files of its own: a machine that was given up may still render the same slice, with equal results.
    """
    if plan.failure() is not None:
        return STOPPED
    final, unit = plan.part(frame, number), plan.unit(frame, number)
    if os.path.exists(final) or plan.is_finished(frame):
        return DONE
    ending = "%03d.%s-%d.part" % (number, socket.gethostname(), os.getpid())
    own = plan.path("parts", plan.unit(frame)) + "-" + ending
    for checkpoint in plan.attempts(frame, number, ".part.checkpoint")[:1]:
        shutil.copyfile(checkpoint, own + ".checkpoint")
    command = [*plan.strobe, *([] if frame is None else ["--frames=%d:%d" % (frame, frame)]),
               "--slice", "%d/%d" % (number, plan.tasks), "--expect", plan.path("scene.json"),
               "--checkpoint", "%g" % plan.checkpoint, "--resume", *limits(plan, threads),
               "-o", plan.path("parts", ("still-" if frame is None else "####-") + ending)]
    strobe = Strobe(plan, unit, command)
    code = strobe.run()
    if code != 0:
        return ended(plan, unit, strobe, code)
    strobe.say(progress=1, end=time.time())
    try:
        os.replace(own, final)
    except FileNotFoundError:  # the render was finished by others meanwhile
        return DONE
    for file in plan.attempts(frame, number, ".part") + plan.attempts(frame, number, ".part.checkpoint"):
        remove(file)
    return DONE


def merge_frame(plan, frame):
    """Merges the slices of a frame to its images, and removes them. Returns an exit code."""
    if plan.failure() is not None:
        return STOPPED
    if plan.is_finished(frame) or not os.path.isdir(plan.folder):
        return DONE
    unit = plan.unit(frame)
    parts = [plan.part(frame, number) for number in range(1, plan.tasks + 1)]
    command = [plan.strobe[0], "merge", *parts, *plan.merge]
    for output in plan.outputs:
        command += ["-o", os.path.join(plan.directory, numbered(output, frame))]
    strobe = Strobe(plan, unit, command)
    code = strobe.run()
    if code != 0:
        return ended(plan, unit, strobe, code)
    with open(plan.path("finished", unit), "w", encoding="utf-8"):
        pass
    plan.keep_warnings(frame)
    plan.remove_frame(frame)
    if len(plan.finished()) == len(plan.frames):
        plan.remove()
    return DONE
