"""Runs inside Blender: the scenes. Each makes itself and returns how it is exported and rendered:
frame, shutter: of the picture (none: at rest); export: options of the exporter; bounces, samples: of Cycles;
more: how many times as many strobe takes, where it is noisier; file: its name's ending; why: Cycles has no equal material."""
import math

import bpy
import kit
from kit import camera, floor, keys, light, link, material, put, shape
from mathutils import Quaternion

ANIMATED = dict(frame=7, shutter=0.5, last=13)
# Blender derives normals from deformed faces, glTF deforms normals. Without any, both have those of the faces.
FACED = dict(ANIMATED, export=dict(export_normals=False))
BENT_NORMALS = "Blender derives normals from the deformed faces, glTF deforms those of the rest pose"


def lamps():
    light("POINT", 800, (3, -4, 5))
    light("SUN", 1, rotation=(0.6, 0.3, 0))


def primitives():
    """Smooth and flat normals."""
    floor()
    shape("uv_sphere", material("red", (0.8, 0.1, 0.1)), (-2, 0, 1), smooth=True)
    shape("ico_sphere", material("flat", (0.2, 0.5, 0.8)), (0.3, 0.6, 1), subdivisions=2)
    shape("torus", material("green", (0.1, 0.6, 0.2)), (2.2, 0, 0.6), smooth=True, rotation=(0.9, 0.2, 0))
    shape("cone", material("sand", (0.7, 0.5, 0.2)), (0.6, -2, 0.7), radius1=0.7, depth=1.4)
    shape("cube", material("pale", (0.8, 0.8, 0.7)), (-1.2, -2, 0.4), rotation=(0, 0, 0.5), size=0.8)
    lamps()
    camera()
    return {}


def hierarchy():
    """Instances of one mesh below moved, turned, unevenly scaled and mirrored parents."""
    floor()
    shape("monkey", material("clay", (0.7, 0.35, 0.2)), (-2.3, 0.5, 1), smooth=True, name="first")
    mesh = bpy.context.object.data
    turned = put(None, "turned", (0, 0.4, 1.1), (0.2, -0.3, 0.9), scale=(1.5, 0.5, 0.8))
    put(mesh, "sheared", (0, 0, 0), (0.3, 0.6, 0.2), turned)
    mirror = put(None, "mirror", (2.4, 0, 1), scale=(-1, 1, 1))
    put(mesh, "mirrored", (0, 0, 0), (0, 0.2, 0.7), mirror)
    put(mesh, "inside out", (1.2, -1.9, 0.5), (0.3, 0, -0.5), scale=(-0.5, -0.5, -0.5))
    put(mesh, "below", (-1.2, -1.6, -0.3), (0.1, 0, 0), turned, (0.5, 0.9, 0.5))
    lamps()
    camera()
    return {}


def rigid():
    """Objects that move along lines, one below a moving parent, blurred."""
    floor()
    parent = put(None, "carrier", (-1.5, 0.8, 1))
    keys(parent, "location", {1: (-2.4, 0.8, 1), 13: (1.8, 0.8, 1)})
    red = shape("monkey", material("red", (0.8, 0.1, 0.1)), smooth=True, parent=parent)
    red.rotation_mode = "QUATERNION"
    keys(red, "rotation_quaternion", {f: (math.cos(a := (f - 1) * 0.12), 0, math.sin(a), 0) for f in range(1, 14)})
    box = shape("cube", material("blue", (0.1, 0.3, 0.8)), (1.6, -2, 0.6), size=1)
    keys(box, "location", {1: (-2.6, -2, 0.6), 13: (2.6, -2.2, 0.7)})
    keys(box, "scale", {1: (1, 1, 1), 13: (0.6, 1.4, 1)})
    lamps()
    camera()
    return ANIMATED


def step_and_spline():
    """One thing jumps, others swing along splines; keys, not samples, are exported."""
    floor()
    jumper = shape("cube", material("yellow", (0.8, 0.7, 0.1)), (0, 0, 0.5), size=0.9)
    keys(jumper, "location", {1: (-2.5, -1, 0.5), 5: (-2.2, -1.8, 0.5), 12: (2, 0, 0.5)}, "CONSTANT")
    swing = shape("uv_sphere", material("red", (0.8, 0.15, 0.1)), smooth=True, radius=0.6)
    keys(swing, "location", {1: (-1.5, 1, 0.8), 8: (2.2, 0.5, 2), 13: (2, -2, 0.8)}, "BEZIER")
    puff = shape("ico_sphere", material("green", (0.1, 0.6, 0.3)), (0.8, -2.2, 0.6), subdivisions=2)
    keys(puff, "scale", {1: (0.2, 0.2, 0.2), 12: (1.2, 0.5, 0.9)}, "BEZIER")
    lamps()
    camera()
    return dict(ANIMATED, frame=5, export=dict(export_force_sampling=False))


