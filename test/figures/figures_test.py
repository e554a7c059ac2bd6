"""Tests of what tools/figures computes from images and curves, and of its restart after an interruption."""
import os
import subprocess
import sys
import tempfile
import unittest
import unittest.mock

HERE = os.path.dirname(os.path.abspath(__file__))
ROOT = os.path.dirname(os.path.dirname(HERE))
sys.path.insert(0, os.path.join(ROOT, "tools"))
sys.dont_write_bytecode = True  # the source tree stays clean
try:
    import matplotlib  # noqa: F401
    import numpy
    import OpenImageIO  # noqa: F401
    from strobe_figures import curves, images, methods, pareto, peers, runs, stability, statements, styles
    from strobe_figures.context import Context, Reference, TooNoisy
    MISSING = ""
except ImportError as error:
    MISSING = str(error)


@unittest.skipIf(MISSING, MISSING)
class ErrorEstimateTest(unittest.TestCase):
    """Images with known bias and noise. The standard error of means over 100 x 100 x 3 values is about half a percent."""
    BIAS, NOISE, REFERENCE_NOISE = 0.03, 0.02, 0.01

    def setUp(self):
        random = numpy.random.default_rng(1)
        expected = numpy.full((100, 100, 3), 0.5)
        self.pictures = [expected + self.BIAS + self.NOISE * random.standard_normal(expected.shape) for _ in range(8)]
        image = expected + self.REFERENCE_NOISE * random.standard_normal(expected.shape)
        mask = numpy.ones((100, 100), bool)
        self.reference = Reference(image, self.REFERENCE_NOISE ** 2, self.REFERENCE_NOISE ** 2 / 0.51 ** 2, mask)

    def test_separates_bias_from_noise_and_subtracts_the_noise_of_the_reference(self):
        error = images.ErrorEstimate(self.pictures, self.reference)
        self.assertAlmostEqual(error.bias, self.BIAS, delta=0.0005)
        self.assertAlmostEqual(error.noise, self.NOISE, delta=0.0002)
        self.assertAlmostEqual(error.mean_square, self.BIAS ** 2 + self.NOISE ** 2, delta=3e-5)
        self.assertAlmostEqual(error.mean_squares.mean(), error.mean_square, delta=1e-12)

    def test_relative_errors_are_divided_by_the_reference(self):
        error = images.ErrorEstimate(self.pictures, self.reference, relative=True)
        self.assertAlmostEqual(error.mean_square, (self.BIAS ** 2 + self.NOISE ** 2) / 0.51 ** 2, delta=1e-4)

    def test_unbiased_images_have_a_bias_near_zero_and_an_interval_around_the_rmse(self):
        error = images.ErrorEstimate([p - self.BIAS for p in self.pictures], self.reference)
        self.assertLess(abs(error.bias_square), 2e-5)
        low, high = error.interval()
        self.assertTrue(low < error.rmse < high < 1.05 * low)

    def test_pixels_beside_a_light_are_excluded(self):
        reference = numpy.zeros((5, 5, 3))
        reference[2, 2] = 100
        self.assertEqual(int(images.comparable_pixels(reference).sum()), 25 - 9)

    def test_a_noisy_reference_is_refused(self):
        with tempfile.TemporaryDirectory() as folder:
            context = Context(folder, __file__, folder, True)
            context.check_noise(self.reference, 9.1 * self.REFERENCE_NOISE ** 2)
            with self.assertRaises(TooNoisy):
                context.check_noise(self.reference, 8.9 * self.REFERENCE_NOISE ** 2)


@unittest.skipIf(MISSING, MISSING)
class HashOfProgramTest(unittest.TestCase):
    def test_changes_with_the_program_and_its_libraries(self):
        with tempfile.TemporaryDirectory() as folder:
            program, library = (os.path.join(folder, name) for name in ("strobe", "libstrobe.so.0"))

            def hash_with(*contents):
                for name, content in zip((program, library), contents):
                    with open(name, "w") as file:
                        file.write(content)
                return runs.hash_of_program(program)

            with open(os.path.join(folder, "ldd"), "w") as file:
                file.write("#!/bin/sh\necho '\tlibstrobe.so.0 => %s (0x00007f0000000000)'\n" % library)
            os.chmod(file.name, 0o755)
            with unittest.mock.patch.dict(os.environ, {"PATH": folder + ":" + os.environ["PATH"]}):
                hashes = [hash_with("a", "b"), hash_with("c", "b"), hash_with("a", "d")]
                self.assertEqual(len(set(hashes)), 3)
                self.assertEqual(hash_with("a", "b"), hashes[0])


