"""Several threads, with unfinished images, checkpoints and signals: the image equals that of one thread. Built with
ThreadSanitizer, strobe exits with a code of its own after a data race.
Usage: threads_test.py PATH_OF_STROBE [unittest arguments]"""
import os
import signal
import sys
import unittest

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
sys.dont_write_bytecode = True  # do not write to the source tree
from scene_case import SCENE, SceneTest  # noqa: E402

SMALL = ["--resolution", "40x30", "--tile", "4"]
DETERMINISTIC = (["supersample"], ["msaa"], ["msaa-cache"], ["msaa-cache", "-D", "cache-mb=1"], ["indirect-cache", "--shading", "path"])
ORDER_DEPENDENT = (["msaa-cache", "-D", "scope=thread"], ["msaa-cache", "-D", "scope=mutex"], ["msaa-cache", "-D", "scope=tile"])
THREADED = ["--threads", "4", "--write-interval", "0.02"]


class ThreadsTest(SceneTest):
    def setUp(self):
        super().setUp()
        self.run_strobe(*SMALL, "-o", "image.png")
        with open(self.path("s.scene"), "w", encoding="utf-8") as file:
            file.write('Option "string conventions" "pbrt-v2"\n' + SCENE.replace(
                'Material "matte" "rgb Kd" [.6 .5 .4]',
                'Texture "t" "rgb" "imagemap" "string filename" "image.png"\nMaterial "matte" "texture Kd" "t"'))

    def test_image_does_not_depend_on_the_number_of_threads(self):
        for integrator in DETERMINISTIC:
            with self.subTest(integrator=integrator):
                self.run_strobe("--integrator", *integrator, *SMALL, "--threads", "1", "-o", "one.exr")
                self.run_strobe("--integrator", *integrator, *SMALL, *THREADED, "--checkpoint", "0.02", "-o", "many.exr")
                self.assertEqual(self.pixels("many.exr"), self.pixels("one.exr"))

    def test_order_dependent_caches_have_no_data_races(self):
        for integrator in ORDER_DEPENDENT:
            with self.subTest(integrator=integrator):
                self.run_strobe("--integrator", *integrator, *SMALL, *THREADED, "-o", "many.exr")

    def test_passes_and_frames_have_no_data_races(self):
        for integrator in (["msaa-cache"], ["indirect-cache", "--shading", "path"]):
            with self.subTest(integrator=integrator):
                self.run_strobe("--integrator", *integrator, *SMALL, *THREADED, "--noise-target", "1", "--time-limit", "5",
                                "--display-server", "127.0.0.1:9", "-o", "p.exr")
                self.run_strobe("--integrator", *integrator, *SMALL, *THREADED, "--frames", "0:2", "--fps", "3", "-o", "f.#.exr")

    def test_signals_have_no_data_races(self):
        for integrator in (["supersample"], ["msaa-cache"]):
            with self.subTest(integrator=integrator):
                settings = ["--integrator", *integrator, *SMALL, *THREADED, "--spp", "16384", "--checkpoint", "0.1", "--resume"]
                process = self.start(*settings, "-o", "o.exr")
                self.addCleanup(process.kill)
                self.wait_until(lambda: os.path.exists(self.path("o.exr.checkpoint")) or process.poll() is not None)
                process.send_signal(signal.SIGHUP)
                process.send_signal(signal.SIGTERM)
                self.assertEqual(process.wait(60), 5)
                os.remove(self.path("o.exr.checkpoint"))


if __name__ == "__main__":
    unittest.main()
