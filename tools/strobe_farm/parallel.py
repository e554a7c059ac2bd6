"""The engine `parallel`: GNU parallel, over ssh. Options are those of parallel, such as -S HOST,HOST or --sshloginfile FILE.

Each host renders one slice at a time with all of its processors, unless -j is given.
"""

import shlex
import shutil
import subprocess
import time

from . import worker
from .foreground import Lock, cancel, is_active  # noqa: F401 (the engine has them)
from .plan import FarmError

DETACHED = False
RETRIES = 5


def submit(plan, missing, words, tool):
    """Renders the slices `missing`: pairs of a frame and its slices. Returns an exit code."""
    if not shutil.which("parallel"):
        raise FarmError("GNU parallel is missing: install the package parallel")
    jobs = [] if any(word.startswith(("-j", "--jobs", "-P", "--max-procs")) for word in words) else ["--jobs", "1"]
    command = ["parallel", *jobs, "--retries", str(RETRIES), "--halt", "soon,fail=1", "--line-buffer", "--colsep", " ",
               *words, " ".join(map(shlex.quote, [*tool, "--task", plan.folder])) + " {1} {2}"]
    tasks = "".join("%s %d\n" % ("still" if frame is None else frame, n) for frame, numbers in missing for n in numbers)
    with Lock(plan):
        process = subprocess.Popen(command, stdin=subprocess.PIPE, text=True)
        try:
            process.stdin.write(tasks)
            process.stdin.close()
            return merge_whole_frames(plan, [frame for frame, _ in missing], process, tool)
        except KeyboardInterrupt:
            process.wait()
            return worker.STOPPED


def merge_whole_frames(plan, frames, process, tool):
    """Merges each frame as soon as it is whole, while the process renders. Returns an exit code."""
    while frames:
        has_ended = process.poll() is not None
        for frame in [frame for frame in frames if plan.is_whole(frame)]:
            code = subprocess.run([*tool, "--merge", plan.folder, "still" if frame is None else str(frame)],
                                  stdin=subprocess.DEVNULL, check=False).returncode
            if code not in (worker.DONE, worker.AGAIN):
                process.terminate()
                process.wait()
                return code
            if code == worker.DONE:
                frames.remove(frame)
        if has_ended and frames and not any(map(plan.is_whole, frames)):
            return worker.FAILED
        time.sleep(.2)
    process.wait()
    return worker.DONE
