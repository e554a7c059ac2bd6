"""Lights, in Blender's units: watts of points, spots and areas, watts per square meter of suns."""
import hashlib
import math
import os
import re

import numpy as np

from . import exr, scene_text

SEGMENTS = 64  # of a disk
SPOT_ROWS = 1024  # of the map of a spot, from pole to pole


def group_parameters(name):
    """Returns the parameter of a light group, whose name has letters, digits and underscores only."""
    return [("string", "group", group_name(name))] if name else []


def group_name(name):
    """Returns the name of a light group in strobe."""
    return re.sub(r"\W", "_", name, flags=re.ASCII)


def _color(light):
    """Returns the color times the strength."""
    strength = light.energy
    color = np.array(light.color, float)
    if light.use_nodes and light.node_tree:
        node = next((n for n in light.node_tree.nodes if n.type == "EMISSION"), None)
        if node and not node.inputs["Strength"].is_linked and not node.inputs["Color"].is_linked:
            color = color * np.array(node.inputs["Color"].default_value)[:3]
            strength *= node.inputs["Strength"].default_value
    return color * strength


def _has_unknown_nodes(light):
    """Returns whether nodes of a light have more than an emission of constant color."""
    if not (light.use_nodes and light.node_tree):
        return False
    return any(n.type not in ("EMISSION", "OUTPUT_LIGHT", "REROUTE", "FRAME") for n in light.node_tree.nodes)


def _outline(light):
    """Returns the corners of an area light in its plane, in the order that makes it emit along -z, and its area."""
    x, y = light.size, light.size if light.shape in ("SQUARE", "DISK") else light.size_y
    if light.shape in ("SQUARE", "RECTANGLE"):
        return [(-x / 2, -y / 2), (-x / 2, y / 2), (x / 2, y / 2), (x / 2, -y / 2)], x * y
    # The polygon has the area of the ellipse.
    r = math.sqrt(2 * math.pi / (SEGMENTS * math.sin(2 * math.pi / SEGMENTS))) / 2
    angles = [-2 * math.pi * i / SEGMENTS for i in range(SEGMENTS)]
    return [(x * r * math.cos(a), y * r * math.sin(a)) for a in angles], math.pi / 4 * x * y


def _polygon(corners):
    """Returns the parameters of a fan of triangles."""
    indices = [i for k in range(1, len(corners) - 1) for i in (0, k, k + 1)]
    points = [c for x, y in corners for c in (x, y, 0.0)]
    return [("integer", "indices", [float(i) for i in indices]), ("point", "P", points)]


def _emitter(name, radiance, group, shape, parameters, visible):
    """Returns the lines of a shape that emits. An alpha of 0 hides it from all rays but those of light sampling."""
    hidden = [] if visible else [("float", "alpha", 0.0)]
    return [scene_text.directive("Material", "matte", [("rgb", "Kd", [0.0] * 3)]),
            scene_text.directive("AreaLightSource", "diffuse", [("rgb", "L", radiance)] + group),
            scene_text.directive("Shape", shape, parameters + [("string", "name", name)] + hidden)]


def _point(obj, light, group, messages):
    """Returns the lines of a point light, which is a sphere if it has a radius."""
    r = light.shadow_soft_size
    if r <= 0:
        return [scene_text.directive("LightSource", "point", [("rgb", "I", _color(light) / (4 * math.pi))] + group)]
    return _emitter(obj.name, _color(light) / (4 * math.pi ** 2 * r * r), group, "sphere", [("float", "radius", r)],
                    obj.visible_camera)


def _spot(obj, light, group, messages, folder):
    """Returns the lines of a spot. Blender's falloff, a smooth step times the cosine to the axis, is a map of intensity."""
    if light.shadow_soft_size > 0:
        messages.add(obj.name, "the spot has no size: its shadows are sharp")
    edge = math.cos(light.spot_size / 2)
    angles = (np.arange(SPOT_ROWS) + 0.5) / SPOT_ROWS * math.pi
    cosine = np.cos(angles)
    smooth = (1 - edge) * light.spot_blend
    x = np.clip((cosine - edge) / smooth, 0, 1) if smooth > 0 else (cosine > edge).astype(float)
    falloff = np.where(cosine > edge, cosine * x * x * (3 - 2 * x), 0).astype("<f4")
    name = "spot-" + hashlib.blake2b(falloff, digest_size=8).hexdigest() + ".exr"
    path = os.path.join(folder, name)
    if not os.path.exists(path):
        image = np.ascontiguousarray(np.broadcast_to(falloff[:, None], (SPOT_ROWS, 8)))
        exr.write(path, {c: image for c in "RGB"})
    return ["Rotate -90 1 0 0", scene_text.directive("LightSource", "goniometric", [
        ("rgb", "I", _color(light) / (4 * math.pi)), ("string", "mapname", name)] + group)]


def _area(obj, light, group, matrix, messages):
    """Returns the lines of an area light."""
    if light.spread < math.pi * 0.999:
        messages.add(obj.name, "the spread of the area light is 180 degrees")
    corners, area = _outline(light)
    area *= matrix.col[0].to_3d().cross(matrix.col[1].to_3d()).length
    return _emitter(obj.name, _color(light) / (4 * area), group, "trianglemesh", _polygon(corners), obj.visible_camera)


def _sun(light, group):
    """Returns the lines of a sun."""
    return [scene_text.directive("LightSource", "distant", [
        ("rgb", "L", _color(light)), ("vector", "from", [0.0, 0.0, 1.0]), ("vector", "to", [0.0] * 3),
        ("float", "angle", min(math.degrees(light.angle), 179.0))] + group)]


def lines(obj, matrix, folder, messages):
    """Returns the lines of a light after its transform."""
    light = obj.data
    group = group_parameters(getattr(obj, "lightgroup", ""))
    if _has_unknown_nodes(light):
        messages.add(obj.name, "nodes of the light are ignored")
    return {"POINT": lambda: _point(obj, light, group, messages), "SPOT": lambda: _spot(obj, light, group, messages, folder),
            "AREA": lambda: _area(obj, light, group, matrix, messages),
            "SUN": lambda: _sun(light, group)}[light.type]()
