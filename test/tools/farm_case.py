"""A folder with a scene, and tools/farm, for its tests."""
import os
import signal
import subprocess
import sys
import tempfile
import time
import unittest

sys.dont_write_bytecode = True  # do not write to the source tree
HERE = os.path.dirname(os.path.abspath(__file__))
sys.path.insert(0, os.path.join(HERE, "..", "cli"))
from exr import Exr  # noqa: E402
from scene_case import CORNER, SCENE, STROBE  # noqa: E402

FARM = os.path.join(HERE, "..", "..", "tools", "farm")


class FarmCase(unittest.TestCase):
    """A test in a folder of its own."""

    def setUp(self):
        folder = tempfile.TemporaryDirectory(prefix="strobe-farm-")
        self.addCleanup(folder.cleanup)
        self.folder = folder.name
        self.environment = dict(os.environ)
        for name, text in (("s.scene", SCENE), ("corner.scene", CORNER)):
            self.write(name, text)

    def path(self, name):
        """Returns the path of a file in the folder."""
        return os.path.join(self.folder, name)

    def write(self, name, text):
        """Writes a file."""
        with open(self.path(name), "w", encoding="utf-8") as file:
            file.write(text)

    def command(self, *words):
        """Returns a command of tools/farm with the program under test. Options of the engine follow "--"."""
        end = words.index("--") if "--" in words else len(words)
        return [FARM, *words[:end], "--strobe", STROBE, *words[end:]]

    def farm(self, *words, code=0):
        """Runs tools/farm. Returns its output and its messages."""
        done = subprocess.run(self.command(*words), cwd=self.folder, env=self.environment, text=True, check=False,
                              capture_output=True, timeout=120)
        self.assertEqual(done.returncode, code, done.stdout + done.stderr)
        return done.stdout + done.stderr

    def start(self, *words):
        """Starts tools/farm in a group of processes of its own."""
        return subprocess.Popen(self.command(*words), cwd=self.folder, env=self.environment, start_new_session=True,
                                stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)

    def strobe(self, *words):
        """Renders with one process."""
        subprocess.run([STROBE, *words, "-q"], cwd=self.folder, check=True, timeout=120)

    def assert_same_pixels(self, a, b):
        """Compares the pixels of two EXRs to the bit."""
        self.assertEqual(list(Exr(self.path(a)).pixels().values()), list(Exr(self.path(b)).pixels().values()), (a, b))

    def wait_for(self, condition, seconds=60):
        """Waits until a condition holds. Returns its value."""
        limit = time.monotonic() + seconds
        while not (value := condition()):
            self.assertLess(time.monotonic(), limit, "timeout")
            time.sleep(.02)
        return value

    def files(self):
        """Returns the names of the files and folders in the folder."""
        return sorted(set(os.listdir(self.folder)) - {"s.scene", "corner.scene"})

    @staticmethod
    def interrupt(process):
        """Ends a group of processes as Ctrl-C does."""
        os.killpg(process.pid, signal.SIGINT)
        process.wait(60)
