"""What the figures compute from pictures and curves, and how tools/figures goes on after it was stopped."""
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
    from strobe_figures import curves, images, pareto, peers, runs, stability, statements
    from strobe_figures.context import Context, Reference, TooNoisy
    LACKS = ""
except ImportError as error:
    LACKS = str(error)


@unittest.skipIf(LACKS, LACKS)
class SplitTest(unittest.TestCase):
    """Pictures with a known bias and a known noise. 100 x 100 x 3 values: sums are sure to about half a percent."""
    BIAS, NOISE, TRUE_NOISE = 0.03, 0.02, 0.01

    def setUp(self):
        random = numpy.random.default_rng(1)
        truth = numpy.full((100, 100, 3), 0.5)
        self.pictures = [truth + self.BIAS + self.NOISE * random.standard_normal(truth.shape) for _ in range(8)]
        measured = truth + self.TRUE_NOISE * random.standard_normal(truth.shape)
        keep = numpy.ones((100, 100), bool)
        self.reference = Reference(measured, self.TRUE_NOISE ** 2, self.TRUE_NOISE ** 2 / 0.51 ** 2, keep)

    def test_parts_bias_from_noise_and_takes_off_the_reference_s(self):
        split = images.Split(self.pictures, self.reference)
        self.assertAlmostEqual(split.bias, self.BIAS, delta=0.0005)
        self.assertAlmostEqual(split.noise, self.NOISE, delta=0.0002)
        self.assertAlmostEqual(split.mean_square, self.BIAS ** 2 + self.NOISE ** 2, delta=3e-5)
        self.assertAlmostEqual(split.of_seeds.mean(), split.mean_square, delta=1e-12)

    def test_relative_errors_are_those_over_the_truth(self):
        split = images.Split(self.pictures, self.reference, relative=True)
        self.assertAlmostEqual(split.mean_square, (self.BIAS ** 2 + self.NOISE ** 2) / 0.51 ** 2, delta=1e-4)

    def test_no_bias_comes_out_near_zero_and_an_interval_holds_the_rmse(self):
        split = images.Split([p - self.BIAS for p in self.pictures], self.reference)
        self.assertLess(abs(split.bias_square), 2e-5)
        low, high = split.interval()
        self.assertTrue(low < split.rmse < high < 1.05 * low)

    def test_pixels_beside_a_light_do_not_count(self):
        truth = numpy.zeros((5, 5, 3))
        truth[2, 2] = 100
        self.assertEqual(int(images.comparable(truth).sum()), 25 - 9)

    def test_a_noisy_reference_is_refused(self):
        with tempfile.TemporaryDirectory() as folder:
            context = Context(folder, __file__, folder, True)
            context.check(self.reference, 9.1 * self.TRUE_NOISE ** 2)
            with self.assertRaises(TooNoisy):
                context.check(self.reference, 8.9 * self.TRUE_NOISE ** 2)


