"""What users expect at hand: formats, standard streams, values in scenes, lists of frames, alpha, dry runs, and damaged images.
Usage: everyday_test.py PATH_OF_STROBE [unittest arguments]"""
import json
import os
import re
import shutil
import subprocess
import sys
import unittest

import numpy as np
import OpenImageIO as oiio

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
sys.dont_write_bytecode = True
from cli_test import OPTIONS, OUTPUT, SCENE, USAGE, CliTest  # noqa: E402
from exr import Exr  # noqa: E402
from scene_case import STROBE  # noqa: E402

BALL = """Film "image" "integer xresolution" 48 "integer yresolution" 32
Sampler "sobol" "integer pixelsamples" 16
LookAt 0 0 -4  0 0 0  0 1 0
Camera "perspective" "float fov" 40
WorldBegin
LightSource "infinite" "rgb L" [.5 .6 .7]
Material "matte" "rgb Kd" [.8 .3 .2]
Shape "sphere" "float radius" 1
"""
VALUES = """Default "width" 48
Default "spp" "4"
Default "shade" "matte"
Film "image" "integer xresolution" $width "integer yresolution" [$width]
Sampler "sobol" "integer pixelsamples" $spp
LookAt 0 0 -4  0 0 0  0 1 0
Camera "perspective" "float fov" 40
WorldBegin
LightSource "infinite"
Material "$shade"
Shape "sphere" "float radius" 1
"""


def image_of(path):
    file = oiio.ImageInput.open(path)
    return file.read_image(0, 0, 0, file.spec().nchannels, oiio.FLOAT), file.spec()


class EverydayTest(CliTest):
    def setUp(self):
        super().setUp()
        self.write("b.scene", BALL)
        self.write("v.scene", VALUES)

    def run_bytes(self, *arguments, stdin=None, environment=None, code=0):
        done = subprocess.run([STROBE, *arguments], cwd=self.folder, input=stdin, capture_output=True, timeout=60,
                              env={**os.environ, **(environment or {})})
        self.assertEqual(done.returncode, code, done.stderr)
        return done


class Help(EverydayTest):
    def test_lines_have_at_most_100_columns(self):
        for arguments in (["--help"], ["merge", "--help"]):
            self.assertLessEqual(max(map(len, self.run_strobe(*arguments).out.splitlines())), 100)

    def test_one_plugin_is_listed(self):
        text = self.run_strobe("--list", "msaa").out
        self.assertEqual(len(re.findall(r"(?m)^  \S", text)), 1)
        self.assertIn("shades", text)
        self.assertIn('did you mean "glass"?', self.run_strobe("--list", "glas", code=USAGE).err)

    def test_completions_and_the_manual_know_every_option(self):
        names = set(re.findall(r"(?<![\w-])--[a-z][\w-]+", self.run_strobe("--help").out.split("Exit codes")[0]))
        for arguments, prefix in ((["--print-completion", "bash"], "--"), (["--print-completion", "zsh"], "--"),
                                  (["--print-completion", "fish"], "-l "), (["--print-man"], "\\-\\-")):
            text = self.run_strobe(*arguments).out
            for name in names:
                expected = prefix + (name[2:].replace("-", "\\-") if "man" in arguments[0] else name[2:])
                self.assertIn(expected, text, arguments)
        self.assertIn("unknown shell", self.run_strobe("--print-completion", "csh", code=USAGE).err)

    def test_bash_completes(self):
        script = self.run_strobe("--print-completion", "bash").out
        self.write("c.bash", script + 'COMP_WORDS=(strobe --integrator m); COMP_CWORD=2; _strobe; echo "${COMPREPLY[@]}"\n'
                   'COMP_WORDS=(strobe --chec); COMP_CWORD=1; _strobe; echo "${COMPREPLY[@]}"\n')
        out = subprocess.run(["bash", "c.bash"], cwd=self.folder, capture_output=True, text=True, check=True).stdout
        self.assertEqual(out, "msaa msaa-cache\n--checkpoint\n")

    @unittest.skipUnless(shutil.which("man"), "man is not installed")
    def test_man_formats_the_page(self):
        self.write("strobe.1", self.run_strobe("--print-man").out)
        done = subprocess.run(["man", "--warnings", "-E", "UTF-8", "-l", "-Tutf8", "strobe.1"], cwd=self.folder, capture_output=True, text=True)
        self.assertEqual((done.returncode, done.stderr), (0, ""))