def _bend(mesh, bones, at):
    """Puts a mesh over a chain of bones along z, weighted by Blender."""
    bpy.ops.object.armature_add(location=at)
    rig = bpy.context.object
    bpy.ops.object.mode_set(mode="EDIT")
    parts = rig.data.edit_bones
    last = parts[0]
    last.head, last.tail = (0, 0, 0), (0, 0, bones[0])
    for i, end in enumerate(bones[1:]):
        bone = parts.new(f"bone{i + 1}")
        bone.head, bone.tail, bone.parent = last.tail, (0, 0, end), last
        last = bone
    bpy.ops.object.mode_set(mode="OBJECT")
    bpy.ops.object.select_all(action="DESELECT")
    mesh.select_set(True)
    rig.select_set(True)
    bpy.context.view_layer.objects.active = rig
    bpy.ops.object.parent_set(type="ARMATURE_AUTO")
    return rig


def _tube(made, at, smooth, height=2.4, radius=0.35):
    tube = shape("cylinder", made, (at[0], at[1], at[2] + height / 2), smooth=smooth, radius=radius, depth=height,
                 vertices=24)
    bpy.context.view_layer.objects.active = tube
    bpy.ops.object.mode_set(mode="EDIT")
    bpy.ops.mesh.select_all(action="SELECT")
    bpy.ops.mesh.bisect(plane_co=(0, 0, 0), plane_no=(1, 0, 0))
    for i in range(1, 12):
        bpy.ops.mesh.select_all(action="SELECT")
        bpy.ops.mesh.bisect(plane_co=(0, 0, at[2] + height * i / 12), plane_no=(0, 0, 1))
    bpy.ops.object.mode_set(mode="OBJECT")
    return tube


def _skins(smooth):
    floor()
    for name, at, color, turn in (("left", (-1.4, 0, 0), (0.1, 0.3, 0.8), 1),
                                   ("right", (1.4, 0.3, 0), (0.8, 0.3, 0.1), -0.8)):
        rig = _bend(_tube(material(name, color), at, smooth), (0.8, 1.6, 2.4), at)
        for i, bone in enumerate(rig.pose.bones):
            bone.rotation_mode = "QUATERNION"
            axis = (0, 0, turn) if i % 2 else (turn, 0, 0)
            keys(bone, "rotation_quaternion",
                 {f: (math.cos(a := (f - 5) * 0.03 * (i + 1)), *[math.sin(a) * x for x in axis]) for f in range(1, 14)})
    lamps()
    camera()


def skinned():
    """Two tubes that bend over chains of three bones."""
    _skins(False)
    return FACED


def skinned_smooth():
    """The same with normals."""
    _skins(True)
    return dict(ANIMATED, why=BENT_NORMALS)


def _shape_keys(smooth):
    floor()
    box = shape("cube", material("green", (0.1, 0.6, 0.2)), (1.6, -0.6, 0.8), size=1.2)
    box.shape_key_add(name="Basis")
    tall = box.shape_key_add(name="tall")
    for vertex in tall.data:
        if vertex.co.z > 0:
            vertex.co.x, vertex.co.y, vertex.co.z = vertex.co.x * 0.3, vertex.co.y * 0.3, vertex.co.z * 3
    keys(tall, "value", {1: 0, 13: 1})
    ball = shape("uv_sphere", material("red", (0.8, 0.2, 0.1)), (-1.5, 0, 1.1), smooth=smooth, segments=32, ring_count=16)
    ball.shape_key_add(name="Basis")
    wide, nose = ball.shape_key_add(name="wide"), ball.shape_key_add(name="nose")
    for vertex in wide.data:
        vertex.co.x *= 1.5
    for vertex in nose.data:
        if vertex.co.y < -0.8:
            vertex.co.y -= 4 * (-0.8 - vertex.co.y)
    keys(wide, "value", {1: 0, 13: 1})
    keys(nose, "value", {1: 1, 13: 0.2})
    lamps()
    camera()


def morphs():
    """Shape keys, one at a time and two at once."""
    _shape_keys(False)
    return FACED


def morphs_smooth():
    """The same with normals."""
    _shape_keys(True)
    return dict(ANIMATED, why=BENT_NORMALS)


