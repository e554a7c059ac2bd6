"""Renders that are watched, cut short, or go on until they are good enough, from outside.
Usage: progressive_test.py PATH_OF_STROBE [unittest arguments]"""
import csv
import json
import os
import random
import signal
import socket
import subprocess
import sys
import tempfile
import time
import unittest

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
sys.dont_write_bytecode = True  # the source tree stays clean
from exr import Exr  # noqa: E402
from tev_server import TevServer  # noqa: E402

STROBE = os.path.abspath(sys.argv.pop(1)) if len(sys.argv) > 1 else os.environ.get("STROBE", "strobe")

SCENE = """TransformTimes 0 1
Film "image" "integer xresolution" 150 "integer yresolution" 100
Sampler "sobol" "integer pixelsamples" 8
Integrator "directlighting"
Camera "perspective" "float fov" 60
WorldBegin
LightSource "infinite" "rgb L" [.2 .3 .4]
AttributeBegin
  Translate 2 3 1
  AreaLightSource "diffuse" "rgb L" [20 20 20]
  Shape "sphere" "float radius" .5
AttributeEnd
Material "matte" "rgb Kd" [.6 .5 .4]
Translate -.6 0 4
ActiveTransform EndTime
Translate 1.2 0 0
ActiveTransform All
Shape "sphere" "float radius" .8
"""


