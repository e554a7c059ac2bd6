"""The verdict of tools/soak on simulated measurements.
Usage: soak_test.py"""
import importlib.machinery
import importlib.util
import os
import random
import sys
import unittest

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
sys.dont_write_bytecode = True  # do not write to the source tree
loader = importlib.machinery.SourceFileLoader("soak", os.path.join(ROOT, "tools", "soak"))
soak = importlib.util.module_from_spec(importlib.util.spec_from_loader("soak", loader))
loader.exec_module(soak)


class SoakTest(unittest.TestCase):
    def wrong(self, leak=0, lost=0, late=0, seconds=4000):
        """Returns the verdict on 5 frames per second at 150 MB with noise of 2 MB and a warm-up. `leak`, `lost`: bytes and open
        files more per frame. `late`: threads more in the second half."""
        chance = random.Random(3)
        rows = []
        for second in range(seconds):
            frame = 5 * second
            memory = 150e6 + chance.uniform(-2e6, 2e6) - max(0, 20e6 - 2e5 * frame) + leak * frame
            rows.append((second, frame, memory, 6 + chance.randrange(3) + late * (2 * second > seconds), 3 + chance.randrange(2) + int(lost * frame)))
        return soak.judge(rows)[0]

    def test_constant_memory_passes(self):
        self.assertEqual(self.wrong(), [])
        self.assertEqual(self.wrong(leak=100), [])  # 17 MB in two hours of frames at 24 per second
        self.assertEqual(self.wrong(late=1), [])

    def test_growth_fails(self):
        self.assertEqual(self.wrong(leak=1500), ["memory grows"])
        self.assertEqual(self.wrong(lost=1e-3), ["open files grow in number"])

    def test_short_runs_have_no_verdict(self):
        self.assertEqual(self.wrong(seconds=100), ["too short to tell whether memory grows"])
        self.assertEqual(self.wrong(seconds=30), ["too few frames to tell"])


if __name__ == "__main__":
    unittest.main()
