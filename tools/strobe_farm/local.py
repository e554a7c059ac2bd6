"""The engine `local`: processes of this machine, to try. Options: -j N, the number of processes (2)."""

import argparse
import concurrent.futures
import os
import subprocess
import threading

from . import worker
from .foreground import Lock, cancel, is_active  # noqa: F401 (the engine has them)

DETACHED = False  # submit returns when the image is finished


class Pool:
    """Renders the slices of a plan, and merges each frame as soon as it is whole."""

    def __init__(self, plan, jobs, tool):
        self.plan, self.jobs, self.tool = plan, jobs, tool
        self.threads = max(1, (os.cpu_count() or 1) // jobs)
        self.guard, self.merged = threading.Lock(), set()

    def run(self, mode, frame, *words):
        """Runs a worker until it is done or cannot go on. Returns its exit code."""
        command = [*self.tool, mode, self.plan.folder, "still" if frame is None else str(frame), *words]
        while (code := subprocess.run(command, stdin=subprocess.DEVNULL, check=False).returncode) == worker.AGAIN:
            pass
        return code

    def render(self, frame, number):
        """Renders a slice, and merges its frame if it was the last one."""
        code = self.run("--task", frame, str(number), str(self.threads))
        if code != worker.DONE:
            return code
        with self.guard:
            is_last = self.plan.is_whole(frame) and frame not in self.merged
            if is_last:
                self.merged.add(frame)
        return self.run("--merge", frame) if is_last else code

    def run_all(self, missing):
        """Renders the slices. Returns the largest exit code."""
        with concurrent.futures.ThreadPoolExecutor(self.jobs) as pool:
            futures = [pool.submit(self.render, frame, number) for frame, numbers in missing for number in numbers]
            try:
                codes = [future.result() for future in futures]
                whole = [frame for frame, numbers in missing if not numbers]  # all slices were there before
                return max([*codes, *(self.run("--merge", frame) for frame in whole)], default=worker.DONE)
            except KeyboardInterrupt:  # the workers have received it, too
                pool.shutdown(cancel_futures=True)
                return worker.STOPPED


def submit(plan, missing, words, tool):
    """Renders the slices `missing`: pairs of a frame and its slices. Returns an exit code."""
    parser = argparse.ArgumentParser(prog="farm local ... --")
    parser.add_argument("-j", "--jobs", type=int, default=2)
    jobs = max(1, parser.parse_args(words).jobs)
    with Lock(plan):
        return Pool(plan, jobs, tool).run_all(missing)