class Streams(EverydayTest):
    def test_images_to_standard_output(self):
        self.run_strobe("b.scene", "-q", "-o", "b.exr", "-o", "b.png")
        exr = self.run_bytes("b.scene", "-o", "-").stdout
        self.write("piped.exr", exr)
        np.testing.assert_array_equal(image_of(self.path("piped.exr"))[0], image_of(self.path("b.exr"))[0])
        png = self.run_bytes("b.scene", "-o", "-.png").stdout
        self.assertTrue(png.startswith(b"\x89PNG"))
        self.run_bytes("b.scene", "-o", "-", "--stats", "-", code=USAGE)
        self.assertNotIn("-.exr", self.names())

    def test_statistics_to_standard_output(self):
        settings = json.loads(self.run_bytes("b.scene", "--no-output", "--stats", "-").stdout)["settings"]
        self.assertEqual((settings["shading:maxdepth"], settings["integrator"]), (5, "supersample"))
        self.assertEqual([n for n in self.names() if not n.endswith(".scene")], [])

    def test_scenes_from_standard_input_and_pipes(self):
        self.run_strobe("b.scene", "-q", "-o", "b.exr")
        self.run_bytes("-", "-q", "-o", "in.exr", stdin=BALL.encode())
        subprocess.run(["bash", "-c", f'"{STROBE}" <(cat b.scene) -q -o pipe.exr'], cwd=self.folder, check=True)
        for name in ("in.exr", "pipe.exr"):
            np.testing.assert_array_equal(image_of(self.path(name))[0], image_of(self.path("b.exr"))[0])
        self.run_bytes("-", "-q", stdin=BALL.encode())
        self.assertIn("image.exr", self.names())
        self.assertIn(b"-:1:1: error: unknown directive 'Flim'", self.run_bytes("-", stdin=b"Flim", code=SCENE).stderr)

    def test_dumb_terminals_get_lines(self):
        import pty
        for term, draws in (("dumb", False), ("xterm", True)):
            leader, follower = pty.openpty()
            subprocess.run([STROBE, "b.scene", "-o", "b.exr"], cwd=self.folder, stderr=follower, env={**os.environ, "TERM": term}, check=True)
            os.close(follower)
            text = os.read(leader, 1 << 16).decode()
            os.close(leader)
            self.assertEqual("[=" in text, draws, text)

    def test_a_large_task_is_announced(self):
        self.assertIn("visibility samples and about", self.run_strobe("b.scene", "--spp", "8388608", "--resolution", "2000x2000", "--dry-run").err)
        self.assertIn("more than this machine has", self.run_strobe("b.scene", "--samples", "s.csv", "--resolution", "4000x4000",
                                                                    "--spp", "4096", code=USAGE).err)


