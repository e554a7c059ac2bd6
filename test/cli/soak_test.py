"""How tools/soak judges what it has seen.
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
    def wrong(self, leak=0, lost=0, late=0, seconds=4000):
        """The verdict on 5 frames a second of 150 MB, which goes up and down by 2 MB, warms up, and leaks bytes and files a frame; in its
        second half it has some threads more."""
        chance = random.Random(3)
        rows = []
        for second in range(seconds):
            frame = 5 * second
            memory = 150e6 + chance.uniform(-2e6, 2e6) - max(0, 20e6 - 2e5 * frame) + leak * frame
            rows.append((second, frame, memory, 6 + chance.randrange(3) + late * (2 * second > seconds), 3 + chance.randrange(2) + int(lost * frame)))
        return soak.judge(rows)[0]

    def test_flat(self):
        self.assertEqual(self.wrong(), [])
        self.assertEqual(self.wrong(leak=100), [])  # 17 MB in a film of two hours
        self.assertEqual(self.wrong(late=1), [])

    def test_growth(self):
        self.assertEqual(self.wrong(leak=1500), ["memory grows"])
        self.assertEqual(self.wrong(lost=1e-3), ["open files grow in number"])

    def test_too_short_to_tell(self):
        self.assertEqual(self.wrong(seconds=100), ["too short to tell whether memory grows"])
        self.assertEqual(self.wrong(seconds=30), ["too few frames to tell"])


if __name__ == "__main__":
    unittest.main()
