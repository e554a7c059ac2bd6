"""Damaged glTF files: strobe exits with code 2 and a message that names the file, the location and the error.

    gltf_mangled_test.py STROBE [--sanitized] [--flips N]

--sanitized: the program was built with sanitizers: memory is not checked, and time limits are longer. --flips N: also tests
N files with random bytes, which must either render or be an error.
"""
import argparse
import base64
import concurrent.futures
import json
import os
import random
import struct
import subprocess
import sys
import tempfile
import threading

sys.dont_write_bytecode = True
import gltf_model
from gltf_model import *  # noqa: F403  (the numbers of accessors and nodes)
from strobe_gltf.glb import pack

SECONDS, MEGABYTES = 5, 500


def put(root, path, value):
    """Sets root["a"][0]["b"] for the path "a.0.b"; None removes it."""
    *outer, last = [int(part) if part.isdigit() else part for part in path.split(".")]
    for part in outer:
        root = root[part]
    if value is None:
        del root[last]
    elif isinstance(root, list) and last == len(root):
        root.append(value)
    else:
        root[last] = value


def edited(*changes):
    """Returns the model with changed members: path, value, path, value, …"""
    glb = gltf_model.model()
    for path, value in zip(changes[::2], changes[1::2]):
        put(glb.root, path, value)
    return glb.bytes()


def numbers(accessor, element, value):
    """Returns the model with a changed number of an accessor."""
    glb = gltf_model.model()
    members = glb.root["accessors"][accessor]
    kind = {5126: "<f", 5123: "<H", 5121: "<B"}[members["componentType"]]
    start = glb.root["bufferViews"][members["bufferView"]]["byteOffset"]
    struct.pack_into(kind, glb.binary, start + element * struct.calcsize(kind), value)
    return glb.bytes()


def buffered(**members):
    """Returns the model as JSON, with these members of its buffer."""
    glb = gltf_model.model()
    glb.root["buffers"] = [dict({"byteLength": len(glb.binary)}, **members)]
    return json.dumps(glb.root).encode()


def data_uri(data):
    return "data:application/octet-stream;base64," + base64.b64encode(data).decode()


def with_word(data, offset, value):
    """Returns the bytes with a changed 32-bit word."""
    return data[:offset] + struct.pack("<I", value) + data[offset + 4:]


def cut(data, length, fix_header=False):
    """Returns the first bytes; `fix_header`: with their number in the header."""
    data = data[:length]
    return with_word(data, 8, length) if fix_header else data


def text(source):
    """Returns a .glb with this text as JSON."""
    return pack(source, b"")


def deep_nodes(count):
    return text(json.dumps({"asset": {"version": "2.0"}, "scenes": [{"nodes": [0]}],
                            "nodes": [{"children": [i + 1]} for i in range(count - 1)] + [{}]}).encode())


A = "accessors"
PRIMITIVE = "meshes.0.primitives.0"


