"""blender -b --factory-startup --python blender_main.py -- FOLDER EFFORT SCENE…: exports and renders the named scenes."""
import json
import os
import sys
import traceback

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
sys.dont_write_bytecode = True
import kit
import scenes

SAMPLES, BOUNCES = 256, 2


def make(name, folder, effort):
    kit.reset()
    how = getattr(scenes, name)()
    ending = how.get("file", ".glb")
    os.makedirs(folder, exist_ok=True)
    base = os.path.join(folder, name)
    export = dict({"export_format": "GLB" if ending == ".glb" else "GLTF_SEPARATE"}, **how.get("export", {}))
    kit.export(base + ending, 1, how.get("last"), **export)
    facts = {key: how.get(key) for key in ("frame", "shutter", "clip", "why", "more")}
    facts.update(file=name + ending, bounces=how.get("bounces", BOUNCES),
                 samples=max(1, round(how.get("samples", SAMPLES) * effort)))
    kit.render(base + ".exr", facts["samples"], facts["bounces"], facts["frame"], facts["shutter"])
    with open(base + ".json", "w") as out:
        json.dump(facts, out)


def main(folder, effort, *names):
    bad = []
    for name in names:
        try:
            make(name, os.path.join(folder, name), float(effort))
        except Exception:
            traceback.print_exc()
            bad.append(name)
    if bad:
        sys.exit("scenes that failed: " + ", ".join(bad))


main(*sys.argv[sys.argv.index("--") + 1:])
