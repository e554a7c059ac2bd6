"""Image files as other programs read them: colors compared with oiiotool, EXRs read by OpenImageIO, exrheader and Blender.
Usage: outputs_test.py PATH_OF_STROBE [unittest arguments]"""
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
from cli_test import OPTIONS, OUTPUT, USAGE, WORLD, CliTest  # noqa: E402

SCENE = OPTIONS.replace('"integer xresolution" 24', '"integer xresolution" 72').replace(
    '"integer yresolution" 16', '"integer yresolution" 48').replace('pixelsamples" 16', 'pixelsamples" 4') + WORLD.replace(
        "[.2 .3 .4]", "[.02 .05 .1]").replace("[20 20 20]", "[400 300 200]")
BUILTIN_VIEWS = [(display, view) for display in ("sRGB", "Rec.1886 Rec.709", "P3-D65") for view in ("Standard", "ACES", "Raw")]

# An OpenColorIO config with another name of the working space, a view with a look, and a file rule.
SHOW_CONFIG = """ocio_profile_version: 2
strictparsing: true
roles:
  default: flat
  scene_linear: Utility - Linear - sRGB
file_rules:
  - !<Rule> {name: cards, regex: ".*_card\\\\.[^.]+$", colorspace: flat}
  - !<Rule> {name: Default, colorspace: default}
displays:
  projector:
    - !<View> {name: film, colorspace: dense, looks: night}
    - !<View> {name: flat, colorspace: flat}
looks:
  - !<Look>
    name: night
    process_space: Utility - Linear - sRGB
    transform: !<CDLTransform> {slope: [0.5, 0.6, 0.9], power: [1.1, 1.1, 1]}
  - !<Look>
    name: noon
    process_space: Utility - Linear - sRGB
    transform: !<CDLTransform> {slope: [1.6, 1.5, 1.2], sat: 0.8}
colorspaces:
  - !<ColorSpace> {name: Utility - Linear - sRGB, isdata: false}
  - !<ColorSpace>
    name: flat
    from_reference: !<ExponentTransform> {value: [2.2, 2.2, 2.2, 1], direction: inverse}
  - !<ColorSpace>
    name: dense
    from_reference: !<GroupTransform>
      children:
        - !<MatrixTransform> {matrix: [0.8, 0.1, 0.1, 0, 0.05, 0.9, 0.05, 0, 0.1, 0.1, 0.8, 0, 0, 0, 0, 1]}
        - !<LogAffineTransform> {log_side_slope: 0.12, log_side_offset: 0.8, lin_side_offset: 0.01}
"""


class OutputTest(CliTest):
    def setUp(self):
        super().setUp()
        self.write("o.scene", SCENE)

    def channels(self, name):
        """Returns the stored pixels of all EXR parts by channel name."""
        file = oiio.ImageInput.open(self.path(name))  # ImageBuf caches files by name
        self.assertIsNotNone(file, oiio.geterror())
        found, part = {}, 0
        while file.seek_subimage(part, 0):
            pixels = file.read_image(part, 0, 0, file.spec().nchannels, oiio.UINT8 if name.endswith(".png") else oiio.FLOAT)
            self.assertIsNotNone(pixels, file.geterror())
            found.update({channel: pixels[..., k] for k, channel in enumerate(file.spec().channelnames)})
            part += 1
        return found

    def header(self, name):
        return oiio.ImageInput.open(self.path(name)).spec()

    def tool(self, *arguments, ocio=None):
        environment = {**os.environ, **({"OCIO": self.path(ocio)} if ocio else {})}
        subprocess.run(["oiiotool", *arguments], cwd=self.folder, env=environment, check=True, capture_output=True)

    def run_with(self, ocio, *arguments, **more):
        os.environ["OCIO"] = self.path(ocio)
        try:
            return self.run_strobe(*arguments, **more)
        finally:
            del os.environ["OCIO"]


