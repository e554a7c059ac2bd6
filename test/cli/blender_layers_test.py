"""Blender finds each layer of an EXR by name, and its Cryptomatte node extracts mattes that equal the coverage in the file.
Usage: blender_layers_test.py PATH_OF_STROBE [unittest arguments]"""
import json
import os
import shutil
import struct
import subprocess
import sys
import tempfile
import unittest

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
sys.dont_write_bytecode = True  # do not write to the source tree
from exr import Exr  # noqa: E402

STROBE = os.path.abspath(sys.argv.pop(1)) if len(sys.argv) > 1 else os.environ.get("STROBE", "strobe")
BLENDER = shutil.which("blender")
WIDTH, HEIGHT = 24, 16
LAYERS = "normal,albedo,depth,position,uv,motionvector,objectid,materialid,primitiveid,direct,indirect,lightgroups,samples,cryptoobject,cryptomaterial"

SCENE = f"""TransformTimes 0 1
Film "image" "integer xresolution" {WIDTH} "integer yresolution" {HEIGHT}
Sampler "sobol" "integer pixelsamples" 64
Camera "perspective" "float fov" 60
WorldBegin
LightSource "infinite" "string group" "sky"
Translate -.6 0 4
MakeNamedMaterial "blue" "string type" "matte" "rgb Kd" [.1 .2 .8]
NamedMaterial "blue"
AttributeBegin
ActiveTransform EndTime
Translate 1.2 0 0
ActiveTransform All
Shape "sphere" "float radius" .8 "string name" "runner"
AttributeEnd
Translate 0 -1.6 3
Shape "sphere" "float radius" 1.4
"""

# Script for Blender.
INSIDE = """
import bpy, json, sys
picture, matte, answer = sys.argv[sys.argv.index("--") + 1:]
scene = bpy.context.scene
scene.use_nodes = True
tree = scene.node_tree
tree.nodes.clear()
image = bpy.data.images.load(picture)
node = tree.nodes.new("CompositorNodeImage")
node.image = image
outputs = [o.name for o in node.outputs if o.enabled]
crypto = tree.nodes.new("CompositorNodeCryptomatteV2")
crypto.source, crypto.image = "IMAGE", image
crypto.layer_name = "CryptoObject"
crypto.matte_id = "runner"
out = tree.nodes.new("CompositorNodeComposite")
tree.links.new(crypto.outputs["Matte"], out.inputs[0])
render = scene.render
render.resolution_x, render.resolution_y, render.resolution_percentage = %d, %d, 100
render.image_settings.file_format, render.image_settings.color_depth = "OPEN_EXR", "32"
render.image_settings.color_mode = "BW"
render.filepath = matte
scene.view_settings.view_transform = "Raw"
bpy.ops.render.render(write_still=True)
json.dump({"outputs": outputs, "entries": [e.name for e in crypto.entries]}, open(answer, "w"))
""" % (WIDTH, HEIGHT)


@unittest.skipUnless(BLENDER, "Blender is not installed")
class BlenderOpensLayers(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        folder = tempfile.TemporaryDirectory(prefix="strobe-blender-")
        cls.addClassCleanup(folder.cleanup)
        path = {name: os.path.join(folder.name, name) for name in ("s.scene", "p.exr", "matte.exr", "answer.json", "inside.py")}
        for name, text in (("s.scene", SCENE), ("inside.py", INSIDE)):
            with open(path[name], "w") as file:
                file.write(text)
        subprocess.run([STROBE, path["s.scene"], "--quiet", "-o", path["p.exr"], "--aov", LAYERS], check=True, timeout=60)
        result = subprocess.run([BLENDER, "-b", "-noaudio", "--python-exit-code", "1", "--python", path["inside.py"], "--",
                                 path["p.exr"], path["matte.exr"], path["answer.json"]],
                                capture_output=True, timeout=120)
        assert result.returncode == 0, result.stdout.decode() + result.stderr.decode()
        with open(path["answer.json"]) as file:
            cls.answer = json.load(file)
        cls.picture = Exr(path["p.exr"])
        cls.matte = Exr(path["matte.exr"])

    def test_blender_finds_every_layer_by_name(self):
        crypto = {f"Crypto{kind}0{i}" for kind in ("Object", "Material") for i in range(3)}
        plain = set(LAYERS.split(",")) - {"cryptoobject", "cryptomaterial", "lightgroups"}
        self.assertEqual(set(self.answer["outputs"]) - {"Alpha"}, {"Combined", "light_sky"} | plain | crypto)

    def test_mattes_equal_the_coverage(self):
        self.assertEqual(self.answer["entries"], ["runner"])
        attribute, = (v for k, v in self.picture.attributes.items() if k == "cryptomatte/3ae39a5/manifest")
        runner, = struct.unpack("<f", struct.pack("<I", int(json.loads(attribute)["runner"], 16)))
        partial = 0
        red, = (c for c in self.matte.channels if c.split(".")[-1] == "R")
        for y in range(HEIGHT):
            for x in range(WIDTH):
                coverage = sum(self.picture.value(f"CryptoObject0{i}.{b}", x, y) for i in range(3) for a, b in ("RG", "BA")
                               if self.picture.value(f"CryptoObject0{i}.{a}", x, y) == runner)
                self.assertAlmostEqual(self.matte.value(red, x, y), coverage, delta=1e-6)
                partial += 0 < coverage < 1
        self.assertGreater(partial, 40, "motion blur gives pixels with partial coverage")


if __name__ == "__main__":
    unittest.main()
