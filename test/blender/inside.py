"""Runs in Blender for addon_test.py: renders small scenes and prints one line of JSON per check.

    blender -b --python-exit-code 1 --python inside.py -- FOLDER TOOLS
"""
import json
import os
import sys

FOLDER, TOOLS = sys.argv[sys.argv.index("--") + 1:]
sys.path.insert(0, TOOLS)
sys.dont_write_bytecode = True
import bpy  # noqa: E402
import numpy as np  # noqa: E402

from strobe_blender import blender_main, scenes  # noqa: E402
from strobe_gltf import kit  # noqa: E402


def answer(name, **facts):
    """Prints the result of a check."""
    print("CHECK " + json.dumps({"name": name, **facts}), flush=True)


def picture(path):
    """Returns the pixels of an image file."""
    image = bpy.data.images.load(path)
    pixels = np.array(image.pixels[:], np.float64).reshape(image.size[1], image.size[0], -1)
    bpy.data.images.remove(image)
    return pixels


def render(name, engine="STROBE"):
    """Renders to a file and returns its pixels."""
    scene = bpy.context.scene
    scene.render.engine = engine
    scene.render.filepath = os.path.join(FOLDER, f"{name}-{engine}.exr")
    bpy.ops.render.render(write_still=True)
    return picture(scene.render.filepath)[..., :3]


def build(name, samples):
    """Builds one of the scenes of tools/blender-check, at a small size."""
    kit.reset()
    bpy.context.scene.render.resolution_x, bpy.context.scene.render.resolution_y = 80, 60
    blender_main.settings(getattr(scenes, name)(), samples)


def compare(name, samples=64):
    """Compares means of blocks with Cycles."""
    build(name, samples)
    a, b = (render(name, engine) for engine in ("STROBE", "CYCLES"))
    d = (a - b).reshape(6, 10, 8, 10, 3).mean((1, 3)) / b.mean()
    answer("compare " + name, worst=float(np.abs(d).max()), rms=float(np.sqrt((d ** 2).mean())), mean=float(a.mean() / b.mean()))


def fails(name):
    """Renders and prints the error."""
    try:
        bpy.ops.render.render()
        answer(name, error="")
    except RuntimeError as error:
        answer(name, error=str(error))


def errors():
    """A program that is missing, too old, or fails; a folder that cannot be made; no camera."""
    build("rigid", 1)
    bpy.context.scene.render.engine = "STROBE"
    preferences = bpy.context.preferences.addons["strobe"].preferences
    preferences.folder = "/proc/strobe"
    fails("unwritable folder")
    preferences.folder = ""
    old = os.path.join(FOLDER, "old")
    with open(old, "w") as file:
        file.write("#!/bin/sh\necho strobe 0.1.0\n")
    os.chmod(old, 0o755)
    for name, path in (("missing program", "/nowhere/strobe"), ("old version", old)):
        preferences.program = path
        fails(name)
    preferences.program = ""
    bpy.context.scene.objects["Cube"].scale = (0, 1, 1)
    bpy.context.scene.objects["Cube"].animation_data_clear()
    fails("flat object")
    bpy.context.scene.camera = None
    fails("no camera")


def region():
    """A region has the pixels of the whole image."""
    build("rigid", 4)
    whole = render("whole")
    r = bpy.context.scene.render
    r.use_border, r.use_crop_to_border = True, True
    r.border_min_x, r.border_max_x, r.border_min_y, r.border_max_y = 0.25, 0.75, 0.5, 1
    part = render("part")
    answer("region", shape=part.shape, equal=bool((part == whole[30:60, 20:60]).all()))


def layers():
    """Passes arrive in a multilayer EXR."""
    build("rigid", 4)
    scene, layer = bpy.context.scene, bpy.context.view_layer
    layer.use_pass_z = layer.use_pass_normal = layer.use_pass_vector = layer.use_pass_cryptomatte_object = True
    scene.strobe.use_albedo = True
    scene.render.engine = "STROBE"
    scene.render.image_settings.file_format = "OPEN_EXR_MULTILAYER"
    scene.render.filepath = os.path.join(FOLDER, "layers.exr")
    bpy.ops.render.render(write_still=True)
    with open(scene.render.filepath, "rb") as file:
        head = file.read(8000)
    names = ("Combined.R", "Depth.Z", "Normal.X", "Vector.X", "CryptoObject00", "Albedo.R", "cryptomatte/", "Cube.001")
    answer("layers", missing=[name for name in names if name.encode() not in head])


def replaced():
    """Unsupported nodes are named, and the render goes on."""
    build("rigid", 1)
    material = scenes.shader("odd", "BsdfVelvet")
    bpy.data.objects["Cube"].data.materials[0] = material
    print("BEGIN replaced")
    render("replaced")
    print("END replaced")


def frames():
    """An animation that skips the frame that exists."""
    build("rigid", 1)
    scene = bpy.context.scene
    scene.render.engine, scene.frame_start, scene.frame_end = "STROBE", 1, 3
    scene.render.filepath = os.path.join(FOLDER, "frame")
    scene.render.use_overwrite, scene.render.use_placeholder = False, True
    with open(os.path.join(FOLDER, "frame0002.exr"), "w") as file:
        file.write("finished")
    bpy.ops.render.render(animation=True)
    answer("frames", sizes=[os.path.getsize(os.path.join(FOLDER, f"frame{i:04d}.exr")) for i in (1, 2, 3)])
    bpy.ops.wm.save_as_mainfile(filepath=os.path.join(FOLDER, "saved.blend"))


for scene_name in ("delta_lights", "area_lights", "rigid", "shape_keys", "depth_of_field"):
    compare(scene_name)
for check in (region, layers, replaced, errors, frames):
    check()
