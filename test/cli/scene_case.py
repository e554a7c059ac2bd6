"""A small scene and the program strobe, for tests of parts, passes, checkpoints and threads."""
import os
import signal
import subprocess
import sys
import tempfile
import time
import unittest

from exr import Exr

STROBE = os.path.abspath(sys.argv.pop(1)) if len(sys.argv) > 1 else os.environ.get("STROBE", "strobe")

WORLD = """WorldBegin
LightSource "infinite" "rgb L" [.2 .3 .4]
AttributeBegin
  Translate 2 3 1
  AreaLightSource "diffuse" "rgb L" [20 20 20]
  Shape "sphere" "float radius" .5
AttributeEnd
Material "matte" "rgb Kd" [.6 .5 .4]
Translate -.6 0 4
ActiveTransform EndTime
Translate 1.2 0 0
ActiveTransform All
Shape "sphere" "float radius" .8
"""
SCENE = """TransformTimes 0 1
Film "image" "integer xresolution" 150 "integer yresolution" 100
Sampler "sobol" "integer pixelsamples" 8
Integrator "directlighting"
Camera "perspective" "float fov" 60
""" + WORLD

# A corner with a moving ball, a mirror and a lamp that the camera sees.
CORNER = """TransformTimes 0 1
Film "image" "integer xresolution" 150 "integer yresolution" 100
Sampler "sobol" "integer pixelsamples" 8
Integrator "path"
LookAt 0 2 -6  0 1.2 0  0 1 0
Camera "perspective" "float fov" 50
WorldBegin
LightSource "point" "point3 from" [1 4 -3] "rgb I" [40 40 40]
Material "matte" "rgb Kd" [.8 .7 .5]
Shape "trianglemesh" "integer indices" [0 2 1 0 3 2] "point P" [-9 0 -9  9 0 -9  9 0 9  -9 0 9]
Shape "trianglemesh" "integer indices" [0 1 2 0 2 3] "point P" [-9 0 2  9 0 2  9 9 2  -9 9 2]
AttributeBegin
  Material "matte" "rgb Kd" [.2 .7 .3]
  Translate -1.2 1 0
  ActiveTransform EndTime
  Translate .5 0 0
  ActiveTransform All
  Shape "sphere" "float radius" .7
AttributeEnd
AttributeBegin
  Material "mirror"
  Translate 1.2 .8 .5
  Shape "sphere" "float radius" .7
AttributeEnd
AttributeBegin
  AreaLightSource "diffuse" "rgb L" [40 40 40]
  Translate -1.3 2.6 .5
  Shape "sphere" "float radius" .2
AttributeEnd
"""


class SceneTest(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory(prefix="strobe-progressive-")
        self.addCleanup(folder.cleanup)
        self.folder = folder.name
        self.write_scene(SCENE)

    def write_scene(self, text):
        with open(self.path("s.scene"), "w", encoding="utf-8") as file:
            file.write(text)

    def path(self, name):
        return os.path.join(self.folder, name)

    def run_strobe(self, *args, code=0):
        """Renders s.scene. Returns the text on standard error and the wall-clock seconds."""
        start = time.monotonic()
        done = subprocess.run([STROBE, "s.scene", *args], cwd=self.folder, capture_output=True, text=True, timeout=60)
        self.assertEqual(done.returncode, code, done.stderr)
        return done.stderr, time.monotonic() - start

    def start(self, *args):
        """Starts a render of s.scene in the background."""
        return subprocess.Popen([STROBE, "s.scene", *args, "--quiet"], cwd=self.folder)

    @staticmethod
    def handles_signals(process):
        """Whether the process has blocked SIGHUP, which it does once its signal handling is set up."""
        with open("/proc/%d/status" % process.pid, encoding="utf-8") as file:
            line = next(line for line in file if line.startswith("SigBlk:"))
        blocked = int(line.split()[1], 16)
        # While a thread is created, all signals are blocked for a moment, SIGCHLD too.
        return blocked >> signal.SIGHUP - 1 & 1 and not blocked >> signal.SIGCHLD - 1 & 1

    def wait_until(self, condition):
        limit = time.monotonic() + 60
        while not condition():
            self.assertLess(time.monotonic(), limit, "timeout")
            time.sleep(0.005)

    def pixels(self, name):
        """Returns the pixels of an EXR, row by row."""
        return list(Exr(self.path(name)).pixels().values())
