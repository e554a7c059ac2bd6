"""A test case that opens the sample report in headless Chromium. Needs Debian's chromium, chromium-driver and
python3-selenium; MISSING_PACKAGE and MISSING_BROWSER name missing packages."""
import base64
import json
import os
import shutil
import sys
import tempfile
import time
import unittest

HERE = os.path.dirname(os.path.abspath(__file__))
TOOLS = os.path.join(HERE, "..", "..", "tools")
sys.path[:0] = [HERE, TOOLS]

MISSING_PACKAGE = MISSING_BROWSER = ""
try:
    import report_sample as sample
    from strobe_figures.report import write_report
except ImportError as error:
    MISSING_PACKAGE = f"{error.name} is missing: install python3-numpy and python3-openimageio"
try:
    from selenium import webdriver
    from selenium.webdriver.common.action_chains import ActionChains
    from selenium.webdriver.common.by import By
    from selenium.webdriver.chrome.service import Service
    if not (shutil.which("chromium") and shutil.which("chromedriver")):
        MISSING_BROWSER = "no chromium or chromedriver: install chromium and chromium-driver"
except ImportError:
    MISSING_BROWSER = "selenium is missing: install python3-selenium"

FRAMES = """const done = arguments[0], next = requestAnimationFrame; next(() => next(() => next(done)))"""
# Reads a canvas through a copy, because willReadFrequently would change the page's canvas.
READ = """const read = (canvas) => {
  const copy = document.createElement('canvas'), context = copy.getContext('2d', { willReadFrequently: true });
  [copy.width, copy.height] = [canvas.width, canvas.height];
  context.drawImage(canvas, 0, 0);
  return context;
};
"""