class Color(OutputTest):
    def setUp(self):
        super().setUp()
        self.write("builtin.ocio", self.run_strobe("--print-ocio").out)
        self.write("show.ocio", SHOW_CONFIG)
        self.run_strobe("o.scene", "--quiet", "-o", "linear.exr")
        self.linear = self.read("linear.exr")

    def assert_same_bytes(self, ours, theirs):
        """Compares 8-bit images. Values halfway between two bytes may be rounded either way."""
        a, b = self.channels(ours), self.channels(theirs)
        self.assertEqual(sorted(a), ["B", "G", "R"])
        difference = np.abs(np.stack([a[c].astype(int) - b[c] for c in "RGB"]))
        self.assertLessEqual(difference.max(), 1)
        self.assertLess(np.mean(difference > 0), 0.005)
        self.assertGreater(np.ptp(a["G"]), 50, "the image is constant")

    def test_pngs_are_srgb_by_default(self):
        self.run_strobe("o.scene", "--quiet", "-o", "ours.png")
        self.tool("linear.exr", "--colorconvert", "linear", "sRGB", "-d", "uint8", "-o", "theirs.png")
        self.assert_same_bytes("ours.png", "theirs.png")
        self.run_with("show.ocio", "o.scene", "--quiet", "-o", "with_ocio.png")
        np.testing.assert_array_equal(self.channels("ours.png")["G"], self.channels("with_ocio.png")["G"])

    def test_built_in_views_equal_those_of_oiiotool(self):
        for display, view in BUILTIN_VIEWS:
            with self.subTest(display=display, view=view):
                self.run_strobe("o.scene", "--quiet", "--display", display, "--view", view, "-o", "ours.png")
                self.tool("linear.exr", "--ociodisplay", display, view, "-d", "uint8", "-o", "theirs.png",
                          ocio="builtin.ocio")
                self.assert_same_bytes("ours.png", "theirs.png")

    def test_views_of_a_config_equal_those_of_oiiotool(self):
        for view in ("film", "flat"):
            with self.subTest(view=view):
                self.run_with("show.ocio", "o.scene", "--quiet", "--view", view, "-o", "ours.png")
                self.run_with("show.ocio", "o.scene", "--quiet", "-o", "named.exr")
                self.tool("named.exr", "--ociodisplay", "projector", view, "-d", "uint8", "-o", "theirs.png",
                          ocio="show.ocio")
                self.assert_same_bytes("ours.png", "theirs.png")

    def test_look_replaces_the_looks_of_the_view(self):
        self.run_with("show.ocio", "o.scene", "--quiet", "--look", "noon", "-o", "ours.png")
        self.tool("linear.exr", "--iscolorspace", "scene_linear", "--ociolook:from=scene_linear:to=scene_linear", "noon",
                  "--tocolorspace", "dense", "-d", "uint8", "-o", "theirs.png", ocio="show.ocio")
        self.assert_same_bytes("ours.png", "theirs.png")

    def test_exposure_applies_to_pngs_only(self):
        factor = 2**-1.5
        self.run_strobe("o.scene", "--quiet", "--exposure", "-1.5", "-o", "ours.png", "-o", "same.exr")
        self.tool("linear.exr", "--mulc", str(factor), "--colorconvert", "linear", "sRGB", "-d", "uint8", "-o", "theirs.png")
        self.assert_same_bytes("ours.png", "theirs.png")
        self.run_strobe("o.scene", "--quiet", "--exposure", "-1.5", "--view", "ACES", "-o", "ours.png")
        self.tool("linear.exr", "--mulc", str(factor), "--ociodisplay", "sRGB", "ACES", "-d", "uint8", "-o", "theirs.png",
                  ocio="builtin.ocio")
        self.assert_same_bytes("ours.png", "theirs.png")
        self.run_strobe("o.scene", "--quiet", "--view", "ACES", "-o", "other.exr")
        for name in ("same.exr", "other.exr"):
            for channel, values in self.channels(name).items():
                np.testing.assert_array_equal(values, self.channels("linear.exr")[channel])

    def test_merge_has_the_image_options_of_a_render(self):
        self.run_strobe("o.scene", "--quiet", "-o", "p.part")
        how = ("--view", "film", "--display", "projector", "--look", "noon", "--exposure", "1", "--exr", "half,tiles:16")
        self.run_with("show.ocio", "o.scene", "--quiet", *how, "-o", "ours.png", "-o", "ours.exr")
        self.run_with("show.ocio", "merge", "p.part", "--quiet", *how, "-o", "merged.png", "-o", "merged.exr")
        for kind in ("png", "exr"):
            ours, merged = self.channels("ours." + kind), self.channels("merged." + kind)
            for channel in "RGB":
                np.testing.assert_array_equal(ours[channel], merged[channel])
        self.assertEqual(self.header("merged.exr").tile_width, 16)
        self.assertIn(b"strobe:exposure", self.read("merged.png"))
        for wrong, message in ((["--view", "Film"], "unknown view"), (["--exr", "deflate"], '--exr: unknown EXR setting "deflate"'), (["--exposure", "nan"], "takes a number")):
            self.assertIn(message, self.run_strobe("merge", "p.part", "-o", "no.png", *wrong, code=USAGE).err)
        self.assertNotIn("no.png", self.names())

    def test_metadata_name_the_color_space(self):
        header = self.header("linear.exr")
        self.assertEqual(header["oiio:ColorSpace"], "lin_rec709")
        self.assertEqual(header["colorInteropID"], "lin_rec709_scene")
        self.run_with("show.ocio", "o.scene", "--quiet", "-o", "show.exr")
        self.assertEqual(self.header("show.exr")["oiio:ColorSpace"], "Utility - Linear - sRGB")
        np.testing.assert_allclose(header["chromaticities"], (.64, .33, .3, .6, .15, .06, .3127, .329), rtol=1e-6)
        self.run_strobe("o.scene", "--quiet", "--view", "ACES", "--exposure", "1", "-o", "v.png", "-o", "s.png")
        self.assertEqual(self.header("v.png")["strobe:view"], "ACES")

    def test_textures_follow_file_rules_and_encodings(self):
        card = oiio.ImageBuf(oiio.ImageSpec(1, 1, 3, oiio.UINT8))
        oiio.ImageBufAlgo.fill(card, (0.5, 0.25, 0.75))
        for name in ("a_card.png", "a.png"):
            card.write(self.path(name))

        def render_red(file, *encoding):
            self.write("t.scene", SCENE.replace('Material "matte"', f'Texture "t" "color" "imagemap" "string filename" "{file}" '
                       f'{" ".join(encoding)}\nMaterial "matte" "texture Kd" "t" #'))
            self.run_with("show.ocio", "t.scene", "--quiet", "--spp", "4", "-o", "t.exr")
            return self.channels("t.exr")["R"]

        by_rule = render_red("a_card.png")
        np.testing.assert_array_equal(by_rule, render_red("a.png", '"string encoding" "flat"'))
        np.testing.assert_array_equal(by_rule, render_red("a_card.png", '"string encoding" "default"'))  # a role
        self.assertFalse(np.array_equal(by_rule, render_red("a.png")))
        np.testing.assert_allclose(by_rule, render_red("a.png", '"string encoding" "gamma 2.2"'), rtol=1e-4)

    def test_errors(self):
        for arguments, message in (
            (["--view", "ACSE"], 'unknown view "ACSE"; did you mean "ACES"? (known: Standard, ACES, Raw)'),
            (["--display", "TV"], 'unknown display "TV" (known: sRGB, Rec.1886 Rec.709, P3-D65)'),
            (["--look", "Noir"], 'unknown look "Noir" (there is none)'),
            (["--exposure", "nan"], "--exposure"),
            (["--exposure", "bright"], "--exposure"),
        ):
            err = self.run_strobe("o.scene", "-o", "no.png", *arguments, code=USAGE).err
            self.assertIn(message, err)
        err = self.run_with("show.ocio", "o.scene", "-o", "no.png", "--view", "flim", code=USAGE).err
        self.assertIn('unknown view "flim"; did you mean "film"? (known: film, flat)', err)
        err = self.run_with("none.ocio", "o.scene", "-o", "no.png", "--view", "film", code=USAGE).err
        self.assertIn("none.ocio", err)
        self.assertNotIn("no.png", self.names())


