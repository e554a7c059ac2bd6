"""Tests of how tools/soak judges its measurements.
Usage: soak_test.py"""
import importlib.machinery
import importlib.util
import os
import random
import sys
import unittest

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
sys.dont_write_bytecode = True  # the source tree stays clean
loader = importlib.machinery.SourceFileLoader("soak", os.path.join(ROOT, "tools", "soak"))
soak = importlib.util.module_from_spec(importlib.util.spec_from_loader("soak", loader))
loader.exec_module(soak)


class SoakTest(unittest.TestCase):
    def problems(self, leak=0, lost=0, late=0, seconds=4000):
        """Returns the problems of a synthetic process with 5 frames a second. Its memory varies by 2 MB around 150 MB after a
        warm-up. It leaks `leak` bytes and `lost` files per frame, and has `late` more threads in the second half."""
        chance = random.Random(3)
        rows = []
        for second in range(seconds):
            frame = 5 * second
            memory = 150e6 + chance.uniform(-2e6, 2e6) - max(0, 20e6 - 2e5 * frame) + leak * frame
            rows.append((second, frame, memory, 6 + chance.randrange(3) + late * (2 * second > seconds), 3 + chance.randrange(2) + int(lost * frame)))
        return soak.judge(rows)[0]

    def test_flat(self):
        self.assertEqual(self.problems(), [])
        self.assertEqual(self.problems(leak=100), [])  # 17 MB in a film of two hours
        self.assertEqual(self.problems(late=1), [])

    def test_growth(self):
        self.assertEqual(self.problems(leak=1500), ["memory grows"])
        self.assertEqual(self.problems(lost=1e-3), ["the number of open files grows"])

    def test_too_short_for_a_result(self):
        self.assertEqual(self.problems(seconds=100), ["too short to measure the growth of memory"])
        self.assertEqual(self.problems(seconds=30), ["too few frames"])


if __name__ == "__main__":
    unittest.main()
