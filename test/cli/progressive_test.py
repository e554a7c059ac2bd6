"""Renders that are watched, cut short, or go on until they are good enough, from outside.
Usage: progressive_test.py PATH_OF_STROBE [unittest arguments]"""
import csv
import json
import os
import signal
import socket
import subprocess
import sys
import time
import unittest

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
sys.dont_write_bytecode = True  # the source tree stays clean
from exr import Exr  # noqa: E402
from scene_case import STROBE, SceneTest  # noqa: E402
from tev_server import TevServer  # noqa: E402


class ProgressiveTest(SceneTest):
    def server(self, **how):
        server = TevServer(**how)
        self.addCleanup(server.close)
        return server

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
        self.run_strobe("-o", "o.exr", "--time-limit", "4", "--crop", "0", ".3", "0", ".3", "--display-server", server.address)
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
            _, seconds = self.run_strobe("--integrator", integrator, "--time-limit", "1", "-o", "o.exr", "--stats", "s.json")
            self.assertLess(seconds, 1.6)
            with open(self.path("s.json"), encoding="utf-8") as file:
                stats = json.load(file)
            self.assertGreater(stats["passes"], 1)
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

    def test_signals_end_passes(self):
        for goal in (["--noise-target", "1e-9", "--spp", "4"], ["--time-limit", "100"]):
            for first in (False, True):  # in the first pass, which is finished, or later
                with self.subTest(goal, first=first):
                    size = "900x600" if first else "60x40"
                    process = self.start("-o", "o.exr", "--resolution", size, *goal)
                    self.wait_until(lambda: self.listens(process))
                    time.sleep(0 if first else 1)
                    process.send_signal(signal.SIGINT)
                    self.assertEqual(process.wait(30), 5)
                    attributes = Exr(self.path("o.exr")).attributes
                    self.assertEqual(attributes["strobe:unfinished"], 1)
                    least = 4 if goal[0] == "--noise-target" else 1
                    self.assertGreaterEqual(attributes["strobe:samplesPerPixel"], least if first else 2 * least)
                    os.remove(self.path("o.exr"))

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


if __name__ == "__main__":
    unittest.main()
