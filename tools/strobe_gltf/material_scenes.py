"""Scenes of materials and textures, built in Blender. Runs inside Blender. See scenes.py for the options they return."""
import math

import kit
from kit import camera, floor, link, material, shape
from scenes import lamps


def emissive():
    """Emissive meshes as the only lights, with emission above 1 (KHR_materials_emissive_strength)."""
    floor()
    shape("plane", material("wall", (0.5, 0.5, 0.6)), (0, 3, 2), rotation=(math.pi / 2, 0, 0), size=12)
    shape("cube", material("box", (0.7, 0.7, 0.7)), (0, 0, 0.6), rotation=(0, 0, 0.4), size=1.2)
    shape("plane", material("panel", (0, 0, 0), emission=(1, 0.8, 0.5), strength=12), (-2, 0, 3.6), size=1.5,
          rotation=(math.pi, 0.4, 0))
    shape("ico_sphere", material("bulb", (0, 0, 0), emission=(0.2, 0.5, 1), strength=3), (2.2, -0.4, 1.5), radius=0.5,
          subdivisions=3)
    camera()
    return dict(bounces=4, samples=600)


def metals():
    """GGX metals of increasing roughness under a large emissive panel."""
    floor((0.4, 0.4, 0.4))
    shape("plane", material("wall", (0.5, 0.5, 0.5)), (0, 3, 2), rotation=(math.pi / 2, 0, 0), size=16)
    for i, roughness in enumerate((0.35, 0.45, 0.6, 0.8, 1)):
        color = ((0.95, 0.85, 0.6), (0.9, 0.9, 0.92), (0.9, 0.6, 0.5), (0.8, 0.8, 0.8), (0.95, 0.95, 0.95))[i]
        shape("uv_sphere", material(f"metal{i}", color, 1, roughness), (i * 1.5 - 3, 0.3 * (i % 2), 0.75), smooth=True,
              segments=48, ring_count=24, radius=0.7)
    panel = material("panel", (0, 0, 0), emission=(1, 1, 1), strength=6)
    shape("plane", panel, (0, -2, 5), rotation=(math.pi - 0.4, 0, 0), size=4)
    camera((0, -9, 3.5), (70, 0, 0))
    return dict(samples=600)


def _wave(x, n):
    """Returns a sine of n periods over [0,1], with values in [0,1]."""
    return 0.5 + 0.5 * math.sin(2 * math.pi * n * x)


def _separated(owner, node):
    """Returns the red, green and blue outputs of a texture node."""
    split = owner.node_tree.nodes.new("ShaderNodeSeparateColor")
    link(owner, node.outputs["Color"], split.inputs[0])
    return split.outputs


def _dotted(name, dots=4):
    """Returns an image whose alpha has round holes with soft edges."""
    def texel(x, y):
        r = math.hypot((x * dots) % 1 - 0.5, (y * dots) % 1 - 0.5)
        return (0.9, 0.5 + 0.4 * y, 0.3, min(max((r - 0.2) * 5, 0), 1))
    return kit.image(name, texel)


def _patches():
    """Returns a material with a roughness texture of waves and a metallic texture of stripes."""
    patches = material("patches", (0.95, 0.85, 0.7))
    channels = _separated(patches, kit.texture(patches, kit.image(
        "patches", lambda x, y: (0, 0.45 + 0.5 * _wave(y, 1), float(4 * x % 1 > 0.5), 1), color=False)))
    link(patches, channels["Green"], kit.bsdf_of(patches).inputs["Roughness"])
    link(patches, channels["Blue"], kit.bsdf_of(patches).inputs["Metallic"])
    return patches


def _bumps(**options):
    """Returns a material with a normal map."""
    bumpy = material("bumpy", (0.7, 0.5, 0.4), **options)
    node = kit.texture(bumpy, kit.image("bumps", lambda x, y: (
        0.5 + 0.25 * math.cos(2 * math.pi * 3 * x), 0.5 + 0.2 * math.cos(2 * math.pi * 2 * y), 0.93, 1), color=False))
    normals = bumpy.node_tree.nodes.new("ShaderNodeNormalMap")
    normals.uv_map = "UVMap"
    link(bumpy, node.outputs["Color"], normals.inputs["Color"])
    link(bumpy, normals.outputs["Normal"], kit.bsdf_of(bumpy).inputs["Normal"])
    return bumpy