class Outputs(EverydayTest):
    def test_formats(self):
        names = ["b.exr", "b.PNG", "b.jpg", "b.jpeg", "b.tif", "b.tiff", "b.hdr"]
        self.run_strobe("b.scene", "-q", *sum((["-o", name] for name in names), []))
        linear = image_of(self.path("b.exr"))[0]
        shown = np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * np.maximum(linear, 1e-9) ** (1 / 2.4) - 0.055).clip(0, 1)
        for name, expected, tolerance in (("b.PNG", shown, 0.003), ("b.jpg", shown, 0.15), ("b.jpeg", shown, 0.15),
                                          ("b.tif", shown, 1e-4), ("b.tiff", shown, 1e-4), ("b.hdr", linear, 0.01)):
            with self.subTest(name=name):
                pixels, spec = image_of(self.path(name))
                self.assertEqual((spec.width, spec.height, spec.nchannels), (48, 32, 3))
                self.assertLess(np.abs(pixels - expected).max(), tolerance)
                self.assertLess(np.abs(pixels - expected).mean(), 0.01)

    def test_frames_of_all_formats_with_metadata_are_finished(self):
        for extension in ("png", "jpg", "tif"):
            self.run_strobe("b.scene", "--frames", "1,3", "-o", f"f.#.{extension}", "--spp", "1")
            again = self.run_strobe("b.scene", "--frames", "1,3", "-o", f"f.#.{extension}", "--spp", "1").err
            self.assertIn("2 frames: 0 rendered now, 2 before", again)

    def test_lists_of_frames(self):
        self.run_strobe("b.scene", "--frames", "1,3,5-7,10:14:2,3", "-o", "f.#.png", "--spp", "1", "-q")
        self.assertEqual({n for n in self.names() if n.endswith(".png")}, {f"f.{i}.png" for i in (1, 3, 5, 6, 7, 10, 12, 14)})
        for text in ("", "1,", "a", "5-3", "1:9:0", "1-9:2", "1,,2", "1:2000000000"):
            self.assertIn("--frames", self.run_strobe("b.scene", "--frames", text, code=USAGE).err)

    def test_folders_on_request(self):
        self.run_strobe("b.scene", "-o", "new/er/b.exr", code=OUTPUT)
        self.run_strobe("b.scene", "-q", "--mkdir", "-o", "new/er/b.exr", "--stats", "other/s.json")
        self.assertTrue(os.path.exists(self.path("new/er/b.exr")) and os.path.exists(self.path("other/s.json")))

    def test_a_dry_run_writes_nothing(self):
        before = self.names()
        text = self.run_strobe("b.scene", "--dry-run", "-o", "b.exr").err
        for words in ("48x32 pixels, 16 samples per pixel", "supersample, path", "1 quadrics", "b.exr", "about"):
            self.assertIn(words, text)
        self.assertEqual(self.names(), before)
        self.run_strobe("b.scene", "--dry-run", "-o", "missing/b.exr", code=OUTPUT)

    def test_estimates_and_finished_frames(self):
        frames = ("b.scene", "--frames", "3:5", "-o", "b.#.exr")
        self.run_strobe("b.scene", "--frames", "4", "-q", "-o", "b.#.exr")
        self.run_strobe(*frames, "--dry-run", "--stats", "e.json")
        with open(self.path("e.json"), encoding="utf-8") as file:
            stats = json.load(file)
        self.assertEqual(stats["frames"], {"all": [3, 4, 5], "finished": [4]})
        self.assertEqual(stats["settings"]["frame"], 3)
        self.assertGreater(stats["estimate"]["threadSeconds"], 0)
        self.assertGreater(stats["estimate"]["memory"], 48 * 32 * 12)
        self.assertFalse(os.path.exists(self.path("b.3.exr")))
        self.run_strobe(*frames, "--overwrite", "--dry-run", "--stats", "-")

    def test_expected_scene(self):
        self.run_strobe("b.scene", "-q", "-o", "b.exr", "--stats", "s.json")
        self.run_strobe("b.scene", "-q", "-o", "c.exr", "--expect", "s.json")
        with open(self.path("b.scene"), "a", encoding="utf-8") as file:
            file.write("# changed\n")
        text = self.run_strobe("b.scene", "-o", "c.exr", "--expect", "s.json", code=USAGE).err
        self.assertIn("--expect s.json: the scene is another one: b.scene has changed", text)
        self.assertIn("cannot read", self.run_strobe("b.scene", "--expect", "no.json", code=USAGE).err)
        for content in ("", "{}", '{"version": 1}', '{"version": "0", "content": {"hash": "x", "files": []}}'):
            with open(self.path("s.json"), "w", encoding="utf-8") as file:
                file.write(content)
            self.assertIn("not a file of --stats", self.run_strobe("b.scene", "--expect", "s.json", code=USAGE).err)
        with open(self.path("s.json"), "w", encoding="utf-8") as file:
            file.write('{"version": "0.0.1", "content": {"hash": "1", "files": []}}')
        self.assertIn("was written by strobe 0.0.1", self.run_strobe("b.scene", "--expect", "s.json", code=USAGE).err)

    def test_exr_metadata_for_compositors(self):
        self.run_strobe("b.scene", "-q", "-o", "b.exr")
        spec = image_of(self.path("b.exr"))[1]
        to_ndc = np.array(spec.getattribute("worldToNDC")).reshape(4, 4)
        to_camera = np.array(spec.getattribute("worldToCamera")).reshape(4, 4)
        self.assertTrue(np.allclose(np.array([0, 0, 0, 1]) @ to_camera, [0, 0, 4, 1], atol=1e-5))
        for point, expected in (([0, 0, 0], [0.5, 0.5]), ([0, np.tan(np.radians(20)) * 4, 0], [0.5, 0]),
                                ([np.tan(np.radians(20)) * 6, 0, 0], [1, 0.5])):
            p = np.array([*point, 1]) @ to_ndc
            self.assertTrue(np.allclose(p[:2] / p[3], expected, atol=1e-5), (point, p))
        self.assertEqual(spec.getattribute("strobe:commandLine").split()[1:], ["b.scene", "-q", "-o", "b.exr"])
        self.assertRegex(spec.getattribute("strobe:sceneHash"), r"^[0-9a-f]{16}$")


