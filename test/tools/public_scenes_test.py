"""Tests tools/public-scenes with a scene and pictures of its own. Usage: public_scenes_test.py STROBE."""
import pathlib
import subprocess
import sys
import tempfile
import unittest

TOOL = pathlib.Path(__file__).resolve().parents[2] / "tools" / "public-scenes"
SCENE = """LookAt 0 0 -4  0 0 0  0 1 0
Camera "perspective" "float fov" 40
Film "image" "integer xresolution" 64 "integer yresolution" 48
WorldBegin
LightSource "infinite" "rgb L" [.5 .6 .7]
Material "matte" "rgb Kd" [KD KD KD]
Shape "sphere"
"""


class PublicScenes(unittest.TestCase):
    def test_pictures_of_the_same_and_of_another_scene(self):
        with tempfile.TemporaryDirectory() as name:
            folder = pathlib.Path(name)
            repository = folder / "someone+scenes"
            repository.mkdir()
            for kd in ("0.2", "0.8"):
                scene = repository / f"{kd}.pbrt"
                scene.write_text(SCENE.replace("KD", kd))
                subprocess.run([STROBE, scene, "-o", repository / f"{kd}.png", "--spp", "64"], check=True,
                               capture_output=True)
            (repository / "broken.pbrt").write_text("Nonsense")
            (folder / "list.csv").write_text("repository,commit,scene,picture,options,remark\n"
                                             "someone/scenes,0,0.2.pbrt,0.2.png,,\n"
                                             "someone/scenes,0,0.8.pbrt,0.2.png,,another scene\n"
                                             "someone/scenes,0,broken.pbrt,0.2.png,,\n")
            result = subprocess.run([TOOL, "render", folder, "--list", folder / "list.csv", "--strobe", STROBE, "--out",
                                     folder / "out", "--spp", "16"], check=True, capture_output=True, text=True)
            self.assertIn("1 within 5 %, 0 within 20 %, 1 worse, 1 refused, 0 with warnings", result.stdout)
            table = (folder / "out" / "table.md").read_text()
            self.assertIn("| another scene |", table)
            self.assertIn("unknown directive", table)
            self.assertTrue((folder / "out" / "sheet-1.png").exists())

    def test_pictures_rendered_by_pbrt(self):
        """strobe stands in for pbrt: it renders the file that pbrt would be given."""
        with tempfile.TemporaryDirectory() as name:
            folder = pathlib.Path(name)
            repository = folder / "someone+scenes"
            repository.mkdir()
            (repository / "scene.pbrt").write_text(SCENE.replace("KD", "0.5").replace(
                "WorldBegin", 'Sampler "halton" "integer pixelsamples" [4]\nAccelerator "kdtree"\n'
                'Integrator "bdpt"  # comment\nWorldBegin') + 'WorldEnd\nCamera "orthographic"\nWorldBegin\nWorldEnd\n')
            (folder / "list.csv").write_text("repository,commit,scene,picture,options,remark\n"
                                             "someone/scenes,0,scene.pbrt,pbrt-v3,,\n"
                                             "someone/scenes,0,scene.pbrt,pbrt-v4,,no program\n")
            pbrt = folder / "pbrt"
            pbrt.write_text(f'#!/bin/sh\ncp "$1" "{folder}/seen.pbrt"\nexec "{STROBE}" "$1" -o reference.exr\n')
            pbrt.chmod(0o755)
            result = subprocess.run([TOOL, "render", folder, "--list", folder / "list.csv", "--strobe", STROBE, "--out",
                                     folder / "out", "--spp", "16", "--width", "32", "--pbrt", f"v3={pbrt}"],
                                    check=True, capture_output=True, text=True)
            self.assertIn("1 within 5 %, 0 within 20 %, 0 worse, 0 refused", result.stdout)
            seen = (folder / "seen.pbrt").read_text()
            for text in ('"integer xresolution" 32 "integer yresolution" 24', '"integer pixelsamples" 16',
                         'Integrator "volpath"'):
                self.assertIn(text, seen)
            for text in ("halton", "kdtree", "orthographic"):
                self.assertNotIn(text, seen)
            self.assertEqual([path.name for path in repository.iterdir()], ["scene.pbrt"])


if __name__ == "__main__":
    STROBE = sys.argv.pop(1)
    unittest.main()
