"""Many threads, watched and interrupted: the picture is that of one thread. Built with ThreadSanitizer, strobe ends with a code of
its own where threads are at odds.
Usage: threads_test.py PATH_OF_STROBE [unittest arguments]"""
import os
import signal
import sys
import unittest

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
sys.dont_write_bytecode = True  # the source tree stays clean
from scene_case import SCENE, SceneTest  # noqa: E402

SMALL = ["--resolution", "40x30", "--tile", "4"]
SAME = (["supersample"], ["msaa"], ["msaa-cache"], ["msaa-cache", "-D", "cache-mb=1"], ["indirect-cache", "--shading", "path"])
BY_COURSE = (["msaa-cache", "-D", "scope=thread"], ["msaa-cache", "-D", "scope=mutex"], ["msaa-cache", "-D", "scope=tile"])
WATCHED = ["--threads", "4", "--partial", "0.02"]


class ThreadsTest(SceneTest):
    def setUp(self):
        super().setUp()
        self.run_strobe(*SMALL, "-o", "image.png")
        with open(self.path("s.scene"), "w", encoding="utf-8") as file:
            file.write('Option "string conventions" "pbrt-v2"\n' + SCENE.replace(
                'Material "matte" "rgb Kd" [.6 .5 .4]',
                'Texture "t" "rgb" "imagemap" "string filename" "image.png"\nMaterial "matte" "texture Kd" "t"'))

    def test_the_picture_is_that_of_one_thread(self):
        for integrator in SAME:
            with self.subTest(integrator=integrator):
                self.run_strobe("--integrator", *integrator, *SMALL, "--threads", "1", "-o", "one.exr")
                self.run_strobe("--integrator", *integrator, *SMALL, *WATCHED, "--checkpoint", "0.02", "-o", "many.exr")
                self.assertEqual(self.pixels("many.exr"), self.pixels("one.exr"))

    def test_caches_that_depend_on_the_course(self):
        for integrator in BY_COURSE:
            with self.subTest(integrator=integrator):
                self.run_strobe("--integrator", *integrator, *SMALL, *WATCHED, "-o", "many.exr")

    def test_passes_and_frames(self):
        for integrator in (["msaa-cache"], ["indirect-cache", "--shading", "path"]):
            with self.subTest(integrator=integrator):
                self.run_strobe("--integrator", *integrator, *SMALL, *WATCHED, "--noise-target", "1", "--time-limit", "5",
                                "--display-server", "127.0.0.1:9", "-o", "p.exr")
                self.run_strobe("--integrator", *integrator, *SMALL, *WATCHED, "--frames", "0:2", "--fps", "3", "-o", "f.#.exr")

    def test_signals(self):
        for integrator in (["supersample"], ["msaa-cache"]):
            with self.subTest(integrator=integrator):
                settings = ["--integrator", *integrator, *SMALL, *WATCHED, "--spp", "16384", "--checkpoint", "0.1", "--resume"]
                process = self.start(*settings, "-o", "o.exr")
                self.addCleanup(process.kill)
                self.wait_until(lambda: os.path.exists(self.path("o.exr.checkpoint")) or process.poll() is not None)
                process.send_signal(signal.SIGHUP)
                process.send_signal(signal.SIGTERM)
                self.assertEqual(process.wait(60), 5)
                os.remove(self.path("o.exr.checkpoint"))


if __name__ == "__main__":
    unittest.main()