@unittest.skipIf(MISSING, MISSING)
class CurvesTest(unittest.TestCase):
    SECONDS = [1.0, 4.0, 16.0]
    NOISY = [0.2, 0.1, 0.05]  # half the error after four times the seconds
    BIASED = [0.2, 0.1, 0.09]

    def test_interpolates_on_logarithmic_axes(self):
        self.assertAlmostEqual(curves.seconds_to(self.SECONDS, self.NOISY, 0.1 / 2 ** 0.5), 8)
        self.assertAlmostEqual(curves.seconds_to(self.SECONDS, self.NOISY, 0.05), 16)
        self.assertAlmostEqual(curves.error_after(self.SECONDS, self.NOISY, 2), 0.2 / 2 ** 0.5)

    def test_an_error_that_is_not_reached_has_no_seconds(self):
        self.assertIsNone(curves.seconds_to(self.SECONDS, self.BIASED, 0.08))
        self.assertIsNone(curves.seconds_to(self.SECONDS, self.NOISY, 0.049))
        self.assertIsNone(curves.error_after(self.SECONDS, self.NOISY, 0.9))

    def test_outside_of_the_curve_its_end_points_count(self):
        self.assertEqual(curves.seconds_to(self.SECONDS, self.NOISY, 0.5), 1)
        self.assertEqual(curves.error_after(self.SECONDS, self.NOISY, 100), 0.05)

    def test_baselines_are_extrapolated(self):
        self.assertAlmostEqual(curves.seconds_to(self.SECONDS, self.NOISY, 0.025, extend=True), 64)
        self.assertAlmostEqual(curves.error_after(self.SECONDS, self.NOISY, 64, extend=True), 0.025)
        self.assertIsNone(curves.seconds_to(self.SECONDS, [0.2, 0.1, 0.1], 0.05, extend=True))

    def test_the_first_point_that_reaches_an_error_counts(self):
        self.assertAlmostEqual(curves.seconds_to(self.SECONDS, [0.2, 0.05, 0.1], 0.1), 2)

    def test_the_pareto_front_holds_points_that_no_line_passes_below(self):
        plain = [(1, 0.2, "a"), (4, 0.1, "b"), (16, 0.05, "c")]
        other = [(2, 0.15, "above the line from a to b"), (3, 0.05, "d"), (20, 0.06, "worse than c and d")]
        self.assertEqual([p[2] for p in curves.pareto_front([plain, other])], ["a", "d"])
        self.assertEqual([p[2] for p in curves.pareto_front([plain, [(8, 0.05, "d")]])], ["a", "b", "d"])
        self.assertEqual([p[2] for p in curves.pareto_front([plain])], ["a", "b", "c"])

    def test_intervals_of_a_mean_and_of_an_undefined_statistic(self):
        values = numpy.random.default_rng(2).standard_normal(400)
        low, high = curves.bootstrap_interval(lambda seeds: values[seeds].mean(), 400)
        self.assertAlmostEqual(low, values.mean() - 1.96 / 20, delta=0.02)
        self.assertAlmostEqual(high, values.mean() + 1.96 / 20, delta=0.02)
        self.assertEqual(curves.bootstrap_interval(lambda seeds: None if 0 in seeds else 3.0, 2), (None, 3.0))
        self.assertEqual(curves.bootstrap_interval(lambda seeds: None if 0 in seeds else 3.0, 2, undefined=numpy.inf), (3.0, None))
        self.assertEqual(curves.bootstrap_interval(lambda seeds: None, 2), (None, None))


