"""--sandbox: a scene reads no file outside of the given folders, and does not choose the output file.
Usage: sandbox_test.py PATH_OF_STROBE [unittest arguments]"""
import base64
import gzip
import json
import os
import struct
import sys
import unittest
import zlib

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
sys.dont_write_bytecode = True
from cli_test import OK, SCENE, USAGE, CliTest  # noqa: E402

OPTIONS = """Film "image" "integer xresolution" 4 "integer yresolution" 4
Sampler "sobol" "integer pixelsamples" 1
Camera "perspective" "float fov" 60
WorldBegin
LightSource "infinite" "rgb L" [1 1 1]
Translate 0 0 4
"""
SHAPE = 'Shape "sphere" "float radius" 1\n'
PLY = b"""ply
format ascii 1.0
element vertex 3
property float x
property float y
property float z
element face 1
property list uchar int vertex_indices
end_header
-1 -1 0
1 -1 0
0 1 0
3 0 1 2
"""
POSITIONS = struct.pack("<9f", -1, -1, 0, 1, -1, 0, 0, 1, 0)


def png():
    def chunk(kind, data):
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    return (b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", struct.pack(">IIBBBBB", 1, 1, 8, 2, 0, 0, 0)) +
            chunk(b"IDAT", zlib.compress(b"\0\x80\x80\x80")) + chunk(b"IEND", b""))


