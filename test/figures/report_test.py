"""Tests of the HTML report: writes a synthetic report, opens it in headless Chromium, and operates it with pointer and
keyboard. With REPORT_PICTURES=DIR, writes screenshots of the page at both widths to DIR.
Usage: report_test.py [unittest arguments]"""
import base64
import copy
import json
import math
import os
import subprocess
import sys
import tempfile
import unittest

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
sys.dont_write_bytecode = True  # the source tree stays clean
from report_browser import MISSING_BROWSER, MISSING_PACKAGE, TOOLS, PageTest  # noqa: E402

if not MISSING_PACKAGE:
    import OpenImageIO as oiio
    from report_browser import sample, write_report
if not MISSING_BROWSER:
    from report_browser import ActionChains, By
    from selenium.webdriver.common.keys import Keys

WIDTHS = (1280, 420)


def srgb(linear):
    """Returns the sRGB byte of a linear value above 0.0031308."""
    return round(255 * (1.055 * linear ** (1 / 2.4) - 0.055))


@unittest.skipIf(MISSING_PACKAGE, MISSING_PACKAGE)
class ReportWriterTest(unittest.TestCase):
    """Tests of report.py without a browser."""

    def setUp(self):
        self.folder = tempfile.TemporaryDirectory()
        self.addCleanup(self.folder.cleanup)
        self.report = sample.write_sample(self.folder.name)

    def write(self, report):
        """Writes the page of a report and returns its path."""
        with open(os.path.join(self.folder.name, "report.json"), "w", encoding="utf-8") as file:
            json.dump(report, file)
        return write_report(self.folder.name)

    def assertInvalid(self, change, message):
        """Changes the sample's items, {id: item}, and expects an error."""
        report = copy.deepcopy(self.report)
        change({item["id"]: item for section in report["sections"] for item in section["items"]})
        with self.assertRaisesRegex(ValueError, message):
            self.write(report)

    def test_an_invalid_item_is_an_error_that_names_the_item(self):
        self.assertInvalid(lambda items: items["cost"].update(id="speed"),
                           "item 'speed' of section .* has the id 'speed' of another item")
        self.assertInvalid(lambda items: items["cost"].update(title="Figure 1: Bunny"), "has a number in its title")
        self.assertInvalid(lambda items: items["cost"].update(title="Paper Figure 3a"), "has a number in its title")
        self.assertInvalid(lambda items: items["cost"].update(id="a b"), "has an invalid id 'a b'")
        self.assertInvalid(lambda items: items["cost"].update(kind="film"), "unknown kind 'film' .known: images, chart")
        self.assertInvalid(lambda items: items["cost"]["rows"].append(["x", "many", 1, ""]),
                           "has 'many' in column 'shades per pixel', expected a number")
        self.assertInvalid(lambda items: items["cost"]["rows"].append(["x"]), "has a row without 4 cells")
        self.assertInvalid(lambda items: items["balls"].update(crops=[[200, 0, 41, 9]]),
                           "has a crop .* outside of 240 x 160 pixels")
        self.assertInvalid(lambda items: items["balls"].update(reference=4), "has no image 4 for the reference")
        self.assertInvalid(lambda items: items["balls"]["images"][0].update(file="none.exr"), "none.exr")
        self.assertInvalid(lambda items: items["balls"].pop("images"), "item 'balls' .*has no images")
        self.assertInvalid(lambda items: items["speed"]["series"][1]["labels"].pop(), "has 4 labels for 5 points")
        self.assertInvalid(lambda items: items["speed"].pop("xlabel"), "lacks 'xlabel'")
        self.assertInvalid(lambda items: items["drawing"].update(file="report.json"),
                           "has a file report.json, expected .png, .svg or .jpg")

    def test_images_of_different_sizes_are_an_error(self):
        sample.write(os.path.join(self.folder.name, "small.exr"), sample.scene()[:10])
        self.assertInvalid(lambda items: items["balls"]["images"][0].update(file="small.exr"), "images of different sizes")

    def test_the_command_line_writes_the_same_page(self):
        command = [sys.executable, "-B", os.path.join(TOOLS, "strobe_figures", "report.py"), self.folder.name]
        page = os.path.join(self.folder.name, "page.html")
        self.assertEqual(subprocess.run([*command, page], capture_output=True, check=False).returncode, 0)
        with open(page, "rb") as first, open(write_report(self.folder.name), "rb") as second:
            self.assertEqual(first.read(), second.read())
        os.remove(os.path.join(self.folder.name, "report.json"))
        failed = subprocess.run(command, capture_output=True, text=True, check=False)
        self.assertEqual((failed.returncode, failed.stderr[:8]), (1, "report: "))

    def test_an_image_file_of_two_items_is_stored_once(self):
        size = os.path.getsize(self.write(self.report))
        again = copy.deepcopy(self.report["sections"][0]["items"][1])
        self.report["sections"][1]["items"].append({**again, "id": "again"})
        self.assertLess(os.path.getsize(self.write(self.report)) - size, 3000)


