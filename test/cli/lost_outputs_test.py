"""Outputs that must not be lost: streams that fail, signals, files that cannot be written, two renders with one output.
Usage: lost_outputs_test.py PATH_OF_STROBE [--all] [unittest arguments]; --all: 200 random signals instead of 24"""
import fcntl
import os
import random
import resource
import signal
import subprocess
import sys
import time
import unittest

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
sys.dont_write_bytecode = True
SIGNALS = 200 if "--all" in sys.argv else 24
sys.argv = [argument for argument in sys.argv if argument != "--all"]
from exr import Exr  # noqa: E402
from scene_case import STROBE, SceneTest  # noqa: E402

LONG = "a" * 300 + ".exr"


class LostOutputsTest(SceneTest):
    def shell(self, command, code=0, **options):
        """Runs a bash command, in which $S is strobe. Returns the text on standard error."""
        done = subprocess.run(["bash", "-c", command], cwd=self.folder, env={**os.environ, "S": STROBE}, text=True, timeout=60,
                              stdout=subprocess.PIPE, stderr=subprocess.PIPE, **options)
        self.assertEqual(done.returncode, code, command + "\n" + done.stderr)
        return done.stderr

    def bytes(self, name):
        with open(self.path(name), "rb") as file:
            return file.read()

    def names(self):
        return sorted(os.listdir(self.folder))

    def stop_early(self, *arguments):
        """Starts a long render, and sends SIGTERM when it handles signals. Returns the text on standard error."""
        samples = () if "--spp" in arguments else ("--spp", "100000")
        process = subprocess.Popen([STROBE, "s.scene", *samples, *arguments], cwd=self.folder, stderr=subprocess.PIPE,
                                   text=True)
        self.wait_until(lambda: self.handles_signals(process))
        process.send_signal(signal.SIGTERM)
        err = process.communicate()[1]
        self.assertEqual(process.returncode, 5, err)
        return err

    def test_unfinished_images_keep_finished_ones(self):
        self.run_strobe("-o", "k.exr", "-o", "k.png", "--quiet")
        before = self.bytes("k.exr"), self.bytes("k.png")
        self.stop_early("--checkpoint", "60", "--resume", "-o", "k.exr", "-o", "k.png", "--quiet")
        self.assertEqual((self.bytes("k.exr"), self.bytes("k.png")), before)
        err = self.stop_early("--checkpoint", "60", "--resume", "-o", "k.exr")
        self.assertIn("k.exr is kept; ", err)
        if "k.exr.checkpoint" not in self.names():
            self.assertNotIn("--resume continues", err)

    def test_unfinished_images_are_beside_finished_ones_until_the_end(self):
        self.run_strobe("-o", "k.exr", "--quiet")
        err = self.stop_early("--time-limit", "100", "--spp", "4", "-o", "k.exr")
        self.assertIn("k.exr is kept; the unfinished image is k.unfinished.exr\n", err)
        self.assertNotIn("strobe:unfinished", Exr(self.path("k.exr")).attributes)
        self.assertEqual(Exr(self.path("k.unfinished.exr")).attributes["strobe:unfinished"], 1)
        os.remove(self.path("k.unfinished.exr"))
        self.run_strobe("--time-limit", ".3", "-o", "k.exr", "--quiet")
        self.assertEqual(self.names(), ["k.exr", "s.scene"])

    def test_unfinished_images_do_not_shrink(self):
        self.stop_early("--time-limit", "100", "--spp", "64", "-o", "k.exr", "--quiet")
        samples = int(Exr(self.path("k.exr")).attributes["strobe:sampleCount"])
        self.assertGreaterEqual(samples, 150 * 100)
        self.stop_early("--time-limit", "100", "--spp", "1", "--resolution", "6x4", "-o", "k.exr", "--quiet")
        self.assertEqual(int(Exr(self.path("k.exr")).attributes["strobe:sampleCount"]), samples)
        self.assertLess(int(Exr(self.path("k.unfinished.exr")).attributes["strobe:sampleCount"]), samples)

    def test_messages_may_be_lost(self):
        for frames in ("", " --frames 1:2"):
            for stream in ("2>/dev/full", "2>&-", "2>&- >&- <&-", "2>&1 | true"):
                self.shell(f"set -o pipefail; $S s.scene --spp 1 -o m.exr{frames} {stream}")
                for name in ["m.exr"] if not frames else ["m.0001.exr", "m.0002.exr"]:
                    Exr(self.path(name)).pixels()
                    os.remove(self.path(name))

    def test_results_may_not_be_lost(self):
        for command in ("--list", "--help", "--version", "--print-ocio", "merge --help", "s.scene --pixel 1,1"):
            with self.subTest(command=command):
                self.assertIn("error: cannot write to standard output: No space left on device\n",
                              self.shell(f"$S {command} >/dev/full", code=3))
                self.shell(f"$S {command} >&-", code=3)
                self.assertEqual(self.shell(f"set -o pipefail; $S {command} | true"), "")

    def test_outputs_are_checked_before_the_render(self):
        os.symlink("/dev/full", self.path("full.exr"))
        os.symlink("a.exr", self.path("b.exr"))
        os.symlink("b.exr", self.path("a.exr"))
        os.mkfifo(self.path("fifo.exr"))
        before = self.names()
        for output, problem in (("-o full.exr", "full.exr: it is not a regular file"), ("-o /proc/x.png", "/proc/x.png: No such"),
                                ("-o fifo.exr", "fifo.exr: it is not"), ("-o n.exr --stats /dev/full", "/dev/full: it is not"),
                                ("-o a.exr", "a.exr: Too many levels of symbolic links"), ("-o " + LONG, LONG + ": File name too long"),
                                ("-o n.exr --samples none/x.csv", "none/x.csv: No such file or directory")):
            with self.subTest(output=output):
                err = self.shell(f"$S s.scene --spp 1 {output}", code=3)
                self.assertTrue(err.startswith("error: cannot write " + problem), err)
                self.assertEqual(err.count("\n"), 1, err)
        self.assertEqual(self.names(), before)

    def test_symbolic_links_are_followed(self):
        os.mkdir(self.path("d"))
        os.symlink("d/new.exr", self.path("l.exr"))
        os.symlink("l.exr", self.path("ll.exr"))
        for _ in range(2):
            self.run_strobe("--spp", "1", "-o", "ll.exr", "--quiet")
            self.assertTrue(os.path.islink(self.path("ll.exr")) and os.path.islink(self.path("l.exr")))
            Exr(self.path("d/new.exr")).pixels()

    def test_one_render_per_checkpoint(self):
        first = self.start("--spp", "100000", "--checkpoint", "100", "-o", "k.exr")
        self.wait_until(lambda: "k.exr.checkpoint.lock" in self.names() and self.handles_signals(first))
        self.wait_until(lambda: self.bytes("k.exr.checkpoint.lock"))
        holder = self.bytes("k.exr.checkpoint.lock").decode()
        self.assertEqual(holder, f"process {first.pid} on {os.uname().nodename}")
        err, _ = self.run_strobe("--checkpoint", "100", "-o", "k.exr", code=1)
        self.assertEqual(err, f"error: k.exr.checkpoint is in use by {holder}\n")
        first.kill()
        first.wait()
        self.run_strobe("--checkpoint", "100", "--resume", "-o", "k.exr", "--quiet")
        self.assertEqual(self.names(), ["k.exr", "s.scene"])

    def test_merge_does_not_replace_its_parts(self):
        self.run_strobe("--spp", "1", "-o", "a.part", "--quiet")
        os.symlink("a.part", self.path("b.part"))
        for name in ("a.part", "./a.part", "b.part"):
            self.assertIn(f'error: "{name}" is a part to merge: choose another name\n', self.shell(f"$S merge a.part -o {name}", 1))

    def test_folders_and_long_names(self):
        os.mkdir(self.path("k.exr.checkpoint"))
        self.assertIn("k.exr.checkpoint: it is a folder", self.shell("$S s.scene --checkpoint 9 --resume -o k.exr", 1))
        self.assertIn(".: it is a folder", self.shell("$S merge . -o x.exr", 1))
        self.assertIn("Too many levels", self.shell("ln -s q q; $S q -o x.exr", 1))
        self.assertIn("File name too long", self.shell(f"$S {LONG} -o x.exr", 1))

    def test_threads(self):
        self.assertIn("--threads: takes an integer of at most 4096", self.shell("$S s.scene --threads 100000 -o x.exr", 1))
        limit = resource.getrlimit(resource.RLIMIT_NPROC)
        if os.getuid() == 0:
            self.skipTest("the system does not limit the threads of root")
        err = self.shell("$S s.scene --spp 1 -o x.exr --quiet", preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_NPROC, (3, limit[1])))
        self.assertNotIn("internal", err)

    def test_random_signals(self):
        """Each image is the former one, a complete one or an unfinished one, and no temporary file remains."""
        self.run_strobe("-o", "old.exr", "--quiet")
        old = self.bytes("old.exr")
        chance = random.Random(25)
        kinds = {"plain": "", "checkpoint": "--checkpoint .05 --resume", "sequence": "--frames 1:3 --overwrite", "noise": "--noise-target .02"}
        streams = {"good": None, "full": "/dev/full", "closed": "closed"}
        numbers = [signal.SIGTERM, signal.SIGINT, signal.SIGHUP, signal.SIGPIPE, signal.SIGXFSZ, signal.SIGXCPU, signal.SIGUSR1]
        pairs = [(kind, stream) for kind in kinds for stream in streams]
        for i in range(SIGNALS):
            kind, stream = pairs[i % len(pairs)]
            number = numbers[chance.randrange(len(numbers))]
            with self.subTest(i=i, kind=kind, stream=stream, signal=number.name):
                self.signal_once(old, kind, kinds[kind], stream, number, chance.uniform(0, .4))

    def signal_once(self, old, kind, options, stream, number, delay):
        names = ["k.0001.exr", "k.0002.exr", "k.0003.exr"] if kind == "sequence" else ["k.exr"]
        for name in names:
            with open(self.path(name), "wb") as file:
                file.write(old)
        redirect = {"good": "2>/dev/null", "full": "2>/dev/full", "closed": "2>&-"}[stream]
        process = subprocess.Popen(["bash", "-c", f"exec $S s.scene --threads 2 --spp 16 {options} -o k.exr {redirect}"],
                                   cwd=self.folder, env={**os.environ, "S": STROBE}, stdout=subprocess.DEVNULL)
        time.sleep(delay)
        process.send_signal(number)
        code = process.wait(60)
        if number in (signal.SIGPIPE, signal.SIGXFSZ) and code >= 0:
            self.assertEqual(code, 0)
        self.assertIn(code, (0, 5, -number))
        for name in names:
            if self.bytes(name) != old:
                self.assertNotIn("strobe:unfinished", Exr(self.path(name)).attributes)
        for name in self.names():
            self.assertFalse(name.endswith(".tmp"), name)
            if name.startswith("k."):
                if name.endswith(".exr"):
                    Exr(self.path(name)).pixels()
                os.remove(self.path(name))


if __name__ == "__main__":
    unittest.main()