def moving_camera():
    """The camera flies and turns past things at rest."""
    floor()
    for i in range(5):
        shape("cube", material(f"box{i}", (0.2 + 0.15 * i, 0.5, 0.8 - 0.15 * i)), (i * 1.3 - 2.6, (i % 2) * 1.5 - 0.5, 0.5),
              rotation=(0, 0, i * 0.4), size=0.9)
    lamps()
    view = camera((-2, -8, 4))
    view.rotation_mode = "QUATERNION"
    keys(view, "location", {1: (-2, -8, 4), 13: (2, -7, 3.4)})
    keys(view, "rotation_quaternion",
         {f: Quaternion((0, 0, 1), (7 - f) * 0.03) @ Quaternion((1, 0, 0), math.radians(65)) for f in range(1, 14)})
    return ANIMATED


def orthographic():
    floor()
    shape("uv_sphere", material("red", (0.8, 0.1, 0.1)), (-1.4, 0, 1), smooth=True)
    shape("cube", material("blue", (0.1, 0.2, 0.8)), (1.3, 0, 0.7), rotation=(0, 0, 0.6), size=1.4)
    lamps()
    camera((4, -6, 6), (52, 0, 34), width=8)
    return {}


def lights():
    """Colored point, spot and sun; hard cones. A closed corner sends light on."""
    floor((0.7, 0.7, 0.7))
    shape("plane", material("wall", (0.6, 0.55, 0.5)), (0, 3, 2), rotation=(math.pi / 2, 0, 0), size=12)
    shape("uv_sphere", material("ball", (0.7, 0.7, 0.7)), (0, 0.5, 1), smooth=True, segments=96, ring_count=48)
    light("POINT", 300, (-3, -1, 2), color=(1, 0.3, 0.2))
    light("SPOT", 1500, (3, -2, 5), (0.45, 0.45, 0), (0.3, 0.6, 1), cone=40)
    light("SPOT", 800, (-1, -3, 4), (0.6, -0.2, 0), (0.4, 1, 0.4), cone=25)
    light("SUN", 0.3, rotation=(-0.3, 0.7, 0), color=(1, 0.9, 0.6))
    camera()
    return dict(bounces=5, samples=400, more=6)


def emissive():
    """Meshes that shine, one beyond 1 (KHR_materials_emissive_strength), and nothing else."""
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
    """GGX metals of growing roughness under a large panel, before a wall."""
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


def two_clips():
    """The second of two animations; strobe is told its name."""
    floor()
    box = shape("cube", material("orange", (0.8, 0.4, 0.1)), (0, 0, 0.6), size=1.2)
    ball = shape("uv_sphere", material("blue", (0.1, 0.3, 0.8)), (0, -2, 0.5), smooth=True, radius=0.5)
    for clip, ends in (("slide", ((-3, 3), (2, 2))), ("climb", ((1.5, 2.2), (-2.5, 1.5)))):
        for thing, (a, b) in zip((box, ball), ends):
            y, z = thing.location.y, thing.location.z
            keys(thing, "location", {1: (a, y, 0.6), 13: (b, y, 0.6 if clip == "slide" else 2)})
            track = thing.animation_data.nla_tracks.new()
            track.name = clip
            track.strips.new(clip, 1, thing.animation_data.action).action_frame_end = 13
            thing.animation_data.action = None
            track.mute = clip == "slide"
    lamps()
    camera()
    return dict(ANIMATED, clip="climb")


def _wave(x, n):
    return 0.5 + 0.5 * math.sin(2 * math.pi * n * x)


def _separated(made, node):
    split = made.node_tree.nodes.new("ShaderNodeSeparateColor")
    link(made, node.outputs["Color"], split.inputs[0])
    return split.outputs


def _dotted(name, dots=4):
    """White, with round soft holes."""
    def texel(x, y):
        r = math.hypot((x * dots) % 1 - 0.5, (y * dots) % 1 - 0.5)
        return (0.9, 0.5 + 0.4 * y, 0.3, min(max((r - 0.2) * 5, 0), 1))
    return kit.image(name, texel)


def _patches():
    """Roughness in waves, metal and not in stripes."""
    made = material("patches", (0.95, 0.85, 0.7))
    parts = _separated(made, kit.texture(made, kit.image(
        "patches", lambda x, y: (0, 0.45 + 0.5 * _wave(y, 1), float(4 * x % 1 > 0.5), 1), color=False)))
    link(made, parts["Green"], kit.bsdf_of(made).inputs["Roughness"])
    link(made, parts["Blue"], kit.bsdf_of(made).inputs["Metallic"])
    return made


def _bumps(**how):
    made = material("bumpy", (0.7, 0.5, 0.4), **how)
    node = kit.texture(made, kit.image("bumps", lambda x, y: (
        0.5 + 0.25 * math.cos(2 * math.pi * 3 * x), 0.5 + 0.2 * math.cos(2 * math.pi * 2 * y), 0.93, 1), color=False))
    normals = made.node_tree.nodes.new("ShaderNodeNormalMap")
    normals.uv_map = "UVMap"
    link(made, node.outputs["Color"], normals.inputs["Color"])
    link(made, normals.outputs["Normal"], kit.bsdf_of(made).inputs["Normal"])
    return made