@unittest.skipIf(MISSING_PACKAGE or MISSING_BROWSER, MISSING_PACKAGE or MISSING_BROWSER)
class PageTest(unittest.TestCase):
    """Opens the sample's page before every test. Fails if the page logged an error or accessed the network."""

    @classmethod
    def setUpClass(cls):
        folder = tempfile.TemporaryDirectory()
        cls.addClassCleanup(folder.cleanup)
        cls.folder = folder.name
        cls.report = sample.write_sample(cls.folder)
        cls.page = "file://" + write_report(cls.folder)
        options = webdriver.ChromeOptions()
        root = ["--no-sandbox"] * (os.geteuid() == 0)
        for argument in ["--headless=new", "--hide-scrollbars", "--disable-dev-shm-usage", *root]:
            options.add_argument(argument)
        options.set_capability("goog:loggingPrefs", {"browser": "ALL", "performance": "ALL"})
        cls.driver = webdriver.Chrome(options=options, service=Service(shutil.which("chromedriver")))
        cls.addClassCleanup(cls.driver.quit)

    def setUp(self):
        self.prefer("light")
        self.open(1280)

    def tearDown(self):
        self.assertEqual(self.driver.get_log("browser"), [], "the console must have no messages")
        self.assertEqual(self.js("return performance.getEntriesByType('resource').map((e) => e.name)"), [])
        events = [json.loads(entry["message"])["message"] for entry in self.driver.get_log("performance")]
        sent = [event["params"]["request"]["url"] for event in events if event["method"] == "Network.requestWillBeSent"]
        self.assertEqual([url for url in sent if not url.startswith((self.page, "data:"))], [])

    def prefer(self, theme, media=""):
        """Sets the preferred color theme, reduced motion, and optionally the print medium."""
        features = [{"name": "prefers-color-scheme", "value": theme},
                    {"name": "prefers-reduced-motion", "value": "reduce"}]
        self.driver.execute_cdp_cmd("Emulation.setEmulatedMedia", {"media": media, "features": features})

    def open(self, width, height=900):
        """Opens the page in a window of this size and waits until it is drawn."""
        size = {"width": width, "height": height, "deviceScaleFactor": 1, "mobile": False}
        self.driver.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", size)
        self.driver.get(self.page)
        self.js("try { localStorage.clear() } catch {}")
        end = time.monotonic() + 10
        while self.js("return document.querySelectorAll('.stage').length") < 2 and time.monotonic() < end:
            time.sleep(0.02)
        self.frames()

    def js(self, script, *arguments):
        """Runs a script in the page and returns its result."""
        return self.driver.execute_script(script, *arguments)

    def frames(self):
        """Waits until pending changes are drawn."""
        self.driver.execute_async_script(FRAMES)

    def find(self, selector):
        """Returns the first element of a CSS selector."""
        return self.driver.find_element(By.CSS_SELECTOR, selector)

    def button(self, within, name):
        """Returns a button of an item by its text."""
        return self.driver.find_element(By.XPATH, f"//*[@id='{within}']//button[normalize-space()='{name}']")

    def choose(self, value, within="balls"):
        """Selects a radio button of an item."""
        self.find(f"#{within} input[value={value}]").click()
        self.frames()

    def press(self, element, *keys):
        """Focuses an element and presses keys."""
        self.js("arguments[0].focus()", element)
        for key in keys:
            ActionChains(self.driver).send_keys(key).perform()
        self.frames()

    def pointer(self, element, u, v, *steps):
        """Moves the pointer to a position in an element, from (0, 0) at the top left to (1, 1). With steps, presses the button and
        drags to these positions."""
        self.js("arguments[0].scrollIntoView({block: 'center', behavior: 'instant'})", element)
        box = element.rect
        offset = lambda x, y: (int((x - 0.5) * box["width"]), int((y - 0.5) * box["height"]))
        chain = ActionChains(self.driver, duration=20).move_to_element_with_offset(element, *offset(u, v))
        if steps:
            chain.click_and_hold()
            for step in steps:
                chain.move_to_element_with_offset(element, *offset(*step))
            chain.release()
        chain.perform()
        self.frames()

    def stage(self, x, y):
        """Returns the RGB color of pixel x, y of an image on the first stage, which must not be zoomed."""
        return self.js(READ + """const c = document.querySelector('#balls .stage canvas'), [x, y, w, h] = arguments;
            return [...read(c).getImageData((x + .5) * c.width / w, (y + .5) * c.height / h, 1, 1).data].slice(0, 3)
            """, x, y, sample.WIDTH, sample.HEIGHT)

    def thumbnail(self, item, index):
        """Returns the RGBA bytes of a thumbnail."""
        return self.js(READ + """
            const c = document.querySelectorAll(`#${arguments[0]} .strip button`)[arguments[1]].firstChild;
            return [...read(c).getImageData(0, 0, c.width, c.height).data]""", item, index)

    def scale(self, value):
        """Returns the color of an error in the color scale below the stage."""
        return self.js(READ + """const c = document.querySelector('#balls .scale canvas');
            const x = Math.round(arguments[0] * (c.width - 1));
            return [...read(c).getImageData(x, 0, 1, 1).data].slice(0, 3)""", value)

    def close(self, color, expected, tolerance=3):
        """Fails if a color differs from the expected color by more than the tolerance."""
        difference = max(abs(a - b) for a, b in zip(color, expected))
        self.assertLessEqual(difference, tolerance, f"{color} is not {expected}")

    def keep(self, name, width):
        """Writes a screenshot of the whole page to the folder $REPORT_PICTURES, if it is set."""
        folder = os.environ.get("REPORT_PICTURES")
        if folder:
            height = self.js("return document.documentElement.scrollHeight")
            clip = {"x": 0, "y": 0, "width": width, "height": height, "scale": 1}
            shot = self.driver.execute_cdp_cmd("Page.captureScreenshot", {"captureBeyondViewport": True, "clip": clip})
            with open(os.path.join(folder, name + ".png"), "wb") as file:
                file.write(base64.b64decode(shot["data"]))
