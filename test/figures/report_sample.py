"""A small synthetic output folder of tools/figures with difficult content: text that looks like HTML, pixels that are NaN, and
points that a logarithmic axis cannot show."""
import json
import os

import numpy as np
import OpenImageIO as oiio

WIDTH, HEIGHT = 240, 160
GRAY = 0.25            # linear value of the left ten columns of every image, and of the next ten of the reference
OFF_GRAY = 0.375       # linear value of the next ten columns of the noisy images
NOISE = {4: 0.30, 16: 0.15, 64: 0.075}
DRAWING = """<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 400 120" width="400" height="120">
<style>.a { fill: #0064a6 }</style><rect class="a" width="180" height="120"/>
<circle cx="290" cy="60" r="50" style="fill: #c44a06"/></svg>"""
HOSTILE = "<b>bold</b> & \"quoted\" </script><script>document.title = 'broken'</script>"


def write(path, pixels):
    """Writes an EXR or PNG file."""
    height, width, channels = pixels.shape
    spec = oiio.ImageSpec(width, height, channels, oiio.FLOAT if path.endswith(".exr") else oiio.UINT8)
    file = oiio.ImageOutput.create(path)
    file.open(path, spec)
    file.write_image(np.ascontiguousarray(pixels, dtype=np.float32))
    file.close()


def encoded(linear):
    """Returns linear values clamped to [0,1] and encoded as sRGB."""
    linear = np.clip(linear, 0, 1)
    return np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1 / 2.4) - 0.055)


