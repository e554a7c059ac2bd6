"""Images of the scenes: an environment map at dusk and two patterns. Each function returns rows of RGB values."""

import numpy as np


def _waves(d, frequencies, seed):
    """Returns smooth noise of about [-1,1] for directions: a sum of sines along axes that follow from the seed."""
    total = np.zeros(d.shape[:-1])
    angle = seed
    for f in frequencies:
        for _ in range(3):
            angle += 2.399963
            axis = np.array([np.cos(angle), np.sin(angle), np.sin(1.7 * angle) * 0.6])
            total += np.sin(f * (d @ axis) + 5 * angle) / f
    return total / sum(1 / f for f in frequencies) / 1.7


def directions(width):
    """Returns the unit vectors of the pixels of a latitude-longitude map with z up, as an array of shape (width / 2, width, 3)."""
    height = width // 2
    phi = (np.arange(width) + 0.5) / width * 2 * np.pi
    theta = (np.arange(height) + 0.5) / height * np.pi
    sin = np.sin(theta)[:, None]
    return np.stack([sin * np.cos(phi), sin * np.sin(phi), np.cos(theta)[:, None] + 0 * phi], -1)


def dusk(width=1024):
    """Returns a latitude-longitude map of linear radiance with z up: u = phi / 2 pi, v = theta / pi; row 0 is the zenith."""
    d = directions(width)
    z = d[..., 2:]
    horizon, zenith = np.array([1.25, 0.55, 0.24]), np.array([0.07, 0.13, 0.34])
    sky = zenith + (horizon - zenith) * np.exp(-5.5 * np.abs(z))
    flow = d / (np.abs(z) + 0.22)  # projects the clouds to a plane
    cloud = np.clip(_waves(flow, (2.1, 3.7, 6.3, 11.0), 0.3) * 1.5 + 0.12, 0, 1)[..., None] ** 1.5
    sun = np.array([np.cos(0.9), np.sin(0.9), 0.26])
    sun /= np.linalg.norm(sun)
    cosine = np.clip(d @ sun, -1, 1)[..., None]
    glow = np.exp(-(1 - cosine) / 0.03)
    lit = np.array([0.95, 0.42, 0.30]) * (0.35 + 1.6 * glow)
    sky = sky * (1 - 0.75 * cloud) + lit * 0.75 * cloud + np.array([1.6, 0.75, 0.25]) * glow
    disc = 1 / (1 + np.exp((np.arccos(cosine) - 0.045) / 0.006))
    sky = sky + np.array([260.0, 165.0, 85.0]) * disc
    ground = np.array([0.055, 0.045, 0.05]) * (1 + 0.25 * _waves(flow, (5.0, 9.0), 1.0)[..., None])
    ground = ground + np.array([0.16, 0.07, 0.03]) * np.exp(-9 * np.abs(z))
    edge = 1 / (1 + np.exp(-z / 0.006))
    return np.maximum(ground * (1 - edge) + sky * edge, 0)


def _smooth(x, width):
    """Returns a linear ramp from 0 to 1 of this width, centered at x = 0."""
    return np.clip(x / width + 0.5, 0, 1)


def stripes(width=1024, height=512):
    """Returns petrol and cream bands with orange lines as display values. The bands spiral around a sphere."""
    u = ((np.arange(width) + 0.5) / width)[None, :]
    v = ((np.arange(height) + 0.5) / height)[:, None]
    phase = (7 * v + 2 * u) % 1
    band = _smooth(0.26 - np.abs(phase - 0.5), 0.02)[..., None]
    line = _smooth(0.028 - np.abs(phase - 0.12), 0.02)[..., None] + _smooth(0.028 - np.abs(phase - 0.88), 0.02)[..., None]
    rgb = np.array([0.93, 0.89, 0.80]) * (1 - band) + np.array([0.05, 0.34, 0.40]) * band
    return rgb * (1 - line) + np.array([0.92, 0.42, 0.10]) * line


def tiles(size=512):
    """Returns a repeating pattern of 4 x 4 tiles, whose quarter circles join to rings, as display values."""
    x, y = np.meshgrid((np.arange(size) + 0.5) / size * 4, (np.arange(size) + 0.5) / size * 4)
    ix, iy = np.floor(x).astype(int), np.floor(y).astype(int)
    fx, fy = x - ix, y - iy
    turn = (ix * 7 + iy * 5 + ix * iy) % 2
    fx = np.where(turn, 1 - fx, fx)
    near = np.minimum(np.hypot(fx, fy), np.hypot(1 - fx, 1 - fy))
    ring = (_smooth(0.14 - np.abs(near - 0.5), 0.02))[..., None]
    core = (_smooth(0.19 - near, 0.02))[..., None]
    tint = (0.94 + 0.06 * ((ix * 3 + iy * 7) % 4) / 3)[..., None]
    rgb = np.array([0.90, 0.87, 0.78]) * (1 - ring) + np.array([0.10, 0.27, 0.50]) * ring
    rgb = rgb * (1 - core) + np.array([0.80, 0.35, 0.16]) * core
    edge = np.minimum(np.minimum(x % 1, 1 - x % 1), np.minimum(y % 1, 1 - y % 1))
    grout = _smooth(0.014 - edge, 0.012)[..., None]
    return rgb * tint * (1 - grout) + np.array([0.42, 0.40, 0.38]) * grout
