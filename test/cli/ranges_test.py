"""Values and transforms without physical meaning: errors in .scene files, warnings in .pbrt files. Misspelt options.
Usage: ranges_test.py PATH_OF_STROBE [unittest arguments]"""
import os
import subprocess
import sys
import unittest

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
sys.dont_write_bytecode = True
from scene_case import STROBE, SceneTest  # noqa: E402

HEAD = """Film "image" "integer xresolution" 16 "integer yresolution" 16
Camera "perspective"
WorldBegin
LightSource "infinite"
Translate 0 0 4
"""
SPHERE = 'Shape "sphere"\n'


class RangesTest(SceneTest):
    def render(self, text, *arguments, name="s.scene", head=HEAD):
        with open(self.path(name), "w", encoding="utf-8") as file:
            file.write(head + text)
        done = subprocess.run([STROBE, name, "--spp", "1", "-o", "o.exr", *arguments], cwd=self.folder, capture_output=True, text=True)
        return done.returncode, done.stderr

    def test_physical_ranges(self):
        for material, problem in (('"matte" "rgb Kd" [2 2 2]', '"Kd" must be at most 1'),
                                  ('"matte" "rgb Kd" [-1 0 0]', '"Kd" must not be negative'),
                                  ('"mirror" "rgb Kr" [0 0 1.5]', '"Kr" must be at most 1'),
                                  ('"plastic" "rgb Ks" [2 0 0]', '"Ks" must be at most 1'),
                                  ('"plastic" "float roughness" -1', '"roughness" must not be negative'),
                                  ('"glass" "float eta" 0', '"eta" must be positive'),
                                  ('"glass" "float eta" -1.5', '"eta" must be positive')):
            with self.subTest(material=material):
                code, err = self.render(f"Material {material}\n{SPHERE}")
                self.assertEqual(code, 2, err)
                self.assertIn(f"error: {problem}", err)
        code, err = self.render('Material "matte" "rgb Kd" [2 2 2]\n' + SPHERE, name="s.pbrt")
        self.assertEqual(code, 0, err)
        self.assertIn('warning: "Kd" must be at most 1', err)

    def test_textures_and_limits_are_accepted(self):
        for text in ('Material "matte" "rgb Kd" [1 0 1]\n', 'Texture "t" "rgb" "constant" "rgb value" [3 3 3]\nMaterial "matte" "texture Kd" "t"\n',
                     'Material "glass" "float eta" .7\n'):
            self.assertEqual(self.render(text + SPHERE)[0], 0, text)

    def test_clipped_spheres(self):
        shape = 'Shape "sphere" "float zmin" 1 "float zmax" -1\n'
        code, err = self.render(shape)
        self.assertEqual((code, '"zmin" is above "zmax"' in err), (2, True), err)
        code, err = self.render(shape, name="s.pbrt")
        self.assertEqual((code, 'warning: "zmin" is above "zmax" (they are exchanged)' in err), (0, True), err)

    def test_keys(self):
        ends = "ActiveTransform StartTime\nTranslate -1 0 0\nActiveTransform EndTime\nTranslate 1 0 0\nActiveTransform All\n" + SPHERE
        text = "StartTime and EndTime change the first and the last of 5 keys only; choose those between by number: ActiveTransform 1"
        code, err = self.render(ends, head="TransformTimes 0 .25 .5 .75 1\n" + HEAD)
        self.assertEqual((code, text in err), (0, True), err)
        code, err = self.render("ActiveTransform 1\nTranslate 0 0 0\n" + ends, head="TransformTimes 0 .25 .5 .75 1\n" + HEAD)
        self.assertEqual((code, "StartTime" in err), (0, False), err)
        self.assertNotIn("warning", self.render(ends)[1])

    def test_mirroring_and_whole_turns(self):
        mirror = "ActiveTransform EndTime\nScale -1 1 1\n" + SPHERE
        code, err = self.render(mirror)
        self.assertEqual((code, "error: a key of the transform mirrors, and another does not" in err), (2, True), err)
        code, err = self.render(mirror, name="s.pbrt")
        self.assertEqual((code, "warning: a key of the transform mirrors" in err), (0, True), err)
        self.assertNotIn("mirrors", self.render("Scale -1 1 1\n" + SPHERE)[1])
        turn = "ActiveTransform EndTime\nRotate {} 0 1 0\n" + SPHERE
        self.assertIn("between two keys, rotations take the shortest way", self.render(turn.format(360))[1])
        self.assertNotIn("warning", self.render(turn.format(170))[1])

    def test_command_line(self):
        for arguments, problem in ((("--crop", "-1", "2", "0", "1"), "--crop: takes fractions of the frame, from 0 to 1"),
                                   (("--frames", "1:1", "--fps", "1e-300"), "--fps: must be in 1e-6 to 1e6"),
                                   (("-D", "maxdepth=-1"), "error: -D maxdepth: must not be negative")):
            code, err = self.render(SPHERE, *arguments)
            self.assertEqual((code, problem in err), (1, True), err)
        code, err = self.render(SPHERE, "--resolution", "65536x65536", "--max-memory", "1G")
        self.assertEqual(code, 2)
        self.assertTrue(err.startswith("error: a picture of 65536x65536 pixels"), err)

    def test_misspelt_options(self):
        for argument, nearest in (("--splp", "--spp"), ("--thraeds=3", "--threads")):
            code, err = self.render(SPHERE, argument)
            self.assertEqual(code, 1)
            self.assertIn(f"The following argument was not expected: {argument}; did you mean {nearest}?\n", err)
        self.assertNotIn("did you mean", self.render(SPHERE, "--completely-different")[1])
        self.assertEqual(self.render(SPHERE, "-q", "-t", "1"), (0, ""))

    def test_two_worlds(self):
        code, err = self.render("WorldBegin\n")
        self.assertEqual((code, "s.scene:6:1: error: a second WorldBegin; the first is at s.scene:3:1" in err), (2, True), err)


if __name__ == "__main__":
    unittest.main()
