"""Tests of the figure gains: errors against two references, ratios with bounds on synthetic data, and verdicts."""
import csv
import json
import os
import subprocess
import sys
import tempfile
import unittest

HERE = os.path.dirname(os.path.abspath(__file__))
ROOT = os.path.dirname(os.path.dirname(HERE))
sys.path.insert(0, os.path.join(ROOT, "tools"))
sys.dont_write_bytecode = True  # the source tree stays clean
try:
    import matplotlib  # noqa: F401
    import numpy
    import OpenImageIO  # noqa: F401
    from strobe_figures import gains, methods, paired
    from strobe_figures.context import Context
    MISSING = ""
except ImportError as error:
    MISSING = str(error)


@unittest.skipIf(MISSING, MISSING)
class ReferencesTest(unittest.TestCase):
    """A uniform image of 200 x 200 pixels. The references are as noisy as the measured images."""
    VALUE, NOISE = 0.5, 0.05

    def setUp(self):
        self.random = numpy.random.default_rng(1)
        self.references = paired.References(*(self.image(self.NOISE) for _ in range(3)))

    def image(self, noise, bias=0.0):
        return self.VALUE + bias + noise * self.random.standard_normal((200, 200, 3))

    def test_the_noise_of_the_references_drops_out(self):
        for noise, bias in ((0.05, 0), (0.02, 0), (0, 0.03), (0.02, 0.03)):
            errors = self.references.mean_squares(self.image(noise, bias))
            expected = noise ** 2 + bias ** 2
            self.assertAlmostEqual(errors["radiance"], expected, delta=5e-5)
            self.assertAlmostEqual(errors["clipped"], expected, delta=5e-5)
            divided = expected * 1.0285  # the mean of 1 / (divisor² + 0.01), with the noise of the divisor, times 0.26
            self.assertAlmostEqual(errors["relative"], divided / (self.VALUE ** 2 + 0.01), delta=3e-4)

    def test_the_noise_of_the_references_is_that_of_their_mean(self):
        self.assertAlmostEqual(self.references.noise()["radiance"], self.NOISE ** 2 / 2, delta=2e-5)

    def test_only_the_clipped_error_ignores_values_above_one(self):
        references = paired.References(*[numpy.full((10, 10, 3), 1.0)] * 3)
        errors = references.mean_squares(numpy.full((10, 10, 3), 3.0))
        self.assertEqual((errors["clipped"], errors["radiance"]), (0, 4))


@unittest.skipIf(MISSING, MISSING)
class RatioTest(unittest.TestCase):
    def test_a_known_ratio_comes_out_of_images_and_seconds(self):
        random = numpy.random.default_rng(2)
        image = lambda noise: 0.5 + noise * random.standard_normal((80, 80, 3))
        references = paired.References(*(image(0.02) for _ in range(3)))
        costs = lambda noise, seconds: [references.mean_squares(image(noise))["radiance"] * seconds for _ in range(16)]
        ratio = paired.ratio_of(costs(0.05, 3.0), costs(0.1, 1.5))  # a quarter of the error, times two
        self.assertAlmostEqual(ratio.value, 0.5, delta=0.01)
        self.assertTrue(ratio.value < ratio.upper < 0.52)

    def test_the_bound_covers_the_true_ratio_in_95_percent_of_the_cases(self):
        random = numpy.random.default_rng(3)
        trials = 1000
        for seeds, spread, true in ((4, 0.5, 0.3), (16, 0.2, 1.1)):
            covered = 0
            for _ in range(trials):
                common = random.normal(0, 1, seeds)  # of a seed; cancels in the pair
                costs = numpy.exp(common + numpy.log(true) + spread * random.standard_normal(seeds))
                covered += paired.ratio_of(costs, numpy.exp(common)).upper >= true
            self.assertAlmostEqual(covered / trials, 0.95, delta=0.021)  # three standard errors

    def test_equal_costs_have_a_ratio_of_one_without_an_interval(self):
        self.assertEqual(paired.ratio_of([1, 2, 3], [1, 2, 3]), paired.Ratio(1, 1))

    def test_errors_below_the_noise_of_the_references_have_no_ratio(self):
        for costs in ([1, -1], [1, 0], [1, float("nan")]):
            self.assertIsNone(paired.ratio_of(costs, [1, 1]))
            self.assertIsNone(paired.ratio_of([1, 1], costs))


@unittest.skipIf(MISSING, MISSING)
class SameTimeTest(unittest.TestCase):
    """Loading takes 3 seconds and a sample 0.5; errors fall with the power 1.5 up to 16 samples, then with 1."""
    SAMPLES, TIMES, ERRORS = (4, 16, 64), (5.0, 11.0, 35.0), (8.0, 1.0, 0.25)

    def test_samples_follow_from_times(self):
        for samples in (2, 4, 10, 16, 30, 64, 100):
            self.assertAlmostEqual(paired.samples_in(3 + 0.5 * samples, self.SAMPLES, self.TIMES), samples)

    def test_times_without_an_order_give_measured_samples(self):
        self.assertEqual(paired.samples_in(5.0, (4, 16), (5.0, 4.0)), 4)

    def test_errors_follow_power_laws(self):
        for samples, expected in ((4, 8), (8, 2 ** 1.5), (16, 1), (32, 0.5), (64, 0.25), (256, 0.0625), (1, 64)):
            self.assertAlmostEqual(paired.error_with(samples, self.SAMPLES, self.ERRORS), expected)

    def test_there_is_no_error_beside_one_that_is_not_positive(self):
        self.assertTrue(numpy.isnan(paired.error_with(8, self.SAMPLES, (8.0, -1.0, 0.25))))

    def test_a_cell_compares_errors_in_the_same_time(self):
        base, own = methods.SUPERSAMPLE_1_LIGHT, methods.ADAPTIVE_CACHE_1_LIGHT
        errors = lambda error: {name: numpy.array([error, 2 * error]) for name in paired.ERRORS}
        values = {n: {base: (numpy.array([t, 1.1 * t]), errors(e))} for n, t, e in zip(self.SAMPLES, self.TIMES, self.ERRORS)}
        values[4][own] = (numpy.array([7.0, 7.7]), errors(1.0))  # 3 + 0.5 * 8 seconds
        samples = gains.samples_of_same_time(values, 4, own)
        for found in samples:
            self.assertAlmostEqual(found, 8)
        for found, expected in zip(gains.base_errors_with(values, samples, "clipped"), (2 ** 1.5, 2 ** 2.5)):
            self.assertAlmostEqual(found, expected)