class Alpha(EverydayTest):
    MOVING = BALL.replace('Shape', 'ActiveTransform EndTime\nTranslate .7 0 0\nActiveTransform All\nShape').replace(
        "[.5 .6 .7]", "[0 0 0]\nLightSource \"distant\" \"rgb L\" [2 2 2] \"point from\" [0 0 -1] \"point to\" [0 0 0]")

    def test_coverage_is_exact_under_blur(self):
        """A black sphere that emits covers as much as it shines."""
        emission = 'AreaLightSource "diffuse" "rgb L" [1 1 1]\nShape'
        self.write("m.scene", self.MOVING.replace("Shape", emission).replace("[.8 .3 .2]", "[0 0 0]"))
        for arguments in (["--spp", "64"], ["--spp", "16", "--integrator", "msaa-cache"], ["--spp", "16", "--integrator", "adaptive-cache"]):
            self.run_strobe("m.scene", "-q", "--transparent", "-o", "m.exr", *arguments)
            pixels, spec = image_of(self.path("m.exr"))
            self.assertEqual(spec.channelnames, ("R", "G", "B", "A"))
            alpha = pixels[..., 3]
            self.assertGreater(np.mean((alpha > 0.1) & (alpha < 0.9)), 0.05, "nothing is blurred")
            if "--integrator" not in arguments:  # the emitter covers as much as it shines
                self.assertLess(np.abs(pixels[..., 0] - alpha).max(), 1e-5)
            self.assertTrue(np.all(pixels[..., :3][alpha == 0] == 0))

    def test_over_the_background_it_is_the_picture(self):
        self.run_strobe("b.scene", "-q", "--transparent", "-o", "t.exr", "-o", "t.png", "-o", "t.tif", "-o", "t.jpg")
        self.run_strobe("b.scene", "-q", "-o", "b.exr")
        pixels = image_of(self.path("t.exr"))[0]
        over = pixels[..., :3] + (1 - pixels[..., 3:]) * np.array([0.5, 0.6, 0.7])
        self.assertLess(np.abs(over - image_of(self.path("b.exr"))[0]).max(), 1e-5)
        self.assertEqual(image_of(self.path("t.jpg"))[1].nchannels, 3)
        for name, tolerance in (("t.png", 0.005), ("t.tif", 1e-4)):
            stored = oiio.ImageInput.open(self.path(name), self.unassociated()).read_image(oiio.FLOAT)
            self.assertLess(np.abs(stored[..., 3] - pixels[..., 3]).max(), tolerance)
            solid = pixels[..., 3] > 0.5
            color = (pixels[..., :3] / np.maximum(pixels[..., 3:], 1e-9))[solid]
            shown = np.where(color <= 0.0031308, 12.92 * color, 1.055 * color ** (1 / 2.4) - 0.055).clip(0, 1)
            self.assertLess(np.abs(stored[..., :3][solid] - shown).max(), tolerance)

    @staticmethod
    def unassociated():
        spec = oiio.ImageSpec()
        spec.attribute("oiio:UnassociatedAlpha", 1)
        return spec

    def test_parts_have_alpha(self):
        self.run_strobe("b.scene", "-q", "--transparent", "-o", "t.exr")
        for i in (0, 8):
            self.run_strobe("b.scene", "-q", "--transparent", "-o", f"{i}.part", "--sample-range", f"{i}:{i + 8}")
        self.run_strobe("merge", "0.part", "8.part", "-q", "-o", "merged.exr", "-o", "merged.png")
        np.testing.assert_array_equal(image_of(self.path("merged.exr"))[0], image_of(self.path("t.exr"))[0])
        self.assertEqual(image_of(self.path("merged.png"))[1].nchannels, 4)

    def test_alpha_without_transparency_keeps_the_background(self):
        self.run_strobe("b.scene", "-q", "--aov", "alpha", "-o", "a.exr")
        self.run_strobe("b.scene", "-q", "-o", "b.exr")
        pixels = image_of(self.path("a.exr"))[0]
        np.testing.assert_array_equal(pixels[..., :3], image_of(self.path("b.exr"))[0])


