"""Tests of the program strobe: the effect of each option, messages, exit codes, and that failed runs leave files unchanged.
Usage: cli_test.py PATH_OF_STROBE [unittest arguments]"""
import glob
import json
import os
import pty
import re
import shutil
import struct
import subprocess
import sys
import tempfile
import unittest

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
sys.dont_write_bytecode = True  # do not write to the source tree
from exr import Exr  # noqa: E402
from scene_case import STROBE, WORLD  # noqa: E402

os.environ.pop("OCIO", None)  # the color config of the user would change the results
OK, USAGE, SCENE, OUTPUT = 0, 1, 2, 3

OPTIONS = """TransformTimes 0 1
Film "image" "integer xresolution" 24 "integer yresolution" 16
Sampler "sobol" "integer pixelsamples" 16
PixelFilter "gaussian"
Integrator "path" "integer maxdepth" 3
Camera "perspective" "float fov" 60
"""


class CliTest(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory(prefix="strobe-cli-")
        self.addCleanup(folder.cleanup)
        self.folder = folder.name
        self.write("s.scene", OPTIONS + WORLD)

    def path(self, name):
        return os.path.join(self.folder, name)

    def write(self, name, text):
        with open(self.path(name), "wb" if isinstance(text, bytes) else "w") as file:
            file.write(text)

    def read(self, name):
        with open(self.path(name), "rb") as file:
            return file.read()

    def run_strobe(self, *arguments, code=OK):
        result = subprocess.run([STROBE, *map(str, arguments)], cwd=self.folder, capture_output=True, timeout=60)
        result.out, result.err = result.stdout.decode(), result.stderr.decode()
        self.assertEqual(result.returncode, code, f"{arguments}\n{result.err}")
        return result

    def render(self, *arguments, scene="s.scene"):
        """Renders an EXR and returns it."""
        self.run_strobe(scene, "--quiet", "-o", "picture.exr", *arguments)
        return Exr(self.path("picture.exr"))

    def stats(self, *arguments, scene="s.scene"):
        self.run_strobe(scene, "--quiet", "-o", "picture.exr", "--stats", "stats.json", *arguments)
        return json.loads(self.read("stats.json"))

    def names(self):
        return sorted(os.listdir(self.folder))


class Information(CliTest):
    def test_help_names_every_option(self):
        text = self.run_strobe("--help").out
        options = """--integrator --shading -D --spp --resolution --aov --crypto-depth --exr --view --display --look --exposure
            --print-ocio --heatmap --heatmap-of --samples -o --output --threads --tile --crop --pixel --sample --seed
            --frame-time --frames --fps --shutter --overwrite --animation --camera --time-limit --noise-target --reference
            --curve --write-interval --display-server --pixel-bounds --sample-range --slice --checkpoint --resume --sandbox
            --max-memory --strict --clamp --quick --quiet --stats --log-level --list --version --help"""
        for option in options.split():
            self.assertRegex(text, rf"(^|[\s,]){option}[\s,]")
        self.assertEqual(self.run_strobe("-h").out, text)
        self.assertNotIn("--partial", text, "the former name of --write-interval is hidden")

    def test_merge_is_a_command(self):
        self.assertIn("strobe merge PART... -o OUT...", self.run_strobe("--help").out)
        self.assertIn("merge: must be the first argument: strobe merge PART... -o OUT...",
                      self.run_strobe("--quiet", "merge", "a.part", "-o", "m.exr", code=USAGE).err)
        self.write("merge", OPTIONS + WORLD)
        self.run_strobe("--quiet", "merge", "--spp", "1")

    def test_version(self):
        self.assertRegex(self.run_strobe("--version").out, r"^strobe \d+\.\d+\.\d+\n$")

    def test_list_names_every_plugin_with_its_parameters(self):
        text = self.run_strobe("--list").out
        kinds = {}
        for line in text.splitlines():
            if line and not line.startswith(" "):
                kind = kinds.setdefault(re.match(r"\w+", line)[0], {})
            elif line.startswith("      "):
                parameters.append(line)
            elif line.startswith("  "):
                name, doc = line.strip().split(maxsplit=1)
                self.assertGreater(len(doc), 3, line)
                parameters = kind.setdefault(name, [])
        expected = {
            "Integrator": "supersample",
            "SurfaceIntegrator": "directlighting path",
            "Camera": "perspective orthographic environment",
            "Film": "image",
            "Sampler": "independent stratified sobol",
            "PixelFilter": "box triangle gaussian mitchell sinc",
            "Shape": "trianglemesh plymesh loopsubdiv sphere disk",
            "Material": "matte plastic mirror glass metal measured",
            "Texture": "constant scale mix checkerboard imagemap",
            "LightSource": "point spot distant infinite",
            "AreaLightSource": "diffuse",
            "AOV": "normal depth cryptoobject direct lightgroups shades variance",
        }
        for kind, names in expected.items():
            self.assertLessEqual(set(names.split()), set(kinds[kind]), kind)
        self.assertTrue(any(re.search(r"\binteger +maxdepth .*\[5; 0 to 1024\]$", p) for p in kinds["SurfaceIntegrator"]["path"]))
        self.assertTrue(any("default under pbrt-v2's conventions: 4" in p for p in kinds["Sampler"]["sobol"]))
        self.assertTrue(any(re.search(r"\bfloat +radius .*\[1\]$", p) for p in kinds["Shape"]["sphere"]))
        self.assertTrue(any("normal.X normal.Y normal.Z" in c for c in kinds["AOV"]["normal"]))

    def test_listed_plugins_exist(self):
        """Each listed material builds; `measured` fails for lack of a file."""
        text = self.run_strobe("--list").out
        materials = re.search(r"^Material\n(.*?)\n\n", text, re.M | re.S)[1]
        for name in re.findall(r"^  (\w+)", materials, re.M):
            self.write("m.scene", OPTIONS + f'WorldBegin\nLightSource "point"\nMaterial "{name}"\nShape "sphere"\n')
            code = SCENE if name == "measured" else OK
            err = self.run_strobe("m.scene", "--spp", "1", "-o", "m.exr", "--quiet", code=code).err
            self.assertEqual("is missing" in err, name == "measured")


class Options(CliTest):
    def test_default_output_is_the_scenes_stem(self):
        self.run_strobe("s.scene", "--spp", "1")
        self.assertEqual(self.names(), ["s.exr", "s.scene"])
        self.write("named.scene", OPTIONS.replace('"image"', '"image" "string filename" "chosen.png"') + WORLD)
        self.run_strobe("named.scene", "--spp", "1")
        self.assertEqual(self.names(), ["chosen.png", "named.scene", "s.exr", "s.scene"])

    def test_unsupported_output_extension_of_a_scene_becomes_exr(self):
        self.write("t.scene", OPTIONS.replace('"image"', '"image" "string filename" "x.tga"') + WORLD)
        err = self.run_strobe("t.scene", "--spp", "1").err
        self.assertIn('"x.tga" is not a supported kind of image file; writing .exr instead', err)
        self.assertEqual(self.names(), ["s.scene", "t.scene", "x.exr"])

    def test_two_outputs(self):
        self.run_strobe("s.scene", "--spp", "2", "-o", "a.exr", "--output", "b.png")
        self.assertEqual(self.names(), ["a.exr", "b.png", "s.scene"])
        png = self.read("b.png")
        self.assertEqual(png[:8], b"\x89PNG\r\n\x1a\n")
        self.assertEqual(struct.unpack(">2I", png[16:24]), (24, 16))
        self.assertEqual(Exr(self.path("a.exr")).display, (0, 0, 23, 15))

    def test_options_between_files_take_one_value(self):
        """The scene after -o and -D is not a value of these options."""
        self.run_strobe("--quiet", "-o", "a.exr", "-D", "maxdepth=1", "s.scene")
        self.assertEqual(self.names(), ["a.exr", "s.scene"])

    def test_outputs_are_replaced_by_renaming(self):
        self.write("a.exr", "old")
        os.link(self.path("a.exr"), self.path("link.exr"))
        self.run_strobe("s.scene", "--spp", "1", "-o", "a.exr")
        self.assertEqual(self.read("link.exr"), b"old")  # the old file was not changed
        Exr(self.path("a.exr"))

    def test_metadata(self):
        a = self.render("--spp", "4", "--seed", "18446744073709551615", "-D", "maxdepth=2").attributes
        self.assertEqual(a["strobe:integrator"], "supersample")
        self.assertEqual(a["strobe:shading"], "path")
        self.assertEqual(a["strobe:shading:maxdepth"], "2")
        self.assertEqual(a["strobe:shading:strategy"].strip('"'), "auto")
        self.assertEqual(a["strobe:sampler"], "sobol")
        self.assertEqual(a["strobe:filter"], "gaussian")
        self.assertEqual(a["strobe:samplesPerPixel"], 4)
        self.assertEqual(a["strobe:seed"], "18446744073709551615")
        self.assertEqual(a["strobe:visibilitySamples"], str(4 * 24 * 16))
        self.assertIn(int(a["strobe:shades"]), range(1, 4 * 24 * 16 + 1))
        self.assertGreaterEqual(int(a["strobe:rays"]), 4 * 24 * 16)
        self.assertIn(a["strobe:version"], self.run_strobe("--version").out)
        for stage in "parse build render begin finish".split():
            self.assertGreaterEqual(a["strobe:seconds:" + stage], 0)
        for stage in "generate trace plan shade resolve film".split():
            self.assertGreaterEqual(a["strobe:threadSeconds:" + stage], 0)

    def test_integrator(self):
        self.assertEqual(self.render("--integrator", "supersample").rows, self.render().rows)

    def test_defines(self):
        """-D overrides the scene. Each -D counts; of those with the same name, the last."""
        deep = self.render()
        shallow = self.render("-D", "maxdepth=1")
        self.assertNotEqual(deep.rows, shallow.rows)
        self.write("shallow.scene", OPTIONS.replace('"integer maxdepth" 3', '"integer maxdepth" 1') + WORLD)
        self.assertEqual(shallow.rows, self.render(scene="shallow.scene").rows)
        self.write("one.scene", OPTIONS.replace('"integer maxdepth" 3', '"integer maxdepth" 1 "string strategy" "one"') + WORLD)
        both = self.render("-D", "maxdepth=1", "-D", "strategy=one")
        self.assertEqual(both.rows, self.render(scene="one.scene").rows)
        self.assertNotEqual(both.rows, shallow.rows)
        self.assertEqual(self.render("-D", "maxdepth=9", "-D", "maxdepth=1").rows, shallow.rows)

    def test_spp(self):
        picture = self.render("--spp", "64")
        self.write("fine.scene", OPTIONS.replace('"integer pixelsamples" 16', '"integer pixelsamples" 64') + WORLD)
        self.assertEqual(picture.rows, self.render(scene="fine.scene").rows)
        self.assertEqual(picture.attributes["strobe:samplesPerPixel"], 64)
        self.assertNotEqual(picture.rows, self.render().rows)

    def test_rounded_sample_counts_are_reported(self):
        stderr = self.run_strobe("s.scene", "-o", "a.exr", "--spp", "12").err
        self.assertIn('note: --spp 12: sampler "sobol" takes 16\n', stderr)
        self.assertEqual(Exr(self.path("a.exr")).attributes["strobe:samplesPerPixel"], 16)
        self.write("twelve.scene", OPTIONS.replace('"integer pixelsamples" 16', '"integer pixelsamples" 12') + WORLD)
        stderr = self.run_strobe("twelve.scene", "-o", "a.exr").err
        self.assertIn("twelve.scene:3:17: note: 12 samples per pixel become 16, a power of two\n", stderr)
        self.write("strata.scene", OPTIONS.replace('"sobol" "integer pixelsamples" 16', '"stratified"') + WORLD)
        for scene, *arguments in (("s.scene",), ("s.scene", "--quick"), ("twelve.scene", "--spp", "8"), ("strata.scene", "--spp", "12")):
            self.assertNotIn("warning", self.run_strobe(scene, "-o", "a.exr", *arguments).err)

    def test_threads_and_tiles_do_not_change_the_image(self):
        reference = self.render("--threads", "1", "--tile", "16").rows
        for arguments in (["--threads", "7", "--tile", "3"], ["--threads", "2", "--tile", "1"], ["--threads", "0"],
                          ["--tile", "2147483647"], ["--tile", "8", "--threads", "3"]):
            self.assertEqual(self.render(*arguments).rows, reference, arguments)
        self.assertEqual(len(self.stats("--threads", "1")["threads"]), 1)

    def test_crop(self):
        whole = self.render().pixels()
        for crop, window in ((("0.25", "0.75", "0.5", "1"), (6, 8, 17, 15)), (("0", ".1", "0", "1"), (0, 0, 2, 15))):
            part = self.render("--crop", *crop, "--tile", "2147483647")
            self.assertEqual(part.window, window)
            self.assertEqual(part.display, (0, 0, 23, 15))
            self.assertEqual(part.pixels(), {p: v for p, v in whole.items() if p in part.pixels()})

    def test_crop_at_whole_pixels(self):
        """Rounding of floats neither adds nor omits pixels: adjacent crops share none."""
        size = ("--resolution", "100x75", "--spp", "1")
        self.assertEqual(self.render(*size, "--crop", ".3", ".7", ".2", ".9").window, (30, 15, 69, 67))
        end = -1
        for i in range(10):
            window = self.render(*size, "--crop", str(i / 10), str((i + 1) / 10), "0", "1").window
            self.assertEqual((window[0], window[2]), (end + 1, 10 * i + 9))
            end = window[2]

    def test_seed(self):
        self.assertEqual(self.render("--seed", "3").rows, self.render("--seed", "3").rows)
        self.assertEqual(self.render("--seed", "0").rows, self.render().rows)
        self.assertNotEqual(self.render("--seed", "3").rows, self.render().rows)
        for same in ("016", "0x10"):
            self.assertEqual(self.render("--seed", same).attributes["strobe:seed"], "16")

    def test_frame_time(self):
        """--frame-time renders the positions at that time without motion blur."""
        motion = WORLD.index("ActiveTransform EndTime"), WORLD.index("ActiveTransform All")
        for time, shift in (("0", 0), ("0.25", 0.3), ("1", 1.2)):
            self.write("still.scene", OPTIONS + WORLD[: motion[0]] + f"Translate {shift} 0 0\n" + WORLD[motion[1] :])
            still, frozen = self.render(scene="still.scene").pixels(), self.render("--frame-time", time).pixels()
            differences = [abs(still[p][0] - frozen[p][0]) for p in still]
            self.assertLess(sorted(differences)[-4], 1e-5, time)  # rounding changes single samples at edges
            self.assertLess(max(differences), 0.1)
        self.assertEqual(self.stats("--frame-time", "0.5")["geometry"]["timeSteps"], 0)
        self.assertGreater(self.stats()["geometry"]["timeSteps"], 0)

    def test_quick(self):
        quick = self.stats("--quick")
        self.assertEqual(quick["resolution"], [6, 4])
        self.assertEqual(quick["visibilitySamples"], 6 * 4 * 4)
        self.assertEqual(self.stats("--quick", "--spp", "32")["visibilitySamples"], 6 * 4 * 32)

    def test_files_are_read_one_after_another(self):
        self.write("head.scene", OPTIONS)
        self.write("tail.scene", WORLD)
        self.run_strobe("head.scene", "tail.scene", "--quiet")
        self.assertIn("head.exr", self.names())
        self.assertEqual(Exr(self.path("head.exr")).rows, self.render().rows)

    def test_pixel_and_sample(self):
        picture = self.render("--seed", "5")
        number = r"(-?[\d.e+-]+)"
        for x, y in ((0, 0), (23, 15), (11, 7), (4, 12)):
            out = self.run_strobe("s.scene", "--seed", "5", "--pixel", f"{x},{y}").out
            found = re.fullmatch(rf"pixel {x},{y}: {number} {number} {number}\n", out)
            printed = tuple(struct.unpack("<f", struct.pack("<f", float(v)))[0] for v in found.groups())
            self.assertEqual(printed, picture.pixel(x, y))  # nine digits represent a float exactly
        # With a box filter, all weights are 1: the pixel is the mean of its samples.
        self.write("box.scene", OPTIONS.replace('"gaussian"', '"box"') + WORLD)
        total = [0.0, 0.0, 0.0]
        for sample in range(16):
            out = self.run_strobe("box.scene", "--pixel", "11,7", "--sample", str(sample)).out
            found = re.fullmatch(rf"pixel 11,7 sample {sample}: {number} {number} {number}\n", out)
            total = [t + float(v) for t, v in zip(total, found.groups())]
        self.run_strobe("box.scene", "--quiet")
        for mean, value in zip(total, Exr(self.path("box.exr")).pixel(11, 7)):
            self.assertAlmostEqual(mean / 16, value, delta=1e-6 * value)
        self.assertEqual(self.names(), ["box.exr", "box.scene", "picture.exr", "s.scene"])

    def test_statistics(self):
        s = self.stats("--threads", "2", "--tile", "4", "--crop", "0", ".5", "0", "1")
        self.assertEqual(s["scenes"], ["s.scene"])
        self.assertEqual(s["resolution"], [24, 16])
        self.assertEqual(s["pixelBounds"], [0, 12, 0, 16])
        self.assertEqual(s["pixels"], 12 * 16)
        self.assertEqual(s["visibilitySamples"], 12 * 16 * 16)
        rays = s["rays"]
        self.assertEqual(rays["camera"], s["visibilitySamples"])
        self.assertEqual(rays["total"], sum(rays[k] for k in ("camera", "shadow", "light", "bounce")))
        for kind in "camera shadow bounce".split():
            self.assertGreater(rays[kind], 0, kind)
        self.assertEqual(s["shades"] + s["missed"], s["visibilitySamples"])
        self.assertAlmostEqual(s["shadesPerPixel"], s["shades"] / s["pixels"])
        for counter in "pixels shades".split():
            self.assertEqual(s[counter], sum(t[counter] for t in s["threads"]), counter)
        for stage, seconds in s["threadSeconds"].items():
            self.assertAlmostEqual(seconds, sum(t["seconds"][stage] for t in s["threads"]), places=9)
        self.assertLessEqual(sum(s["threadSeconds"].values()), len(s["threads"]) * s["seconds"]["render"] * 1.01 + 0.01)
        self.assertLessEqual(s["seconds"]["begin"] + s["seconds"]["finish"], s["seconds"]["render"])
        self.assertGreater(s["missed"], 0)
        self.assertEqual(s["footprints"], 0)
        self.assertEqual(s["invalidSamples"], 0)
        self.assertEqual(s["geometry"]["quadrics"], 2)
        self.assertEqual(s["settings"]["shading:maxdepth"], 3)
        self.assertEqual(s["settings"]["samplesPerPixel"], 16)

    def test_resolution(self):
        self.assertEqual(self.stats("--resolution", "10x7")["resolution"], [10, 7])

    def test_shading(self):
        s = self.stats("--shading", "directlighting")
        self.assertEqual(s["settings"]["shading"], "directlighting")
        self.assertEqual(s["settings"]["shading:maxdepth"], 5, "parameters of another shading integrator are ignored")

    def test_layers_of_sharing(self):
        picture = self.render("--integrator", "msaa", "--aov", "shades,samples", "--aov", "hitrate")
        self.assertEqual(sorted(picture.channels), ["B", "G", "R", "hitrate.Y", "samples.Y", "shades.Y"])
        shades = sum(picture.value("shades.Y", x, y) for y in range(16) for x in range(24))
        self.assertEqual(shades, int(picture.attributes["strobe:shades"]))
        self.assertEqual(picture.value("samples.Y", 3, 4), 16)
        self.assertEqual(picture.pixels(), self.render("--integrator", "msaa").pixels(), "layers change the image")

    def test_layers_of_visible_surfaces(self):
        world = WORLD.replace('"float radius" .8', '"float radius" .8 "string name" "ball \\"1\\""')
        self.write("named.scene", OPTIONS + world)
        names = "normal,albedo,depth,position,uv,motionvector,objectid,materialid,primitiveid,cryptoobject,cryptomaterial"
        picture = self.render("--aov", names, "--crypto-depth", "4", scene="named.scene")
        layers = {"normal": "XYZ", "albedo": "RGB", "depth": "Z", "position": "XYZ", "uv": "UV", "motionvector": "XY",
                  "objectid": "Y", "materialid": "Y", "primitiveid": "Y",
                  **{f"Crypto{kind}0{i}": "RGBA" for kind in ("Object", "Material") for i in (0, 1)}}
        self.assertEqual(sorted(picture.channels),
                         sorted([*"RGB", *(f"{layer}.{c}" for layer, cs in layers.items() for c in cs)]))
        metadata = {k.split("/")[2]: v for k, v in picture.attributes.items() if k.startswith("cryptomatte/3ae39a5/")}
        self.assertEqual((metadata["name"], metadata["hash"], metadata["conversion"]),
                         ("CryptoObject", "MurmurHash3_32", "uint32_to_float32"))
        manifest = json.loads(metadata["manifest"])
        self.assertEqual(set(manifest), {'ball "1"', "sphere#1"})
        ball, = struct.unpack("<f", struct.pack("<I", int(manifest['ball "1"'], 16)))
        x, y = 12, 8  # the ball passes the center
        self.assertEqual(picture.value("CryptoObject00.R", x, y), ball)
        self.assertGreater(picture.value("CryptoObject00.G", x, y), .2)
        self.assertEqual(picture.value("depth.Z", 0, 15), float(struct.unpack("<f", struct.pack("<f", 1e10))[0]))
        self.assertEqual(self.render(scene="named.scene").pixels(), picture.pixels())

    def test_layers_of_light(self):
        self.write("lights.scene", OPTIONS + WORLD.replace('[.2 .3 .4]', '[.2 .3 .4] "string group" "sky"'))
        picture = self.render("--aov", "direct,indirect,lightgroups", scene="lights.scene")
        self.assertEqual(sorted(picture.channels), sorted(
            [*"RGB", *(f"{layer}.{c}" for layer in ("direct", "indirect", "light_sky", "light_rest") for c in "RGB")]))
        for (x, y), pixel in picture.pixels().items():
            for c, whole in zip("RGB", pixel):
                for a, b in (("direct", "indirect"), ("light_sky", "light_rest")):
                    parts = picture.value(f"{a}.{c}", x, y) + picture.value(f"{b}.{c}", x, y)
                    self.assertAlmostEqual(parts, whole, delta=1e-5 * whole + 1e-6)

    def test_variance_needs_passes(self):
        picture = self.render("--spp", "4", "--noise-target", "0.2", "--aov", "variance")
        self.assertEqual(sorted(picture.channels), ["B", "G", "R", "variance.Y"])
        values = [picture.value("variance.Y", x, y) for x, y in picture.pixels()]
        self.assertTrue(all(0 <= v < 1 for v in values))
        self.assertGreater(max(values), 0)
        for words, message in ((("variance",), "--aov variance: needs --noise-target"),
                            (("variance,shades", "--noise-target", "1"), "--aov shades: does not go with --noise-target")):
            self.assertIn(message, self.run_strobe("s.scene", "--aov", *words, code=USAGE).err)

    def test_layers_need_an_exr(self):
        error = self.run_strobe("s.scene", "-o", "picture.png", "--spp", "1", "--aov", "depth").err
        self.assertIn("--aov: there is no .exr output to hold the layers", error)

    def test_heatmap(self):
        self.run_strobe("s.scene", "--quiet", "-o", "picture.exr", "--heatmap", "heat.png", "--heatmap-of", "hitrate")
        width, height = struct.unpack(">II", self.read("heat.png")[16:24])
        self.assertGreaterEqual(width, 24)
        self.assertGreater(height, 16, "the scale is missing")

    def test_sample_table(self):
        self.run_strobe("s.scene", "--quiet", "-o", "p.exr", "--integrator", "msaa", "--crop", ".4", ".5", ".4", ".5",
                        "--samples", "samples.csv", "--stats", "stats.json")
        rows = [line.split(",") for line in self.read("samples.csv").decode().splitlines()]
        stats = json.loads(self.read("stats.json"))
        self.assertEqual(len(rows) - 1, stats["visibilitySamples"])
        shades = rows[0].index("shades")
        self.assertEqual(sum(int(row[shades]) for row in rows[1:]), stats["shades"])
        for row in rows[1:]:
            self.assertLess(abs(float(row[3]) - int(row[0]) - 0.5), 3, "the film position is near the pixel")
            self.assertTrue(0 <= float(row[5]) < 1, "the time is a fraction of the shutter")

    def test_bias_bound_is_in_the_statistics(self):
        self.assertEqual(self.stats()["bias"], {"reachPixels": 0, "shutterFraction": 0})
        bound = self.stats("--integrator", "msaa-cache", "-D", "blocksize=2", "-D", "timebins=8")["bias"]
        self.assertGreater(bound["reachPixels"], 2)
        self.assertEqual(bound["shutterFraction"], 0.125)

    def test_statistics_have_the_cost_of_shades_by_material(self):
        s = self.stats("--threads", "1")
        self.assertTrue(any("matte (s.scene:" in row["material"] for row in s["shadeCost"]), s["shadeCost"])
        for row in s["shadeCost"]:
            self.assertGreater(row["meanSeconds"], 0)


class Messages(CliTest):
    def test_progress_in_a_pipe_is_lines_of_percentages(self):
        result = self.run_strobe("s.scene", "-o", "a.exr", "--tile", "2")
        self.assertNotIn("\r", result.err)
        self.assertNotIn("\x1b", result.err)
        percentages = re.findall(r"^(\d+)%$", result.err, re.M)
        self.assertEqual(percentages, [str(p) for p in range(10, 101, 10)])
        self.assertIn("wrote a.exr", result.err)
        self.assertEqual(result.out, "")

    def test_progress_bar_on_a_terminal(self):
        try:
            master, slave = pty.openpty()
        except OSError as error:  # /dev/pts is not mounted
            self.skipTest(f"cannot open a terminal: {error}")
        code = subprocess.run([STROBE, "s.scene", "-o", "a.exr"], cwd=self.folder, stderr=slave, timeout=60).returncode
        os.close(slave)
        text = b""
        try:
            while chunk := os.read(master, 4096):
                text += chunk
        except OSError:
            pass  # the other end is closed
        os.close(master)
        self.assertEqual(code, OK)
        self.assertIn(b"\r[", text)
        self.assertIn(b"left", text)
        self.assertNotRegex(text, rb"(?m)^10%")

    def test_quiet_prints_errors_only(self):
        result = self.run_strobe("s.scene", "--quiet", "-o", "a.exr")
        self.assertEqual(result.err + result.out, "")
        self.write("warned.pbrt", OPTIONS + WORLD + 'Material "coateddiffuse" Shape "sphere"\n')
        self.assertEqual(self.run_strobe("warned.pbrt", "--quiet").err, "")
        self.assertIn("error", self.run_strobe("none.scene", "--quiet", code=USAGE).err)

    def test_log_levels(self):
        self.write("warned.scene", OPTIONS + WORLD + 'Material "coateddiffuse" Shape "sphere"\n')

        def printed(level):
            err = self.run_strobe("warned.scene", "--log-level", level, "--spp", "1").err
            return ["parsed in" in err, "wrote" in err, "warning" in err]

        self.assertEqual(printed("debug"), [True, True, True])
        self.assertEqual(printed("info"), [False, True, True])
        self.assertEqual(printed("warn"), [False, False, True])
        self.assertEqual(printed("error"), [False, False, False])

    def test_scene_errors_have_location_and_caret(self):
        self.write("bad.scene", 'WorldBegin\n  Shape "sphere" "float raduis" 2\n')
        err = self.run_strobe("bad.scene", code=SCENE).err
        self.assertEqual(err, 'bad.scene:2:18: error: unknown parameter "raduis"; did you mean "radius"? (known: radius, '
                              'zmin, zmax, phimax, name)\n    Shape "sphere" "float raduis" 2\n                   ^\n')


class Failures(CliTest):
    """Exit codes, and that no file is created or changed."""

    def setUp(self):
        super().setUp()
        for name in ("out.exr", "out.png", "stats.json"):
            self.write(name, "original")
            os.utime(self.path(name), (1000, 1000))

    def fails(self, code, *arguments, message=None):
        before = self.names()
        result = self.run_strobe(*arguments, code=code)
        self.assertEqual(self.names(), before, arguments)
        for name in ("out.exr", "out.png", "stats.json"):
            self.assertEqual(self.read(name), b"original", arguments)
            self.assertEqual(os.stat(self.path(name)).st_mtime, 1000, arguments)
        self.assertNotEqual(result.err, "")
        self.assertEqual(result.out, "")
        if message:
            self.assertIn(message, result.err)

    OUT = ("-o", "out.exr", "-o", "out.png", "--stats", "stats.json")

    def test_usage_errors(self):
        for arguments, message in (
            ([], "FILE"),
            (["s.scene", "--bogus"], "--bogus"),
            (["s.scene", "--spp", "0"], "--spp: takes an integer of at least 1"),
            (["s.scene", "--spp", "-4"], "--spp: takes an integer of at least 1"),
            (["s.scene", "--spp", "many"], "--spp: takes an integer of at least 1"),
            (["s.scene", "--spp", "4.5"], "--spp: takes an integer of at least 1"),
            (["s.scene", "--spp", "2147483648"], "--spp: takes an integer of at most 2147483647"),
            (["s.scene", "--spp"], "--spp"),
            (["s.scene", "--threads", "-1"], "--threads: takes an integer of at least 0"),
            (["s.scene", "--tile", "0"], "--tile: takes an integer of at least 1"),
            (["s.scene", "--crop", "0", "1", "0"], "--crop"),
            (["s.scene", "--crop", "0", "1", "1", "0"], "--crop"),
            (["s.scene", "--crop", "0", "nan", "0", "1"], "--crop"),
            (["s.scene", "--crop", "2", "3", "0", "1"], "crop"),
            (["s.scene", "--pixel", "3"], "--pixel"),
            (["s.scene", "--pixel", "3,4,5"], "--pixel"),
            (["s.scene", "--pixel", "1,1"], "-o: does not go with --pixel"),
            (["s.scene", "--sample", "1"], "needs --pixel"),
            (["s.scene", "--pixel", "3,4", "--sample", "-1"], "--sample: takes an integer of at least 0"),
            (["s.scene", "--seed", "x"], "--seed: takes an integer of at least 0"),
            (["s.scene", "--seed", "-1"], "--seed: takes an integer of at least 0"),
            (["s.scene", "--seed", "18446744073709551616"], "--seed: takes an integer of at most 18446744073709551615"),
            *((["s.scene", option, value], f"{option}: takes a number above 0") for value in ("0", "-1", "nan", "inf", "1e999", "soon")
              for option in ("--fps", "--time-limit", "--noise-target", "--write-interval", "--checkpoint", "--clamp")),
            *((["s.scene", option, value], f"{option}: takes a number") for value in ("nan", "-inf", "1e999", "soon")
              for option in ("--frame-time", "--exposure")),
            (["s.scene", "--aov", "cryptoobject", "--crypto-depth", "0"], "--crypto-depth: takes an integer of at least 1"),
            (["s.scene", "--resolution", "10"], "--resolution"),
            (["s.scene", "--resolution", "0x4"], "--resolution"),
            (["s.scene", "--resolution", "4x65537"], "takes WxH, two integers from 1 to 65536"),
            (["s.scene", "--resolution", "4294967300x4"], "--resolution"),
            (["s.scene", "--resolution", "4x4x4"], "--resolution"),
            (["s.scene", "--aov", "shade"], 'unknown layer "shade" (known: normal, albedo, depth, position, uv, motionvector, objectid, materialid, '
             'primitiveid, cryptoobject, cryptomaterial, alpha, direct, indirect, lightgroups, shades, samples, hitrate, cell, shadetime, sharedweight, sharedwidth, sharederror, variance)'),
            (["s.scene", "--heatmap", "heat.exr"], "must end in .png"),
            (["s.scene", "--heatmap-of", "x"], 'unknown layer "x"'),
            (["s.scene", "--heatmap-of", "cell"], "--heatmap-of: needs --heatmap"),
            (["s.scene", "--aov", "depth", "--crypto-depth", "4"], "--crypto-depth: needs --aov cryptoobject or cryptomaterial"),
            (["s.scene", "--shading", "toon"], "toon"),
            (["s.scene", "--frame-time", "soon"], "--frame-time"),
            (["s.scene", "--frames", "3:1"], "--frames: takes frames such as"),
            (["s.scene", "--frames", "1:3:0"], "--frames"),
            (["s.scene", "--frames", "1:3:1:1"], "--frames"),
            (["s.scene", "--frames", "1:"], "--frames"),
            (["s.scene", "--frames", "99999999999"], "--frames"),
            (["s.scene", "--frames", "1:3", "--fps", "0"], "--fps"),
            (["s.scene", "--frames", "1:3", "--shutter", ".5,.2"], "--shutter: takes open,close"),
            (["s.scene", "--frames", "1:3", "--shutter", ".5"], "--shutter"),
            (["s.scene", "--frames", "1:3", "--shutter", "0,inf"], "--shutter"),
            (["s.scene", "--frames", "1:3", "--pixel", "1,1"], "--pixel: renders a single frame; --frames has several"),
            (["s.scene", "--frames", "1:3", "--frame-time", "1"], "--frame-time: renders a single frame; it does not go with --frames"),
            (["s.scene", "--shutter", "0,1"], "--shutter: needs --frames"),
            (["s.scene", "--fps", "24"], "--fps: needs --frames"),
            (["s.scene", "--overwrite"], "--overwrite: needs --frames"),
            (["s.scene", "--log-level", "loud"], "--log-level"),
            (["s.scene", "-o", "out.gif"], "out.gif"),
            (["s.scene", "-o", ""], "-o"),
            (["s.scene", "-D", "maxdepht=2"], 'unknown parameter "maxdepht"; did you mean "maxdepth"?'),
            (["s.scene", "-D", "maxdepth"], "name=value"),
            (["s.scene", "-D", "maxdepth=deep"], "not a number"),
            (["s.scene", "-D", "maxdepth=3.5"], '"3.5" is not an integer'),
            (["s.scene", "-D", "maxdepth=99999999999"], '"99999999999" does not fit a 32-bit integer'),
            (["none.scene"], "none.scene"),
            (["."], '"."'),
            (["s.scene", "none.scene"], "none.scene"),
        ):
            with self.subTest(arguments):
                self.fails(USAGE, *arguments, *self.OUT, message=message)

    def test_usage_errors_of_pixels(self):
        for arguments, message in (
            (["--pixel", "24,0"], "--pixel 24,0: the frame has 24x16 pixels"),
            (["--pixel", "-1,0"], "--pixel"),
            (["--pixel", "3,4", "--sample", "16"], "--sample 16: a pixel has 16 samples"),
            (["--pixel", "3,4", "--stats", "a.json"], "--stats: does not go with --pixel"),
            (["--pixel", "3,4", "--heatmap", "a.png"], "--heatmap: does not go with --pixel"),
            (["--pixel", "3,4", "--samples", "a.csv"], "--samples: does not go with --pixel"),
            (["--pixel", "3,4", "--aov", "normal"], "--aov normal: does not go with --pixel"),
            (["--pixel", "3,4", "--write-interval", "1"], "--write-interval: does not go with --pixel"),
            (["--pixel", "3,4", "--partial", "1"], "--write-interval: does not go with --pixel"),
            (["--partial=0"], "--write-interval: takes a number above 0"),
        ):
            with self.subTest(arguments):
                self.fails(USAGE, "s.scene", *arguments, message=message)

    def test_integrators_and_shading_integrators_have_their_own_options(self):
        self.fails(USAGE, "s.scene", "--integrator", "path", *self.OUT, message="--integrator path: there is no such integrator; use --shading path")
        self.fails(USAGE, "s.scene", "--shading", "msaa", *self.OUT, message="--shading msaa: there is no such shading integrator; use --integrator msaa")

    def test_errors_of_unknown_integrators_list_the_known(self):
        self.fails(USAGE, "s.scene", "--integrator", "supersampel", *self.OUT, message='did you mean "supersample"?')
        self.fails(USAGE, "s.scene", "--integrator", "xyz", *self.OUT, message="(known: supersample")

    def test_scene_errors(self):
        scenes = {
            "misspelt": OPTIONS + WORLD + 'Shape "sphere" "float raduis" 2\n',
            "unclosed": OPTIONS + WORLD + "AttributeBegin\n",
            "empty": "",
            "garbage": bytes(range(256)) * 64,
            "zeros": b"\0" * 4096,
            "missing": OPTIONS + WORLD + 'Shape "plymesh" "string filename" "none.ply"\n',
            "depth": OPTIONS.replace('"integer maxdepth" 3', '"integer maxdepth" -1') + WORLD,
            "film": OPTIONS.replace('"integer xresolution" 24', '"integer xresolution" 0') + WORLD,
            "self": 'Include "self.scene"\n',
            "huge": OPTIONS.replace('"integer pixelsamples" 16', '"integer pixelsamples" 16e9') + WORLD,
        }
        for name, text in scenes.items():
            with self.subTest(name):
                self.write(name + ".scene", text)
                self.fails(SCENE, name + ".scene", *self.OUT, message=name + ".scene:")
        with self.subTest("twice"):
            self.fails(SCENE, "s.scene", "s.scene", *self.OUT, message="s.scene:1:1: error: TransformTimes must come before")

    def test_unwritable_outputs(self):
        os.mkdir(self.path("folder.exr"))
        self.fails(OUTPUT, "s.scene", "-o", "none/out.exr", message="none/out.exr")
        self.fails(OUTPUT, "s.scene", "-o", "s.scene/out.exr", message="s.scene/out.exr")
        self.fails(OUTPUT, "s.scene", "-o", "folder.exr", message="folder.exr")
        self.fails(OUTPUT, "s.scene", "-o", "out.exr", "-o", "none/out.png", message="none/out.png")
        self.fails(OUTPUT, "s.scene", "-o", "new.exr", "--stats", "none/stats.json", message="none/stats.json")
        self.fails(OUTPUT, "s.scene", "-o", "new.exr", "--stats", ".", message="cannot write")
        self.write("named.scene", OPTIONS.replace('"image"', '"image" "string filename" "none/out.exr"') + WORLD)
        self.fails(OUTPUT, "named.scene", message="none/out.exr")

    def test_two_outputs_to_one_file_are_an_error(self):
        os.symlink("out.exr", self.path("link.exr"))
        for outputs in (["-o", "out.png", "--heatmap", "out.png"], ["-o", "out.exr", "--stats", "./out.exr"], ["-o", "out.exr", "-o", "link.exr"],
                        ["--samples", "new.csv", "--stats", "new.csv"], ["--reference", "r.exr", "--curve", "new.csv", "--stats", "new.csv"],
                        ["--stats", "s.exr"], ["--frames", "1:2", "-o", "a.#.exr", "--stats", "a.#.exr"],
                        ["--frames", "1:2", "-o", "new.#.exr", "-o", "new.%d.exr"]):
            with self.subTest(outputs):
                self.fails(USAGE, "s.scene", *outputs, message="is to be written twice")
        os.symlink("loop", self.path("loop"))  # files whose names cannot be resolved are different files
        self.fails(OUTPUT, "s.scene", "-o", "loop/a.exr", "-o", "loop/b.exr", message="loop/a.exr")

    def test_files_that_the_scene_reads_are_not_overwritten(self):
        self.run_strobe("s.scene", "--quiet", "--spp", "1", "-o", "env.exr")
        self.write("part.scene", WORLD.replace('"rgb L" [.2 .3 .4]', '"string mapname" "env.exr"'))
        self.write("env.scene", OPTIONS + 'Include "part.scene"\n')
        os.symlink("env.exr", self.path("link.exr"))
        kept = {name: self.read(name) for name in ("env.exr", "part.scene", "env.scene")}
        for arguments, name in (([], "env.exr"), (["-o", self.path("env.exr")], self.path("env.exr")), (["-o", "link.exr"], "link.exr"),
                                (["-o", "new.exr", "--stats", "env.scene"], "env.scene"), (["--samples", "part.scene", "-o", "new.exr"], "part.scene"),
                                (["--sandbox", ".", "-o", "env.exr"], "env.exr")):
            with self.subTest(arguments):
                self.fails(OUTPUT, "env.scene", *arguments, message=f'cannot write "{name}": the scene reads it')
        os.rename(self.path("env.exr"), self.path("env.0002.exr"))
        self.write("part.scene", kept["part.scene"].replace(b"env.exr", b"env.0002.exr"))
        err = self.run_strobe("env.scene", "--frames", "1:2", "--quiet", code=OUTPUT).err
        self.assertIn('cannot write "env.0002.exr": the scene reads it', err)
        self.assertEqual(self.read("env.0002.exr"), kept["env.exr"])
        self.fails(OUTPUT, "s.scene", "--reference", "env.0002.exr", "-o", "env.0002.exr", message="--reference reads it")

    def test_missing_image_library_is_an_error_before_rendering(self):
        for file in (STROBE, *glob.glob(os.path.join(os.path.dirname(STROBE), "libstrobe.so.?.?"))):
            shutil.copy(file, self.folder)
        def run(*arguments):
            return subprocess.run([self.path("strobe"), "s.scene", "--quiet", *arguments], cwd=self.folder, capture_output=True,
                                  timeout=60)
        self.assertEqual(run("-o", "out.exr").returncode, OK, "the library is needed only to read images and to write PNGs")
        result = run("-o", "new.exr", "-o", "out.png")
        self.assertEqual(result.returncode, SCENE)
        self.assertIn(b"cannot load the image library libstrobe_images.so: it is neither beside libstrobe nor in its folder "
                      b"strobe", result.stderr)
        self.assertFalse(os.path.exists(self.path("new.exr")), "the error comes after rendering")


class Sequences(CliTest):
    def sequence(self, *arguments, scene="s.scene"):
        """Renders a sequence. Returns the result and the frames that were rendered."""
        result = self.run_strobe(scene, *arguments)
        return result, [int(frame) for frame in re.findall(r"^frame (-?\d+) \(", result.err, re.M)]

    def test_frames_equal_stills_with_the_same_shutter(self):
        self.run_strobe("s.scene", "--frames=-1:3:2", "--fps", "4", "--shutter", ".25,.75", "-o", "a.exr")
        self.assertEqual(self.names(), ["a.-001.exr", "a.0001.exr", "a.0003.exr", "s.scene"])
        for frame, name in ((-1, "-001"), (1, "0001"), (3, "0003")):
            times = f'"float shutteropen" {(frame + .25) / 4} "float shutterclose" {(frame + .75) / 4}'
            self.write("t.scene", OPTIONS.replace('"float fov" 60', '"float fov" 60 ' + times) + WORLD)
            picture = Exr(self.path(f"a.{name}.exr"))
            self.assertEqual(picture.rows, self.render(scene="t.scene").rows, frame)
            self.assertEqual(picture.attributes["strobe:frame"], frame)
            self.assertAlmostEqual(picture.attributes["strobe:shutter:open"], (frame + .25) / 4)
            self.assertAlmostEqual(picture.attributes["strobe:shutter:close"], (frame + .75) / 4)

    def test_default_shutter_is_half_a_frame_of_24(self):
        self.run_strobe("s.scene", "--frames", "12", "--spp", "1")
        picture = Exr(self.path("s.0012.exr"))
        self.assertAlmostEqual(picture.attributes["strobe:shutter:open"], 12 / 24)
        self.assertAlmostEqual(picture.attributes["strobe:shutter:close"], 12.5 / 24)

    def test_file_names_have_the_frame_number(self):
        self.run_strobe("s.scene", "--frames", "7:7", "--spp", "1", "-o", "a.##.exr", "-o", "b_%03d_x.png", "-o", "c%d.exr",
                        "--stats", "d.#.json", "--heatmap", "e.png", "--samples", "f%4d.csv")
        self.assertEqual(self.names(), ["a.07.exr", "b_007_x.png", "c7.exr", "d.7.json", "e.0007.png", "f   7.csv", "s.scene"])
        self.assertEqual(json.loads(self.read("d.7.json"))["settings"]["frame"], 7)
        self.write("named.scene", OPTIONS.replace('"image"', '"image" "string filename" "chosen.#.png"') + WORLD)
        self.run_strobe("named.scene", "--frames", "1:2", "--spp", "1")
        self.assertLessEqual({"chosen.1.png", "chosen.2.png"}, set(self.names()))
        self.run_strobe("s.scene", "--spp", "1", "-o", "g.##.exr")  # without --frames, # is an ordinary character
        self.assertIn("g.##.exr", self.names())

    def test_finished_frames_are_skipped(self):
        arguments = ["--frames", "1:3", "--spp", "2", "-o", "a.#.exr", "-o", "a.#.png", "--stats", "a.#.json"]
        self.assertEqual(self.sequence(*arguments)[1], [1, 2, 3])
        result, frames = self.sequence(*arguments)
        self.assertEqual(frames, [])
        self.assertIn("3 frames: 0 rendered now, 3 before", result.err)
        before = os.stat(self.path("a.1.exr")).st_mtime_ns
        os.remove(self.path("a.2.exr"))
        self.assertEqual(self.sequence(*arguments, "--threads", "1", "--quiet")[1], [])
        self.assertIn("a.2.exr", self.names())
        self.assertEqual(os.stat(self.path("a.1.exr")).st_mtime_ns, before)
        for name in ("a.1.png", "a.1.json"):
            os.remove(self.path(name))
            self.assertEqual(self.sequence(*arguments)[1], [1], name)
        self.write("a.3.exr", self.read("a.3.exr")[:100])
        self.assertEqual(self.sequence(*arguments)[1], [3])
        self.write("a.2.png", "no picture")
        self.assertEqual(self.sequence("--frames", "1:5:2", *arguments[2:])[1], [5])
        self.assertEqual(self.sequence("--frames", "1:5", *arguments[2:])[1], [2, 4])
        self.assertEqual(self.sequence(*arguments, "--overwrite")[1], [1, 2, 3])

    def test_frames_of_another_command_or_scene_are_not_finished(self):
        arguments = ["--frames", "1:2", "-o", "a.#.exr"]
        self.assertEqual(self.sequence(*arguments, "--spp", "2")[1], [1, 2])
        for more in (["--spp", "1"], ["--spp", "1", "--shutter", "0,1"], ["--spp", "1", "--fps", "5"],
                     ["--spp", "1", "--seed", "3"], ["--spp", "1", "-D", "maxdepth=1"], ["--quick"], ["--crop", "0", ".5", "0", "1"]):
            self.assertEqual(self.sequence(*arguments, *more)[1], [1, 2], more)
            self.assertEqual(self.sequence(*arguments, *more)[1], [], more)
        self.write("s.scene", OPTIONS + WORLD + "Shape \"sphere\"\n")
        self.assertEqual(self.sequence(*arguments, *more)[1], [1, 2])

    def test_killed_sequences_continue(self):
        arguments = [STROBE, "s.scene", "--frames", "0:11", "--fps", "12", "-o", "a.##.exr", "--spp", "256", "--resolution", "48x32"]
        process = subprocess.Popen(arguments, cwd=self.folder, stderr=subprocess.PIPE)
        for line in process.stderr:  # until the fourth frame begins
            if line.startswith(b"frame 3"):
                break
        process.kill()
        process.communicate()
        whole = {name: Exr(self.path(name)).rows for name in self.names() if name.startswith("a.")}
        self.assertIn(len(whole), (3, 4))
        _, frames = self.sequence(*arguments[2:])
        self.assertEqual(frames, list(range(len(whole), 12)))
        rows = {f"a.{i:02}.exr": Exr(self.path(f"a.{i:02}.exr")).rows for i in range(12)}
        self.assertEqual(whole, {name: rows[name] for name in whole})
        self.run_strobe(*arguments[1:], "--overwrite")
        for name in rows:
            self.assertEqual(Exr(self.path(name)).rows, rows[name], name)

    def test_a_frame_that_cannot_be_written_ends_the_sequence(self):
        os.mkdir(self.path("a.2.exr"))
        result = self.run_strobe("s.scene", "--frames", "1:3", "--spp", "1", "-o", "a.#.exr", code=OUTPUT)
        self.assertIn("a.2.exr", result.err)
        self.assertEqual(self.names(), ["a.1.exr", "a.2.exr", "s.scene"])


if __name__ == "__main__":
    unittest.main()