def container_cases():
    whole = gltf_model.model().bytes()
    size = struct.unpack_from("<I", whole, 12)[0]
    yield "nothing", b"", "the file is empty"
    yield "magic only", cut(whole, 4), "truncated within its header"
    yield "cut in the header", cut(whole, 19), "truncated within its header"
    for name, length in (("after the header", 20), ("in the JSON", 20 + size // 2), ("after the JSON", 20 + size),
                         ("in the second header", 24 + size), ("before the buffer", 28 + size),
                         ("in the buffer", (28 + size + len(whole)) // 2), ("before the last byte", len(whole) - 1)):
        yield "cut " + name, cut(whole, length), f"it has {length} of {len(whole)} bytes"
    yield "cut in the JSON, header corrected", cut(whole, 20 + size // 2, True), "bytes exceeds the file"
    yield "cut after the JSON, header corrected", cut(whole, 20 + size, True), "buffers[0]: has no uri, and the file has no binary chunk"
    yield "cut in the second header, corrected", cut(whole, 24 + size, True), "within the header of a chunk"
    yield "cut in the buffer, header corrected", cut(whole, len(whole) - 40, True), "bytes exceeds the file"
    yield "version 1", with_word(whole, 4, 1), "version 1 of .glb is not supported"
    yield "endless chunk", with_word(whole, 12, 0xffffffff), "a chunk of 4294967295 bytes exceeds the file"
    yield "length beyond 31 bits", with_word(whole, 8, 0xfffffff0), "the file is truncated"
    yield "first chunk is BIN", with_word(whole, 16, 0x004e4942), "the first chunk is not JSON"
    yield "second chunk is unknown", with_word(whole, 24 + size, 0x12345678), "the second chunk is not the binary buffer"
    yield "no JSON", text(b"what?"), "invalid JSON"
    yield "a list", text(b"[1, 2]"), "is not an object"
    yield "bad UTF-8", text(b'{"asset": {"version": "2.0", "generator": "\xff\xfe"}}'), "invalid JSON"
    yield "NaN in JSON", text(b'{"asset": {"version": "2.0"}, "scene": NaN}'), "invalid JSON"
    yield "nested without end", text(b"[" * 300000), "nested more than 128 deep"
    yield "no asset", edited("asset", None), "asset.version: is missing"
    yield "glTF 1", edited("asset.version", "1.0"), "this is glTF 1.0"


def accessor_cases():
    for count, what in ((2**40, "1099511627776 is out of range"), (2**64, "is out of range"), (-1, "-1 is out of range"),
                        (2.5, "must be an integer"), ("many", "must be an integer")):
        yield f"count {count}", edited(f"{A}.{POSITION}.count", count), "accessors[0].count: " + what
    yield "count 2^31 - 1", edited(f"{A}.{POSITION}.count", 2**31 - 1), "2147483647 elements exceed bufferViews[0], which has room for 4"
    yield "offset beyond", edited(f"{A}.{POSITION}.byteOffset", 2**31 - 1), "which has room for 0"
    yield "offset by one vertex", edited(f"{A}.{POSITION}.byteOffset", 12), "4 elements exceed bufferViews[0]"
    yield "offset 2^63", edited(f"{A}.{POSITION}.byteOffset", 2**63), "accessors[0].byteOffset: 9223372036854775808 is out of range"
    yield "wide stride", edited("bufferViews.0.byteStride", 252), "4 elements exceed bufferViews[0]"
    yield "stride 3", edited("bufferViews.0.byteStride", 3), "bufferViews[0].byteStride: 3 is not a multiple of 4"
    yield "view offset 2^31", edited("bufferViews.0.byteOffset", 2**31 - 1), "bufferViews[0]"
    yield "view too long", edited("bufferViews.0.byteLength", 2**31 - 1), "bufferViews[0]"
    yield "view of no buffer", edited("bufferViews.0.buffer", 7), "there is no buffer 7"
    yield "no such view", edited(f"{A}.{POSITION}.bufferView", 99), "there is no bufferView 99"
    yield "negative view", edited(f"{A}.{POSITION}.bufferView", -3), "out of range"
    yield "component type int", edited(f"{A}.{POSITION}.componentType", 5124), "componentType"
    yield "component type 9999", edited(f"{A}.{POSITION}.componentType", 9999), "omponentType"
    yield "type VEC7", edited(f"{A}.{POSITION}.type", "VEC7"), "VEC7"
    yield "flat positions", edited(f"{A}.{POSITION}.type", "VEC2"), "has 2 components instead of 3"
    yield "too few normals", edited(f"{A}.{NORMAL}.count", 3), "has 3 elements instead of 4"
    yield "float indices", edited(f"{A}.{INDICES}.componentType", 5126), "must have unsigned integers"
    yield "index beyond", numbers(INDICES, 4, 4), "index 4 (number 4) is out of range: the primitive has 4 vertices"
    yield "five indices", edited(f"{A}.{INDICES}.count", 5), "the number of indices, 5, is not a multiple of 3"
    yield "NaN position", numbers(POSITION, 4, float("nan")), "element 1 is not finite"
    yield "infinite normal", numbers(NORMAL, 0, float("inf")), "element 0 is not finite"
    yield "huge positions", numbers(POSITION, 0, 3e38), "too large"
    yield "zeros without end", edited(f"{A}.{SPARSE}.count", 2**31 - 1), "without a bufferView"
    yield "sparse count", edited(f"{A}.{SPARSE}.sparse.count", 1000), "1000 elements exceed bufferViews"
    yield "sparse index beyond", edited(f"{A}.{SPARSE}.count", 2, "meshes.2.primitives.0.attributes.NORMAL", None,
                                        "meshes.2.primitives.0.indices", None), "index 3 is out of range: the accessor has 2 elements"
    yield "sparse values too short", edited(f"{A}.{SPARSE}.sparse.count", 6, f"{A}.{SPARSE}.sparse.indices.bufferView", 6), \
        "sparse.values: 6 elements exceed bufferViews"
    yield "sparse views missing", edited(f"{A}.{SPARSE}.sparse.values.bufferView", 99), "there is no bufferView 99"
    yield "sparse float indices", edited(f"{A}.{SPARSE}.sparse.indices.componentType", 5126), "must be an unsigned integer"
    yield "no such accessor", edited(PRIMITIVE + ".attributes.POSITION", 99), "there is no accessor 99"
    yield "negative accessor", edited(PRIMITIVE + ".attributes.NORMAL", -7), "out of range"
    yield "no POSITION", edited(PRIMITIVE + ".attributes.POSITION", None), "POSITION is missing"
    yield "mode 9", edited(PRIMITIVE + ".mode", 9), "unknown mode 9"


def node_cases():
    yield "child 99", edited(f"nodes.{HIP}.children", [99]), "there is no node 99"
    yield "child -1", edited(f"nodes.{HIP}.children", [-1]), "out of range"
    yield "a node that is its own child", edited(f"nodes.{HIP}.children", [HIP]), "is part of a cycle of nodes"
    yield "a cycle of two nodes", edited(f"nodes.{KNEE}.children", [HIP]), "is part of a cycle of nodes"
    yield "two parents", edited(f"nodes.{BODY}.children", [KNEE]), "already"
    yield "deep tree", deep_nodes(20000), "is more than 1000 levels deep"
    yield "scene shows node 99", edited("scenes.0.nodes", [99]), "there is no node 99"
    yield "scene shows a node twice", edited("scenes.0.nodes", [LIGHT, LIGHT]), "twice"
    yield "scene 5", edited("scene", 5), "there is no scene 5"
    for name, node, member, place in (("mesh", BODY, "mesh", "mesh"), ("skin", BODY, "skin", "skin"),
                                      ("camera", CAMERA, "camera", "camera")):
        yield f"no such {name}", edited(f"nodes.{node}.{member}", 99), f"nodes[{node}].{place}: there is no {name} 99"
    yield "no such light", edited(f"nodes.{LIGHT}.extensions.KHR_lights_punctual.light", 99), "there is no light 99"
    yield "light -1", edited(f"nodes.{LIGHT}.extensions.KHR_lights_punctual.light", -1), "out of range"
    yield "short rotation", edited(f"nodes.{KNEE}.rotation", [0, 0, 1]), "rotation: must be four numbers"
    yield "zero rotation", edited(f"nodes.{KNEE}.rotation", [0, 0, 0, 0]), "not a unit quaternion"
    yield "short matrix", edited(f"nodes.{SCARF}.matrix", [1] * 15), "matrix: must be sixteen numbers"
    yield "projective matrix", edited(f"nodes.{SCARF}.matrix", [1] * 16), "is not affine"
    yield "scale of 1e300", edited(f"nodes.{SCARF}.scale", [1e300, 1, 1]), "does not fit a 32-bit float"
    yield "scale of 1e38", edited(f"nodes.{SCARF}.scale", [1e38, 1e38, 1e38]), "too large"
    yield "yfov 0", edited("cameras.0.perspective.yfov", 0), "yfov"
    yield "cone turned over", edited("extensions.KHR_lights_punctual.lights.0.spot.innerConeAngle", 1.2), "innerConeAngle"
    yield "laser", edited("extensions.KHR_lights_punctual.lights.0.type", "laser"), "laser"
    yield "negative light", edited("extensions.KHR_lights_punctual.lights.0.intensity", -1), "must not be negative"


def material_cases():
    color = "materials.0.pbrMetallicRoughness."
    yield "no such material", edited(PRIMITIVE + ".material", 99), "there is no material 99"
    yield "no such texture", edited(color + "baseColorTexture.index", 99), "there is no texture 99"
    yield "negative texture", edited(color + "baseColorTexture.index", -1), "out of range"
    yield "no such image", edited("textures.0.source", 99), "there is no image 99"
    yield "no such sampler", edited("textures.0.sampler", 99), "there is no sampler 99"
    yield "image of no view", edited("images.0.bufferView", 99), "images[0].bufferView: there is no bufferView 99"
    yield "image that is none", edited("images.0.bufferView", 0), "images[0]"
    yield "image file missing", edited("images.0", {"uri": "nowhere.png"}), "nowhere.png"
    yield "image outside", edited("images.0", {"uri": "../../etc/x.png"}), "is outside the folder of the file"
    yield "image outside, in code", edited("images.0", {"uri": "%2e%2e/x.png"}), "is outside the folder of the file"
    yield "image without bytes", edited("images.0", {"uri": "data:image/png;base64,"}), "images[0].uri: is empty"
    yield "image without source", edited("images.0", {}), "images[0]: must have either a uri or a bufferView"
    yield "two colors", edited(color + "baseColorFactor", [1, 1]), "baseColorFactor"


def motion_cases():
    first = "animations.0.samplers.0"
    yield "short matrices", edited(f"{A}.{MATRICES}.count", 1), "1 matrices for 2 joints"
    yield "no such joint node", edited("skins.0.joints", [HIP, 99]), "there is no node 99"
    yield "no joints", edited("skins.0.joints", []), "skins[0].joints"
    yield "joint 9 of 2", numbers(JOINTS, 1, 9), "joint 9 is out of range: the skin has 2 joints"
    yield "joints without weights", edited(PRIMITIVE + ".attributes.WEIGHTS_0", None), "must be used together"
    yield "two weights", edited("meshes.0.weights", [0.5, 0.5]), "weights"
    yield "short output", edited(f"{A}.{MOVES}.count", 2), "animations[0].samplers[0].output"
    yield "spline with too few", edited(first + ".interpolation", "CUBICSPLINE"), "animations[0].samplers[0].output"
    yield "descending times", numbers(TIMES, 1, 2.0), "times must ascend, but do not at key 2"
    yield "time NaN", numbers(TIMES, 0, float("nan")), "element 0 is not finite"
    yield "interpolation BOUNCE", edited(first + ".interpolation", "BOUNCE"), "unknown \"BOUNCE\""
    yield "no such animation sampler", edited("animations.0.channels.0.sampler", 99), "there is no sampler 99"
    yield "moves node 99", edited("animations.0.channels.0.target.node", 99), "there is no node 99"
    yield "two channels for one property", edited("animations.0.channels.3", {"sampler": 0, "target": {"node": FLOOR, "path": "translation"}}), \
        "animates the same property as another channel"
    yield "weights of none", edited("animations.0.channels.2.target.node", FLOOR), "without morph targets"
    yield "target too long", edited(f"{A}.{TARGET}.count", 5), "targets[0].POSITION"


def buffer_cases():
    whole = bytes(gltf_model.model().binary)
    yield "buffer without uri", buffered(), "buffer"
    yield "buffer file missing", buffered(uri="nowhere.bin"), "nowhere.bin\" cannot be read"
    yield "buffer outside", buffered(uri="../x.bin"), "is outside the folder of the file"
    yield "buffer of the system", buffered(uri="/etc/passwd"), "is outside the folder of the file"
    yield "buffer from the net", buffered(uri="http://example.com/x.bin"), "is not a file name"
    yield "buffer is a folder", buffered(uri="."), "cannot be read"
    yield "no base64", buffered(uri="data:application/octet-stream;base64,?!?!"), "buffers[0].uri: is not base64"
    yield "buffer too short", buffered(uri=data_uri(whole[:40])), "buffers[0].byteLength: is 626, but the data has 40 bytes"
    yield "buffer of 2^31 bytes", buffered(uri=data_uri(whole), byteLength=2**31 - 1), "buffers[0].byteLength: is 2147483647, but the data has 626 bytes"
    yield "buffer longer than its chunk", pack(json.loads(buffered(byteLength=len(whole) + 1000)), whole), "buffers[0].byteLength: is 1626, but the data has 628 bytes"


def extension_cases():
    for name, what in (("ACME_secret", "ACME_secret"), ("KHR_draco_mesh_compression", "compressed by Draco"),
                       ("EXT_meshopt_compression", "compressed by meshoptimizer"), ("KHR_texture_basisu", "Basis Universal")):
        yield f"needs {name}", edited("extensionsUsed.1", name, "extensionsRequired", [name]), what
    yield "extensions no list", edited("extensionsRequired", "all"), "must be an array of strings"


# Unusual but valid files, which render.
def harmless_cases():
    whole = gltf_model.model()
    whole.root["buffers"] = [{"byteLength": len(whole.binary)}]
    twice = json.dumps(whole.root).replace('"scene": 0', '"scene": 99, "scene": 0').encode()
    yield "unchanged", whole.bytes(), ""
    yield "a duplicate key: the last value applies", pack(twice, whole.binary), ""
    yield "no scene", text(b'{"asset": {"version": "2.0"}}'), ""
    yield "path color", edited("animations.0.channels.0.target.path", "color"), "unknown path \"color\" is ignored"
    yield "unneeded extension", edited("extensionsUsed.1", "ACME_secret"), "ACME_secret is ignored"


def flipped(count):
    """Yields files with random bytes, the same in each run."""
    whole = gltf_model.model().bytes()
    for i in range(count):
        chance = random.Random(i)
        data = bytearray(whole)
        for _ in range(chance.choice((1, 1, 2, 5))):
            data[chance.randrange(len(data))] = chance.choice((0, 1, 34, 44, 45, 48, 57, 91, 93, 125, 127, 128, 255,
                                                                   chance.randrange(256)))
        yield f"flip {i}", bytes(data), None


class Runner:
    def __init__(self, args, folder):
        self.args, self.folder = args, folder
        self.seconds = SECONDS * (6 if args.sanitized else 1)

    def run(self, number, data):
        """Renders a file. Returns the exit code (a negative signal number after the time limit), messages, megabytes and path."""
        path = os.path.join(self.folder, f"{number}.gl" + ("tf" if data[:1] == b"{" else "b"))
        with open(path, "wb") as file:
            file.write(data)
        command = ["prlimit", f"--cpu={self.seconds}", self.args.strobe, path, "--resolution", "6x6", "--spp", "1",
                   "--threads", "1", "--frames", "3:3", "--strict", "-o", path + ".exr"]
        environment = dict(os.environ, ASAN_OPTIONS="new_delete_type_mismatch=0", UBSAN_OPTIONS="halt_on_error=1")
        with open(path + ".log", "w+", errors="replace") as log:
            process = subprocess.Popen(command, stdout=log, stderr=log, env=environment)
            watch = threading.Timer(12 * self.seconds, process.kill)  # the limit of CPU time does not end a process that sleeps
            watch.start()
            _, status, usage = os.wait4(process.pid, 0)
            watch.cancel()
            process.returncode = os.waitstatus_to_exitcode(status)
            log.seek(0)
            return process.returncode, log.read(), usage.ru_maxrss / 1024, path

    def fault(self, number, case, codes):
        """Returns the description of a failure, or None."""
        name, data, expected = case
        code, stderr, megabytes, path = self.run(number, data)
        where = f"{name}: exit code {code}, stderr: {stderr.strip()[:300] or 'nothing'}"
        if code not in codes:
            return where
        if code == 2 and os.path.basename(path) not in stderr:
            return where + " — without the file's name"
        if expected is not None and expected not in stderr:
            return where + f" — without \"{expected}\""
        if "Sanitizer" in stderr or "runtime error" in stderr:
            return where
        if megabytes > MEGABYTES and not self.args.sanitized:
            return where + f" — with {megabytes:.0f} MB"
        return None


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("strobe")
    parser.add_argument("--sanitized", action="store_true")
    parser.add_argument("--flips", type=int, default=0)
    args = parser.parse_args()
    groups = (container_cases, accessor_cases, node_cases, material_cases, motion_cases, buffer_cases, extension_cases)
    broken = [case for group in groups for case in group()]
    jobs = [(case, {2}) for case in broken] + [(case, {0}) for case in harmless_cases()]
    jobs += [(case, {0, 2}) for case in flipped(args.flips)]
    with tempfile.TemporaryDirectory() as folder, concurrent.futures.ThreadPoolExecutor(2) as pool:
        runner = Runner(args, folder)
        faults = list(pool.map(lambda job: runner.fault(job[0], job[1][0], job[1][1]), enumerate(jobs)))
    for fault in filter(None, faults):
        print("FAILED", fault)
    print(f"{len(broken)} broken files, {len(jobs) - len(broken) - args.flips} odd ones, {args.flips} with random bytes: "
          f"{sum(map(bool, faults))} failures")
    return 1 if any(faults) else 0


if __name__ == "__main__":
    sys.exit(main())
