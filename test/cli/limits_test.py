"""Resource limits and invalid samples: --max-memory, nesting depths, --strict, replays, --clamp.
Usage: limits_test.py PATH_OF_STROBE [unittest arguments]"""
import gzip
import os
import re
import resource
import subprocess
import sys
import unittest

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
sys.dont_write_bytecode = True
from cli_test import OK, OPTIONS, SCENE, STROBE, USAGE, WORLD, CliTest  # noqa: E402
from exr import Exr  # noqa: E402

INVALID = 6
TRIANGLE = '"point P" [-1 -1 0 1 -1 0 0 1 0] "integer indices" [0 1 2]'
# A visible light whose radiance exceeds the range of the film sums.
GLARE = OPTIONS + WORLD.replace("[20 20 20]", "[1e30 1e30 1e30]").replace("Translate 2 3 1", "Translate .5 .5 3")


class LimitsTest(CliTest):
    def scene(self, world, options=OPTIONS):
        self.write("s.scene", options + "WorldBegin\n" + world)

    def refused(self, *arguments, code=SCENE):
        """Renders a scene that must fail, with less than 600 MB resident. Returns the text on standard error."""
        script = ("import resource, subprocess, sys; r = subprocess.run(sys.argv[1:]); "
                  "print(resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss); sys.exit(r.returncode)")
        result = subprocess.run([sys.executable, "-c", script, STROBE, "s.scene", "-o", "o.exr", *arguments], cwd=self.folder,
                                capture_output=True, timeout=60)
        stderr = result.stderr.decode()
        self.assertEqual(result.returncode, code, stderr)
        self.assertLess(int(result.stdout.split()[-1]) * 1024, 600e6, "resident bytes")
        return stderr

    def test_memory_of_subdivision(self):
        self.scene(f'Shape "loopsubdiv" "integer nlevels" 8 {TRIANGLE}\n' * 40)
        self.run_strobe("s.scene", "-o", "o.exr", "--spp", "1", "--max-memory", "4G")
        self.scene('Shape "loopsubdiv" "integer nlevels" 8 "point P" [' + "-1 -1 0 1 -1 0 0 1 0 " * 300 + '] "integer indices" [' +
                   " ".join(map(str, range(900))) + "]\n")
        stderr = self.refused("--max-memory", "512M")
        self.assertRegex(stderr, r"s\.scene:8:\d+: error: subdividing 300 triangles 8 times would take 4\.4 GB more, with \d+\.\d MB "
                               r"in use: --max-memory allows 536\.9 MB; use a smaller \"nlevels\"")

    def test_memory_of_files(self):
        self.write("zeros.ply.gz", gzip.compress(b"\0" * 300_000_000, 1))
        self.scene('Shape "plymesh" "string filename" "zeros.ply.gz"\n')
        self.assertRegex(self.refused("--max-memory", "256M"), 'the mesh ".*zeros.ply.gz" would take .* more, .*; simplify it')
        self.write("zeros.scene.gz", gzip.compress(b" " * 300_000_000, 1))
        self.scene('Include "zeros.scene.gz"\n')
        self.assertRegex(self.refused("--max-memory", "256M"), 'the text of ".*zeros.scene.gz" would take')

    def test_memory_of_images(self):
        self.scene(f'Shape "trianglemesh" {TRIANGLE}\n')
        self.assertIn("a picture of 30000x30000 pixels would take 90.0 GB more",
                      self.refused("--max-memory", "1G", "--resolution", "30000x30000"))
        if os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE") < 300e9:
            self.assertRegex(self.refused("--resolution", "65536x65536"), r"pixels would take 429.5 GB more, .*: this machine has [\d.]+ GB; ")
        # An image whose header has a large resolution.
        self.write("large.hdr", b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 20000 +X 20000\n")
        self.scene('LightSource "infinite" "string mapname" "large.hdr"\n')
        self.assertRegex(self.refused("--max-memory", "1G"), "the image .*large.hdr would take 9.6 GB more, .*; reduce its resolution")

    def test_memory_of_many_small_objects(self):
        """Allocations that ResourcePolicy does not estimate fail by the limit of the system."""
        self.write("many.scene.gz", gzip.compress(b"AttributeBegin Shape \"sphere\" AttributeEnd\n" * 1_000_000, 1))
        self.scene('Include "many.scene.gz"\n')
        self.assertRegex(self.refused("--max-memory", "256M"),
                         "out of memory: the scene and its render take more than the 268.4 MB of --max-memory|would take")

    def test_instances_are_counted_before_they_are_made(self):
        for depth, message in ((40, "nested objects make more than 67108864 instances"), (27, "67108864 instances would take 107.4 GB")):
            levels = 'ObjectBegin "o0" Shape "sphere" ObjectEnd\n' + "".join(
                f'ObjectBegin "o{i}"\n' + f'ObjectInstance "o{i - 1}"\n' * 2 + "ObjectEnd\n" for i in range(1, depth))
            self.scene(levels + f'ObjectInstance "o{depth - 1}"\n')
            self.assertIn("error: " + message, self.refused("--max-memory", "1G"))

    def test_instances_of_instances(self):
        levels = 'ObjectBegin "o0" Shape "sphere" ObjectEnd\n'
        for i in range(30):
            levels += f'ObjectBegin "o{i + 1}"\n' + f'ObjectInstance "o{i}" Translate .1 0 0\n' * 10 + "ObjectEnd\n"
        self.scene(levels + 'ObjectInstance "o30"\n')
        self.assertRegex(self.refused("--max-memory", "512M"), r"s\.scene:\d+:3?\d: error: nested objects make more than 67108864 instances")
        chain = 'ObjectBegin "o0" Shape "sphere" ObjectEnd\n' + "".join(
            f'ObjectBegin "o{i + 1}" ObjectInstance "o{i}" ObjectEnd\n' for i in range(100_000))
        self.scene(chain + 'ObjectInstance "o100000"\n')
        self.assertIn("objects are nested more than 64 deep", self.refused())

    def test_nesting_depths(self):
        self.scene("AttributeBegin TransformBegin " * 100_000)
        self.assertIn("blocks are nested more than 4096 deep", self.refused())
        self.write("s.scene", "TransformTimes " + " ".join(map(str, range(5000))))
        self.assertIn("TransformTimes has more than 4096 numbers", self.refused())

    def test_memory_sizes_have_units(self):
        self.scene(f'Shape "trianglemesh" {TRIANGLE}\n')
        for size in ("1.5G", "800M", "2 GB", "1gib", "600000K", "536870912"):
            self.run_strobe("s.scene", "-o", "o.exr", "--spp", "1", "--max-memory", size)
        for size in ("127M", "0", "-1G", "nan", "G", "1X", "1e9", "4GG", "9999999T", "much"):
            stderr = self.run_strobe("s.scene", "-o", "o.exr", "--max-memory", size, code=USAGE).err
            self.assertIn("--max-memory: takes a size such as 4G or 800M, at least 128M", stderr)

    # Invalid and clamped samples

    def replays(self, stderr):
        return [line.split("replay with ")[1].split() for line in stderr.splitlines() if "replay with " in line]

    def assertReplays(self, stderr, *settings):
        replays = self.replays(stderr)
        self.assertGreater(len(replays), 3)
        for words in replays[::3]:
            out = self.run_strobe("s.scene", *settings, *words).out
            self.assertGreater(max(map(float, re.search(r"sample \d+: (.*)", out)[1].split())), 2.8e14, words)

    def test_strict(self):
        self.write("s.scene", GLARE)
        stderr = self.run_strobe("s.scene", "-o", "o.exr").err
        count = int(re.search(r"(\d+) samples were NaN, infinite or beyond", stderr)[1])
        self.assertGreater(count, 10)
        self.assertEqual(int(Exr(self.path("o.exr")).attributes["strobe:invalidSamples"]), count)
        self.assertReplays(stderr)
        stderr = self.run_strobe("s.scene", "-o", "o.exr", "--strict", "--quiet", code=INVALID).err
        self.assertIn(f"{count} samples were NaN", stderr)
        x, y, s = re.search(r"--pixel (\d+),(\d+) --sample (\d+)", self.run_strobe("s.scene", "-o", "o.exr", "--strict", code=INVALID).err).groups()
        self.run_strobe("s.scene", "--pixel", f"{x},{y}", "--sample", s, "--strict", code=INVALID)
        stderr = self.run_strobe("s.scene", "--pixel", f"{x},{y}").err
        self.assertIn("samples were NaN, infinite or beyond", stderr)
        self.assertIn(f"replay with --pixel {x},{y} --sample ", stderr)
        self.run_strobe("s.scene", "-o", "o.part", "--strict", code=INVALID)
        self.run_strobe("merge", "o.part", "-o", "m.exr")
        self.run_strobe("merge", "o.part", "-o", "m.exr", "--strict", code=INVALID)
        self.assertEqual(int(Exr(self.path("m.exr")).attributes["strobe:invalidSamples"]), count)
        self.scene(f'LightSource "infinite"\nShape "trianglemesh" {TRIANGLE}\n')
        self.run_strobe("s.scene", "-o", "o.exr", "--strict")

    def test_replay_options_name_the_pass_and_the_frame(self):
        self.write("s.scene", GLARE)
        self.assertReplays(self.run_strobe("s.scene", "-o", "o.exr", "--spp", "4", "--noise-target", "1e-3", "--time-limit", "3").err,
                           "--spp", "4")
        self.assertReplays(self.run_strobe("s.scene", "-o", "o.exr", "--integrator", "msaa-cache", "--frames", "3:3").err,
                           "--integrator", "msaa-cache")

    def test_invalid_samples_of_the_checkpoint_are_counted(self):
        self.write("s.scene", GLARE)
        self.run_strobe("s.scene", "-o", "whole.exr", "--spp", "256")
        process = subprocess.Popen([STROBE, "s.scene", "--spp", "256", "--tile", "1", "--threads", "1", "--checkpoint", "0.01", "-o", "o.exr",
                                    "--quiet"], cwd=self.folder)
        while not os.path.exists(self.path("o.exr.checkpoint")) and process.poll() is None:
            pass
        process.kill()
        process.wait()
        self.run_strobe("s.scene", "--spp", "256", "--checkpoint", "9", "--resume", "-o", "o.exr", "--strict", code=INVALID)
        self.assertEqual(*(Exr(self.path(name)).attributes["strobe:invalidSamples"] for name in ("o.exr", "whole.exr")))

    def test_clamp(self):
        plain = self.render()
        self.assertNotIn("strobe:bias:clamp", plain.attributes)
        same = self.render("--clamp", "1000")
        self.assertEqual(same.rows, plain.rows)
        self.assertEqual(same.attributes["strobe:bias:clamp"], 1000)
        self.assertNotIn("scaled down", self.run_strobe("s.scene", "-o", "o.exr", "--clamp", "1000").err)
        stderr = self.run_strobe("s.scene", "-o", "o.exr", "--clamp", "0.1", "--aov", "direct,indirect").err
        self.assertRegex(stderr, r"--clamp 0.1: [1-9]\d* samples were scaled down; the image is biased")
        dark = Exr(self.path("o.exr"))
        x0, y0, x1, y1 = dark.window
        for y in range(y0, y1 + 1):
            for x in range(x0, x1 + 1):
                self.assertLessEqual(max(dark.pixel(x, y)), 0.1000001)
                self.assertAlmostEqual(dark.value("R", x, y), dark.value("direct.R", x, y) + dark.value("indirect.R", x, y), 6)
                if max(plain.pixel(x, y)) > 0:  # the hue does not change
                    ratio = dark.pixel(x, y)[0] / plain.pixel(x, y)[0]
                    self.assertLess(ratio, 1.000001)
        self.write("s.scene", GLARE)  # invalid samples are not clamped
        self.assertEqual(self.stats("--clamp", "1e20", "--spp", "1")["invalidSamples"], self.stats("--spp", "1")["invalidSamples"])
        self.run_strobe("s.scene", "--clamp", "0", code=USAGE)


if __name__ == "__main__":
    unittest.main()