def cells(ratios, method, light="path", error="clipped"):
    """Returns cells with (value, upper bound) each, or None."""
    scene = gains.Scene("s", "s.scene", "own")
    numbers = (1.0, 1.0, 1.0, 1.0, 1.0, 0.0, 4.0)
    return [gains.Cell(scene, light, method, 4, error, r and paired.Ratio(*r), numbers) for r in ratios]


@unittest.skipIf(MISSING, MISSING)
class VerdictTest(unittest.TestCase):
    def setUp(self):
        self.adaptive, self.indirect = methods.ADAPTIVE_CACHE_1_LIGHT, methods.INDIRECT_CACHE_1_LIGHT

    def test_summary_counts_gains_and_possible_losses(self):
        count, better, losses, mean = gains.summary(cells([(0.25, 0.5), (1.0, 1.04), (4.0, 5.0), None], self.adaptive))
        self.assertEqual((count, better, losses), (3, 1, 1))
        self.assertAlmostEqual(mean, 1)
        self.assertEqual(gains.summary(cells([None], self.adaptive)), (0, 0, 0, None))

    def test_recommends_the_smallest_mean_below_one(self):
        good, fair, bad = [(0.2, 0.3)], [(0.8, 0.9)], [(1.1, 1.2)]
        for adaptive, indirect, expected in ((good, fair, "adaptive-cache"), (bad, fair, "indirect-cache"),
                                             (bad, bad, "supersample"), ([None], fair, "indirect-cache")):
            measured = cells(adaptive, self.adaptive) + cells(indirect, self.indirect)
            self.assertEqual(gains.recommended(measured).integrator, expected)

    def test_the_verdict_states_counts_and_mean(self):
        measured = cells([(0.25, 0.3), (1.0, 1.1)], self.adaptive) + cells([(9.0, 9.0)], self.adaptive, error="radiance")
        self.assertEqual(gains.verdict(measured, "path"),
                         "Paths of depth 5: use adaptive-cache. adaptive-cache is better than supersample in 1 of 2 cells, "
                         "geometric mean 0.50; cells with a bound above 1.05: 1.")


@unittest.skipIf(MISSING, MISSING)
class ScenesTest(unittest.TestCase):
    def test_stress_scenes_have_one_value_with_quick_and_two_with_full(self):
        with tempfile.TemporaryDirectory() as folder:
            counts = {}
            for quick in (True, False):
                scenes = gains.scenes_of(Context(folder, __file__, folder, quick))
                counts[quick] = [sum(s.group == group for s in scenes) for group in ("paper", "stress")]
                self.assertEqual(len({s.name for s in scenes}), len(scenes))
        self.assertEqual(counts, {True: [0, 16], False: [0, 32]})


@unittest.skipIf(MISSING, MISSING)
class CommandTest(unittest.TestCase):
    """A fake strobe renders the same images with every integrator."""

    def test_writes_the_verdict_a_table_and_charts(self):
        with tempfile.TemporaryDirectory(prefix="strobe-gains-") as folder:
            out = os.path.join(folder, "out")
            command = [sys.executable, os.path.join(ROOT, "tools", "figures"), "--only", "gains", "--scene", "still",
                       "--out", out, "--strobe", os.path.join(HERE, "fake_strobe.py")]
            changed = dict(os.environ, STROBE_SCENES=folder, FAKE_CALLS=os.path.join(folder, "calls"))
            done = subprocess.run(command, env=changed, capture_output=True, text=True)
            self.assertEqual(done.returncode, 0, done.stderr)
            self.assertIn("Paths of depth 5: use ", done.stdout)
            with open(os.path.join(out, "csv", "gains.csv"), newline="") as file:
                rows = list(csv.DictReader(file))
            self.assertEqual(len(rows), 2 * 3 * 3)  # integrators, sample counts and errors
            self.assertTrue(all(float(row["MSE ratio"]) == 1 for row in rows))
            for name in paired.ERRORS:
                for extension in (".png", ".svg"):
                    self.assertTrue(os.path.exists(os.path.join(out, "charts", "gains-" + name + extension)))
            with open(os.path.join(out, "report.json")) as file:
                section = json.load(file)["sections"][0]
            self.assertTrue(section["text"].startswith("Paths of depth 5: use "))
            self.assertEqual([item["kind"] for item in section["items"]], ["picture", "table", "picture", "picture"])


if __name__ == "__main__":
    unittest.main()
