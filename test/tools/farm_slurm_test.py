"""Tests tools/farm with a Slurm cluster of three nodes on this machine, whose parts are killed while it renders.
Usage: farm_slurm_test.py PATH_OF_STROBE [unittest arguments]; for a long run, STROBE_FRAMES: frames of a sequence (none),
STROBE_DEAD_NODES: nodes that die meanwhile (20)"""
import os
import random
import sys
import time
import unittest

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
sys.dont_write_bytecode = True
from farm_case import FarmCase  # noqa: E402
from slurm_cluster import SlurmCluster, kill, missing_programs  # noqa: E402

FRAMES, DEAD_NODES = int(os.environ.get("STROBE_FRAMES", "0")), int(os.environ.get("STROBE_DEAD_NODES", "20"))
SIZE = ("--resolution", "120x80")
RENDERS = {  # by the name of the output; the slices of the first take 10 s, those of the others a second
    "supersample": ("--integrator", "supersample", "--spp", "16384"),
    "msaa": ("--integrator", "msaa", "-D", "shades=2", "--spp", "2048"),
    "msaa-cache": ("--integrator", "msaa-cache", "--spp", "1024"),
    "indirect-cache": ("--integrator", "indirect-cache", "--shading", "path", "--spp", "512"),
    "adaptive-cache": ("--integrator", "adaptive-cache", "--shading", "path", "-D", "share=indirect", "--spp", "256"),
}


class FarmSlurmTest(FarmCase):
    def setUp(self):
        super().setUp()
        self.cluster = self.enterContext(SlurmCluster()) if hasattr(self, "enterContext") else self.enter(SlurmCluster())
        self.environment = self.cluster.environment

    def enter(self, context):
        """Enters a context until the end of the test."""
        self.addCleanup(context.__exit__)
        return context.__enter__()

    def submit(self, scene, output, *words):
        """Submits a render that saves checkpoints often."""
        return self.farm("slurm", scene, "-o", output, "--save", ".3", *words)

    def wait_for_finish(self, *outputs, seconds=50):
        """Waits until the images are there and nothing else is left."""
        try:
            self.wait_for(lambda: self.files() == sorted(outputs), seconds)
        except AssertionError:
            queue = self.cluster.run("squeue", check=False) + self.cluster.run("sinfo", check=False)
            left = ["%s/%s" % (folder, name) for folder, _, names in os.walk(self.folder) for name in names]
            raise AssertionError("\n".join(["timeout", queue, *left])) from None

    def test_integrators_while_parts_of_the_cluster_die(self):
        outputs = {}
        for name, words in RENDERS.items():
            scene = "corner.scene" if name == "adaptive-cache" else "s.scene"
            outputs[name + ".exr"] = (scene, *SIZE, *words)
            self.assertRegex(self.submit(scene, name + ".exr", "--tasks", "3", *SIZE, *words), r"slices in job \d+, merge in job \d+")
        self.wait_for(lambda: len(self.cluster.programs("strobe")) == 3)
        self.cluster.wait_for_saved_state()
        self.cluster.kill_controller()
        self.cluster.start_controller()
        killed, requeued, dies = self.cluster.programs("strobe")
        job, node = self.cluster.job_of(requeued), self.cluster.node_of(dies)
        kill([killed])
        self.cluster.kill_node(node)
        self.cluster.run("scontrol", "requeue", job)
        self.wait_for_finish(*outputs)
        for output, words in outputs.items():
            self.strobe(*words, "-o", "one.exr")
            self.assert_same_pixels(output, "one.exr")

    @unittest.skipUnless(FRAMES, "STROBE_FRAMES is not given")
    def test_sequence_while_nodes_die(self):
        frames = ("--frames", "1:%d" % FRAMES, *SIZE, "--spp", "256")
        self.submit("s.scene", "a.#.exr", "--tasks", "4", *frames)
        chance = random.Random(1)
        for _ in range(DEAD_NODES):
            node = chance.choice(self.cluster.nodes)
            time.sleep(chance.uniform(.2, 1))
            self.cluster.kill_node(node)
            time.sleep(chance.uniform(.2, 1))
            self.cluster.start_node(node)
        self.wait_for_finish(*("a.%d.exr" % frame for frame in range(1, FRAMES + 1)), seconds=900)
        self.wait_for(lambda: not self.cluster.run("squeue", "-h"))
        self.strobe("s.scene", "-o", "b.#.exr", *frames)
        for frame in range(1, FRAMES + 1):
            self.assert_same_pixels("a.%d.exr" % frame, "b.%d.exr" % frame)

    def test_wrong_scene_cancels_the_rest(self):
        self.submit("s.scene", "a.exr", "--tasks", "40", *SIZE, "--integrator", "msaa-cache", "-D", "scope=tile")
        self.wait_for(lambda: not self.cluster.run("squeue", "-h"), 30)
        self.assertIn("slices", self.farm("--status", "-o", "a.exr", code=1))

    def test_options_that_slurm_refuses(self):
        text = self.farm("slurm", "s.scene", "-o", "a.exr", *SIZE, "--", "--mem", "9T", code=1)
        self.assertIn("sbatch", text)
        self.assertEqual(self.files(), [])

    def test_cancel_and_watch(self):
        words = ("--tasks", "3", *SIZE, *RENDERS["supersample"])
        self.submit("s.scene", "a.exr", *words)
        self.wait_for(lambda: self.cluster.programs("strobe"))
        self.wait_for(lambda: any(name.endswith(".checkpoint") for name in os.listdir(self.path("a.exr.farm/parts"))))
        self.assertIn("run", self.farm("--status", "-o", "a.exr"))
        self.assertIn("being rendered", self.farm("slurm", "s.scene", "-o", "a.exr", *words, code=1))
        self.farm("--cancel", "-o", "a.exr")
        self.wait_for(lambda: not self.cluster.run("squeue", "-h"), 30)
        text = self.farm("slurm", "s.scene", "-o", "a.exr", "--watch", *words)
        self.assertIn("unfinished image", text)
        self.assertIn("finished: a.exr", text)
        self.assertEqual(self.files(), ["a.exr"])


if __name__ == "__main__":
    if missing_programs():
        print("SKIPPED: Slurm is missing: " + ", ".join(missing_programs()))
        sys.exit(0)
    unittest.main()
