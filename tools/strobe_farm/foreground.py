"""What engines have in common whose render ends with the program."""

import fcntl

from .plan import FarmError


class Lock:
    """Says that this program renders the plan, until it ends."""

    def __init__(self, plan):
        self.file = open(plan.path("lock"), "w", encoding="utf-8")
        try:
            fcntl.flock(self.file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            raise FarmError("%s: another process renders it" % plan.folder) from None

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.file.close()


def cancel(plan):
    """Says how the render is ended."""
    raise FarmError("%s: Ctrl-C ends the program that renders it" % plan.name)


def is_active(plan):
    """Whether a program of this machine renders the plan."""
    try:
        with Lock(plan):
            return False
    except FarmError:
        return True
