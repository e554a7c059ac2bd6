"""Scenes of geometry, motion, cameras and lights, built in Blender. Runs inside Blender.

Each function without arguments builds a scene and returns its options:
frame, shutter    frame number and shutter time; without them the scene is rendered at rest
clip              name of the animation that strobe renders
export            options of the glTF exporter; file: the extension of the file; last: the last frame
bounces, samples  options of Cycles
strobe_factor     factor of strobe's samples, for scenes where strobe has more noise
inexact           why Cycles cannot reproduce the image exactly
"""
import math

import bpy
from kit import add_object, camera, floor, keys, light, material, shape
from mathutils import Quaternion

ANIMATED = dict(frame=7, shutter=0.5, last=13)
# Blender computes normals of the deformed faces; glTF deforms the normals. Without exported normals, both use face normals.
FACE_NORMALS = dict(ANIMATED, export=dict(export_normals=False))
BENT_NORMALS = "Blender computes the normals of the deformed faces, glTF deforms the normals of the rest pose"


def lamps():
    """Adds a point light and a sun."""
    light("POINT", 800, (3, -4, 5))
    light("SUN", 1, rotation=(0.6, 0.3, 0))


def primitives():
    """Shapes with smooth and with flat normals."""
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
    """Instances of one mesh with translated, rotated, unevenly scaled and mirrored parents."""
    floor()
    shape("monkey", material("clay", (0.7, 0.35, 0.2)), (-2.3, 0.5, 1), smooth=True, name="first")
    mesh = bpy.context.object.data
    turned = add_object(None, "turned", (0, 0.4, 1.1), (0.2, -0.3, 0.9), scale=(1.5, 0.5, 0.8))
    add_object(mesh, "sheared", (0, 0, 0), (0.3, 0.6, 0.2), turned)
    mirror = add_object(None, "mirror", (2.4, 0, 1), scale=(-1, 1, 1))
    add_object(mesh, "mirrored", (0, 0, 0), (0, 0.2, 0.7), mirror)
    add_object(mesh, "inside out", (1.2, -1.9, 0.5), (0.3, 0, -0.5), scale=(-0.5, -0.5, -0.5))
    add_object(mesh, "below", (-1.2, -1.6, -0.3), (0.1, 0, 0), turned, (0.5, 0.9, 0.5))
    lamps()
    camera()
    return {}


def rigid():
    """Rigid linear motion, one object with a moving parent."""
    floor()
    parent = add_object(None, "carrier", (-1.5, 0.8, 1))
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
    """Step and spline interpolation; the exporter writes keys instead of samples."""
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


def _bend(mesh, bones, location):
    """Skins a mesh to a chain of bones along z, with automatic weights. Returns the armature."""
    bpy.ops.object.armature_add(location=location)
    rig = bpy.context.object
    bpy.ops.object.mode_set(mode="EDIT")
    edit_bones = rig.data.edit_bones
    last = edit_bones[0]
    last.head, last.tail = (0, 0, 0), (0, 0, bones[0])
    for i, end in enumerate(bones[1:]):
        bone = edit_bones.new(f"bone{i + 1}")
        bone.head, bone.tail, bone.parent = last.tail, (0, 0, end), last
        last = bone
    bpy.ops.object.mode_set(mode="OBJECT")
    bpy.ops.object.select_all(action="DESELECT")
    mesh.select_set(True)
    rig.select_set(True)
    bpy.context.view_layer.objects.active = rig
    bpy.ops.object.parent_set(type="ARMATURE_AUTO")
    return rig


def _tube(tube_material, location, smooth, height=2.4, radius=0.35):
    """Adds a vertical tube, divided along its height and at x = 0, and returns it."""
    x, y, z = location
    tube = shape("cylinder", tube_material, (x, y, z + height / 2), smooth=smooth, radius=radius, depth=height,
                 vertices=24)
    bpy.context.view_layer.objects.active = tube
    bpy.ops.object.mode_set(mode="EDIT")
    bpy.ops.mesh.select_all(action="SELECT")
    bpy.ops.mesh.bisect(plane_co=(0, 0, 0), plane_no=(1, 0, 0))
    for i in range(1, 12):
        bpy.ops.mesh.select_all(action="SELECT")
        bpy.ops.mesh.bisect(plane_co=(0, 0, z + height * i / 12), plane_no=(0, 0, 1))
    bpy.ops.object.mode_set(mode="OBJECT")
    return tube


