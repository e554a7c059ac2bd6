"""Renders in parts, and killed renders that resume from checkpoints.
Usage: parts_test.py PATH_OF_STROBE [unittest arguments]; for long runs, of each integrator, STROBE_KILLS: number of kills (3),
STROBE_SPLITS: number of images in 16 parts (1 in 4 parts)"""
import os
import random
import signal
import subprocess
import sys
import time
import unittest
from concurrent.futures import ThreadPoolExecutor

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
sys.dont_write_bytecode = True  # do not write to the source tree
from exr import Exr  # noqa: E402
from scene_case import CORNER, SCENE, STROBE, SceneTest  # noqa: E402

KILLS = int(os.environ.get("STROBE_KILLS", "3"))
SPLITS, PARTS = int(os.environ.get("STROBE_SPLITS", "1")), 16 if "STROBE_SPLITS" in os.environ else 4
INTEGRATORS = (["supersample"], ["msaa", "-D", "shades=2"], ["msaa-cache"], ["indirect-cache", "--shading", "path"], ["adaptive-cache", "-D", "share=indirect"])

LAYERS = ("normal,albedo,depth,position,uv,motionvector,objectid,materialid,primitiveid,cryptoobject,cryptomaterial,"
          "direct,indirect,lightgroups")


def split(box, parts, chance):
    """Cuts a box, [first, end] of columns, rows and samples, into this many boxes at random positions."""
    if parts == 1:
        return [box]
    side = chance.choice([side for side in range(3) if box[side][1] - box[side][0] >= parts])
    first, end = box[side]
    cut = chance.randrange(first + parts // 2, end - (parts - 1) // 2)
    halves = [[*box[:side], part, *box[side + 1:]] for part in ([first, cut], [cut, end])]
    return split(halves[0], parts // 2, chance) + split(halves[1], parts - parts // 2, chance)


class PartsTest(SceneTest):
    # Parts

    def merged(self, parts, out="m.exr", code=0, options=()):
        done = subprocess.run([STROBE, "merge", *parts, "-o", out, *options], cwd=self.folder, capture_output=True, text=True, timeout=60)
        self.assertEqual(done.returncode, code, done.stderr)
        return done.stderr

    def random_parts(self, settings, chance):
        """Renders the frame in random parts. Returns their file names in random order."""
        names, commands = [], []
        for x, y, samples in split([[0, 30], [0, 20], [0, 16]], PARTS, chance):
            names.append("p%d.part" % len(names))
            commands.append([*settings, "--pixel-bounds", *map(str, x + y), "--sample-range", "%d:%d" % tuple(samples),
                             "--threads", str(chance.randrange(1, 4)), "-o", names[-1]])
        with ThreadPoolExecutor() as pool:
            list(pool.map(lambda command: self.run_strobe(*command), commands))
        chance.shuffle(names)
        return names

    def test_random_parts_merge_to_the_whole_image(self):
        chance = random.Random(7)
        for integrator in INTEGRATORS:
            self.write_scene(CORNER if integrator[0] == "adaptive-cache" else SCENE)
            settings = ["--integrator", *integrator, "--resolution", "30x20", "--spp", "16", "--quiet"]
            self.run_strobe(*settings, "-o", "whole.exr")
            for number in range(SPLITS):
                names = self.random_parts(settings, chance)
                self.merged(names[:2], "some.part")  # a merged part can be merged again
                stderr = self.merged([*names[2:], "some.part"])
                self.assertNotIn("missing", stderr)
                self.assertEqual(self.pixels("m.exr"), self.pixels("whole.exr"), (integrator, number))
                attributes = Exr(self.path("m.exr")).attributes
                self.assertEqual(attributes["strobe:integrator"], integrator[0])
                self.assertNotIn("strobe:unfinished", attributes)
        self.assertEqual(attributes["strobe:integratorNote"], "shares indirect light")

    def test_slices_of_a_frame_of_a_sequence(self):
        settings = ["--frames", "2:2", "--resolution", "30x20", "--quiet"]
        self.run_strobe(*settings, "-o", "whole.#.exr")
        for number in (1, 2):
            self.run_strobe(*settings, "--slice", "%d/2" % number, "-o", "p%d.part" % number, "--checkpoint", "9")
        self.run_strobe("--frames", "3:3", *settings[2:], "--slice", "2/2", "-o", "p2.part")
        self.merged(["p1.0002.part", "p2.0002.part"], "merged.2.exr")
        self.assertEqual(self.pixels("merged.2.exr"), self.pixels("whole.2.exr"))
        merged, whole = (Exr(self.path(name)).attributes for name in ("merged.2.exr", "whole.2.exr"))
        for name in ("strobe:frame", "strobe:frameKey"):
            self.assertEqual(merged[name], whole[name])
        frames = ("--frames", "2:3", *settings[2:-1], "--dry-run", "-o", "merged.#.exr")
        self.assertIn("2 frames, 1 finished", self.run_strobe(*frames)[0])
        self.assertIn("frame is 3, not 2", self.merged(["p1.0002.part", "p2.0003.part"], code=1))
        self.merged(["p1.0002.part", "none.part"], "some.exr", options=["--allow-missing"])
        self.assertNotIn("strobe:frameKey", Exr(self.path("some.exr")).attributes)

    def slices(self, settings, count):
        """Renders the frame in slices, and returns their file names."""
        names = ["s%d.part" % number for number in range(1, count + 1)]
        for number, name in enumerate(names, 1):
            self.run_strobe(*settings, "--slice", "%d/%d" % (number, count), "--threads", str(1 + number % 3), "-o", name)
        return names

    def test_slices_merge_to_the_whole_image(self):
        for integrator in INTEGRATORS:
            self.write_scene(CORNER if integrator[0] == "adaptive-cache" else SCENE)
            settings = ["--integrator", *integrator, "--resolution", "90x60", "--spp", "16", "--quiet", "--aov", LAYERS, "--exr", "float"]
            self.run_strobe(*settings, "-o", "whole.exr")
            self.merged(self.slices(settings, 5))
            self.assertEqual(self.layers("m.exr"), self.layers("whole.exr"), integrator)
            self.assertNotIn("strobe:unfinished", Exr(self.path("m.exr")).attributes)

    def test_missing_and_doubled_slices_are_named(self):
        settings = ["--resolution", "30x20", "--spp", "1", "--quiet"]
        names = self.slices(settings, 20)
        self.merged(names)
        self.run_strobe(*settings, "-o", "whole.exr")
        self.assertEqual(self.pixels("m.exr"), self.pixels("whole.exr"))
        some = [name for number, name in enumerate(names, 1) if number not in (1, 7, 8, 9, 20)]
        self.assertIn("slices 1, 7-9, 20 of 20 are missing; --allow-missing writes what there is", self.merged(some, code=1))
        self.assertIn("slices 1, 7-9, 20 of 20 are missing", self.merged(some, options=["--allow-missing"]))
        self.run_strobe(*settings, "--slice", "3/20", "-o", "again.part")
        self.run_strobe(*settings, "--slice", "9/20", "--seed", "1", "-o", "foreign.part")
        stderr = self.merged([*names, "again.part", "foreign.part"], code=1)
        self.assertIn("again.part: slice 3 of 20 is also in s3.part", stderr)
        self.assertIn("foreign.part: it is a part of another render: seed is 1, not 0", stderr)

    def test_killed_slices_resume(self):
        self.write_scene(CORNER)
        settings = ["--integrator", "adaptive-cache", "-D", "share=indirect", "--spp", "256", "--resolution", "90x60", "--tile", "4"]
        self.run_strobe(*settings, "-o", "whole.exr")
        names = self.slices(settings, 2)
        process = self.start(*settings, "--slice", "1/2", "--checkpoint", "0.01", "-o", "s1.part")
        self.wait_until(lambda: os.path.exists(self.path("s1.part.checkpoint")) or process.poll() is not None)
        process.kill()
        process.wait()
        if os.path.exists(self.path("s1.part.checkpoint")):
            stderr, _ = self.run_strobe(*settings, "--slice", "2/2", "--checkpoint", "9", "--resume", "-o", "s1.part", code=1)
            self.assertIn("s1.part.checkpoint: it has slice 1 of 2, not slice 2 of 2", stderr)
        self.run_strobe(*settings, "--slice", "1/2", "--checkpoint", "9", "--resume", "-o", "s1.part")
        self.merged(names)
        self.assertEqual(self.pixels("m.exr"), self.pixels("whole.exr"))

    def layers(self, name):
        """Returns the names and the bytes of all channels, and the metadata of Cryptomatte."""
        picture = Exr(self.path(name))
        return picture.channels, picture.rows, {k: v for k, v in picture.attributes.items() if k.startswith("cryptomatte/")}

    def test_layers_of_parts_merge_to_those_of_the_whole_image(self):
        chance = random.Random(3)
        for integrator in INTEGRATORS:
            self.write_scene(CORNER if integrator[0] == "adaptive-cache" else SCENE)
            settings = ["--integrator", *integrator, "--resolution", "30x20", "--spp", "16", "--quiet", "--aov", LAYERS, "--exr", "float"]
            self.run_strobe(*settings, "-o", "whole.exr")
            names = self.random_parts(settings, chance)
            self.merged(names[:2], "some.part")
            self.merged([*names[2:], "some.part"])
            self.assertEqual(self.layers("m.exr"), self.layers("whole.exr"), integrator)
            self.assertGreater(len(self.layers("m.exr")[0]), 40)
            self.assertEqual(len(self.layers("m.exr")[2]), 8)

    def test_parts_with_other_layers_are_an_error(self):
        small = ["--resolution", "30x20", "--quiet"]
        self.run_strobe(*small, "--sample-range", "0:4", "--aov", "depth,cryptoobject", "-o", "a.part")
        self.run_strobe(*small, "--sample-range", "4:8", "-o", "b.part")
        self.assertIn("b.part: it is a part of another render: aov is none, not depth,cryptoobject(6)",
                      self.merged(["a.part", "b.part"], code=1))

    def test_killed_renders_resume_to_the_same_layers(self):
        for integrator in (INTEGRATORS[0], INTEGRATORS[4]):
            self.write_scene(CORNER if integrator[0] == "adaptive-cache" else SCENE)
            settings = ["--integrator", *integrator, "--spp", "512", "--resolution", "90x60", "--aov", LAYERS]
            self.run_strobe(*settings, "-o", "whole.exr")
            self.assertGreater(self.killed_and_resumed(settings, 3, 5), 1)
            self.assertEqual(self.layers("o.exr"), self.layers("whole.exr"), integrator)

    def test_layers_of_passes_do_not_depend_on_tiles(self):
        settings = ["--resolution", "30x20", "--spp", "4", "--noise-target", "0.1", "--exr", "float"]
        self.run_strobe(*settings, "--aov", LAYERS, "-o", "a.exr")
        self.run_strobe(*settings, "--aov", LAYERS, "--tile", "5", "--threads", "3", "-o", "b.exr")
        self.assertEqual(self.layers("a.exr"), self.layers("b.exr"))
        self.run_strobe(*settings, "-o", "plain.exr")
        self.assertEqual(self.pixels("a.exr"), self.pixels("plain.exr"))
        # Direct and indirect light of all passes add up to the image.
        a = Exr(self.path("a.exr"))
        for x, y in ((15, 10), (3, 4)):
            self.assertAlmostEqual(a.value("direct.R", x, y) + a.value("indirect.R", x, y), a.value("R", x, y), places=5)

    def test_parts_of_different_renders_are_an_error(self):
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
        self.assertRegex(self.merged(["a.part", "b.part"], code=1), "it is a part of another scene: s.scene has changed")
        self.assertFalse(os.path.exists(self.path("m.exr")))

    def test_overlapping_parts_and_missing_samples_are_errors(self):
        small = ["--resolution", "30x20", "--quiet"]
        self.run_strobe(*small, "--sample-range", "0:5", "-o", "a.part")
        self.run_strobe(*small, "--sample-range", "4:8", "--pixel-bounds", "0", "10", "0", "20", "-o", "b.part")
        self.assertIn("b.part: samples 4:8 of pixels 0 10 0 20 overlap those of a.part", self.merged(["a.part", "b.part"], code=1))
        missing = "1800 samples of the pixels from 0,0 to 29,19 are missing"
        self.assertIn(missing + "; --allow-missing writes what there is", self.merged(["a.part"], code=1))
        self.assertIn("none.part: cannot read it: No such file", self.merged(["a.part", "none.part"], code=1))
        stderr = self.merged(["a.part", "none.part"], options=["--allow-missing"])
        self.assertIn(missing, stderr)
        self.assertIn("1 of 2 parts do not exist, as none.part", stderr)
        self.assertEqual(Exr(self.path("m.exr")).attributes["strobe:unfinished"], 1)

    def test_merged_parts_that_do_not_cover_the_frame(self):
        """They may be of a crop: the image is not marked unfinished, but a warning gives its pixels."""
        small = ["--resolution", "30x20", "--quiet"]
        self.run_strobe(*small, "--pixel-bounds", "0", "30", "0", "10", "-o", "a.part")
        self.assertIn("the parts show pixels 0,0 to 29,9 of a frame of 30x20", self.merged(["a.part"]))
        self.assertNotIn("strobe:unfinished", Exr(self.path("m.exr")).attributes)
        self.assertNotIn("the parts show", self.merged(["a.part"], "some.part"))
        self.run_strobe(*small, "--pixel-bounds", "0", "30", "10", "20", "-o", "b.part")
        self.assertNotIn("the parts show", self.merged(["a.part", "b.part"]))

    def test_damaged_parts_are_an_error(self):
        self.run_strobe("--resolution", "30x20", "--quiet", "-o", "a.part")
        with open(self.path("a.part"), "rb") as file:
            good = file.read()
        for damaged, reason in ((good[:-1], "it is truncated"), (good + b"x", "it is too long"), (b"hello", "it is not a part of a render"),
                              (b"strobe part 3" + good[13:], "it is a part of another version of strobe"), (good[:60], "it is damaged"),
                              (good[:-28] + bytes([good[-28] ^ 1]) + good[-27:], "it is damaged"),
                              (good.replace(b'"seed":"0"', b'"seed":"1"', 1), "it is damaged")):
            with open(self.path("b.part"), "wb") as file:
                file.write(damaged)
            self.assertIn("b.part: " + reason, self.merged(["b.part"], code=1))
        self.assertIn("none.part: cannot read it: No such file", self.merged(["none.part"], code=1))

    def test_invalid_slices_are_an_error(self):
        for args, reason in ((["--sample-range", "8:9"], "samples 8:9: a pixel has 8"), (["--sample-range", "-1:2"], "takes first:end"),
                             (["--slice", "1"], "takes i/n, two integers"), (["--slice", "0/4", "-o", "o.part"], "must be i/n with 1 <= i <= n"),
                             (["--slice", "1/4"], "--slice: needs -o *.part, and no other image"),
                             (["--pixel-bounds", "0", "200", "0", "9"], "the frame has 150x100 pixels"),
                             (["--sample-range", "0:4", "--integrator", "msaa-cache", "-D", "scope=tile"], "cannot be rendered in slices"),
                             (["--sample-range", "0:4", "--noise-target", "1"], "--sample-range: does not go with --noise-target"),
                             (["--sample-range", "0:4", "--aov", "shades"], "--aov shades: does not go with --sample-range")):
            stderr, _ = self.run_strobe(*args, "-o", "o.exr", code=1)
            self.assertIn(reason, stderr)
        stderr, _ = self.run_strobe("--slice", "1/4", "--integrator", "msaa-cache", "-D", "scope=tile", "-o", "o.part", code=1)
        self.assertIn("cannot be rendered in slices", stderr)

    # Checkpoints

    def checkpoint(self):
        """Returns a value that differs between checkpoints; None if there is none."""
        try:
            status = os.stat(self.path("o.exr.checkpoint"))
            return status.st_ino, status.st_mtime_ns
        except FileNotFoundError:
            return None

    def killed_and_resumed(self, settings, kills, seed):
        """Renders with checkpoints, and kills each process after its first one. Returns how many processes resumed."""
        random_numbers = random.Random(seed)
        resumed = 0
        for kill in range(kills):
            before = self.checkpoint()
            process = self.start(*settings, "--checkpoint", "0.01", "--resume", "--tile", str(8 << kill % 2), "--threads",
                                 str(1 + kill % 3), "-o", "o.exr")
            self.wait_until(lambda: self.checkpoint() not in (None, before) or process.poll() is not None)
            time.sleep(random_numbers.uniform(0, 0.03))
            process.kill()
            process.wait()
            resumed += before is not None
        resumed += self.checkpoint() is not None
        self.run_strobe(*settings, "--checkpoint", "0.01", "--resume", "-o", "o.exr")
        self.assertIsNone(self.checkpoint())
        return resumed

    def test_killed_renders_resume_to_the_same_image(self):
        for number, integrator in enumerate(INTEGRATORS):
            self.write_scene(CORNER if integrator[0] == "adaptive-cache" else SCENE)
            settings = ["--integrator", *integrator, "--spp", "1024", "--resolution", "90x60"]
            self.run_strobe(*settings, "-o", "whole.exr")
            resumed = 0
            for killed in range(0, KILLS, 3):  # three kills per image
                resumed += self.killed_and_resumed(settings, min(3, KILLS - killed), 1000 * number + killed)
                self.assertEqual(self.pixels("o.exr"), self.pixels("whole.exr"), (integrator, killed))
            self.assertGreater(resumed, KILLS / 2)

    def test_signals_save_checkpoints(self):
        settings = ["--spp", "4096", "--tile", "8", "--checkpoint", "100", "-o", "o.exr"]
        process = self.start(*settings)
        self.wait_until(lambda: self.handles_signals(process))
        self.wait_until(lambda: process.send_signal(signal.SIGHUP) or self.checkpoint())  # saves a checkpoint; rendering continues
        self.assertIsNone(process.poll())
        process.send_signal(signal.SIGTERM)
        self.assertEqual(process.wait(20), 5)
        self.assertEqual(Exr(self.path("o.exr")).attributes["strobe:unfinished"], 1)
        stderr, _ = self.run_strobe(*settings, code=1)
        self.assertIn("o.exr.checkpoint exists: continue from it with --resume, or remove it to start anew", stderr)
        for change, reason in ((["--seed", "3"], "it is a part of another render: seed is 0, not 3"),
                               (["--pixel-bounds", "0", "90", "0", "60"], "its pixels are 0 150 0 100, not 0 90 0 60"),
                               (["--sample-range", "0:9"], "it has samples 0:4096, not 0:9")):
            stderr, _ = self.run_strobe(*settings, *change, "--resume", code=1)
            self.assertIn("o.exr.checkpoint: " + reason, stderr)

    def test_second_interrupt_stops_at_once(self):
        process = self.start("--spp", "65536", "--checkpoint", "100", "-o", "o.exr", "--tile", "256")
        self.wait_until(lambda: self.handles_signals(process))
        process.send_signal(signal.SIGINT)
        time.sleep(0.15)
        process.send_signal(signal.SIGINT)
        self.assertIn(process.wait(5), (5, 130))  # the first signal may have sufficed

    def test_options_that_exclude_checkpoints(self):
        for args, reason in ((["--resume"], "--resume: needs --checkpoint"),
                             (["--checkpoint", "1", "--frames", "1:2"], "--frames with several frames: does not go with --checkpoint"),
                             (["--checkpoint", "1", "--time-limit", "1"], "--checkpoint: does not go with --time-limit"),
                             (["--checkpoint", "1", "--integrator", "msaa-cache", "-D", "scope=tile"], "samples of this integrator depend on other pixels or on the order of rendering")):
            stderr, _ = self.run_strobe(*args, "-o", "o.exr", code=1)
            self.assertIn(reason, stderr)


if __name__ == "__main__":
    unittest.main()
