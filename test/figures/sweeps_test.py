"""Tests of the comments that mark the swept number of a scene."""
import os
import sys
import tempfile
import unittest

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
sys.path.insert(0, os.path.join(ROOT, "tools", "strobe_figures"))
sys.dont_write_bytecode = True  # the source tree stays clean
from sweeps import Sweep, read_sweep, scene_with  # noqa: E402


class SweepsTest(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory(prefix="strobe-sweeps-")
        self.addCleanup(folder.cleanup)
        self.folder = folder.name

    def write(self, text, name="s.scene"):
        path = os.path.join(self.folder, name)
        with open(path, "w", encoding="utf-8") as file:
            file.write(text)
        return path

    def assertRefused(self, text, message):
        path = self.write(text)
        with self.assertRaises(ValueError) as caught:
            read_sweep(path)
        self.assertEqual(str(caught.exception), path + message)

    def test_reads_name_unit_values_and_default(self):
        path = self.write('# x\n  "float shutterclose" 16  # sweep blur length (px): 0 1.5 16 1e3\nWorldBegin\n')
        self.assertEqual(read_sweep(path), Sweep("blur length", "px", (0, 1.5, 16, 1000), 16))

    def test_the_unit_is_optional(self):
        path = self.write('"float roughness" .01 # sweep roughness: 1 .1 .01\n')
        self.assertEqual(read_sweep(path), Sweep("roughness", "", (1, 0.1, 0.01), 0.01))

    def test_replaces_only_the_first_number_outside_of_quotes(self):
        path = self.write('# 3\nScale -2e0 1 2\nTexture "t 7" "float" Scale2 "a" [-.5 4] # sweep s: -.5 4 0.0001\n5\n')
        self.assertEqual(
            scene_with(path, 0.0001),
            '# 3\nScale -2e0 1 2\nTexture "t 7" "float" Scale2 "a" [0.0001 4] # sweep s: -.5 4 0.0001\n5\n')
        self.assertIn("[4 4]", scene_with(path, 4.0))

    def test_the_default_leaves_the_scene_unchanged(self):
        text = '"float lensradius" 2.5   # sweep lens (px): 0 2.5\nShape "sphere" # is round\n'
        self.assertEqual(scene_with(self.write(text), 2.5), text)

    def test_names_of_files_beside_the_scene_become_absolute(self):
        self.write("", "part.scene")
        text = 'Include "part.scene" # "part.scene"\nInclude "$X/part.scene"\nTranslate 1 0 0 # sweep x: 1 2\n'
        beside = os.path.join(self.folder, "part.scene")
        self.assertEqual(
            scene_with(self.write(text), 2),
            f'Include "{beside}" # "part.scene"\nInclude "$X/part.scene"\nTranslate 2 0 0 # sweep x: 1 2\n')

    def test_no_sweep_and_two_sweeps_are_errors(self):
        message = ": 0 lines have a comment '# sweep name (unit): values', expected one"
        self.assertRefused("Translate 1 0 0\n", message)
        self.assertRefused('Include "# sweep a: 1 2" 1\n', message)
        self.assertRefused("1 # sweep a: 1\n2 # sweep b: 2\n", message.replace("0 lines", "2 lines"))

    def test_an_invalid_sweep_is_an_error(self):
        self.assertRefused('\n"float 3" # sweep a: 1 2\n', ":2: the line has no number outside of quotes to sweep")
        self.assertRefused("Scale 3 1 1 # sweep a: 1 2\n", ":1: the swept number 3 is not one of the values")
        self.assertRefused("Scale 3 1 1 # sweep a: 1 x\n",
                           ":1: the values of a sweep must be numbers: could not convert string to float: 'x'")


class StressScenesTest(unittest.TestCase):
    def test_every_stress_scene_has_a_sweep_whose_default_leaves_it_unchanged(self):
        folder = os.path.join(ROOT, "scenes", "stress")
        for name in sorted(os.listdir(folder)):
            with self.subTest(name):
                path = os.path.join(folder, name)
                sweep = read_sweep(path)
                self.assertGreater(len(sweep.values), 3)
                with open(path, encoding="utf-8") as file:
                    self.assertEqual(scene_with(path, sweep.default), file.read())


if __name__ == "__main__":
    unittest.main()
