"""Images of the living room: floorboards, a rug, a painting, and the view from the window.

Each function returns rows of RGB values as display values; row 0 is the top.
"""

import numpy as np


def _grid(width, height):
    """Returns x in [0,1] to the right and y in [0,1] upward, at the centers of the pixels."""
    return np.meshgrid((np.arange(width) + 0.5) / width, 1 - (np.arange(height) + 0.5) / height)


def _ramp(x, width):
    """Returns a linear ramp from 0 to 1 of this width, centered at x = 0."""
    return np.clip(x / width + 0.5, 0, 1)


def _noise(x, y, seed, count=9):
    """Returns smooth noise of about [-1,1]: a sum of sines along directions that follow from the seed."""
    total = 0 * (x + y)
    for k in range(count):
        angle, f = seed + 2.399963 * k, 1.45 ** k
        total = total + np.sin(2 * np.pi * f * (np.cos(angle) * x + np.sin(angle) * y) + 7 * angle) / (1 + 0.5 * k)
    return total / 3.0


def _paint(rgb, mask, color):
    """Returns an image with a color where the mask is 1."""
    mask = mask[..., None]
    return rgb * (1 - mask) + np.asarray(color, float) * mask


def floorboards(size=768, rows=8):
    """Returns boards of oak along x, which repeat in both directions; `rows` boards lie above each other."""
    x, y = _grid(size, size)
    row = np.floor(y * rows)
    shift = (row * 0.6180339887) % 1
    along = x + shift
    board = row * 2 + np.floor(along * 2) % 2
    tone = (board * 0.7548776662 + 0.2) % 1
    # The grain repeats with the board: it depends on the distance from the board's end.
    local = (along * 2) % 1
    wave = np.sin(np.pi * local) ** 2 * _noise(0.8 * local, 0.5 * y * rows, 1.3, 5)
    grain = np.sin(46 * (y * rows % 1) + 9 * wave + 40 * tone)
    fine = np.sin(np.pi * local) * _noise(7 * local + 9 * tone, 3.0 * y * rows + 11 * tone, 2.1)
    light = 0.86 + 0.26 * (tone - 0.5) + 0.045 * grain + 0.06 * fine
    rgb = light[..., None] * np.array([0.74, 0.55, 0.37]) + (tone[..., None] - 0.5) * np.array([0.02, 0.0, -0.03])
    gap = np.minimum(y * rows % 1, 1 - y * rows % 1) / rows
    end = np.minimum(local, 1 - local) / 2
    return _paint(rgb, np.maximum(_ramp(0.0018 - gap, 0.0015), _ramp(0.0013 - end, 0.0015)), (0.26, 0.17, 0.10))


def rug(width=960, height=640):
    """Returns a woven rug with a border and a field of lozenges."""
    x, y = _grid(width, height)
    x = 1.5 * x
    edge = np.minimum(np.minimum(x, 1.5 - x), np.minimum(y, 1 - y))
    cream, red, navy, sand = (0.88, 0.83, 0.72), (0.62, 0.22, 0.16), (0.15, 0.22, 0.34), (0.78, 0.58, 0.34)
    rgb = np.broadcast_to(np.array(cream), (*x.shape, 3))
    u, v = (x * 8) % 1 - 0.5, (y * 8) % 1 - 0.5
    lozenge = np.abs(u) + np.abs(v)
    odd = (np.floor(x * 8) + np.floor(y * 8)) % 2
    rgb = _paint(rgb, _ramp(0.44 - lozenge, 0.03) * odd, navy)
    rgb = _paint(rgb, _ramp(0.44 - lozenge, 0.03) * (1 - odd), red)
    rgb = _paint(rgb, _ramp(0.26 - lozenge, 0.03), sand)
    rgb = _paint(rgb, _ramp(0.12 - lozenge, 0.03), cream)
    rgb = _paint(rgb, _ramp(0.125 - edge, 0.004), navy)
    teeth = np.abs(((x + y) * 16) % 1 - 0.5)
    rgb = _paint(rgb, _ramp(0.11 - edge, 0.004) * _ramp(edge - 0.065, 0.004) * _ramp(teeth - 0.25, 0.06), sand)
    rgb = _paint(rgb, _ramp(0.05 - edge, 0.004), red)
    rgb = _paint(rgb, _ramp(0.018 - edge, 0.004), cream)
    thread = 1 + 0.05 * np.sin(x * 640) * np.sin(y * 640) + 0.04 * _noise(3 * x, 20 * y, 0.4)
    return rgb * thread[..., None]


def painting(width=720, height=480):
    """Returns a painting of hills at sunset in flat colors, with a white margin."""
    x, y = _grid(width, height)
    rgb = np.array([0.95, 0.72, 0.48]) * y[..., None] + np.array([0.98, 0.90, 0.74]) * (1 - y[..., None])
    disc = np.hypot(1.5 * (x - 0.64), y - 0.60)
    rgb = _paint(rgb, _ramp(0.20 - disc, 0.006), (0.97, 0.55, 0.30))
    rgb = _paint(rgb, _ramp(0.13 - disc, 0.006), (0.93, 0.36, 0.22))
    hills = ((0.52, 0.10, 1.1, (0.55, 0.50, 0.55)), (0.40, 0.12, 2.7, (0.30, 0.42, 0.50)), (0.27, 0.10, 4.4, (0.16, 0.30, 0.38)),
             (0.14, 0.07, 0.2, (0.09, 0.17, 0.22)))
    for level, rise, seed, color in hills:
        ridge = level + rise * _noise(0.55 * x, 0 * y, seed, 4)
        rgb = _paint(rgb, _ramp(ridge - y, 0.006), color)
    margin = np.minimum(np.minimum(x, 1 - x) * 1.5, np.minimum(y, 1 - y))
    return _paint(rgb, _ramp(0.07 - margin, 0.004), (0.93, 0.91, 0.87))


def garden(width=512, height=448):
    """Returns the view from the window: sky with clouds, a row of trees and a meadow."""
    x, y = _grid(width, height)
    rgb = np.array([0.70, 0.83, 0.97]) * y[..., None] + np.array([0.95, 0.97, 0.98]) * (1 - y[..., None])
    cloud = np.clip(_noise(0.9 * x, 2.0 * y, 3.1) * 1.4 - 0.1, 0, 1) * _ramp(y - 0.5, 0.4)
    rgb = _paint(rgb, cloud, (1, 1, 1))
    far = 0.36 + 0.03 * _noise(0.8 * x, 0 * y, 5.0)
    rgb = _paint(rgb, _ramp(far - y, 0.02), (0.55, 0.70, 0.68))
    crown = 0.34 + 0.07 * np.abs(np.sin(9 * x + 0.7)) ** 0.7 + 0.02 * _noise(4 * x, 4 * y, 0.9)
    rgb = _paint(rgb, _ramp(crown - y, 0.012), (0.30, 0.48, 0.26))
    rgb = rgb * (1 + 0.12 * _noise(5 * x, 5 * y, 2.0) * _ramp(0.4 - y, 0.1))[..., None]
    meadow = 0.24 + 0.02 * _noise(0.7 * x, 0 * y, 1.7)
    return _paint(rgb, _ramp(meadow - y, 0.01), (0.62, 0.74, 0.38))