class Values(EverydayTest):
    def resolution(self, *arguments):
        self.run_strobe("v.scene", "-q", "-o", "v.exr", "--stats", "s.json", *arguments)
        stats = json.loads(self.read("s.json"))
        return stats["resolution"], stats["settings"]["samplesPerPixel"]

    def test_defaults_and_definitions(self):
        self.assertEqual(self.resolution(), ([48, 48], 4))
        self.assertEqual(self.resolution("-D", "width=16", "-D", "spp=8", "-D", "maxdepth=2"), ([16, 16], 8))
        self.run_strobe("v.scene", "-q", "-o", "mirror.exr", "-D", "shade=mirror")

    def test_strings_and_unknown_names(self):
        self.write("n.scene", VALUES.replace('"$shade"', '"${shade}"').replace("$spp", "$sp"))
        self.assertIn('n.scene:5:40: error: $ with an unknown name "sp" (known: shade, spp, width); -D sp=VALUE or Default "sp" "VALUE" sets it', self.run_strobe("n.scene", code=SCENE).err)
        self.write("n.scene", VALUES.replace('"matte"', '"mat"').replace('"$shade"', '"${shade}te"'))
        self.run_strobe("n.scene", "-q", "-o", "n.exr")
        self.assertIn('v.scene:4:36: error: parameter "xresolution" needs a number', self.run_strobe("v.scene", "-D", "width=wide", code=SCENE).err)
        self.assertIn('unknown parameter "q"', self.run_strobe("v.scene", "-D", "q=1", code=USAGE).err)

    def test_parts_of_other_values_do_not_merge(self):
        self.run_strobe("v.scene", "-q", "-o", "a.part", "--sample-range", "0:2")
        self.run_strobe("v.scene", "-q", "-o", "b.part", "--sample-range", "2:4", "-D", "shade=mirror")
        self.assertIn("another scene: $shade has changed", self.run_strobe("merge", "a.part", "b.part", "-o", "m.exr", code=USAGE).err)


