"""Tests tools/farm with the engines local and parallel. Usage: farm_test.py PATH_OF_STROBE [unittest arguments]"""
import os
import shutil
import sys
import unittest

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
sys.dont_write_bytecode = True
from farm_case import FarmCase  # noqa: E402
from slurm_cluster import kill, processes  # noqa: E402

SMALL = ("--resolution", "60x40", "--spp", "4")
LONG = ("--resolution", "150x100", "--spp", "4096")


class FarmTest(FarmCase):
    def running(self):
        """Returns the processes of strobe that render slices of this test."""
        found = []
        for number in processes("PWD="):
            try:
                with open("/proc/%d/cmdline" % number, "rb") as file:
                    words = file.read().split(b"\0")
            except OSError:
                continue
            if b"--slice" in words and any(self.folder.encode() in word for word in words):
                found.append(number)
        return found

    def test_image(self):
        self.farm("local", "s.scene", "-t", "1", "-o", "a.exr", "-o", "a.png", "--tasks", "3", *SMALL)
        self.strobe("s.scene", "-o", "b.exr", *SMALL)
        self.assert_same_pixels("a.exr", "b.exr")
        self.assertEqual(self.files(), ["a.exr", "a.png", "b.exr"])

    def test_sequence(self):
        text = self.farm("local", "s.scene", "--frames", "1:3", "-o", "a.##.exr", "--tasks", "2", *SMALL)
        self.assertIn("3 frames, of which 0 are finished", text)
        self.strobe("s.scene", "--frames", "1:3", "-o", "b.##.exr", *SMALL)
        for frame in ("01", "02", "03"):
            self.assert_same_pixels("a.%s.exr" % frame, "b.%s.exr" % frame)
        os.remove(self.path("a.02.exr"))
        text = self.farm("local", "s.scene", "--frames", "1:3", "-o", "a.##.exr", "--tasks", "2", *SMALL)
        self.assertIn("of which 2 are finished", text)
        self.assertEqual(len(self.files()), 6)
        # strobe alone skips the frames, too
        self.strobe("s.scene", "--frames", "1:3", "-o", "a.##.exr", "--dry-run", "--stats", "n.json", *SMALL)
        with open(self.path("n.json"), encoding="utf-8") as file:
            self.assertIn('"finished": [\n      1,\n      2,\n      3\n    ]', file.read())

    def test_negative_frame(self):
        self.farm("local", "s.scene", "--frames=-1:0", "-o", "a.exr", "--tasks", "2", *SMALL)
        self.assertEqual(self.files(), ["a.-001.exr", "a.0000.exr"])

    def test_killed_slices_continue(self):
        farm = self.start("local", "s.scene", "-o", "a.exr", "--tasks", "2", "--save", ".2", *LONG)
        kill(self.wait_for(self.running)[:1])
        self.assertEqual(farm.wait(120), 0)
        self.strobe("s.scene", "-o", "b.exr", *LONG)
        self.assert_same_pixels("a.exr", "b.exr")
        self.assertEqual(self.files(), ["a.exr", "b.exr"])

    def test_interrupted_render_continues(self):
        command = ("local", "s.scene", "-o", "a.exr", "--tasks", "3", *LONG)
        farm = self.start(*command)
        self.wait_for(self.running)
        self.assertIn("being rendered", self.farm(*command, code=1))
        status = self.farm("--status", "-o", "a.exr")
        self.assertIn("0 of 1 images are finished", status)
        self.assertIn("slices are finished", status)
        self.assertIn("Ctrl-C", self.farm("--cancel", "-o", "a.exr", code=1))
        self.interrupt(farm)
        self.assertEqual(self.files(), ["a.exr.farm"])
        self.assertIn("other render", self.farm(*command[:-1], "2048", code=1))
        self.farm(*command, "--watch")
        self.strobe("s.scene", "-o", "b.exr", *LONG)
        self.assert_same_pixels("a.exr", "b.exr")
        self.assertEqual(self.files(), ["a.exr", "b.exr"])

    def test_errors(self):
        for words, message in ((("local", "s.scene"), "-o is missing"), (("fast", "s.scene", "-o", "a.exr"), "slurm, parallel, local"),
                               (("local", "no.scene", "-o", "a.exr"), "no.scene"), (("--status", "-o", "a.exr"), "there is no render"),
                               (("local", "s.scene", "-o", "a.exr", "--time-limit", "3"), "does not go with slices"),
                               (("local", "s.scene", "-o", "no/a.exr"), "no/a.exr"), (("local", "s.scene", "-o", "a.exr", "--tasks", "0"), "at least 1")):
            self.assertIn(message, self.farm(*words, code=1))
        self.assertEqual(self.files(), [])

    def test_scene_that_is_wrong_on_a_machine(self):
        # The options are found wrong by the tasks only: slices of this scope are an error.
        text = self.farm("local", "s.scene", "-o", "a.exr", "--integrator", "msaa-cache", "-D", "scope=tile", *SMALL, code=1)
        self.assertIn("slices", text)
        self.assertTrue(os.path.exists(self.path("a.exr.farm/failed")))

    def test_scene_that_changes(self):
        farm = self.start("local", "s.scene", "-o", "a.exr", "--tasks", "3", *LONG)
        self.wait_for(self.running)
        with open(self.path("s.scene"), "a", encoding="utf-8") as file:
            file.write("# new\n")
        self.assertEqual(farm.wait(120), 1)
        self.assertIn("s.scene has changed", self.farm("--status", "-o", "a.exr", code=1))

    def test_estimate(self):
        text = self.farm("local", "s.scene", "-o", "a.exr", "--tasks", "3", "--dry-run", *SMALL)
        self.assertRegex(text, r"3 slices of about .* s of one processor each, and .* to load; about \d+ MB of memory")
        self.assertEqual(self.files(), [])

    @unittest.skipUnless(shutil.which("parallel"), "GNU parallel is missing")
    def test_parallel(self):
        self.farm("parallel", "s.scene", "--frames", "1:2", "-o", "a.#.exr", "--tasks", "2", *SMALL, "--", "-S", "2/:")
        self.strobe("s.scene", "--frames", "1:2", "-o", "b.#.exr", *SMALL)
        for frame in "12":
            self.assert_same_pixels("a.%s.exr" % frame, "b.%s.exr" % frame)
        self.assertIn("slices", self.farm("parallel", "s.scene", "-o", "c.exr", "--integrator", "msaa-cache", "-D", "scope=tile",
                                          *SMALL, "--", "-S", "2/:", code=1))


if __name__ == "__main__":
    unittest.main()