class ReportPage(PageTest):
    """Tests of the page in a browser."""

    # The page

    def test_structure(self):
        self.assertEqual(self.driver.title, self.report["title"])
        counts = (("h1", 1), ("main", 1), ("nav", 1), ("main section > h2", 2), ("figure.item h3", 6), ("table", 3))
        for selector, count in counts:
            self.assertEqual(len(self.driver.find_elements(By.CSS_SELECTOR, selector)), count, selector)
        targets = self.js("""return [...document.querySelectorAll('nav a')].map((a) =>
            document.querySelector(a.hash).tagName)""")
        self.assertEqual(sorted(targets), ["FIGURE"] * 6 + ["SECTION"] * 2)
        self.assertIn(sample.HOSTILE, self.find("#speed-and-accuracy > p:nth-of-type(2)").text)
        self.assertIn(sample.HOSTILE, self.find("#balls .strip figcaption").text)
        self.assertIn("Figure 2 Noise against samples", self.find("nav").text)
        self.assertIn("Paper Table 7 Cost of an image", self.find("nav").text, "a number of the item is kept")
        self.assertNotIn("Table 1", self.find("nav").text)
        self.assertGreater(self.js("return document.querySelector('.picture img').naturalWidth"), 0)

    def test_the_page_forbids_the_network(self):
        blocked = self.driver.execute_async_script("""const done = arguments[0], seen = new Set();
            document.addEventListener('securitypolicyviolation', (event) => {
              seen.add(event.effectiveDirective);
              if (seen.size === 4) done([...seen]);
            });
            const add = (tag, attributes) => document.head.append(Object.assign(document.createElement(tag), attributes));
            fetch('http://127.0.0.1:9/').catch(() => {});
            add('img', { src: 'http://127.0.0.1:9/' });
            add('script', { textContent: 'document.title = "broken"' });
            add('style', { textContent: 'body { display: none }' });""")
        self.assertEqual(sorted(blocked), ["connect-src", "img-src", "script-src-elem", "style-src-elem"])
        self.assertEqual(self.driver.title, self.report["title"])
        for log in ("browser", "performance"):  # this test causes messages on purpose
            self.driver.get_log(log)
        self.js("performance.clearResourceTimings()")

    def test_neither_width_scrolls_sideways(self):
        for width in WIDTHS:
            self.open(width)
            self.js("document.querySelectorAll('details').forEach((one) => { one.open = true; })")
            self.frames()
            self.assertEqual(self.js("return document.documentElement.scrollWidth"), width)
            self.keep(f"page-{width}", width)

    def test_print(self):
        self.prefer("light", "print")
        seen = {".controls": False, ".screen": False, ".theme": False, ".strip": True, ".plot svg": True}
        for selector, shown in seen.items():
            self.assertEqual(self.find(selector).is_displayed(), shown, selector)
        pdf = base64.b64decode(self.driver.execute_cdp_cmd("Page.printToPDF", {"preferCSSPageSize": True})["data"])
        self.assertIn(pdf.count(b"/Type /Page\n"), range(3, 8))

    def test_theme(self):
        paper = "return getComputedStyle(document.body).backgroundColor"
        control, light = self.find(".theme"), self.js(paper)
        self.assertEqual(control.text, "Dark theme")
        self.press(control, Keys.ENTER)
        dark = self.js(paper)
        self.assertNotEqual(light, dark)
        self.assertEqual(control.text, "Light theme")
        self.keep("page-dark", 1280)
        control.click()
        self.assertEqual(self.js(paper), light)
        self.js("localStorage.clear()")
        self.prefer("dark")
        self.open(1280)
        self.assertEqual(self.js(paper), dark)

    def test_colors_have_contrast_in_both_themes(self):
        contrast = """const linear = (v) => (v /= 255) <= 0.04045 ? v / 12.92 : ((v + 0.055) / 1.055) ** 2.4;
            const light = (css) => {
              const c = document.createElement('canvas').getContext('2d');
              c.fillStyle = css;
              c.fillRect(0, 0, 1, 1);
              const [r, g, b] = [...c.getImageData(0, 0, 1, 1).data].map(linear);
              return 0.2126 * r + 0.7152 * g + 0.0722 * b + 0.05;
            };
            const paper = light(getComputedStyle(document.body).backgroundColor);
            return [...document.querySelectorAll(arguments[0])].map((e) => light(getComputedStyle(e)[arguments[1]]))
              .map((v) => Math.max(v, paper) / Math.min(v, paper));"""
        minima = (("p, td, nav a, button", "color", 4.5), (".plot text", "fill", 4.5), (".series .line", "stroke", 3))
        for _ in range(2):
            for selector, kind, minimum in minima:
                self.assertGreaterEqual(min(self.js(contrast, selector, kind)), minimum, selector)
            self.find(".theme").click()

    def test_every_control_can_be_focused_and_shows_it(self):
        visited = []
        while len(visited) < 120:
            ActionChains(self.driver).send_keys(Keys.TAB).perform()
            focused = self.js("""const e = document.activeElement; if (e === document.body) return null;
                const seen = e.type === 'radio' ? e.nextSibling : e, style = getComputedStyle(seen);
                const name = e.className.baseVal ?? e.className;
                return [name, e.tagName, style.outlineStyle, parseFloat(style.outlineWidth)]""")
            if focused is None:
                break
            self.assertTrue(focused[2] == "solid" and focused[3] >= 2, f"{focused} must show its focus")
            visited.append(focused[0] or focused[1])
        self.assertLess(len(visited), 120, "the focus must leave the page")
        counts = {"skip": 1, "theme": 1, "A": 8, "stage": 2, "SELECT": 4, "svg": 2, "SUMMARY": 4}
        self.assertEqual({name: visited.count(name) for name in counts}, counts)

    # Image comparisons

    def test_pixels_equal_those_of_the_file(self):
        file = oiio.ImageBuf(os.path.join(self.folder, "flat.png")).get_pixels(oiio.UINT8)
        shown = self.thumbnail("plain", 0)
        self.assertEqual([v for i, v in enumerate(shown) if i % 4 != 3], file.flatten().tolist())
        offset = 4 * (sample.WIDTH - 1)
        self.assertEqual(self.thumbnail("balls", 1)[offset:offset + 3], [255, 0, 255], "NaN is magenta")

    def test_wipe(self):
        off, gray = srgb(sample.OFF_GRAY), srgb(sample.GRAY)
        slider = self.find("#balls .screen input[type=range]")
        self.press(slider, Keys.HOME)
        self.close(self.stage(15, 80), [gray] * 3, 1)
        self.press(slider, Keys.END)
        self.close(self.stage(15, 80), [off] * 3, 1)
        self.press(slider, Keys.HOME, *[Keys.ARROW_RIGHT] * 10)
        self.assertEqual(self.find("#balls .divider").get_attribute("style"), "left: 5%;")
        self.pointer(self.find("#balls .stage"), 0.5, 0.5, (0.25, 0.5))
        self.assertAlmostEqual(float(slider.get_attribute("value")), 0.25, delta=0.01)
        self.press(self.find("#balls .stage"), *[Keys.ARROW_RIGHT] * 5)
        self.assertAlmostEqual(float(slider.get_attribute("value")), 0.35, delta=0.01)

    def test_flip(self):
        off, gray = srgb(sample.OFF_GRAY), srgb(sample.GRAY)
        self.button("balls", "Flip").click()
        self.frames()
        self.close(self.stage(15, 80), [off] * 3, 1)
        for shown in (gray, off, gray):
            self.press(self.find("#balls .stage"), Keys.SPACE)
            self.close(self.stage(15, 80), [shown] * 3, 1)
        self.assertFalse(self.find("#balls .divider").is_displayed())

    def test_images_are_selected(self):
        a, b = self.driver.find_elements(By.CSS_SELECTOR, "#balls select")
        self.press(a, "supersample 64")
        self.assertEqual(self.find("#balls .name.A").text, "A  supersample 64")
        self.find("#balls .strip figure:nth-child(3) button").click()
        self.frames()
        self.assertEqual(b.get_attribute("value"), "2")
        self.button("balls", "⇄").click()
        self.frames()
        self.assertEqual([one.get_attribute("value") for one in (a, b)], ["2", "3"])
        self.press(self.find("#balls .stage"), "1")
        self.assertEqual(self.find("#balls .name.B").text, "B  reference")

    def test_exposure(self):
        self.choose("B")
        slider = self.find("#balls .controls input[type=range]")
        for keys, stops in (([], 0), ([Keys.ARROW_RIGHT] * 4, 1), ([Keys.ARROW_LEFT] * 12, -2), ([Keys.END], 8)):
            self.press(slider, *keys)
            self.close(self.stage(5, 80), [min(255, srgb(sample.GRAY * 2 ** stops))] * 3, 1)
        self.press(self.find("#balls .stage"), "[", "[")
        self.assertEqual(self.find("#balls .controls output").text, "+7 EV")

    def test_error_map(self):
        floor = 0.01 * oiio.ImageBuf(os.path.join(self.folder, "reference.exr")).get_pixels(oiio.FLOAT).mean()
        error = sample.OFF_GRAY - sample.GRAY
        self.choose("A")
        for kind, value in (("relative", error / (sample.GRAY + floor)), ("absolute", error)):
            self.choose(kind)
            self.assertEqual(self.stage(5, 80), [0, 0, 0], "zero error is black")
            self.close(self.stage(15, 80), self.scale(value))
            self.press(self.find("#balls .stage"), "]", "]")
            self.close(self.stage(15, 80), self.scale(2 * value))
            self.assertTrue(self.find("#balls .scale").text.endswith("0.5"))
        self.keep("error", 1280)
        self.press(self.find("#balls .stage"), "e")
        self.close(self.stage(15, 80), [srgb(sample.OFF_GRAY)] * 3, 1)
        self.assertFalse(self.find("#plain input[value=relative]").is_displayed(), "no error map without a reference")

    def test_zoom_and_values(self):
        stage, readout = self.find("#balls .stage"), self.find("#balls .readout")
        self.choose("B")
        self.button("balls", "Crop 1").click()
        self.pointer(stage, 0.01, 0.01)
        self.assertTrue(readout.text.startswith("Pixel 60, 60"), readout.text)
        self.pointer(stage, 0.99, 0.99)
        self.assertTrue(readout.text.startswith("Pixel 104, 89"), readout.text)
        self.press(stage, Keys.ARROW_RIGHT)
        self.pointer(stage, 0.01, 0.01)
        self.assertTrue(readout.text.startswith("Pixel 64, 60"), readout.text)
        self.pointer(stage, 0.5, 0.5, (0.5, 0.9))
        self.pointer(stage, 0.01, 0.01)
        self.assertTrue(readout.text.startswith("Pixel 64, 48"), readout.text)
        self.button("balls", "Crop 2").click()
        self.pointer(stage, 0.01, 0.01)
        self.assertTrue(readout.text.startswith("Pixel 127, 75"), "the whole crop, whose aspect ratio differs: " + readout.text)
        self.press(stage, "0")
        self.pointer(stage, 15.5 / sample.WIDTH, 80.5 / sample.HEIGHT)
        self.assertEqual(readout.text.split(), "Pixel 15, 80 A 0.375 0.375 0.375 B 0.25 0.25 0.25".split())
        self.press(stage, "+", "+", Keys.ARROW_LEFT)
        self.pointer(stage, 0.502, 0.505)
        self.assertTrue(readout.text.startswith("Pixel 114, 80"), readout.text)

    # Charts and tables

    def test_chart_values_under_the_pointer(self):
        tip, second = self.find("#speed .tip"), self.report["sections"][0]["items"][0]["series"][1]
        self.assertFalse(tip.is_displayed())
        marker = self.driver.find_elements(By.CSS_SELECTOR, "#speed .plot .s0 .marker")[2]
        self.pointer(marker, 0.5, 0.5)
        x, y, low, high = second["points"][2]
        self.assertEqual(tip.text.split("\n"), ["supersample, 64 spp", f"seconds {x:.4g}", f"relative MSE {y:.4g}",
                                                 f"from {low:.4g}", f"to {high:.4g}"])
        self.keep("tip", 1280)

    def test_points_lie_at_their_values_on_the_axes(self):
        ticks = self.js("""return Object.fromEntries([...document.querySelectorAll('#speed .plot .tick')].map((tick) =>
            [tick.textContent, [tick.getAttribute('x'), tick.getAttribute('y') - 4].map(Number)]))""")
        markers = self.js("""return [...document.querySelectorAll('#speed .plot .s0 .marker')].map((marker) =>
            marker.getAttribute('transform').match(/[\\d.]+/g).map(Number))""")
        (left, _), (right, _) = ticks["1"], ticks["10"]
        (_, low), (_, high) = ticks["10⁻³"], ticks["10⁻²"]
        for (x, y, *_), (px, py) in zip(sample.speed()["series"][1]["points"], markers, strict=True):
            self.assertAlmostEqual(px, left + math.log10(x) * (right - left), delta=0.01)
            self.assertAlmostEqual(py, low + (math.log10(y) + 3) * (high - low), delta=0.01)

    def test_chart_by_keyboard(self):
        tip, svg = self.find("#speed .tip"), self.find("#speed .plot svg")
        self.press(svg, Keys.ARROW_RIGHT)
        self.assertTrue(tip.text.startswith("Pareto front\nseconds 0.5"), tip.text)
        self.press(svg, Keys.ARROW_DOWN, Keys.ARROW_RIGHT)
        self.assertTrue(tip.text.startswith("supersample, 16 spp\nseconds 1.1"), tip.text)
        self.press(svg, *[Keys.ARROW_LEFT] * 3)
        self.assertTrue(tip.text.startswith("supersample, 4 spp"), tip.text)
        self.press(svg, Keys.ESCAPE)
        self.assertFalse(tip.is_displayed())

    def test_points_that_a_logarithmic_axis_cannot_show_are_counted(self):
        self.assertIn("cannot show: 1.", self.find("#speed .note").text)
        self.assertEqual(len(self.driver.find_elements(By.CSS_SELECTOR, "#speed .plot .s7 .marker")), 1)
        rows = self.driver.find_elements(By.CSS_SELECTOR, "#speed tbody tr")
        self.assertEqual(len(rows), 27, "the table has all values")

    def test_legend(self):
        entry = self.button("speed", "msaa")
        lines = lambda: len(self.driver.find_elements(By.CSS_SELECTOR, "#speed .plot .s1 .line"))
        self.assertEqual((lines(), entry.get_attribute("aria-pressed")), (1, "true"))
        entry.click()
        self.assertEqual((lines(), entry.get_attribute("aria-pressed")), (0, "false"))
        self.press(self.find("#speed .plot svg"), *[Keys.ARROW_DOWN] * 3)
        self.assertTrue(self.find("#speed .tip").text.startswith("msaa-cache"), "points of hidden series are skipped")
        self.press(entry, Keys.ENTER)
        self.assertEqual((lines(), entry.get_attribute("aria-pressed")), (1, "true"))

    def test_table_sorting(self):
        cells = lambda n: self.driver.find_elements(By.CSS_SELECTOR, f"#cost tbody tr > :nth-child({n})")
        column = lambda n: [cell.text for cell in cells(n)]
        head = self.find("#cost thead th:nth-child(3)")
        head.find_element(By.TAG_NAME, "button").click()
        self.assertEqual(column(3), ["4.125", "9.500", "10.250", "–"])
        self.assertEqual(head.get_attribute("aria-sort"), "ascending")
        self.press(head.find_element(By.TAG_NAME, "button"), Keys.ENTER)
        self.assertEqual(column(3), ["10.250", "9.500", "4.125", "–"])
        self.assertEqual(head.get_attribute("aria-sort"), "descending")
        self.press(self.find("#cost thead th:nth-child(1) button"), Keys.SPACE)
        self.assertEqual(column(1), ["msaa", "msaa-cache", "none", "supersample"])
        self.assertEqual(head.get_attribute("aria-sort"), "none")
        self.assertEqual(self.find("#cost tbody td.number").value_of_css_property("text-align"), "right")


if __name__ == "__main__":
    unittest.main()