class DamagedImages(EverydayTest):
    def textured(self, file, name="t.scene"):
        self.write(name, OPTIONS.replace('"gaussian"', '"box"') + f"""LookAt 0 0 -4  0 0 0  0 1 0
WorldBegin
LightSource "infinite"
Texture "t" "color" "imagemap" "string filename" "{file}"
Material "matte" "texture Kd" "t"
Shape "sphere" "float radius" 1.5
""")
        return name

    def write_image(self, name, pixels, **attributes):
        spec = oiio.ImageSpec(pixels.shape[1], pixels.shape[0], pixels.shape[2], "float" if name.endswith("exr") else "uint8")
        for key, value in attributes.items():
            spec.attribute(key, value)
        out = oiio.ImageOutput.create(self.path(name))
        out.open(self.path(name), spec)
        out.write_image(pixels.astype(np.float32))
        out.close()

    def test_truncated_textures_are_errors(self):
        for edge in (64, 2048):  # small images are kept in memory, large ones are cached
            noise = np.random.default_rng(1).random((edge, edge, 3))
            for name, attributes in (("a.tif", {"compression": "none"}), ("b.tif", {"compression": "zip"}), ("c.jpg", {}), ("d.png", {})):
                with self.subTest(name=name, edge=edge):
                    self.write_image(name, noise, **attributes)
                    self.run_strobe(self.textured(name), "-q", "-o", "t.exr")
                    whole = self.read(name)
                    for fraction in (0.5, 0.9):
                        self.write(name, whole[:int(len(whole) * fraction)])
                        error = self.run_strobe("t.scene", "-q", "-o", "t2.exr", code=SCENE).err
                        self.assertRegex(error, rf"(?s)t.scene:\d+:\d+: error: cannot read the image {name}.*filename")
        self.assertNotIn("t2.exr", self.names())

    def test_truncated_environments_are_errors(self):
        self.write_image("c.jpg", np.random.default_rng(1).random((64, 128, 3)))
        whole = self.read("c.jpg")
        self.write("c.jpg", whole[:len(whole) // 2])
        self.write("e.scene", BALL.replace('"rgb L" [.5 .6 .7]', '"string mapname" "c.jpg"'))
        self.assertIn("cannot read the image c.jpg", self.run_strobe("e.scene", code=SCENE).err)

    def test_pixels_that_are_no_light(self):
        for value in (np.nan, np.inf, 3e38, -1):
            pixels = np.full((16, 32, 3), 0.5)
            pixels[3, 4] = value
            self.write_image("n.exr", pixels)
            self.write("e.scene", BALL.replace('"rgb L" [.5 .6 .7]', '"string mapname" "n.exr"'))
            result = self.run_strobe("e.scene", "--strict", "-o", "e.exr")
            self.assertIn("1 pixels of the environment map are negative, not finite or beyond", result.err)
        pixels[:] = 0
        self.write_image("n.exr", pixels)
        self.write("e.scene", BALL.replace('"rgb L" [.5 .6 .7]', '"string mapname" "n.exr" "float illuminance" 2'))
        self.assertIn("the light is black and cannot be scaled", self.run_strobe("e.scene", code=SCENE).err)

    def test_textures_with_nan_are_named(self):
        for edge in (16, 2048):
            pixels = np.full((edge, edge, 3), 0.5)
            pixels[edge // 4:edge // 2] = np.nan
            self.write_image("nan.exr", pixels)
            error = self.run_strobe(self.textured("nan.exr"), "-o", "t.exr").err
            self.assertIn("the image nan.exr has values that are NaN or infinite", error)


class Identity(EverydayTest):
    def test_a_changed_file_is_named_on_resume(self):
        self.run_strobe("b.scene", "-q", "-o", "a.part", "--sample-range", "0:8")
        shutil.move(self.path("a.part"), self.path("b.exr.checkpoint"))
        self.write("b.scene", BALL.replace("[.8 .3 .2]", "[.3 .3 .2]"))
        error = self.run_strobe("b.scene", "-o", "b.exr", "--checkpoint", "9", "--resume", "--sample-range", "0:8", code=USAGE).err
        self.assertIn("b.exr.checkpoint: it is a part of another scene: b.scene has changed", error)

    def test_textures_are_compared_by_content(self):
        self.write("t.scene", BALL.replace('"rgb Kd" [.8 .3 .2]', '"texture Kd" "t"').replace(
            "Material", 'Texture "t" "color" "imagemap" "string filename" "t.png"\nMaterial'))
        self.run_strobe("b.scene", "-q", "-o", "t.png")
        self.run_strobe("t.scene", "-q", "-o", "a.part", "--sample-range", "0:8")
        os.utime(self.path("t.png"), (1, 1))
        self.run_strobe("t.scene", "-q", "-o", "b.part", "--sample-range", "8:16")
        self.run_strobe("merge", "a.part", "b.part", "-q", "-o", "m.exr")
        self.run_strobe("v.scene", "-q", "-o", "t.png")
        self.run_strobe("t.scene", "-q", "-o", "b.part", "--sample-range", "8:16")
        self.assertIn("another scene: t.png has changed", self.run_strobe("merge", "a.part", "b.part", "-o", "m.exr", code=USAGE).err)

    def test_frames_depend_on_the_content_of_the_color_config(self):
        config = self.run_strobe("--print-ocio").out
        self.write("c.ocio", config)

        def frames():
            return self.run_bytes("b.scene", "--frames", "1", "-o", "f.png", environment={"OCIO": self.path("c.ocio")}).stderr.decode()
        self.assertIn("1 rendered now", frames())
        self.assertIn("0 rendered now", frames())
        self.write("c.ocio", config.replace("description:", "description: another", 1))
        self.assertIn("1 rendered now", frames())

    def test_the_variable_of_the_config_is_named(self):
        error = self.run_bytes("b.scene", "--view", "x", environment={"OCIO": "/nope"}, code=USAGE).stderr
        self.assertIn(b'the OpenColorIO config "/nope", given by $OCIO', error)


if __name__ == "__main__":
    unittest.main(argv=[sys.argv[0], *sys.argv[2:]])