def textures():
    """Textures of base color, metallic-roughness, normals (with tangents) and emission, some with KHR_texture_transform, in
    separate files."""
    ground = material("tiles", (1, 1, 1))
    tiles = kit.image("tiles", lambda x, y: (0.35 + 0.4 * _wave(x, 2), 0.5, 0.35 + 0.4 * _wave(y, 3), 1), embedded=False)
    link(ground, kit.texture(ground, tiles, (3, 2), (0.2, 0.1), 0.3).outputs["Color"], kit.bsdf_of(ground).inputs["Base Color"])
    shape("plane", ground, size=12)
    shape("plane", _patches(), (-2.3, 0.4, 1.1), rotation=(1.2, 0, -0.2), size=2)
    shape("plane", _bumps(metallic=1, roughness=0.6), (0.2, 0.8, 1.2), rotation=(1.2, 0, 0.2), size=2)
    screen = material("screen", (0.1, 0.1, 0.1), emission=(1, 1, 1), strength=1.5)
    glow = kit.image("glow", lambda x, y: (_wave(x, 1), _wave(y, 2), 0.3, 1))
    link(screen, kit.texture(screen, glow, (1, 1), (0.25, 0)).outputs["Color"], kit.bsdf_of(screen).inputs["Emission"])
    shape("cube", screen, (2.2, -0.6, 0.6), rotation=(0, 0, 0.5), size=1.2)
    lamps()
    camera()
    return dict(file=".gltf", samples=600, export=dict(export_tangents=True))


def textured_round():
    """A normal map on a diffuse material, and stripes on a sphere up to its silhouette."""
    floor()
    shape("uv_sphere", _patches(), (-1.5, 0.4, 1), smooth=True, segments=48, ring_count=24)
    shape("plane", _bumps(), (1.2, 0.8, 1.2), rotation=(1.2, 0, 0.2), size=2)
    lamps()
    camera()
    return dict(export=dict(export_tangents=True), inexact="Cycles reduces diffuse light where mapped normals differ from the "
                "face's; at a silhouette strobe's texture filter is wider than the visible part")


def alpha():
    """Cut-out and transparent sheets, and their shadows."""
    floor()
    for i, mode in enumerate(("MASK", "BLEND")):
        sheet = material(mode.lower(), alpha=mode, cutoff=0.4)
        node = kit.texture(sheet, _dotted(mode.lower()))
        link(sheet, node.outputs["Color"], kit.bsdf_of(sheet).inputs["Base Color"])
        link(sheet, node.outputs["Alpha"], kit.bsdf_of(sheet).inputs["Alpha"])
        shape("plane", sheet, (3 * i - 1.5, 0, 1.3), rotation=(1.2, 0, 0.3 - 0.6 * i), size=2.2)
    veil = material("veil", (0.2, 0.3, 0.8), alpha="BLEND")
    kit.bsdf_of(veil).inputs["Alpha"].default_value = 0.35
    shape("uv_sphere", veil, (0, -2, 0.7), smooth=True, radius=0.6)
    lamps()
    camera()
    return {}


def vertex_colors():
    """COLOR_0, interpolated over faces and multiplied by the base color."""
    floor()
    for i, tint in enumerate(((1, 1, 1), (1, 0.5, 0.3))):
        painted = material(f"painted{i}", tint)
        ball = shape("uv_sphere" if i else "monkey", None, (3 * i - 1.5, 0, 1.1), smooth=True)
        ball.data.materials.append(painted)
        paint = ball.data.color_attributes.new("paint", "FLOAT_COLOR", "POINT")
        for entry, vertex in zip(paint.data, ball.data.vertices):
            x, y, z = vertex.co
            entry.color = (0.5 + 0.4 * math.sin(4 * x), 0.5 + 0.4 * math.sin(4 * y), 0.5 + 0.4 * z, 1)
        kit.tint_by_attribute(painted, "paint", tint)
    lamps()
    camera()
    return {}


