"""The strobe process of one frame."""
import os
import re
import shutil
import signal
import subprocess
import time


class Failed(Exception):
    """strobe ended with an error."""


def ends_with_blender(command):
    """Returns a command that the system kills when Blender ends, where setpriv exists."""
    setpriv = shutil.which("setpriv")
    return [setpriv, "--pdeathsig", "KILL", "--", *command] if setpriv else command


class Process:
    """Runs strobe and watches its output file."""

    def __init__(self, command, output):
        """Starts the command. `output` is the EXR that it writes."""
        self.output, self._seen = output, 0
        self._log = output + ".log"
        with open(self._log, "wb") as log:
            self._process = subprocess.Popen(ends_with_blender(command), stdout=log, stderr=subprocess.STDOUT,
                                             stdin=subprocess.DEVNULL, start_new_session=True)

    def wait(self, stop, changed, pause=0.05):
        """Waits for the end. Calls changed() after each new image. If stop() returns true, ends the process and returns
        False. Raises Failed."""
        while self._process.poll() is None:
            if stop():
                self.end()
                return False
            if self._is_new():
                changed()
            time.sleep(pause)
        if self._process.returncode != 0:
            raise Failed(self._error())
        return True

    def _is_new(self):
        """Returns whether the output file changed since the last call."""
        try:
            modified = os.stat(self.output).st_mtime_ns
        except OSError:
            return False
        is_new, self._seen = modified != self._seen, modified
        return is_new

    def end(self):
        """Ends the process at once."""
        if self._process.poll() is None:
            self._process.send_signal(signal.SIGKILL)
            self._process.wait()

    def text(self):
        """Returns what strobe printed."""
        with open(self._log, errors="replace") as log:
            return log.read()

    def _error(self):
        """Returns the first error message, or the end of the output."""
        text = self.text()
        found = re.search(r"^.*error: .*$", text, re.M)
        return found.group() if found else text.strip()[-500:] or f"exit code {self._process.returncode}"

    def warnings(self):
        """Returns the warnings that strobe printed."""
        return re.findall(r"^.*warning: .*$", self.text(), re.M)