class ExrFiles(OutputTest):
    KINDS = ("float", "half", "none", "rle", "zips", "piz,half", "b44a,half", "tiles", "tiles:16,zips", "parts",
             "parts,tiles:16,half", "parts,half,dwab", "parts,pxr24", "half,dwaa:20,parts,tiles")

    def render_all(self):
        """Renders KINDS[k] to k.exr with two layers, and reference.exr with default settings."""
        self.run_strobe("o.scene", "--quiet", "--aov", "shades,block", "-o", "reference.exr")
        for k, kind in enumerate(self.KINDS):
            self.run_strobe("o.scene", "--quiet", "--aov", "shades,block", "--exr", kind, "-o", f"{k}.exr")

    def test_every_kind_reads_back(self):
        self.render_all()
        reference = self.channels("reference.exr")
        for k, kind in enumerate(self.KINDS):
            with self.subTest(kind):
                found = self.channels(f"{k}.exr")
                self.assertEqual(sorted(found), ["B", "G", "R", "cell.Y", "shades.Y"])
                half, lossy = "half" in kind, re.search("pxr24|b44|dwa", kind)
                for name, values in found.items():
                    if name.endswith(".Y") or not (half or lossy):
                        np.testing.assert_array_equal(values, reference[name])
                    elif lossy:
                        np.testing.assert_allclose(values, reference[name], atol=0.2)
                    else:
                        np.testing.assert_array_equal(values, reference[name].astype(np.float16).astype(np.float32))

    def test_crop(self):
        crop = ("--crop", ".25", ".8", ".3", "1")
        self.run_strobe("o.scene", "--quiet", "-o", "reference.exr", *crop)
        reference = self.channels("reference.exr")["G"]
        for kind in ("tiles:16", "parts,half,piz"):
            self.run_strobe("o.scene", "--quiet", "-o", "a.exr", "--aov", "shades", "--exr", kind, *crop)
            header = self.header("a.exr")
            self.assertEqual((header.x, header.y, header.full_width, header.full_height), (18, 15, 72, 48))
            np.testing.assert_allclose(self.channels("a.exr")["G"], reference, rtol=1e-3)

    def test_exrheader_lists_the_settings(self):
        self.run_strobe("o.scene", "--quiet", "--aov", "shades,block", "--exr", "half,dwab,tiles:32,parts", "-o", "a.exr")
        text = subprocess.run(["exrheader", "a.exr"], cwd=self.folder, check=True, capture_output=True).stdout.decode()
        parts = text.split("part ")[1:]
        self.assertEqual([re.search(r'name \(type string\): "(.*)"', p)[1] for p in parts], ["rgba", "shades", "cell"])
        for part in parts:
            self.assertRegex(part, r"tiles \(type tiledesc\):\s+single level\s+tile size 32 by 32 pixels")
            self.assertRegex(part, r"red   \(0\.64 0\.33\)")
        self.assertRegex(parts[0], r"compression \(type compression\): dwa, medium scanline blocks")
        self.assertRegex(parts[0], r"R, 16-bit floating-point")
        self.assertRegex(parts[1], r"compression \(type compression\): zip, individual scanlines")
        self.assertRegex(parts[1], r"shades.Y, 32-bit floating-point")
        self.assertIn("strobe:samplesPerPixel", parts[0])

    def test_values_beyond_half_floats_are_reported(self):
        self.write("hot.scene", SCENE.replace("[400 300 200]", "[2e8 1 1]"))
        err = self.run_strobe("hot.scene", "--exr", "half", "-o", "a.exr").err
        count = int(re.search(r"a\.exr: (\d+) values beyond 65504, the largest half float, were clamped to it", err)[1])
        self.assertNotIn("65504", self.run_strobe("hot.scene", "-o", "b.exr").err)
        beyond = self.channels("b.exr")["R"] > 65504
        self.assertEqual(np.sum(beyond), count)
        np.testing.assert_array_equal(self.channels("a.exr")["R"][beyond], 65504)

    def test_errors(self):
        for kind, message in (("deflate", 'unknown EXR setting "deflate" (known: half, float, none, rle, zips, zip, piz, '),
                           ("half,zip:9", '"zip:9"'), ("tiles:0", '"tiles:0"'),
                           ("dwaa", 'dwaa would change the data in "shades"; use zip, or add "parts"')):
            before = self.names()
            self.assertIn(message, self.run_strobe("o.scene", "--aov", "shades", "--exr", kind, "-o", "a.exr", code=USAGE).err)
            self.assertEqual(self.names(), before)
        os.mkdir(self.path("folder.exr"))
        self.run_strobe("o.scene", "--exr", "parts,tiles", "-o", "folder.exr", code=OUTPUT)

    @unittest.skipUnless(shutil.which("blender"), "Blender is not installed")
    def test_blender_opens_them(self):
        """The compositor of Blender finds color and layers by name, with the stored values."""
        self.render_all()
        self.write("open.py", BLENDER)
        files = [self.path(f"{k}.exr") for k in range(len(self.KINDS))]
        subprocess.run(["blender", "-b", "--factory-startup", "--python-exit-code", "1", "--python", self.path("open.py"), "--",
                        self.path("opened"), *files], cwd=self.folder, check=True, capture_output=True, timeout=120)
        for k, kind in enumerate(self.KINDS):
            with self.subTest(kind):
                stored = self.channels(f"{k}.exr")
                for output, names in (("Combined", "RGB"), ("shades", ["shades.Y"]), ("cell", ["cell.Y"])):
                    opened = self.channels(f"opened/{k}.exr {output} 0001.exr")
                    for name, channel in zip(names, "RGB"):
                        np.testing.assert_array_equal(opened[channel if "R" in opened else "V"], stored[name], output)


# Script for Blender: writes each output of the Image node of each file to a float EXR.
BLENDER = """
import bpy, os, sys
folder, *files = sys.argv[sys.argv.index("--") + 1:]
scene = bpy.context.scene
scene.use_nodes = True
scene.render.resolution_x, scene.render.resolution_y, scene.render.resolution_percentage = 72, 48, 100
for file in files:
    tree = scene.node_tree
    tree.nodes.clear()
    image = tree.nodes.new("CompositorNodeImage")
    image.image = bpy.data.images.load(file)
    writer = tree.nodes.new("CompositorNodeOutputFile")
    writer.base_path = folder
    writer.format.file_format, writer.format.color_depth, writer.format.exr_codec = "OPEN_EXR", "32", "ZIP"
    writer.file_slots.clear()
    for output in image.outputs:
        if output.enabled:
            writer.file_slots.new(os.path.basename(file) + " " + output.name + " ")
            tree.links.new(output, writer.inputs[-1])
    tree.links.new(image.outputs[0], tree.nodes.new("CompositorNodeComposite").inputs[0])
    bpy.ops.render.render()
"""


if __name__ == "__main__":
    unittest.main()