@unittest.skipIf(MISSING, MISSING)
class StabilityTest(unittest.TestCase):
    def measured(self, *efficiencies):
        """Returns msaa, and a sweep over 0, 1, ... with these relative efficiencies of msaa."""
        def case(cost):
            result = stability.Case.__new__(stability.Case)
            result.seconds = 2.0
            result.error = type("Error", (), {"mean_square": cost / 2})
            return result
        base, msaa = stability.METHODS[:2]
        return msaa, {float(i): ({base: case(1.0), msaa: case(1 / e)}, None) for i, e in enumerate(efficiencies)}

    def test_values_where_a_method_is_efficient_and_its_failure_threshold(self):
        expected = {(2, 3, 1.5): ("everywhere", None), (0.5, 0.9, 0.1): ("nowhere", 0), (2, 0.5, 0.4): ("at 0", 1),
                    (2, 0.5, 3, 0.5): ("at 0, 2", 3)}
        for efficiencies, (text, threshold) in expected.items():
            method, measured = self.measured(*efficiencies)
            self.assertEqual(stability.efficient_values(measured, method), text, efficiencies)
            self.assertEqual(stability.failure_threshold(measured, method), threshold, efficiencies)

    def test_the_worst_crop_has_the_largest_error(self):
        reference = numpy.full((12, 16, 3), 0.5)
        image = reference.copy()
        image[5:8, 9:13, 1] = 0.9
        self.assertEqual(stability.worst_crop(image, reference, 4, 3), [9, 5, 4, 3])


@unittest.skipIf(MISSING, MISSING)
class StatementsTest(unittest.TestCase):
    """Verdicts are computed from the CSV files."""

    def verdict(self, check, name, columns, rows):
        """Returns the verdict of a statement for the rows of a CSV file."""
        with tempfile.TemporaryDirectory(prefix="strobe-figures-") as folder:
            context = Context(folder, __file__, folder, True)
            context.write_csv(name, columns, rows)
            return check(context)[1]

    def test_each_verdict_can_hold_and_fail(self):
        names = ["method", "task size", "seconds"]
        for seconds, expected in (((9, 5, 7), "holds"), ((9, 5, 5), "does not hold"), ((5, 5, 7), "does not hold")):
            rows = [[methods.CACHE_PER_TILE.name, n, s] for n, s in zip((4, 256, 1024), seconds)]
            self.assertEqual(self.verdict(statements.task_times, "figure-5", names, rows), expected, seconds)
        caches = methods.MSAA_CACHE, methods.MSAA_CACHE_1_BIN, methods.CACHE_PER_THREAD
        names = ["scene", "light"] + [m.name for m in caches]
        for bunny, expected in ((9, "holds"), (3, "does not hold")):
            rows = [["bunny", "direct", 2, bunny, 1], ["killeroo-simple", "direct", 2, 4, 1]]
            self.assertEqual(self.verdict(statements.largest_speedup, "figure-6", names, rows), expected)
        for shades, expected in ((1.2, "holds"), (1.5, "does not hold")):
            rows = [["supersample", 8], ["msaa", shades]]
            names = ["integrator", "shades per covered px"]
            self.assertEqual(self.verdict(statements.msaa_shades, "figure-1", names, rows), expected)

    def test_a_missing_csv_file_is_an_error_that_names_it(self):
        with tempfile.TemporaryDirectory(prefix="strobe-figures-") as folder:
            with self.assertRaisesRegex(runs.Failed, "figure-3a.csv, which does not exist"):
                statements.motion_shades(Context(folder, __file__, folder, True))


@unittest.skipIf(MISSING, MISSING)
class PeersTest(unittest.TestCase):
    def test_equal_error_beside_another_renderer(self):
        def measured(spp, seconds, error):
            return pareto.Measured(methods.CYCLES, spp, numpy.full(3, seconds), numpy.full(3, error ** 2),
                                   {"mean_square": error ** 2}, {}, 0, 0)
        curves_of_strobe = {methods.SUPERSAMPLE: [measured(n, 0.1 * n, 0.2 / n) for n in (1, 4, 16)],
                            methods.MSAA_CACHE: [measured(n, 0.1 * n, 0.1) for n in (1, 4, 16)]}
        *_, plain, cache = list(peers.comparisons(curves_of_strobe, [measured(1, 1.0, 0.4), measured(4, 2.0, 0.05)]))
        self.assertEqual(plain[:4], ["supersample", 4, 0.05, 2.0])
        self.assertAlmostEqual(plain[4], 0.4)
        self.assertAlmostEqual(plain[5], 5)
        self.assertEqual(cache[4:], [None, None, None, None])