class ProgressiveTest(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory(prefix="strobe-progressive-")
        self.addCleanup(folder.cleanup)
        self.folder = folder.name
        with open(self.path("s.scene"), "w", encoding="utf-8") as file:
            file.write(SCENE)

    def path(self, name):
        return os.path.join(self.folder, name)

    def run_strobe(self, *args, code=0):
        """What it says on standard error, and how long it takes."""
        start = time.monotonic()
        done = subprocess.run([STROBE, "s.scene", *args], cwd=self.folder, capture_output=True, text=True, timeout=60)
        self.assertEqual(done.returncode, code, done.stderr)
        return done.stderr, time.monotonic() - start

    def server(self, **how):
        server = TevServer(**how)
        self.addCleanup(server.close)
        return server

    def pixels(self, name):
        """Row by row."""
        return list(Exr(self.path(name)).pixels().values())

    # A viewer

    def test_viewer_gets_the_picture(self):
        server = self.server()
        said, _ = self.run_strobe("-o", "o.exr", "--display-server", server.address)
        self.assertNotIn("viewer", said)
        server.thread.join(0.2)
        self.assertEqual(server.errors, [])
        self.assertEqual(list(server.images), ["o.exr"])
        image = server.images["o.exr"]
        self.assertEqual((image.width, image.height, image.channels), (150, 100, ["R", "G", "B"]))
        self.assertEqual(image.pixels(), self.pixels("o.exr"))

    def test_viewer_gets_a_crop_and_passes(self):
        server = self.server()
        self.run_strobe("-o", "o.exr", "--crop", ".3", ".9", ".2", ".8", "--noise-target", "10", "--spp", "1", "--display-server",
                        server.address)
        server.thread.join(0.2)
        self.assertEqual(server.errors, [])
        self.assertEqual(server.images["o.exr"].pixels(), self.pixels("o.exr"))

    def test_viewer_is_not_there(self):
        with socket.create_server(("127.0.0.1", 0)) as other:
            address = "127.0.0.1:%d" % other.getsockname()[1]
        said, seconds = self.run_strobe("-o", "o.exr", "--display-server", address)
        self.assertIn("no picture for the viewer at %s: Connection refused" % address, said)
        self.assertLess(seconds, 5)
        self.assertTrue(os.path.exists(self.path("o.exr")))

    def test_viewer_stops_reading(self):
        # Its window of the connection fills up; the render goes on and ends.
        server = self.server(stop_after=1)
        said, seconds = self.run_strobe("-o", "o.exr", "--resolution", "900x600", "--spp", "1", "--display-server", server.address)
        self.assertEqual(server.messages, 1)
        self.assertLess(seconds, 15)
        self.assertTrue(os.path.exists(self.path("o.exr")), said)

    def test_viewer_dies(self):
        server = self.server(die_after=2)
        said, seconds = self.run_strobe("-o", "o.exr", "--time-limit", "1", "--display-server", server.address)
        self.assertIn("the connection was lost", said)
        self.assertEqual(said.count("no picture for the viewer"), 1)
        self.assertLess(seconds, 5)
        self.assertTrue(os.path.exists(self.path("o.exr")))

    def test_viewer_comes_back(self):
        server = self.server(die_after=1)
        self.run_strobe("-o", "o.exr", "--time-limit", "5", "--crop", "0", ".3", "0", ".3", "--display-server", server.address)
        server.thread.join(0.2)
        self.assertEqual(server.connections, 2)
        self.assertNotIn(None, server.images["o.exr"].pixels()[0])

    def test_viewer_addresses(self):
        for address in ("nonsense:port", ":14158", "host:0", "host:99999", "[::1", ""):
            said, _ = self.run_strobe("--display-server", address, code=1)
            self.assertIn("--display-server", said)

    # Time and noise

    def test_time_limit(self):
        for integrator in ("supersample", "msaa-cache"):
            _, seconds = self.run_strobe("--integrator", integrator, "--time-limit", "2", "-o", "o.exr", "--stats", "s.json")
            self.assertLess(seconds, 2.6)
            with open(self.path("s.json"), encoding="utf-8") as file:
                stats = json.load(file)
            self.assertGreater(stats["passes"], 2)
            exr = Exr(self.path("o.exr"))
            self.assertEqual(exr.attributes["strobe:samplesPerPixel"], stats["settings"]["samplesPerPixel"])
            self.assertNotIn("strobe:unfinished", exr.attributes)
            self.assertEqual(stats["pixels"], 150 * 100)

    def test_time_limit_too_short(self):
        said, _ = self.run_strobe("--time-limit", "0.001", "-o", "o.exr")
        self.assertIn("--time-limit 0.001: a single pass took", said)
        self.assertEqual(Exr(self.path("o.exr")).attributes["strobe:samplesPerPixel"], 1)

    def test_noise_target(self):
        said, _ = self.run_strobe("--noise-target", "0.5", "--spp", "4", "-o", "o.exr")
        attributes = Exr(self.path("o.exr")).attributes
        self.assertLessEqual(attributes["strobe:noise"], 0.5)
        self.assertEqual(attributes["strobe:samplesPerPixel"], 4 * attributes["strobe:passes"])
        self.assertRegex(said, r"noise 0\.\d+ after \d+ passes\n")

    def test_noise_target_out_of_reach(self):
        said, seconds = self.run_strobe("--noise-target", "1e-6", "--time-limit", "1", "--spp", "1", "-o", "o.exr")
        self.assertLess(seconds, 1.6)
        self.assertIn("the target is not met", said)
        self.assertGreater(Exr(self.path("o.exr")).attributes["strobe:noise"], 1e-6)

    # A reference

    def test_reference(self):
        self.run_strobe("--spp", "64", "-o", "truth.exr", "--quiet")
        for integrator in ("supersample", "msaa"):
            said, _ = self.run_strobe("--integrator", integrator, "--reference", "truth.exr", "--curve", "c.csv", "-o", "o.exr", "--seed", "3")
            with open(self.path("c.csv"), encoding="utf-8", newline="") as file:
                rows = list(csv.DictReader(file))
            self.assertEqual([int(r["samples"]) for r in rows], [1, 2, 4, 8])
            self.assertLess(float(rows[-1]["rmse"]), float(rows[0]["rmse"]))
            for r in rows:
                self.assertIn("%d samples per pixel: RMSE %.5f" % (int(r["samples"]), float(r["rmse"])), said)
            self.run_strobe("--integrator", integrator, "-o", "plain.exr", "--seed", "3")
            self.assertEqual(self.pixels("o.exr"), self.pixels("plain.exr"), "watching changes nothing")
            off = [min(max(a, 0), 1) - min(max(b, 0), 1) for p, q in zip(self.pixels("o.exr"), self.pixels("truth.exr"))
                   for a, b in zip(p, q)]
            self.assertAlmostEqual(float(rows[-1]["rmse"]), (sum(x * x for x in off) / len(off)) ** 0.5, 6)

    def test_reference_of_another_size(self):
        self.run_strobe("--resolution", "40x30", "-o", "truth.exr", "--quiet")
        said, _ = self.run_strobe("--reference", "truth.exr", "-o", "o.exr", code=1)
        self.assertIn("--reference truth.exr: it has 40x30 pixels, the picture 150x100", said)
        said, _ = self.run_strobe("--curve", "c.csv", code=1)
        self.assertIn("--curve: needs --reference", said)

    def test_what_does_not_go_together(self):
        for option in (["--time-limit", "1"], ["--noise-target", "1"]):
            for other in (["--pixel", "1,1"], ["--samples", "s.csv"]):
                said, _ = self.run_strobe(*option, *other, code=1)
                self.assertIn("%s: does not go with %s" % (other[0], option[0]), said)

    # The picture so far

    def test_partial(self):
        process = subprocess.Popen([STROBE, "s.scene", "--spp", "65536", "--partial", "0.3", "-o", "o.exr", "-o", "o.png", "--quiet"],
                                   cwd=self.folder)
        try:
            limit = time.monotonic() + 30
            seen = set()
            while len(seen) < 2 and time.monotonic() < limit:
                if os.path.exists(self.path("o.exr")) and os.path.exists(self.path("o.png")):
                    exr = Exr(self.path("o.exr"))  # whole at any time
                    self.assertEqual(exr.attributes["strobe:unfinished"], 1)
                    seen.add(os.stat(self.path("o.exr")).st_ino)
                time.sleep(0.05)
            self.assertGreaterEqual(len(seen), 2, "it is written again and again")
            self.assertIsNone(process.poll())
        finally:
            process.kill()
            process.wait()

    def test_partial_does_not_change_the_picture(self):
        self.run_strobe("--partial", "0.01", "-o", "a.exr")
        self.run_strobe("-o", "b.exr")
        self.assertEqual(self.pixels("a.exr"), self.pixels("b.exr"))
        self.assertNotIn("strobe:unfinished", Exr(self.path("a.exr")).attributes)

    # Parts

    def merged(self, parts, out="m.exr", code=0):
        done = subprocess.run([STROBE, "merge", *parts, "-o", out], cwd=self.folder, capture_output=True, text=True, timeout=60)
        self.assertEqual(done.returncode, code, done.stderr)
        return done.stderr

    def test_random_splits_merge_to_the_whole(self):
        random_numbers = random.Random(7)
        small = ["--resolution", "30x20", "--spp", "16", "--quiet"]
        for integrator in (["supersample"], ["msaa"], ["msaa", "-D", "shades=2"], ["msaa-cache"], ["indirect-cache", "--shading", "path"]):
            settings = ["--integrator", *integrator, *small]
            self.run_strobe(*settings, "-o", "whole.exr")
            x, y = random_numbers.randrange(1, 30), random_numbers.randrange(1, 20)
            names = []
            for bounds in ((0, x, 0, 20), (x, 30, 0, y), (x, 30, y, 20)):
                cut = random_numbers.randrange(1, 16)
                for slice in ((0, cut), (cut, 16)):
                    names.append("p%d.part" % len(names))
                    self.run_strobe(*settings, "--pixel-bounds", *map(str, bounds), "--sample-range", "%d:%d" % slice,
                                    "--threads", str(random_numbers.randrange(1, 4)), "-o", names[-1])
            random_numbers.shuffle(names)
            self.merged(names[:3], "some.part")  # merging may itself be split
            said = self.merged([*names[3:], "some.part"])
            self.assertNotIn("missing", said)
            self.assertEqual(self.pixels("m.exr"), self.pixels("whole.exr"), integrator)
            attributes = Exr(self.path("m.exr")).attributes
            self.assertEqual(attributes["strobe:integrator"], integrator[0])
            self.assertNotIn("strobe:unfinished", attributes)

    def test_parts_that_do_not_belong_together(self):
        small = ["--resolution", "30x20", "--quiet"]
        self.run_strobe(*small, "--sample-range", "0:4", "-o", "a.part")
        for change, reason in ((["--seed", "1"], "seed is 1, not 0"), (["--integrator", "msaa"], "integrator is msaa, not supersample"),
                               (["--spp", "16"], "pixels have 16 samples, not 8"), (["--resolution", "31x20"], "the frame has 31x20 pixels, not 30x20"),
                               (["-D", "maxdepth=2"], "shading:maxdepth is 2, not 5")):
            settings = [*small, "--sample-range", "4:8", *change]
            if change[0] == "--resolution":
                settings = [*change, "--quiet", "--sample-range", "4:8"]
            self.run_strobe(*settings, "-o", "b.part")
            self.assertIn("b.part: it is a part of another render: " + reason, self.merged(["a.part", "b.part"], code=1))
        with open(self.path("s.scene"), "a", encoding="utf-8") as file:
            file.write("# another\n")
        self.run_strobe(*small, "--sample-range", "4:8", "-o", "b.part")
        self.assertRegex(self.merged(["a.part", "b.part"], code=1), "it is a part of another render: scene is [0-9a-f]+, not [0-9a-f]+")
        self.assertFalse(os.path.exists(self.path("m.exr")))

    def test_parts_that_overlap_or_lack(self):
        small = ["--resolution", "30x20", "--quiet"]
        self.run_strobe(*small, "--sample-range", "0:5", "-o", "a.part")
        self.run_strobe(*small, "--sample-range", "4:8", "--pixel-bounds", "0", "10", "0", "20", "-o", "b.part")
        self.assertIn("b.part: samples 4:8 of pixels 0 10 0 20 are, in part, in another file too", self.merged(["a.part", "b.part"], code=1))
        self.assertIn("1800 samples of the pixels from 0,0 to 29,19 are missing", self.merged(["a.part"]))
        self.assertEqual(Exr(self.path("m.exr")).attributes["strobe:unfinished"], 1)

    def test_damaged_parts(self):
        self.run_strobe("--resolution", "30x20", "--quiet", "-o", "a.part")
        with open(self.path("a.part"), "rb") as file:
            good = file.read()
        for bytes, reason in ((good[:-1], "it is cut short or too long"), (good + b"x", "it is cut short or too long"),
                              (b"hello", "it is not a part of a render"), (good[:60], "it is damaged"),
                              (good[:-9] + b"x" + good[-8:], "it is damaged"),
                              (good.replace(b'"window":[0,30,0,20]', b'"window":[0,30,0,99]', 1), "it is damaged")):
            with open(self.path("b.part"), "wb") as file:
                file.write(bytes)
            self.assertIn("b.part: " + reason, self.merged(["b.part"], code=1))
        self.assertIn("none.part: cannot read it: No such file", self.merged(["none.part"], code=1))

    def test_slices_that_cannot_be(self):
        for args, reason in ((["--sample-range", "8:9"], "samples 8:9: a pixel has 8"), (["--sample-range", "-1:2"], "takes first:end"),
                             (["--pixel-bounds", "0", "200", "0", "9"], "the frame has 150x100 pixels"),
                             (["--sample-range", "0:4", "--integrator", "msaa-cache", "-D", "scope=tile"], "there are no slices of them"),
                             (["--sample-range", "0:4", "--noise-target", "1"], "--sample-range: does not go with --noise-target"),
                             (["--sample-range", "0:4", "--aov", "shades"], "--aov: does not go with --sample-range")):
            said, _ = self.run_strobe(*args, "-o", "o.exr", code=1)
            self.assertIn(reason, said)

    # Checkpoints

    def start(self, *args):
        return subprocess.Popen([STROBE, "s.scene", *args, "--quiet"], cwd=self.folder)

    def killed_and_resumed(self, settings, kills, seed):
        """Renders with checkpoints, killed at random moments; how often a render went on from one."""
        delays = random.Random(seed)
        resumed, tile = 0, 8
        for _ in range(kills):
            if os.path.exists(self.path("o.exr.checkpoint")):
                resumed += 1
            process = self.start(*settings, "--checkpoint", "0.01", "--resume", "--tile", str(tile), "--threads",
                                 str(1 + resumed % 3), "-o", "o.exr")
            time.sleep(delays.uniform(0.05, 0.35))
            process.kill()
            process.wait()
            tile = 16 if tile == 8 else 8
        self.run_strobe(*settings, "--checkpoint", "0.01", "--resume", "-o", "o.exr")
        self.assertFalse(os.path.exists(self.path("o.exr.checkpoint")))
        return resumed

    def test_kills_lose_nothing(self):
        for number, integrator in enumerate((["supersample"], ["msaa"], ["msaa-cache"], ["indirect-cache", "--shading", "path"])):
            settings = ["--integrator", *integrator, "--spp", "64", "--resolution", "90x60"]
            self.run_strobe(*settings, "-o", "whole.exr")
            resumed = self.killed_and_resumed(settings, 6, number)
            self.assertEqual(self.pixels("o.exr"), self.pixels("whole.exr"), integrator)
            self.assertGreater(resumed, 1)

    def test_signals(self):
        settings = ["--spp", "4096", "--checkpoint", "100", "-o", "o.exr"]
        process = self.start(*settings)
        time.sleep(0.7)
        process.send_signal(signal.SIGHUP)  # saves, and goes on
        limit = time.monotonic() + 20
        while not os.path.exists(self.path("o.exr.checkpoint")) and time.monotonic() < limit:
            time.sleep(0.05)
        self.assertTrue(os.path.exists(self.path("o.exr.checkpoint")))
        self.assertIsNone(process.poll())
        process.send_signal(signal.SIGTERM)
        self.assertEqual(process.wait(20), 5)
        self.assertEqual(Exr(self.path("o.exr")).attributes["strobe:unfinished"], 1)
        said, _ = self.run_strobe(*settings, code=1)
        self.assertIn("o.exr.checkpoint is there: --resume goes on from it; remove it to begin anew", said)
        for change, reason in ((["--seed", "3"], "it is a part of another render: seed is 0, not 3"),
                               (["--pixel-bounds", "0", "90", "0", "60"], "its pixels are 0 150 0 100, not 0 90 0 60"),
                               (["--sample-range", "0:9"], "it has samples 0:4096, not 0:9")):
            said, _ = self.run_strobe(*settings, *change, "--resume", code=1)
            self.assertIn("o.exr.checkpoint: " + reason, said)

    def test_second_interrupt_stops_at_once(self):
        process = self.start("--spp", "65536", "--checkpoint", "100", "-o", "o.exr", "--tile", "256")
        time.sleep(0.7)
        process.send_signal(signal.SIGINT)
        time.sleep(0.15)
        process.send_signal(signal.SIGINT)
        self.assertIn(process.wait(5), (5, 130))  # the first may have been enough

    def test_what_has_no_checkpoints(self):
        for args, reason in ((["--resume"], "--resume: needs --checkpoint"),
                             (["--checkpoint", "1", "--frames", "1:2"], "--frames: does not go with --checkpoint"),
                             (["--checkpoint", "1", "--time-limit", "1"], "--checkpoint: does not go with --time-limit"),
                             (["--checkpoint", "1", "--integrator", "msaa-cache", "-D", "scope=tile"], "which cannot be taken up again")):
            said, _ = self.run_strobe(*args, "-o", "o.exr", code=1)
            self.assertIn(reason, said)


if __name__ == "__main__":
    unittest.main()