def scene():
    """Returns an image of three lit balls over a floor: linear, above 1 in the highlights, with a gray margin."""
    y, x = np.mgrid[0:HEIGHT, 0:WIDTH].astype(np.float64)
    floor, sky = 0.12 + 0.1 * ((x // 16 + y // 12) % 2), 0.45 - y / 400
    image = np.where(y > 105, floor, sky)[..., None] * [0.92, 0.97, 1.05]
    light = np.array([-0.5, -0.65, 0.57])
    balls = (80, 85, 38, (0.7, 0.16, 0.1)), (150, 98, 30, (0.12, 0.4, 0.6)), (205, 112, 20, (0.75, 0.6, 0.2))
    for cx, cy, r, color in balls:
        dx, dy = (x - cx) / r, (y - cy) / r
        normal = np.stack([dx, dy, np.sqrt(np.maximum(0, 1 - dx * dx - dy * dy))], axis=-1)
        cosine = np.clip(normal @ light, 0, None)[..., None]
        ball = (0.06 + cosine) * np.array(color) + 6 * cosine ** 60
        inside = dx * dx + dy * dy < 1
        image[inside] = ball[inside]
    image[:, :20] = GRAY
    return image


def pictures(folder):
    """Writes the image files of all items."""
    reference, random = scene(), np.random.default_rng(7)
    write(os.path.join(folder, "reference.exr"), reference)
    for spp, noise in NOISE.items():
        noisy = reference * np.maximum(0, 1 + noise * random.standard_normal((HEIGHT, WIDTH, 1)))
        noisy[:, :10], noisy[:, 10:20] = GRAY, OFF_GRAY
        if spp == 4:
            noisy[0, WIDTH - 1] = np.nan
        write(os.path.join(folder, f"noisy-{spp}.exr"), noisy)
    write(os.path.join(folder, "flat.png"), encoded(reference))
    write(os.path.join(folder, "heat.exr"), reference.mean(axis=2, keepdims=True))
    with open(os.path.join(folder, "drawing.svg"), "w", encoding="utf-8") as file:
        file.write(DRAWING)


def images():
    """Returns a comparison of images with a reference and crops."""
    noisy = [{"label": f"supersample {spp}", "file": f"noisy-{spp}.exr", "caption": f"relMSE {noise ** 2:.4f}"}
             for spp, noise in NOISE.items()]
    reference = {"label": "reference", "file": "reference.exr", "caption": HOSTILE}
    return {"kind": "images", "id": "balls", "title": "Noise against samples",
            "text": "Three balls.\n\nThe margin is gray.", "images": [reference] + noisy, "reference": 0,
            "crops": [[60, 60, 45, 30], [135, 75, 30, 30]]}


def plain():
    """Returns a comparison of images without a reference."""
    return {"kind": "images", "id": "plain", "title": "Two file formats", "reference": None,
            "text": "An 8-bit file and a file with one channel.",
            "images": [{"label": "flat.png", "file": "flat.png", "caption": ""},
                       {"label": "heat.exr", "file": "heat.exr", "caption": "one channel"}]}


def method(name, scale, **members):
    """Returns a series with a confidence band, whose error falls with time."""
    seconds = np.array([0.5, 1.1, 2.3, 4.9, 10.2])
    error = scale / seconds ** 0.9
    return {"name": name, "points": [[s, e, e * 0.8, e * 1.25] for s, e in zip(seconds, error)],
            "labels": [f"{4 * 4 ** i} spp" for i in range(5)], **members}


def speed():
    """Returns a chart with logarithmic axes."""
    front = {"name": "Pareto front", "points": [point[:2] for point in method("", 0.004)["points"]], "front": True}
    exact = {"name": "exact", "points": [[0.7, 0.0], [3.0, 0.0008]], "variant": 1}
    return {"kind": "chart", "id": "speed", "title": "Speed against accuracy", "xlog": True, "ylog": True,
            "text": "Lower and further left is better.", "xlabel": "seconds", "ylabel": "relative MSE",
            "marks": [{"x": 2.0, "label": "two seconds"}],
            "series": [front, method("supersample", 0.02, integrator="supersample"),
                       method("msaa", 0.009, integrator="msaa"),
                       method("msaa-cache", 0.004, integrator="msaa-cache", variant=1), method(HOSTILE[:40], 0.04), exact]}


def flicker():
    """Returns a chart with linear axes."""
    curve = lambda mean, swing: [[frame, mean + swing * np.sin(frame / 4)] for frame in range(0, 25, 4)]
    return {"kind": "chart", "id": "flicker", "title": "Flicker while the camera turns", "text": "",
            "xlabel": "frame", "ylabel": "standard deviation", "xlog": False, "ylog": False,
            "series": [{"name": "supersample", "points": curve(0.02, 0.002)},
                       {"name": "msaa-cache", "points": curve(0.031, 0.006), "variant": 1}]}


def table():
    """Returns a table with empty cells."""
    return {"kind": "table", "id": "cost", "number": "Paper Table 7", "title": "Cost of an image", "text": "Medians of five runs.",
            "columns": [{"name": "method", "type": "text"}, {"name": "shades per pixel", "type": "number", "digits": 2},
                        {"name": "seconds", "type": "number", "digits": 3}, {"name": "remark", "type": "text"}],
            "rows": [["supersample", 16, 9.5, "the baseline"], ["msaa", 2.9, 10.25, HOSTILE[:12]],
                     ["msaa-cache", 0.85, 4.125, ""], ["none", None, None, "did not finish"]]}


def write_sample(folder):
    """Writes the folder. Returns the content of its report.json."""
    pictures(folder)
    drawing = {"kind": "picture", "id": "drawing", "title": "A drawing", "text": "", "file": "drawing.svg"}
    text = "The chart shows error over time on logarithmic axes.\n\nText may look like a tag: " + HOSTILE
    report = {"title": "Speed of shared shading", "subtitle": "strobe 0.0.0 · a synthetic sample · no date",
              "sections": [{"id": "speed-and-accuracy", "title": "Speed and accuracy", "text": text,
                            "items": [speed(), images(), table()]},
                           {"id": "stability", "title": "Stability", "text": "",
                            "items": [flicker(), plain(), drawing]}]}
    with open(os.path.join(folder, "report.json"), "w", encoding="utf-8") as file:
        json.dump(report, file)
    return report