@unittest.skipIf(MISSING, MISSING)
class StylesTest(unittest.TestCase):
    def test_an_integrator_has_one_color_and_marker_whatever_its_parameters(self):
        caches = (methods.MSAA_CACHE, methods.MSAA_CACHE_1_BIN, methods.CACHE_PER_THREAD)
        series = [method.style() for method in (*caches, methods.SUPERSAMPLE)]
        self.assertEqual(styles.palette_indices(series), [2, 2, 2, 0])
        self.assertEqual(len({method.variant for method in caches}), len(caches))

    def test_every_integrator_of_a_method_is_in_the_palette(self):
        integrators = {m.integrator for m in vars(methods).values() if isinstance(m, methods.Method)}
        self.assertEqual(integrators, set(styles.INTEGRATORS))

    def test_series_without_an_integrator_have_colors_of_their_own(self):
        series = [{"name": "bunny"}, methods.MSAA.style(), {"name": "killeroo"}]
        self.assertEqual(styles.palette_indices(series), [6, 1, 7])

    def test_methods_of_one_chart_differ_in_color_or_dashes(self):
        for charted in (pareto.METHODS, peers.METHODS, stability.METHODS):
            self.assertEqual(len({(m.integrator, m.variant) for m in charted}), len(charted))

    def test_colors_and_dashes_equal_those_of_the_page(self):
        with open(os.path.join(ROOT, "tools", "strobe_figures", "report.css")) as file:
            css = file.read()
        for i, color in enumerate(styles.COLORS):
            self.assertIn(".s%d { --hue: light-dark(%s, " % (i, color), css)
        for i, dashes in enumerate(styles.DASHES[1:], 1):
            self.assertIn(".v%d { stroke-dasharray: %s; }" % (i, " ".join("%g" % (2 * d) for d in dashes)), css)
        self.assertEqual(len(styles.MARKERS), len(styles.COLORS))


@unittest.skipIf(MISSING, MISSING)
class CommandTest(unittest.TestCase):
    """Figure 2 takes 15 renders: five methods, each timed three times."""
    FIGURE, RENDERS = "figure-2", 15

    def setUp(self):
        folder = tempfile.TemporaryDirectory(prefix="strobe-figures-")
        self.addCleanup(folder.cleanup)
        self.folder = folder.name
        self.calls = os.path.join(folder.name, "calls")

    def figures(self, *arguments, **environment):
        command = [sys.executable, os.path.join(ROOT, "tools", "figures"), "--strobe", os.path.join(HERE, "fake_strobe.py"),
                   "--out", os.path.join(self.folder, "out"), "--only", self.FIGURE, *arguments]
        changed = dict(os.environ, STROBE_SCENES=self.folder, FAKE_CALLS=self.calls, **environment)
        return subprocess.run(command, env=changed, capture_output=True, text=True)

    def count(self):
        with open(self.calls) as file:
            return len(file.readlines())

    def test_continues_where_it_was_killed(self):
        self.assertEqual(self.figures(FAKE_KILLS_AT="5").returncode, -9)
        self.assertEqual(self.count(), 5)
        done = self.figures()
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertIn("11 renders, 4 reused", done.stdout)
        self.assertEqual(self.count(), 5 + self.RENDERS - 4)
        self.assertIn("0 renders, 15 reused", self.figures().stdout)
        self.assertTrue(os.path.exists(os.path.join(self.folder, "out", "report.html")))

    def test_an_error_of_strobe_is_printed_and_the_exit_code_is_1(self):
        done = self.figures(FAKE_FAILS_AT="3")
        self.assertEqual(done.returncode, 1)
        self.assertIn("figure-2: fake.scene:3:7: no such shape: 'sphree'\n", done.stderr)
        self.assertNotIn("Traceback", done.stderr)

    def test_our_own_scenes_replace_missing_scenes_of_the_paper(self):
        done = self.figures()
        self.assertIn("the paper's scenes are not in %s (see tools/fetch-scenes): our own scenes replace them\n" %
                      self.folder, done.stderr)
        with open(self.calls) as file:
            self.assertTrue(all(os.path.join("scenes", "moving-pair.scene") in line for line in file))

    def test_unknown_names_and_a_missing_program_are_errors(self):
        done = self.figures("--only", "figure-99")
        self.assertEqual(done.returncode, 2)
        self.assertIn("unknown figure 'figure-99' (known: accuracy, ", done.stderr)
        done = self.figures("--strobe", os.path.join(self.folder, "none"))
        self.assertEqual(done.returncode, 1)
        self.assertIn("run tools/demo first, or use --strobe", done.stderr)


if __name__ == "__main__":
    unittest.main()