def _skins(smooth):
    """Adds two tubes, each skinned to three rotating bones."""
    floor()
    for name, location, color, turn in (("left", (-1.4, 0, 0), (0.1, 0.3, 0.8), 1),
                                   ("right", (1.4, 0.3, 0), (0.8, 0.3, 0.1), -0.8)):
        rig = _bend(_tube(material(name, color), location, smooth), (0.8, 1.6, 2.4), location)
        for i, bone in enumerate(rig.pose.bones):
            bone.rotation_mode = "QUATERNION"
            axis = (0, 0, turn) if i % 2 else (turn, 0, 0)
            keys(bone, "rotation_quaternion",
                 {f: (math.cos(a := (f - 5) * 0.03 * (i + 1)), *[math.sin(a) * x for x in axis]) for f in range(1, 14)})
    lamps()
    camera()


def skinned():
    """Two skinned tubes without exported normals."""
    _skins(False)
    return FACE_NORMALS


def skinned_smooth():
    """Two skinned tubes with exported normals."""
    _skins(True)
    return dict(ANIMATED, inexact=BENT_NORMALS)


def _shape_keys(smooth):
    """Adds a box with one and a ball with two animated shape keys."""
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
    """Morph targets, one and two at a time, without exported normals."""
    _shape_keys(False)
    return FACE_NORMALS


def morphs_smooth():
    """Morph targets, one and two at a time, with exported normals."""
    _shape_keys(True)
    return dict(ANIMATED, inexact=BENT_NORMALS)


def moving_camera():
    """A camera that moves and rotates; the objects are static."""
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
    """An orthographic camera."""
    floor()
    shape("uv_sphere", material("red", (0.8, 0.1, 0.1)), (-1.4, 0, 1), smooth=True)
    shape("cube", material("blue", (0.1, 0.2, 0.8)), (1.3, 0, 0.7), rotation=(0, 0, 0.6), size=1.4)
    lamps()
    camera((4, -6, 6), (52, 0, 34), width=8)
    return {}


def lights():
    """Colored point, spot and sun lights with hard cones, and indirect light in a corner."""
    floor((0.7, 0.7, 0.7))
    shape("plane", material("wall", (0.6, 0.55, 0.5)), (0, 3, 2), rotation=(math.pi / 2, 0, 0), size=12)
    shape("uv_sphere", material("ball", (0.7, 0.7, 0.7)), (0, 0.5, 1), smooth=True, segments=96, ring_count=48)
    light("POINT", 300, (-3, -1, 2), color=(1, 0.3, 0.2))
    light("SPOT", 1500, (3, -2, 5), (0.45, 0.45, 0), (0.3, 0.6, 1), cone=40)
    light("SPOT", 800, (-1, -3, 4), (0.6, -0.2, 0), (0.4, 1, 0.4), cone=25)
    light("SUN", 0.3, rotation=(-0.3, 0.7, 0), color=(1, 0.9, 0.6))
    camera()
    return dict(bounces=5, samples=400, strobe_factor=6)


def two_clips():
    """Two animations; strobe renders the second, selected by name."""
    floor()
    box = shape("cube", material("orange", (0.8, 0.4, 0.1)), (0, 0, 0.6), size=1.2)
    ball = shape("uv_sphere", material("blue", (0.1, 0.3, 0.8)), (0, -2, 0.5), smooth=True, radius=0.5)
    for clip, ends in (("slide", ((-3, 3), (2, 2))), ("climb", ((1.5, 2.2), (-2.5, 1.5)))):
        for obj, (a, b) in zip((box, ball), ends):
            y = obj.location.y
            keys(obj, "location", {1: (a, y, 0.6), 13: (b, y, 0.6 if clip == "slide" else 2)})
            track = obj.animation_data.nla_tracks.new()
            track.name = clip
            track.strips.new(clip, 1, obj.animation_data.action).action_frame_end = 13
            obj.animation_data.action = None
            track.mute = clip == "slide"
    lamps()
    camera()
    return dict(ANIMATED, clip="climb")


def parade():
    """24 frames with rigid motion, a skin, a morph target and a moving camera; for tools/gltf-sequence."""
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
    return dict(FACE_NORMALS, frame=15, last=24)
