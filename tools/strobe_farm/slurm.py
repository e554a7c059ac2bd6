"""The engine `slurm`: an array job for each frame, and a job that merges it. Options are those of sbatch.

Jobs have the name of the plan, by which they are found and cancelled. Slurm requeues tasks whose node has failed; a task
whose strobe was killed, or whose time is nearly over, asks for it itself.
"""

import os
import re
import shlex
import signal
import subprocess
import time

from . import worker
from .plan import FarmError

DETACHED = True
SECONDS_TO_SAVE = 60  # before the end of a task's time
SECONDS_TO_REACH_CONTROLLER = 600


def run(*command):
    """Returns the output of a command of Slurm. Throws FarmError."""
    try:
        done = subprocess.run(command, stdin=subprocess.DEVNULL, capture_output=True, text=True, check=False)
    except FileNotFoundError:
        raise FarmError("%s is missing: this machine is not of a Slurm cluster" % command[0]) from None
    if done.returncode:
        raise FarmError("%s: %s" % (command[0], done.stderr.strip()))
    return done.stdout


def run_patiently(*command):
    """As run, while the controller is away."""
    deadline = time.monotonic() + SECONDS_TO_REACH_CONTROLLER
    while True:
        try:
            return run(*command)
        except FarmError as error:
            if time.monotonic() > deadline or not re.search("contact slurm|connect|timed out|Unable to", str(error)):
                raise
            time.sleep(1)


def max_array_size():
    """Returns the number of indices of an array job, which begin at 0."""
    match = re.search(r"MaxArraySize\s*=\s*(\d+)", run("scontrol", "show", "config"))
    return int(match[1]) if match else 1001


def ranges(numbers):
    """Returns ascending numbers as Slurm writes them: 1-3,7."""
    text, first = [], None
    for n, following in zip(numbers, [*numbers[1:], None]):
        first = n if first is None else first
        if following != n + 1:
            text.append(str(n) if first == n else "%d-%d" % (first, n))
            first = None
    return ",".join(text)


def sbatch(plan, words, script, *options):
    """Submits a script that becomes a worker. Returns the number of the job."""
    return run("sbatch", "--parsable", "--job-name", plan.name, "--chdir", plan.directory, "--requeue", "--open-mode", "append",
               "--signal", "B:USR1@%d" % SECONDS_TO_SAVE, *words, *options,
               "--wrap", "exec " + script).strip().split(";")[0]


def submit_frame(plan, frame, numbers, words, tool, size):
    """Submits the slices of a frame and its merge. `size`: of the largest array. Returns the numbers of the jobs."""
    command = " ".join(map(shlex.quote, tool))
    folder, name, unit = shlex.quote(plan.folder), "still" if frame is None else str(frame), plan.unit(frame)
    output = plan.path("logs", unit).replace("%", "%%") + "-%a.out"
    jobs_of_frame = []
    for first in range(0, plan.tasks + 1, size):
        indices = [n - first for n in numbers if first <= n < first + size]
        if indices:
            script = "%s --task %s %s $((%d + SLURM_ARRAY_TASK_ID))" % (command, folder, name, first)
            jobs_of_frame.append(sbatch(plan, words, script, "--array", ranges(indices), "--output", output))
    after = ["--dependency", "afterok:" + ":".join(jobs_of_frame), "--kill-on-invalid-dep", "yes"] if jobs_of_frame else []
    merge = sbatch(plan, words, "%s --merge %s %s" % (command, folder, name), *after, "--output", "/dev/null")
    return [*jobs_of_frame, merge]


def submit(plan, missing, words, tool):
    """Submits the slices `missing`: pairs of a frame and its slices. Prints the jobs. Returns an exit code."""
    size = max_array_size()
    for frame, numbers in missing:
        *slices, merge = submit_frame(plan, frame, numbers, words, tool, size)
        print("%s%smerge in job %s" % ("" if frame is None else "frame %d: " % frame,
                                       "slices in job %s, " % ", ".join(slices) if slices else "", merge), flush=True)
    return worker.DONE


def jobs(plan):
    """Returns the waiting and running tasks: lines of "JOB STATE NODE-OR-REASON"; an array that waits is one line."""
    return run("squeue", "--noheader", "--name", plan.name, "--format", "%i %T %R").split("\n")[:-1]


def is_active(plan):
    """Whether there are jobs of the plan."""
    return bool(jobs(plan))


def cancel(plan):
    """Ends all jobs. Running slices save their checkpoints."""
    run_patiently("scancel", "--name", plan.name)


def this_task():
    """Returns the job or the task of an array that runs this process. The number of one task is that of the whole array."""
    array = os.environ.get("SLURM_ARRAY_JOB_ID")
    return "%s_%s" % (array, os.environ["SLURM_ARRAY_TASK_ID"]) if array else os.environ["SLURM_JOB_ID"]


def after_worker(plan, code):
    """Requeues this task if strobe was killed or its time is over, and cancels the render if it cannot go on."""
    if code == worker.AGAIN:
        signal.signal(signal.SIGTERM, signal.SIG_DFL)
        run_patiently("scontrol", "requeue", this_task())
        time.sleep(60)  # until Slurm ends this process, whose exit code would end the task
    elif code == worker.FAILED:
        cancel(plan)