def gltf(buffer="", image=""):
    """Returns glTF of a triangle. Buffer and image are data URIs unless URIs are given."""
    data = "data:application/octet-stream;base64," + base64.b64encode(POSITIONS).decode()
    model = {"asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}], "nodes": [{"mesh": 0}],
             "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "material": 0}]}],
             "buffers": [{"byteLength": len(POSITIONS), "uri": buffer or data}],
             "bufferViews": [{"buffer": 0, "byteLength": len(POSITIONS)}],
             "accessors": [{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3", "min": [-1, -1, 0],
                            "max": [1, 1, 0]}],
             "materials": [{"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}], "textures": [{"source": 0}],
             "images": [{"uri": image or "data:image/png;base64," + base64.b64encode(png()).decode()}]}
    return json.dumps(model).encode()


# Kinds of files that a scene refers to: file name, content, and directives that refer to it as NAME.
KINDS = {
    "Include": ("part.scene", SHAPE.encode(), 'Include "NAME"'),
    "Include, packed": ("part.scene.gz", gzip.compress(SHAPE.encode()), 'Include "NAME"'),
    "Import": ("part.pbrt", SHAPE.encode(), 'Import "NAME"'),
    "Include of glTF": ("part.gltf", gltf(), 'Include "NAME"'),
    "glTF shape": ("shape.gltf", gltf(), 'Shape "gltf" "string filename" "NAME"'),
    "PLY": ("mesh.ply", PLY, 'Shape "plymesh" "string filename" "NAME"'),
    "PLY, packed": ("mesh.ply.gz", gzip.compress(PLY), 'Shape "plymesh" "string filename" "NAME"'),
    "texture": ("t.png", png(), 'Texture "t" "rgb" "imagemap" "string filename" "NAME"\n'
                'Material "matte" "texture Kd" "t"\n' + SHAPE),
    "BRDF": ("m.brdf", b"1 550 .1 .2 .3 .4 .5\n", 'Material "measured" "string filename" "NAME"\n' + SHAPE),
    "spectrum": ("k.spd", b"400 .5 700 .5\n", 'Material "matte" "spectrum Kd" "NAME"\n' + SHAPE),
    "environment": ("sky.png", png(), 'LightSource "infinite" "string mapname" "NAME"'),
    "light's image": ("l.png", png(), 'AreaLightSource "diffuse" "string filename" "NAME"\n'
                      'Shape "trianglemesh" "point P" [-1 -1 0 1 -1 0 0 1 0] "point2 uv" [0 0 1 0 0 1] '
                      '"integer indices" [0 1 2]'),
}
REFUSED = "it is outside the files and directories given to --sandbox"


class SandboxTest(CliTest):
    def setUp(self):
        super().setUp()
        for folder in ("job", "outside"):
            os.mkdir(self.path(folder))

    def scene(self, directives, name="job/room.scene"):
        self.write(name, OPTIONS + directives)
        return name

    def in_sandbox(self, scene, *arguments, code=OK):
        return self.run_strobe(scene, "-o", "picture.exr", "--sandbox", "job", *arguments, code=code)

    def assertRefused(self, scene, code=SCENE):
        result = self.in_sandbox(scene, code=code)
        self.assertIn(REFUSED, result.err)
        if code == SCENE:
            self.assertRegex(result.err, r"room\.scene:\d+:\d+: error: ")
        self.assertNotIn("picture.exr", self.names())

    def test_files_outside_are_not_read(self):
        os.symlink(self.path("outside"), self.path("job/folder"))
        for kind, (name, content, directives) in KINDS.items():
            self.write("outside/" + name, content)
            self.write("job/own-" + name, content)
            os.symlink(self.path("outside/" + name), self.path("job/link-" + name))
            ways = [f"../outside/{name}", self.path("outside/" + name), "link-" + name]
            if kind in ("PLY", "texture"):
                ways += ["folder/" + name, f"./folder/.//{name}", f"../job/../outside/{name}"]
            for way in ways:
                with self.subTest(kind=kind, way=way):
                    scene = self.scene(directives.replace("NAME", way))
                    self.assertRefused(scene)

    def test_files_inside_are_read(self):
        world = {"outside": "", "job": ""}
        for name, content, directives in KINDS.values():
            for folder in world:
                self.write(f"{folder}/{folder}-{name}", content)
                world[folder] += directives.replace("NAME", f"../{folder}/{folder}-{name}") + "\n"
        self.in_sandbox(self.scene(world["job"]))
        outside = self.scene(world["outside"])
        self.assertIn(REFUSED, self.in_sandbox(outside, code=SCENE).err)
        self.in_sandbox(outside, "--sandbox", "outside")
        self.in_sandbox(outside, *(word for kind in KINDS.values() for word in ("--sandbox", "outside/outside-" + kind[0])))
        self.run_strobe(outside, "-o", "plain.exr")

    def test_errors_do_not_reveal_whether_a_file_exists(self):
        for name in ("../outside/none.ply", "/none.ply", "../outside/../none.ply"):
            self.assertRefused(self.scene(f'Shape "plymesh" "string filename" "{name}"'))

    def test_folders_with_a_common_prefix_are_different(self):
        os.mkdir(self.path("job2"))
        self.write("job2/mesh.ply", PLY)
        self.assertRefused(self.scene('Shape "plymesh" "string filename" "../job2/mesh.ply"'))

    def test_strobe_scenes_variable_is_restricted(self):
        self.write("outside/mesh.ply", PLY)
        scene = self.scene('Shape "plymesh" "string filename" "$STROBE_SCENES/mesh.ply"')
        os.environ["STROBE_SCENES"] = self.path("outside")
        self.addCleanup(os.environ.pop, "STROBE_SCENES")
        self.assertRefused(scene)
        self.in_sandbox(scene, "--sandbox", "outside")

    def test_files_of_gltf_are_restricted(self):
        for name, content in (("o.bin", POSITIONS), ("o.png", png())):
            self.write("outside/" + name, content)
            os.symlink(self.path("outside/" + name), self.path("job/" + name))
        for document in (gltf(buffer="o.bin"), gltf(image="o.png")):
            self.write("job/model.gltf", document)
            scene = self.scene('Include "model.gltf"')
            self.assertRefused(scene)
            self.assertRefused("job/model.gltf", code=USAGE)
            self.run_strobe(scene, "-o", "plain.exr")
            self.in_sandbox(scene, "--sandbox", "outside")
            os.remove(self.path("picture.exr"))
        for uri in ("../outside/o.bin", "%2e%2e/outside/o.bin", self.path("outside/o.bin"), "file://" + self.path("outside/o.bin")):
            self.write("job/model.gltf", gltf(buffer=uri))
            self.in_sandbox(scene, "--sandbox", "outside", code=SCENE)

    def test_scene_file_itself_is_restricted(self):
        self.scene(SHAPE, "outside/room.scene")
        os.symlink(self.path("outside/room.scene"), self.path("job/linked.scene"))
        for scene in ("outside/room.scene", "job/linked.scene"):
            self.assertRefused(scene, code=USAGE)
        self.in_sandbox("job/linked.scene", "--sandbox", "outside/room.scene")
        self.assertIn("No such file", self.run_strobe("outside/room.scene", "--sandbox", "none", code=USAGE).err)

    def test_images_that_refer_to_other_files(self):
        """OpenImageIO passes unknown formats to FFmpeg, which follows lists of files, and expands patterns in names."""
        self.write("outside/o.png", png())
        os.symlink(self.path("outside/o.png"), self.path("job/frame.png"))
        texture = 'Texture "t" "rgb" "imagemap" "string filename" "NAME"\nMaterial "matte" "texture Kd" "t"\n' + SHAPE
        for name, reason in (("list.png", "Not a PNG file"), ("list.mp4", "--sandbox does not allow this image format"),
                             ("list", "--sandbox does not allow this image format")):
            self.write("job/" + name, "ffconcat version 1.0\nfile frame.png\n")
            self.assertIn(reason, self.in_sandbox(self.scene(texture.replace("NAME", name)), code=SCENE).err)
        self.write("job/t.<UDIM>.png", png())
        os.symlink(self.path("outside/o.png"), self.path("job/t.1001.png"))
        self.assertIn("--sandbox does not allow < in its name", self.in_sandbox(self.scene(texture.replace("NAME", "t.<UDIM>.png")), code=SCENE).err)

    def test_only_regular_files_are_read(self):
        os.mkfifo(self.path("job/pipe.spd"))
        scene = self.scene('Material "matte" "spectrum Kd" "pipe.spd"\n' + SHAPE)
        self.assertIn('pipe.spd" is not a regular file', self.in_sandbox(scene, code=SCENE).err)

    def test_output_name_of_the_scene_is_ignored(self):
        self.write("job/room.scene", OPTIONS.replace("4\nS", f'4 "string filename" "{self.path("outside/o.png")}"\nS', 1) + SHAPE)
        result = self.run_strobe("job/room.scene", "--sandbox", "job")
        self.assertIn("--sandbox: the output name in the scene", result.err)
        self.assertEqual(os.listdir(self.path("outside")), [])
        self.assertIn("room.exr", self.names())
        self.run_strobe("job/room.scene")
        self.assertEqual(os.listdir(self.path("outside")), ["o.png"])


if __name__ == "__main__":
    unittest.main()