def gloss():
    """Dielectrics of Blender's Principled BSDF."""
    floor()
    for i, roughness in enumerate((0.15, 0.3, 0.5, 0.75)):
        glossy = material(f"gloss{i}", ((0.8, 0.1, 0.1), (0.1, 0.5, 0.2), (0.2, 0.3, 0.8), (0.7, 0.6, 0.2))[i], 0, roughness,
                        exact=False)
        shape("uv_sphere", glossy, (i * 1.8 - 2.7, 0, 0.8), smooth=True, radius=0.8, segments=48, ring_count=24)
    shape("plane", material("panel", (0, 0, 0), emission=(1, 1, 1), strength=6), (0, -2, 5), rotation=(math.pi - 0.4, 0, 0),
          size=3)
    lamps()
    camera()
    return dict(inexact="Principled has Disney's diffuse lobe instead of Lambert's, and exact Fresnel instead of Schlick's")


def extensions():
    """Transmission, clearcoat, index of refraction and emissive strength."""
    floor()
    glass, coat = (material(name, (0.9, 0.95, 0.9), 0, 0.3, exact=False) for name in ("glass", "coat"))
    kit.bsdf_of(glass).inputs["Transmission"].default_value = 1
    kit.bsdf_of(glass).inputs["IOR"].default_value = 1.3
    kit.bsdf_of(coat).inputs["Base Color"].default_value = (0.6, 0.05, 0.05, 1)
    kit.bsdf_of(coat).inputs["Clearcoat"].default_value = 1
    kit.bsdf_of(coat).inputs["Clearcoat Roughness"].default_value = 0.1
    shape("plane", glass, (-1.6, 0, 1.1), rotation=(1.4, 0, 0.3), size=2)
    shape("cube", material("behind", (0.1, 0.2, 0.8)), (-1.5, 1.6, 0.6), size=1)
    shape("uv_sphere", coat, (1.6, 0, 1), smooth=True, segments=48, ring_count=24)
    shape("plane", material("panel", (0, 0, 0), emission=(1, 0.9, 0.8), strength=8), (0, -2, 5), rotation=(math.pi - 0.4, 0, 0),
          size=2)
    camera()
    return dict(bounces=4, inexact="transmission of glTF is a thin wall, of Principled a solid; "
                "Principled's coat has a quarter of the weight")


def volumes():
    """Glass that absorbs light (KHR_materials_transmission, _volume and _ior) before a wall, lit by emissive panels."""
    floor((0.6, 0.6, 0.6))
    shape("plane", material("wall", (0.7, 0.5, 0.4)), (0, 3, 2), rotation=(math.pi / 2, 0, 0), size=16)
    for i, (color, ior) in enumerate((((1, 1, 1), 1.5), ((0.2, 0.7, 0.4), 1.33), ((0.9, 0.3, 0.1), 1.7))):
        glass = kit.glass(f"glass{i}", color, 1.2, ior)
        kind, options = ("cube", dict(size=1.3, rotation=(0, 0, 0.5))) if i == 1 else (
            "uv_sphere", dict(smooth=True, segments=64, ring_count=32, radius=0.8))
        shape(kind, glass, (i * 2 - 2, 0, 0.9), **options)
    panel = material("panel", (0, 0, 0), emission=(1, 1, 1), strength=4)
    shape("plane", panel, (0, -2, 6), rotation=(math.pi - 0.4, 0, 0), size=8)
    camera((0, -9, 3.5), (70, 0, 0))
    return dict(samples=1000, bounces=12)


def anisotropic():
    """Brushed metals (KHR_materials_anisotropy, which glb.to_anisotropic adds) under an emissive panel."""
    floor((0.4, 0.4, 0.4))
    shape("plane", material("wall", (0.5, 0.5, 0.5)), (0, 3, 2), rotation=(math.pi / 2, 0, 0), size=16)
    for i, (roughness, strength) in enumerate(((0.4, 0.5), (0.5, 0.8), (0.6, 1))):
        brushed = kit.brushed(f"brushed{i} {strength}", (0.9, 0.8, 0.7), roughness, strength)
        shape("plane", brushed, (i * 2.2 - 2.2, 0.3, 1.2), rotation=(1.1, 0, 0.3 * (1 - i)), size=2)
    panel = material("panel", (0, 0, 0), emission=(1, 1, 1), strength=6)
    shape("plane", panel, (0, -2, 5), rotation=(math.pi - 0.4, 0, 0), size=4)
    camera((0, -9, 3.5), (70, 0, 0))
    return dict(samples=600, export=dict(export_tangents=True))
