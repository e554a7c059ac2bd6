"""A small glTF file with all supported features, which test/cli/gltf_mangled_test.py damages."""
import os
import struct
import sys
import zlib

import numpy as np

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
sys.dont_write_bytecode = True
sys.path.insert(0, os.path.join(ROOT, "tools"))
from strobe_gltf.glb import Glb  # noqa: E402


def png(width=2, height=2):
    """Returns a gray PNG."""
    def chunk(kind, data):
        body = kind + data
        return struct.pack(">I", len(data)) + body + struct.pack(">I", zlib.crc32(body))

    rows = b"".join(b"\0" + bytes(40 * (x + y) + 100 for x in range(width) for _ in range(3)) for y in range(height))
    return (b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0)) +
            chunk(b"IDAT", zlib.compress(rows)) + chunk(b"IEND", b""))


def floats(*values):
    return np.array(values, np.float32)


# Accessors, in the order of the file.
(POSITION, NORMAL, UV, COLOR, JOINTS, WEIGHTS, INDICES, TARGET, MATRICES, TIMES, MOVES, TURNS, STRENGTHS,
 SPARSE) = range(14)
# Nodes.
CAMERA, LIGHT, BODY, HIP, KNEE, FLOOR, SCARF = range(7)


def model():
    """Returns a quad that is skinned, morphed, textured and colored, a static quad, lights, a camera and an animation."""
    glb = Glb()
    corners = floats([-1, 0, 0], [1, 0, 0], [-1, 2, 0], [1, 2, 0])
    glb.add(corners, "VEC3", min=[-1, 0, 0], max=[1, 2, 0])
    glb.add(floats(*[[0, 0, 1]] * 4), "VEC3")
    glb.add(floats([0, 1], [1, 1], [0, 0], [1, 0]), "VEC2")
    glb.add(np.array([[255, 128, 64, 255]] * 4, np.uint8), "VEC4", normalized=True)
    glb.add(np.array([[0, 1, 0, 0]] * 4, np.uint8), "VEC4")
    glb.add(floats(*[[1, 0, 0, 0]] * 2, *[[0.3, 0.7, 0, 0]] * 2), "VEC4")
    glb.add(np.array([0, 1, 2, 2, 1, 3], np.uint16), "SCALAR")
    glb.add(floats([0, 0, 0], [0, 0, 0], [0, 0.5, 0.2], [0.2, 0, 0]), "VEC3", min=[0, 0, 0], max=[0.2, 0.5, 0.2])
    glb.add(floats(*[np.eye(4).ravel()] * 2), "MAT4")
    glb.add(floats(0, 0.5, 1), "SCALAR", min=[0], max=[1])
    glb.add(floats([0, 0, 0], [0.2, 0, 0], [0.3, 0.1, 0]), "VEC3")
    glb.add(floats([0, 0, 0, 1], [0, 0, 0.1, 0.995], [0, 0, 0, 1]), "VEC4")
    glb.add(floats(0, 1, 0.5), "SCALAR")
    indices, values = glb.add_view(np.array([1, 3], np.uint16).tobytes()), glb.add_view(floats([0, 0, 1], [0, 0, 1]).tobytes())
    root = glb.root
    root["accessors"].append({"componentType": 5126, "type": "VEC3", "count": 4, "min": [0, 0, 0], "max": [0, 0, 1],
                              "sparse": {"count": 2, "indices": {"bufferView": indices, "componentType": 5123},
                                         "values": {"bufferView": values}}})
    root["images"] = [{"bufferView": glb.add_view(png()), "mimeType": "image/png"}]
    root["samplers"] = [{"magFilter": 9729, "wrapS": 10497}]
    root["textures"] = [{"source": 0, "sampler": 0}]
    root["materials"] = [{"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}, "metallicFactor": 0}}, {}]
    attributes = {"POSITION": POSITION, "NORMAL": NORMAL, "TEXCOORD_0": UV, "COLOR_0": COLOR}
    moved = dict(attributes, JOINTS_0=JOINTS, WEIGHTS_0=WEIGHTS)
    root["meshes"] = [
        {"primitives": [{"attributes": moved, "indices": INDICES, "material": 0, "targets": [{"POSITION": TARGET}]}],
         "weights": [0.5]},
        {"primitives": [{"attributes": attributes, "mode": 5}]},
        {"primitives": [{"attributes": {"POSITION": SPARSE, "NORMAL": NORMAL}, "indices": INDICES, "material": 1}]}]
    root["skins"] = [{"joints": [HIP, KNEE], "inverseBindMatrices": MATRICES}]
    root["cameras"] = [{"type": "perspective", "perspective": {"yfov": 0.9, "znear": 0.1, "aspectRatio": 1}}]
    root["extensionsUsed"] = ["KHR_lights_punctual"]
    root["extensions"] = {"KHR_lights_punctual": {"lights": [
        {"type": "spot", "intensity": 5000, "spot": {"innerConeAngle": 0.2, "outerConeAngle": 0.7}}]}}
    root["nodes"] = [
        {"camera": 0, "translation": [0, 1, 5]},
        {"translation": [0, 1, 4], "extensions": {"KHR_lights_punctual": {"light": 0}}},
        {"mesh": 0, "skin": 0},
        {"children": [KNEE]},
        {"translation": [0, 1, 0], "rotation": [0, 0, 0, 1], "scale": [1, 1, 1]},
        {"mesh": 1, "matrix": [2, 0, 0, 0, 0, 2, 0, 0, 0, 0, 2, 0, 0, 0, -1, 1]},
        {"mesh": 2, "translation": [0, -1, 0]}]
    root["scenes"] = [{"nodes": [CAMERA, LIGHT, BODY, HIP, FLOOR, SCARF]}]
    root["scene"] = 0
    root["animations"] = [{
        "samplers": [{"input": TIMES, "output": MOVES}, {"input": TIMES, "output": TURNS, "interpolation": "STEP"},
                     {"input": TIMES, "output": STRENGTHS}],
        "channels": [{"sampler": 0, "target": {"node": FLOOR, "path": "translation"}},
                     {"sampler": 1, "target": {"node": KNEE, "path": "rotation"}},
                     {"sampler": 2, "target": {"node": BODY, "path": "weights"}}]}]
    # Animated nodes must not have a matrix.
    root["nodes"][FLOOR] = {"mesh": 1, "scale": [2, 2, 2]}
    return glb
