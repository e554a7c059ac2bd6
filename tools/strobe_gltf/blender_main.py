"""Exports and renders the named scenes with Blender.

    blender -b --factory-startup --python blender_main.py -- FOLDER EFFORT SCENE...

EFFORT is a factor of the sample counts.
"""
import json
import os
import sys
import traceback

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
sys.dont_write_bytecode = True
import kit
import material_scenes
import scenes

SAMPLES, BOUNCES = 256, 2


def make(name, folder, effort):
    """Writes a scene as glTF, as an image of Cycles, and its options as JSON."""
    kit.reset()
    build = getattr(scenes, name, None) or getattr(material_scenes, name)
    options = build()
    ending = options.get("file", ".glb")
    os.makedirs(folder, exist_ok=True)
    base = os.path.join(folder, name)
    export = dict({"export_format": "GLB" if ending == ".glb" else "GLTF_SEPARATE"}, **options.get("export", {}))
    kit.export(base + ending, 1, options.get("last"), **export)
    facts = {key: options.get(key) for key in ("frame", "shutter", "clip", "inexact", "strobe_factor")}
    facts.update(file=name + ending, bounces=options.get("bounces", BOUNCES),
                 samples=max(1, round(options.get("samples", SAMPLES) * effort)))
    kit.render(base + ".exr", facts["samples"], facts["bounces"], facts["frame"], facts["shutter"])
    with open(base + ".json", "w") as out:
        json.dump(facts, out)


def main(folder, effort, *names):
    """Makes the named scenes. Exits with an error if one fails."""
    failed = []
    for name in names:
        try:
            make(name, os.path.join(folder, name), float(effort))
        except Exception:
            traceback.print_exc()
            failed.append(name)
    if failed:
        sys.exit("scenes that failed: " + ", ".join(failed))


main(*sys.argv[sys.argv.index("--") + 1:])
