"""Builds scenes in Blender and renders them with Cycles and strobe.

    blender -b --python blender_main.py -- FOLDER SAMPLES ENGINES SCENE...

FOLDER/SCENE-ENGINE.exr are the images, FOLDER/SCENE.json the facts of the scene. ENGINES: words of CYCLES, STROBE
and STILLSn, separated by commas. STILLSn renders n stills at times of the shutter, FOLDER/SCENE-still000.exr ...
"""
import json
import os
import sys
import time
import traceback

sys.path.insert(0, os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
sys.dont_write_bytecode = True
import bpy  # noqa: E402

from strobe_blender import scenes  # noqa: E402
from strobe_gltf import kit  # noqa: E402

BOUNCES = 2


def settings(facts, samples):
    """Sets what both engines have in common: box filter, depth, shutter, linear images of floats."""
    scene = bpy.context.scene
    render, cycles = scene.render, scene.cycles
    render.image_settings.file_format, render.image_settings.color_depth = "OPEN_EXR", "32"
    render.image_settings.color_mode = "RGB"
    scene.view_settings.view_transform = "Raw"
    bounces = facts.get("bounces", BOUNCES)
    cycles.device, cycles.samples, cycles.use_adaptive_sampling, cycles.use_denoising = "CPU", samples, False, False
    cycles.pixel_filter_type = "BOX"
    cycles.max_bounces = cycles.diffuse_bounces = cycles.glossy_bounces = cycles.transmission_bounces = bounces
    cycles.transparent_max_bounces = 64
    cycles.sample_clamp_direct = cycles.sample_clamp_indirect = cycles.blur_glossy = 0
    cycles.light_sampling_threshold = 0
    render.use_motion_blur, render.motion_blur_shutter = "blur" in facts, facts.get("blur", 0.5)
    cycles.motion_blur_position = "CENTER"
    for obj in bpy.data.objects:
        obj.cycles.shadow_terminator_geometry_offset = obj.cycles.shadow_terminator_offset = 0
        obj.cycles.use_motion_blur = obj.cycles.use_deform_motion = True
        obj.cycles.motion_steps = 5
    for frame in range(1, scenes.FRAME + 1):  # particles are simulated in order
        scene.frame_set(frame)
    scene.render.engine = "STROBE"
    scene.strobe.filter, scene.strobe.samples, scene.strobe.integrator = "box", samples, "supersample"
    scene.strobe.shader_path_maxdepth = bounces + 1


def stills(name, folder, count, samples):
    """Renders the shutter as stills without blur, with strobe."""
    scene = bpy.context.scene
    length = scene.render.motion_blur_shutter
    scene.render.engine, scene.render.use_motion_blur, scene.strobe.samples = "STROBE", False, samples
    for i in range(count):
        when = scenes.FRAME + length * ((i + 0.5) / count - 0.5)
        scene.frame_set(int(when // 1), subframe=when % 1)
        scene.strobe.seed = i
        scene.render.filepath = os.path.join(folder, f"{name}-still{i:03d}.exr")
        bpy.ops.render.render(write_still=True)


def make(name, folder, samples, engines):
    """Builds and renders one scene."""
    kit.reset()
    facts = getattr(scenes, name)()
    settings(facts, samples)
    for engine in engines:
        if engine.startswith("STILLS"):
            if "blur" in facts:
                stills(name, folder, int(engine[6:]), 8)
            continue
        bpy.context.scene.render.engine = engine
        bpy.context.scene.render.filepath = os.path.join(folder, f"{name}-{engine}.exr")
        start = time.perf_counter()
        bpy.ops.render.render(write_still=True)
        facts[engine] = time.perf_counter() - start
    with open(os.path.join(folder, name + ".json"), "w") as file:
        json.dump(facts, file)


def main(folder, samples, engines, *names):
    """Makes the named scenes. Exits with an error if one fails."""
    failed = []
    for name in names:
        try:
            make(name, folder, int(samples), engines.split(","))
        except Exception:
            traceback.print_exc()
            failed.append(name)
    if failed:
        sys.exit("scenes that failed: " + ", ".join(failed))


if __name__ == "__main__":
    main(*sys.argv[sys.argv.index("--") + 1:])
