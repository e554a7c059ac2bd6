"""The static subject: a snail on a plinth. z is up, the snail looks along +x, and its length is about two units."""

import numpy as np

from implicit import ball, chain, ellipsoid, limb, mesh, smooth_max, smooth_min

EYES = ((0.885, 0.165, 0.86), (0.885, -0.165, 0.86))
SHELL_CENTER = (-0.10, 0.0, 0.47)


def body(p):
    """Returns the field of the body."""
    foot = chain(p, [(-0.82, 0, 0.035), (-0.45, 0, 0.07), (0.05, 0, 0.11), (0.45, 0, 0.12)], [0.02, 0.06, 0.12, 0.11], 0.1)
    neck = chain(p, [(0.4, 0, 0.14), (0.58, 0, 0.26), (0.68, 0, 0.45)], [0.12, 0.11, 0.09], 0.12)
    d = smooth_min(foot, neck, 0.15)
    ripple = 0.012 * np.sin(16 * p[:, 0]) * np.sign(p[:, 1]) * np.minimum(np.abs(p[:, 1]) / 0.1, 1)
    skirt = ellipsoid(np.stack([p[:, 0], p[:, 1] - ripple, p[:, 2]], 1), (-0.08, 0, 0.03), (0.72, 0.2, 0.035))
    d = smooth_min(d, skirt, 0.08)
    d = smooth_min(d, ellipsoid(p, (0.72, 0, 0.50), (0.15, 0.125, 0.115), -12), 0.09)
    for side in (1, -1):
        eye = EYES[0] if side > 0 else EYES[1]
        stalk = chain(p, [(0.74, side * 0.06, 0.57), (0.80, side * 0.12, 0.70), (eye[0], eye[1], eye[2])], [0.034, 0.024, 0.021], 0.03)
        d = smooth_min(d, stalk, 0.045)
        d = smooth_min(d, limb(p, (0.83, side * 0.055, 0.46), (0.93, side * 0.10, 0.41), 0.020, 0.015), 0.03)
        d = smooth_min(d, ball(p, (0.935, side * 0.103, 0.407), 0.022), 0.015)
    # The mouth: two strokes carved into the head.
    smile = chain(p, [(0.835, -0.07, 0.475), (0.865, 0, 0.445), (0.835, 0.07, 0.475)], [0.010, 0.012, 0.010], 0.02)
    d = smooth_max(d, -smile, 0.012)
    # Fine bumps on the back, which fade toward the head.
    bumps = np.sin(34 * p[:, 0]) * np.sin(34 * p[:, 1]) * np.sin(34 * p[:, 2])
    fade = np.clip((0.55 - p[:, 0]) / 0.3, 0, 1) * np.clip(p[:, 2] / 0.08, 0, 1)
    d = d + 0.006 * bumps * fade
    return smooth_max(d, -p[:, 2], 0.01)  # flat below


def shell(p):
    """Returns the field of the shell: a tube along a logarithmic spiral around the y axis, symmetric in y."""
    growth, start = 0.155, 0.30
    q = p - np.asarray(SHELL_CENTER, p.dtype)
    rho = np.hypot(q[:, 0], q[:, 2])
    angle = np.arctan2(q[:, 2], -q[:, 0])  # the opening is low and faces the head
    d = np.full(len(p), 9.0)
    for turn in range(5):
        theta = angle + 2.55 - 2 * np.pi * turn
        # The tube ends at the opening, theta = 0.75, with a lip.
        end = np.minimum(theta, 0.75)
        scale = np.exp(growth * end)
        r = start * scale
        beyond = (theta - end) * r
        ribs = 0.010 * scale * np.sin(30 * end) * np.clip((0.7 - end) * 4, 0, 1)
        tube = np.sqrt((rho - r) ** 2 + (0.9 * q[:, 1]) ** 2 + beyond ** 2)
        lip = 0.02 * np.exp(-((end - 0.68) / 0.09) ** 2)
        d = smooth_min(d, tube - (0.168 * scale + ribs + lip), 0.025)
    return smooth_min(d, ellipsoid(p, SHELL_CENTER, (0.13, 0.085, 0.13)), 0.03)


def plinth(p):
    """Returns the field of a low round plinth with a groove; its top is at z = 0."""
    rho = np.hypot(p[:, 0], p[:, 1])
    d = smooth_max(rho - 1.12, np.abs(p[:, 2] + 0.09) - 0.09, 0.05)
    foot = smooth_max(rho - 1.22, np.abs(p[:, 2] + 0.22) - 0.08, 0.05)
    d = smooth_min(d, foot, 0.02)
    groove = np.hypot(rho - 1.12, p[:, 2] + 0.07) - 0.022
    return smooth_max(d, -groove, 0.015)


def meshes():
    """Yields the file name and the mesh of each part."""
    yield "snail-body.ply", mesh(body, (-0.95, -0.35, -0.05), (1.05, 0.35, 1.0), 0.0072)
    yield "snail-shell.ply", mesh(shell, (-0.75, -0.4, -0.1), (0.6, 0.4, 1.1), 0.0085)
    yield "plinth.ply", mesh(plinth, (-1.4, -1.4, -0.4), (1.4, 1.4, 0.1), 0.022)