@unittest.skipIf(LACKS, LACKS)
class CurvesTest(unittest.TestCase):
    SECONDS = [1.0, 4.0, 16.0]
    NOISY = [0.2, 0.1, 0.05]  # halves with four times the time
    BIASED = [0.2, 0.1, 0.09]

    def test_reads_between_points_along_powers(self):
        self.assertAlmostEqual(curves.seconds_to(self.SECONDS, self.NOISY, 0.1 / 2 ** 0.5), 8)
        self.assertAlmostEqual(curves.seconds_to(self.SECONDS, self.NOISY, 0.05), 16)
        self.assertAlmostEqual(curves.error_after(self.SECONDS, self.NOISY, 2), 0.2 / 2 ** 0.5)

    def test_what_is_not_reached_is_never_and_not_a_guess(self):
        self.assertIsNone(curves.seconds_to(self.SECONDS, self.BIASED, 0.08))
        self.assertIsNone(curves.seconds_to(self.SECONDS, self.NOISY, 0.049))
        self.assertIsNone(curves.error_after(self.SECONDS, self.NOISY, 0.9))

    def test_outside_the_curve_its_ends_count(self):
        self.assertEqual(curves.seconds_to(self.SECONDS, self.NOISY, 0.5), 1)
        self.assertEqual(curves.error_after(self.SECONDS, self.NOISY, 100), 0.05)

    def test_a_baseline_may_be_continued(self):
        self.assertAlmostEqual(curves.seconds_to(self.SECONDS, self.NOISY, 0.025, extend=True), 64)
        self.assertAlmostEqual(curves.error_after(self.SECONDS, self.NOISY, 64, extend=True), 0.025)
        self.assertIsNone(curves.seconds_to(self.SECONDS, [0.2, 0.1, 0.1], 0.05, extend=True))

    def test_an_error_counts_from_where_it_is_first_reached(self):
        self.assertAlmostEqual(curves.seconds_to(self.SECONDS, [0.2, 0.05, 0.1], 0.1), 2)

    def test_the_front_holds_what_no_line_passes_below(self):
        plain = [(1, 0.2, "a"), (4, 0.1, "b"), (16, 0.05, "c")]
        other = [(2, 0.15, "above the line from a to b"), (3, 0.05, "d"), (20, 0.06, "worse than c and d")]
        self.assertEqual([p[2] for p in curves.front([plain, other])], ["a", "d"])
        self.assertEqual([p[2] for p in curves.front([plain, [(8, 0.05, "d")]])], ["a", "b", "d"])
        self.assertEqual([p[2] for p in curves.front([plain])], ["a", "b", "c"])

    def test_intervals_of_a_mean_and_of_what_may_be_never(self):
        values = numpy.random.default_rng(2).standard_normal(400)
        low, high = curves.interval(lambda seeds: values[seeds].mean(), 400)
        self.assertAlmostEqual(low, values.mean() - 1.96 / 20, delta=0.02)
        self.assertAlmostEqual(high, values.mean() + 1.96 / 20, delta=0.02)
        self.assertEqual(curves.interval(lambda seeds: None if 0 in seeds else 3.0, 2), (None, 3.0))
        self.assertEqual(curves.interval(lambda seeds: None if 0 in seeds else 3.0, 2, never=numpy.inf), (3.0, None))
        self.assertEqual(curves.interval(lambda seeds: None, 2), (None, None))


@unittest.skipIf(LACKS, LACKS)
class StabilityTest(unittest.TestCase):
    def found(self, *worths):
        """What a sweep over 0, 1, ... would find, were msaa worth so much there."""
        def case(cost):
            made = stability.Case.__new__(stability.Case)
            made.seconds, made.error = 2.0, type("Error", (), {"mean_square": cost / 2})
            return made
        base, msaa = stability.METHODS[:2]
        return msaa, {float(i): ({base: case(1.0), msaa: case(1 / w)}, None) for i, w in enumerate(worths)}

    def test_where_a_method_is_worth_it(self):
        expected = {(2, 3, 1.5): ("everywhere", None), (0.5, 0.9, 0.1): ("nowhere", 0), (2, 0.5, 0.4): ("at 0", 1),
                    (2, 0.5, 3, 0.5): ("at 0, 2", 3)}
        for worths, (words, end) in expected.items():
            method, found = self.found(*worths)
            self.assertEqual((stability.spoken(found, method), stability.ends(found, method)), (words, end), worths)

    def test_frames_what_is_worst(self):
        truth = numpy.full((12, 16, 3), 0.5)
        wrong = truth.copy()
        wrong[5:8, 9:13, 1] = 0.9
        self.assertEqual(stability.worst(wrong, truth, 4, 3), [9, 5, 4, 3])


@unittest.skipIf(LACKS, LACKS)
class StatementsTest(unittest.TestCase):
    """Verdicts follow the numbers."""

    def verdict(self, of, name, columns, rows):
        with tempfile.TemporaryDirectory(prefix="strobe-figures-") as folder:
            here = Context(folder, __file__, folder, True)
            here.write_csv(name, columns, rows)
            return of(here)[1]

    def test_either_way(self):
        names = ["cache", "task size", "seconds"]
        for seconds, expected in (((9, 5, 7), "holds"), ((9, 5, 5), "does not hold"), ((5, 5, 7), "does not hold")):
            rows = [["scope=tile", n, s] for n, s in zip((4, 256, 1024), seconds)]
            self.assertEqual(self.verdict(statements.task_times, "figure-5", names, rows), expected, seconds)
        names = ["scene", "light", "msaa-cache", "msaa-cache, one time bin", "as in the paper"]
        for bunny, expected in ((9, "holds"), (3, "does not hold")):
            rows = [["bunny", "direct", 2, bunny, 1], ["killeroo-simple", "direct", 2, 4, 1]]
            self.assertEqual(self.verdict(statements.most, "figure-6", names, rows), expected)
        for few, expected in ((1.2, "holds"), (1.5, "does not hold")):
            rows = [["supersample", 8], ["msaa", few]]
            self.assertEqual(self.verdict(statements.shades, "figure-1", ["integrator", "shades per covered px"], rows),
                             expected)

    def test_a_missing_figure_is_named(self):
        with tempfile.TemporaryDirectory(prefix="strobe-figures-") as folder:
            with self.assertRaisesRegex(runs.Failed, "figure-3a.csv, which is not there"):
                statements.motion(Context(folder, __file__, folder, True))


