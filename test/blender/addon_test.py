"""The Blender add-on: installation from its zip, small scenes beside Cycles, passes, regions, errors, and animations.
Usage: addon_test.py PATH_OF_STROBE [unittest arguments]"""
import json
import os
import shutil
import subprocess
import sys
import tempfile
import unittest

HERE = os.path.dirname(os.path.abspath(__file__))
TOOLS = os.path.join(os.path.dirname(os.path.dirname(HERE)), "tools")
STROBE = os.path.abspath(sys.argv.pop(1)) if len(sys.argv) > 1 else os.environ.get("STROBE", "strobe")
BLENDER = shutil.which("blender")
INSTALL = """import bpy, sys
bpy.ops.preferences.addon_install(filepath=sys.argv[-1])
bpy.ops.preferences.addon_enable(module="strobe")
bpy.ops.wm.save_userpref()
"""
COMPARE = """import bpy, sys
a, b = (list(bpy.data.images.load(path).pixels) for path in sys.argv[-2:])
print("EQUAL", a == b and len(a) == 80 * 60 * 4)
"""


@unittest.skipUnless(BLENDER, "Blender is not installed")
class Addon(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        folder = tempfile.TemporaryDirectory(prefix="strobe-addon-")
        cls.addClassCleanup(folder.cleanup)
        cls.folder = folder.name
        user = os.path.join(cls.folder, "user")
        for name in ("config", "scripts"):
            os.makedirs(os.path.join(user, name))
        # Blender takes the packages of the first python3 in PATH, which may lack numpy.
        path = os.pathsep.join(("/usr/bin", os.environ.get("PATH", "")))
        cls.environment = dict(os.environ, BLENDER_USER_RESOURCES=user, STROBE=STROBE, PATH=path)
        archive = os.path.join(cls.folder, "strobe.zip")
        subprocess.run([os.path.join(TOOLS, "make-blender-addon"), archive], check=True, stdout=subprocess.DEVNULL)
        cls.blender("--python-expr", INSTALL, "--", archive)
        cls.output = cls.blender("--python", os.path.join(HERE, "inside.py"), "--", cls.folder, TOOLS)
        cls.facts = {}
        for line in cls.output.splitlines():
            if line.startswith("CHECK "):
                fact = json.loads(line[6:])
                cls.facts[fact.pop("name")] = fact

    @classmethod
    def blender(cls, *arguments):
        """Runs Blender without a window. Returns its output. Fails if Python fails."""
        done = subprocess.run([BLENDER, "-b", "-noaudio", "--python-exit-code", "1", *arguments], env=cls.environment,
                              stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, timeout=300)
        if done.returncode:
            raise AssertionError(done.stdout[-4000:])
        return done.stdout

    def test_images_equal_those_of_cycles(self):
        for name in ("delta_lights", "area_lights", "rigid", "shape_keys", "depth_of_field"):
            with self.subTest(name):
                fact = self.facts["compare " + name]
                self.assertLess(fact["rms"], 0.02)
                self.assertAlmostEqual(fact["mean"], 1, delta=0.01)

    def test_a_region_has_the_pixels_of_the_image(self):
        self.assertEqual(self.facts["region"], {"shape": [30, 40, 3], "equal": True})

    def test_passes(self):
        self.assertEqual(self.facts["layers"]["missing"], [])

    def test_replaced_nodes_are_named(self):
        text = self.output.partition("BEGIN replaced")[2].partition("END replaced")[0]
        self.assertIn("odd: shader 'Velvet BSDF'", text)

    def test_errors_are_shown(self):
        for name, text in (("unwritable folder", "/proc/strobe"), ("missing program", "/nowhere/strobe"),
                           ("old version", "version 0.1.0"), ("flat object", "Cube"), ("no camera", "no camera")):
            with self.subTest(name):
                self.assertIn(text, self.facts[name]["error"])

    def test_an_animation_skips_finished_frames(self):
        first, second, third = self.facts["frames"]["sizes"]
        self.assertEqual(second, len("finished"))
        self.assertGreater(min(first, third), 1000)

    def test_background_mode_by_command_line(self):
        names = [os.path.join(self.folder, name) for name in ("again-1.exr", "frame0001.exr")]
        output = self.blender(os.path.join(self.folder, "saved.blend"), "-E", "STROBE", "-o", os.path.join(self.folder, "again-#"),
                              "-F", "OPEN_EXR", "-f", "1", "--python-expr", COMPARE, "--", *names)
        self.assertIn("EQUAL True", output)


if __name__ == "__main__":
    unittest.main()
