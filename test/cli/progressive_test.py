"""Progressive renders: viewer, time limit, noise target, reference, unfinished images.
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
sys.dont_write_bytecode = True  # do not write to the source tree
from exr import Exr  # noqa: E402
from scene_case import CORNER, STROBE, SceneTest  # noqa: E402
from tev_server import TevServer  # noqa: E402


class ProgressiveTest(SceneTest):
    def server(self, **how):
        server = TevServer(**how)
        self.addCleanup(server.close)
        return server

    # Viewer

    def test_viewer_receives_the_image(self):
        server = self.server()
        stderr, _ = self.run_strobe("-o", "o.exr", "--display-server", server.address)
        self.assertNotIn("viewer", stderr)
        server.thread.join(0.2)
        self.assertEqual(server.errors, [])
        self.assertEqual(list(server.images), ["o.exr"])
        image = server.images["o.exr"]
        self.assertEqual((image.width, image.height, image.channels), (150, 100, ["R", "G", "B"]))
        self.assertEqual(image.pixels(), self.pixels("o.exr"))

    def test_viewer_receives_a_crop_and_passes(self):
        server = self.server()
        self.run_strobe("-o", "o.exr", "--crop", ".3", ".9", ".2", ".8", "--noise-target", "10", "--spp", "1", "--display-server",
                        server.address)
        server.thread.join(0.2)
        self.assertEqual(server.errors, [])
        self.assertEqual(server.images["o.exr"].pixels(), self.pixels("o.exr"))

    def test_missing_viewer_is_a_warning(self):
        with socket.create_server(("127.0.0.1", 0)) as other:
            address = "127.0.0.1:%d" % other.getsockname()[1]
        stderr, seconds = self.run_strobe("-o", "o.exr", "--display-server", address)
        self.assertIn("no connection to the viewer at %s: Connection refused" % address, stderr)
        self.assertLess(seconds, 5)
        self.assertTrue(os.path.exists(self.path("o.exr")))

    def test_viewer_that_stops_reading_does_not_delay_the_render(self):
        # The send buffer fills up; the render does not wait.
        server = self.server(stop_after=1)
        stderr, seconds = self.run_strobe("-o", "o.exr", "--resolution", "900x600", "--spp", "1", "--display-server", server.address)
        self.assertEqual(server.messages, 1)
        self.assertLess(seconds, 15)
        self.assertTrue(os.path.exists(self.path("o.exr")), stderr)

    def test_lost_connection_is_reported_once(self):
        server = self.server(die_after=2)
        stderr, seconds = self.run_strobe("-o", "o.exr", "--time-limit", "1", "--display-server", server.address)
        self.assertIn("the connection was lost", stderr)
        self.assertEqual(stderr.count("no connection to the viewer"), 1)
        self.assertLess(seconds, 5)
        self.assertTrue(os.path.exists(self.path("o.exr")))

    def test_lost_connection_is_opened_again(self):
        server = self.server(die_after=1)
        self.run_strobe("-o", "o.exr", "--time-limit", "4", "--crop", "0", ".3", "0", ".3", "--display-server", server.address)
        server.thread.join(0.2)
        self.assertEqual(server.connections, 2)
        self.assertNotIn(None, server.images["o.exr"].pixels()[0])

    def test_invalid_viewer_addresses_are_an_error(self):
        for address in ("nonsense:port", ":14158", "host:0", "host:99999", "[::1", ""):
            stderr, _ = self.run_strobe("--display-server", address, code=1)
            self.assertIn("--display-server", stderr)

    # Time limit and noise target

    def run_limited(self, limit, *args):
        """Renders s.scene with two threads and a time limit. Returns the text on standard error.

        The limit is checked in CPU time: other processes can delay the end of a render, but do not add to its CPU time."""
        before = os.times()
        stderr, _ = self.run_strobe("--time-limit", str(limit), "--threads", "2", "-o", "o.exr", *args)
        after = os.times()
        used = after.children_user + after.children_system - before.children_user - before.children_system
        self.assertLess(used, 2 * limit * 1.3)
        return stderr

    def test_time_limit(self):
        for integrator in ("supersample", "msaa-cache"):
            for limit in (2, 4, 8, 16):  # a busy machine may render only one pass
                self.run_limited(limit, "--integrator", integrator, "--stats", "s.json")
                with open(self.path("s.json"), encoding="utf-8") as file:
                    stats = json.load(file)
                if stats["passes"] > 1:
                    break
            self.assertGreater(stats["passes"], 1)
            exr = Exr(self.path("o.exr"))
            self.assertEqual(exr.attributes["strobe:samplesPerPixel"], stats["settings"]["samplesPerPixel"])
            self.assertNotIn("strobe:unfinished", exr.attributes)
            self.assertEqual(stats["pixels"], 150 * 100)

    def test_first_pass_is_rendered_beyond_the_time_limit(self):
        stderr, _ = self.run_strobe("--time-limit", "0.001", "-o", "o.exr")
        self.assertIn("--time-limit 0.001: a single pass took", stderr)
        self.assertEqual(Exr(self.path("o.exr")).attributes["strobe:samplesPerPixel"], 1)

    def test_noise_target(self):
        stderr, _ = self.run_strobe("--noise-target", "0.5", "--spp", "4", "-o", "o.exr")
        attributes = Exr(self.path("o.exr")).attributes
        self.assertLessEqual(attributes["strobe:noise"], 0.5)
        self.assertEqual(attributes["strobe:samplesPerPixel"], 4 * attributes["strobe:passes"])
        self.assertRegex(stderr, r"noise 0\.\d+ after \d+ passes\n")

    def test_time_limit_ends_passes_before_the_noise_target(self):
        stderr = self.run_limited(2, "--noise-target", "1e-6", "--spp", "1")
        self.assertIn("the target is not met", stderr)
        self.assertGreater(Exr(self.path("o.exr")).attributes["strobe:noise"], 1e-6)

    def test_signals_end_passes(self):
        for goal in (["--noise-target", "1e-9", "--spp", "4"], ["--time-limit", "100"]):
            for first in (False, True):  # during the first pass, which is completed, or later
                with self.subTest(goal, first=first):
                    size = "900x600" if first else "60x40"
                    process = self.start("-o", "o.exr", "--resolution", size, *goal)
                    self.wait_until(lambda: self.handles_signals(process))
                    time.sleep(0 if first else 1)
                    process.send_signal(signal.SIGINT)
                    self.assertEqual(process.wait(30), 5)
                    attributes = Exr(self.path("o.exr")).attributes
                    self.assertEqual(attributes["strobe:unfinished"], 1)
                    least = 4 if goal[0] == "--noise-target" else 1
                    self.assertGreaterEqual(attributes["strobe:samplesPerPixel"], least if first else 2 * least)
                    os.remove(self.path("o.exr"))

    # Reference

    def test_error_curve_against_a_reference(self):
        self.run_strobe("--spp", "64", "-o", "truth.exr", "--quiet")
        for integrator in ("supersample", "msaa"):
            stderr, _ = self.run_strobe("--integrator", integrator, "--reference", "truth.exr", "--curve", "c.csv", "-o", "o.exr", "--seed", "3")
            with open(self.path("c.csv"), encoding="utf-8", newline="") as file:
                rows = list(csv.DictReader(file))
            self.assertEqual([int(r["samples"]) for r in rows], [1, 2, 4, 8])
            self.assertLess(float(rows[-1]["rmse"]), float(rows[0]["rmse"]))
            for r in rows:
                self.assertIn("%d samples per pixel: RMSE %.5f" % (int(r["samples"]), float(r["rmse"])), stderr)
            self.run_strobe("--integrator", integrator, "-o", "plain.exr", "--seed", "3")
            self.assertEqual(self.pixels("o.exr"), self.pixels("plain.exr"), "the reference changes the image")
            off = [min(max(a, 0), 1) - min(max(b, 0), 1) for p, q in zip(self.pixels("o.exr"), self.pixels("truth.exr"))
                   for a, b in zip(p, q)]
            self.assertAlmostEqual(float(rows[-1]["rmse"]), (sum(x * x for x in off) / len(off)) ** 0.5, 6)

    def test_error_curve_of_images_that_are_completed_at_the_end(self):
        integrator = ["--integrator", "adaptive-cache", "-D", "share=indirect"]
        self.write_scene(CORNER)
        self.run_strobe("--spp", "64", "-o", "truth.exr", "--quiet")
        stderr, _ = self.run_strobe(*integrator, "--reference", "truth.exr", "--curve", "c.csv", "-o", "o.exr")
        self.assertIn("shares indirect light", stderr)
        with open(self.path("c.csv"), encoding="utf-8", newline="") as file:
            self.assertEqual([int(r["samples"]) for r in csv.DictReader(file)], [1, 2, 4, 8])
        self.run_strobe(*integrator, "-o", "plain.exr")
        self.assertEqual(self.pixels("o.exr"), self.pixels("plain.exr"), "the reference changes the image")

    def test_error_of_the_finished_image_where_slices_are_an_error(self):
        integrator = ["--integrator", "msaa-cache", "-D", "scope=tile"]
        self.run_strobe("--spp", "64", "-o", "truth.exr", "--quiet")
        self.run_strobe(*integrator, "--reference", "truth.exr", "--curve", "c.csv", "-o", "o.exr")
        with open(self.path("c.csv"), encoding="utf-8", newline="") as file:
            self.assertEqual([int(r["samples"]) for r in csv.DictReader(file)], [8])
        self.run_strobe(*integrator, "-o", "plain.exr")
        self.assertEqual(self.pixels("o.exr"), self.pixels("plain.exr"), "the reference changes the image")

    def test_reference_of_another_size_is_an_error(self):
        self.run_strobe("--resolution", "40x30", "-o", "truth.exr", "--quiet")
        stderr, _ = self.run_strobe("--reference", "truth.exr", "-o", "o.exr", code=1)
        self.assertIn("--reference truth.exr: it has 40x30 pixels, the image 150x100", stderr)
        stderr, _ = self.run_strobe("--curve", "c.csv", code=1)
        self.assertIn("--curve: needs --reference", stderr)

    def test_options_that_exclude_each_other(self):
        for option in (["--time-limit", "1"], ["--noise-target", "1"]):
            for other in (["--pixel", "1,1"], ["--samples", "s.csv"]):
                stderr, _ = self.run_strobe(*option, *other, code=1)
                self.assertIn("%s: does not go with %s" % (other[0], option[0]), stderr)

    # Unfinished images

    def test_unfinished_images_are_written_at_intervals(self):
        process = subprocess.Popen([STROBE, "s.scene", "--spp", "65536", "--write-interval", "0.3", "-o", "o.exr", "-o", "o.png", "--quiet"],
                                   cwd=self.folder)
        try:
            limit = time.monotonic() + 30
            seen = set()
            while len(seen) < 2 and time.monotonic() < limit:
                if os.path.exists(self.path("o.exr")) and os.path.exists(self.path("o.png")):
                    exr = Exr(self.path("o.exr"))  # complete at any time
                    self.assertEqual(exr.attributes["strobe:unfinished"], 1)
                    seen.add(os.stat(self.path("o.exr")).st_ino)
                time.sleep(0.05)
            self.assertGreaterEqual(len(seen), 2, "the image is written several times")
            self.assertIsNone(process.poll())
        finally:
            process.kill()
            process.wait()

    def test_write_interval_does_not_change_the_image(self):
        self.run_strobe("-o", "plain.exr")
        for name in ("--write-interval", "--partial"):  # --partial is the former name
            self.run_strobe(name, "0.01", "-o", "a.exr")
            self.assertEqual(self.pixels("a.exr"), self.pixels("plain.exr"))
            self.assertNotIn("strobe:unfinished", Exr(self.path("a.exr")).attributes)


if __name__ == "__main__":
    unittest.main()
