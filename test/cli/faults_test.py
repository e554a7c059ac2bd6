"""Injected failures of file calls: strobe does not crash, leaves no truncated file, and loses no rendered pixels.
Usage: faults_test.py PATH_OF_STROBE PATH_OF_THE_SHIM [unittest arguments]; STROBE_FAULTS: number of runs (20)"""
import os
import re
import struct
import subprocess
import sys
import unittest
import zlib

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
sys.dont_write_bytecode = True
if __name__ == "__main__":
    SHIM = os.path.abspath(sys.argv.pop(2))
    if not os.path.exists(SHIM):
        sys.exit(f"faults_test.py: {SHIM} does not exist; build strobe_faults first")
from cli_test import OPTIONS, STROBE, WORLD, CliTest  # noqa: E402
from exr import Exr  # noqa: E402

RUNS = int(os.environ.get("STROBE_FAULTS", "20"))
PLY = """ply
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


class FaultsTest(CliTest):
    def setUp(self):
        super().setUp()
        os.mkdir(self.path("disk"))
        os.mkdir(self.path("spare"))
        self.write("disk/mesh.ply", PLY)
        self.write("disk/s.scene", OPTIONS + WORLD + 'Shape "plymesh" "string filename" "mesh.ply"\n')
        self.log = self.path("faults.log")

    def faulty(self, seed, *arguments, every=12):
        """Runs strobe with failing calls for files in disk/. Returns the exit code and the text on standard error."""
        environment = {**os.environ, "LD_PRELOAD": SHIM, "FAULTS_DIR": self.path("disk"), "FAULTS_SEED": str(seed),
                       "FAULTS_EVERY": str(every), "FAULTS_LOG": self.log, "TMPDIR": self.path("spare")}
        result = subprocess.run([STROBE, *arguments], cwd=self.path("disk"), capture_output=True, timeout=60, env=environment)
        return result.returncode, result.stderr.decode()

    def pixels(self, name):
        picture = Exr(self.path(name))
        return picture.window, picture.rows

    def assertNoCrash(self, seed, code, stderr):
        self.assertIn(code, (0, 1, 2, 3), f"seed {seed}: {stderr}")
        self.assertEqual([name for name in os.listdir(self.path("disk")) if name.endswith(".tmp")], [], f"seed {seed}")

    def test_images_are_whole_or_absent(self):
        self.run_strobe("disk/s.scene", "--quiet", "-o", "good.exr", "-o", "good.png")
        good, good_png = self.pixels("good.exr"), self.read("good.png")
        self.run_strobe("disk/s.scene", "--quiet", "-o", "disk/p.exr", "--spp", "1")
        old = self.read("disk/p.exr")
        saved = codes = 0
        for seed in range(RUNS):
            with self.subTest(seed=seed):
                self.write("disk/p.exr", old)
                code, stderr = self.faulty(seed, "s.scene", "--quiet", "-o", "p.exr", "-o", "p.png")
                self.assertNoCrash(seed, code, stderr)
                if self.read("disk/p.exr") != old:
                    self.assertEqual(self.pixels("disk/p.exr"), good)
                elif code == 0:
                    self.fail("the image was not replaced")
                if os.path.exists(self.path("disk/p.png")):
                    self.assertEqual(self.png_pixels(self.read("disk/p.png")), self.png_pixels(good_png))
                    os.remove(self.path("disk/p.png"))
                for file in re.findall(r"SAVED INSTEAD: p\.exr is in (\S+)", stderr):
                    self.assertEqual(self.pixels(os.path.relpath(file, self.folder)), good)
                    saved += 1
                if code == 3 and "SAVED" not in stderr:  # nothing was rendered yet
                    self.assertRegex(stderr, "cannot write")
                codes += code != 0
        self.assertGreater(codes, RUNS // 10, "no call has failed")
        self.assertGreater(saved, 0)

    @staticmethod
    def png_pixels(data):
        """Returns the compressed pixels, without the metadata, which contain render times."""
        return b"".join(re.findall(rb"IDAT.*?(?=....(?:IDAT|IEND))", data, re.S))

    def test_renders_resume_after_failures(self):
        """Repeated runs with --resume finish, and give the image of an uninterrupted render."""
        settings = ["s.scene", "--quiet", "--spp", "256", "--tile", "4"]
        self.run_strobe("disk/s.scene", *settings[1:], "-o", "good.exr")
        good = self.pixels("good.exr")
        for seed in range(max(1, RUNS // 5)):
            for attempt in range(100):
                code, stderr = self.faulty(1000 * seed + 2 * attempt, *settings, "--checkpoint", "0.01", "--resume", "-o", "o.exr",
                                         every=40)
                self.assertNoCrash(seed, code, stderr)
                if code == 0:
                    break
            self.assertEqual(code, 0)
            self.assertEqual(self.pixels("disk/o.exr"), good)
            os.remove(self.path("disk/o.exr"))

    def test_merged_files_are_whole_or_absent(self):
        for name, samples in (("a.part", "0:5"), ("b.part", "5:16")):
            self.run_strobe("disk/s.scene", "--quiet", "--sample-range", samples, "-o", "disk/" + name)
        self.run_strobe("merge", "disk/a.part", "disk/b.part", "--quiet", "-o", "good.exr", "-o", "good.part")
        good, good_part = self.read("good.exr"), self.read("good.part")
        for seed in range(RUNS):
            with self.subTest(seed=seed):
                code, stderr = self.faulty(seed, "merge", "a.part", "b.part", "--quiet", "-o", "m.part", "-o", "m.exr", every=6)
                self.assertNoCrash(seed, code, stderr)
                for name, content in (("m.part", good_part), ("m.exr", good)):
                    if code == 0 or os.path.exists(self.path("disk/" + name)):
                        self.assertEqual(self.read("disk/" + name), content)
                        os.remove(self.path("disk/" + name))

    def test_checkpoint_is_saved_when_a_texture_cannot_be_read(self):
        """The error occurs while rendering, since texels are read on demand."""
        rows = b"".join(b"\0" + bytes((97 * x * y + x) & 255 for x in range(3 * 256)) for y in range(256))
        chunks = [struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data)) for kind, data in (
            (b"IHDR", struct.pack(">IIBBBBB", 256, 256, 8, 2, 0, 0, 0)), (b"IDAT", zlib.compress(rows)), (b"IEND", b""))]
        whole = b"\x89PNG\r\n\x1a\n" + b"".join(chunks)
        self.write("s.scene", 'Option "string conventions" "pbrt-v2"\n' + OPTIONS + WORLD.split("Material")[0] +
                   'Texture "t" "rgb" "imagemap" "string filename" "t.png"\nMaterial "matte" "texture Kd" "t"\nTranslate 0 -3 4\n'
                   'Shape "sphere" "float radius" 2\n')
        settings = ["s.scene", "--quiet", "--threads", "1", "--tile", "4", "--checkpoint", "100", "--resume", "-o", "o.exr"]
        self.write("t.png", whole[: len(whole) // 2])
        stderr = self.run_strobe(*settings, code=2).err
        self.assertRegex(stderr, r"s\.scene:\d+:\d+: error: cannot read the image t\.png")
        self.assertIn("o.exr.checkpoint", self.names())
        self.assertIn("cannot read the image t.png", self.run_strobe(*settings, code=2).err, "the checkpoint is whole")
        self.write("o.exr.checkpoint", self.read("o.exr.checkpoint")[:-1])
        self.assertIn("o.exr.checkpoint: it is truncated", self.run_strobe(*settings, code=1).err)

    def test_full_disk(self):
        """A file of at most 4 KB stands for a full disk."""
        command = 'ulimit -f 4; exec "$0" disk/s.scene --quiet --spp 1 --resolution 100x100 -o picture.exr'
        done = subprocess.run(["bash", "-c", command, STROBE], cwd=self.folder, capture_output=True, text=True)
        self.assertEqual(done.returncode, 3, done.stderr)
        self.assertIn("error: cannot write picture.exr: File too large", done.stderr)
        self.assertFalse([name for name in self.names() if "picture" in name])


if __name__ == "__main__":
    unittest.main()