@unittest.skipIf(LACKS, LACKS)
class PeersTest(unittest.TestCase):
    def test_equal_error_beside_another_renderer(self):
        def measured(spp, seconds, error):
            return pareto.Measured(peers.CYCLES, spp, numpy.full(3, seconds), numpy.full(3, error ** 2),
                                   {"mean_square": error ** 2}, {}, 0, 0)
        ours = {pareto.BASELINES[0]: [measured(n, 0.1 * n, 0.2 / n) for n in (1, 4, 16)],
                peers.LINES[2]: [measured(n, 0.1 * n, 0.1) for n in (1, 4, 16)]}
        *_, plain, cache = list(peers.sooner(ours, [measured(1, 1.0, 0.4), measured(4, 2.0, 0.05)]))
        self.assertEqual(plain[:4], ["supersample", 4, 0.05, 2.0])
        self.assertAlmostEqual(plain[4], 0.4)
        self.assertAlmostEqual(plain[5], 5)
        self.assertEqual(cache[4:], [None, None, None, None])


@unittest.skipIf(LACKS, LACKS)
class CommandTest(unittest.TestCase):
    """Figure 2 is 15 runs: five ways, each timed three times."""
    FIGURE, RUNS = "figure-2", 15

    def setUp(self):
        folder = tempfile.TemporaryDirectory(prefix="strobe-figures-")
        self.addCleanup(folder.cleanup)
        self.folder, self.calls = folder.name, os.path.join(folder.name, "calls")

    def figures(self, *arguments, **environment):
        command = [sys.executable, os.path.join(ROOT, "tools", "figures"), "--strobe", os.path.join(HERE, "fake_strobe.py"),
                   "--out", os.path.join(self.folder, "out"), "--only", self.FIGURE, *arguments]
        changed = dict(os.environ, STROBE_SCENES=self.folder, FAKE_CALLS=self.calls, **environment)
        return subprocess.run(command, env=changed, capture_output=True, text=True)

    def count(self):
        with open(self.calls) as file:
            return len(file.readlines())

    def test_goes_on_where_it_was_killed(self):
        self.assertEqual(self.figures(FAKE_KILLS_AT="5").returncode, -9)
        self.assertEqual(self.count(), 5)
        done = self.figures()
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertIn("11 runs made, 4 reused", done.stdout)
        self.assertEqual(self.count(), 5 + self.RUNS - 4)
        self.assertIn("0 runs made, 15 reused", self.figures().stdout)
        self.assertTrue(os.path.exists(os.path.join(self.folder, "out", "report.html")))

    def test_says_what_strobe_said_and_exits_with_1(self):
        done = self.figures(FAKE_FAILS_AT="3")
        self.assertEqual(done.returncode, 1)
        self.assertIn("figure-2: straw.scene:3:7: no such shape: 'sphree'\n", done.stderr)
        self.assertNotIn("Traceback", done.stderr)

    def test_without_the_paper_s_scenes_our_own_stand_in(self):
        done = self.figures()
        self.assertIn("no scenes of the paper in %s (tools/fetch-scenes gets them): our own stand in\n" % self.folder,
                      done.stderr)
        with open(self.calls) as file:
            self.assertTrue(all(os.path.join("scenes", "moving-pair.scene") in line for line in file))

    def test_refuses_unknown_names_and_a_missing_program(self):
        done = self.figures("--only", "figure-99")
        self.assertEqual(done.returncode, 2)
        self.assertIn("unknown figure 'figure-99' (known: accuracy, ", done.stderr)
        done = self.figures("--strobe", os.path.join(self.folder, "none"))
        self.assertEqual(done.returncode, 1)
        self.assertIn("run tools/demo first, or give --strobe", done.stderr)


if __name__ == "__main__":
    unittest.main()