def textures():
    """Base color, metallic-roughness, normals (with tangents) and emission from images, some placed by
    KHR_texture_transform; separate files."""
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
    """Diffuse light on mapped normals, and stripes that end at a limb."""
    floor()
    shape("uv_sphere", _patches(), (-1.5, 0.4, 1), smooth=True, segments=48, ring_count=24)
    shape("plane", _bumps(), (1.2, 0.8, 1.2), rotation=(1.2, 0, 0.2), size=2)
    lamps()
    camera()
    return dict(export=dict(export_tangents=True), why="Cycles dims diffuse light where mapped normals lean from the face; at a "
                "limb strobe's filter of textures is wider than what is seen")


def alpha():
    """Cut-out and half transparent sheets, and the light that goes through them."""
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
    """COLOR_0, smooth over faces and times a base color."""
    floor()
    for i, tint in enumerate(((1, 1, 1), (1, 0.5, 0.3))):
        made = material(f"painted{i}", tint)
        ball = shape("uv_sphere" if i else "monkey", None, (3 * i - 1.5, 0, 1.1), smooth=True)
        ball.data.materials.append(made)
        paint = ball.data.color_attributes.new("paint", "FLOAT_COLOR", "POINT")
        for spot, vertex in zip(paint.data, ball.data.vertices):
            x, y, z = vertex.co
            spot.color = (0.5 + 0.4 * math.sin(4 * x), 0.5 + 0.4 * math.sin(4 * y), 0.5 + 0.4 * z, 1)
        kit.tint_by_attribute(made, "paint", tint)
    lamps()
    camera()
    return {}


def gloss():
    """Dielectrics as Blender's Principled BSDF has them."""
    floor()
    for i, roughness in enumerate((0.15, 0.3, 0.5, 0.75)):
        made = material(f"gloss{i}", ((0.8, 0.1, 0.1), (0.1, 0.5, 0.2), (0.2, 0.3, 0.8), (0.7, 0.6, 0.2))[i], 0, roughness,
                        exact=False)
        shape("uv_sphere", made, (i * 1.8 - 2.7, 0, 0.8), smooth=True, radius=0.8, segments=48, ring_count=24)
    shape("plane", material("panel", (0, 0, 0), emission=(1, 1, 1), strength=6), (0, -2, 5), rotation=(math.pi - 0.4, 0, 0),
          size=3)
    lamps()
    camera()
    return dict(why="Principled's diffuse part is Disney's, not Lambert's; its Fresnel is exact, not Schlick's")


def extensions():
    """Transmission, clearcoat, index of refraction, strong emission."""
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
    return dict(bounces=4, why="glTF's transmission is a thin wall, Principled's a solid; Principled's coat weighs a quarter")


def parade():
    """24 frames in which everything moves: a rigid thing, a skin, a morph, the camera."""
    floor()
    rig = _bend(_tube(material("tube", (0.1, 0.3, 0.8)), (-1.6, 0.4, 0), False), (0.8, 1.6, 2.4), (-1.6, 0.4, 0))
    for i, bone in enumerate(rig.pose.bones):
        bone.rotation_mode = "QUATERNION"
        keys(bone, "rotation_quaternion",
             {f: (math.cos(a := 0.25 * (i + 1) * math.sin(f * 0.26)), math.sin(a), 0, 0) for f in range(0, 25)})
    box = shape("cube", material("box", (0.1, 0.6, 0.2)), (1.8, 0.2, 0.6), size=1.2)
    box.shape_key_add(name="Basis")
    tall = box.shape_key_add(name="tall")
    for vertex in tall.data:
        if vertex.co.z > 0:
            vertex.co.x, vertex.co.y, vertex.co.z = vertex.co.x * 0.3, vertex.co.y * 0.3, vertex.co.z * 3
    keys(tall, "value", {0: 0, 12: 1, 24: 0.2})
    ball = shape("monkey", material("head", (0.8, 0.2, 0.1)), size=1.2)
    keys(ball, "location", {0: (-3, -2, 0.8), 24: (3, -1.8, 0.8)})
    ball.rotation_mode = "QUATERNION"
    keys(ball, "rotation_quaternion", {f: (math.cos(f * 0.1), 0, math.sin(f * 0.1), 0) for f in range(0, 25)})
    lamps()
    view = camera((-0.6, -8, 4))
    keys(view, "location", {0: (-0.6, -8, 4), 24: (0.6, -7.6, 3.8)})
    return dict(FACED, frame=15, last=24)
