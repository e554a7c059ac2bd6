#!/usr/bin/python3
"""Times a glTF scene of many large textures, beside the same scene with textures of one pixel.

Usage: large_textures.py --out DIR [--objects N] [--size PIXELS] [--strobe PROGRAM] [--spp N] [--texture-mb N...]

Makes a scene of N objects (default 20) with three textures each, of --size pixels (default 4096): base color, roughness and
metalness, normals. Renders it at 640x480 and --spp samples (default 16) with textures of one pixel, with all textures in memory,
and with each limit --texture-mb. Prints seconds, peak memory and bytes on disk, and whether the images of all limits have the
same bits. The time to read images is that of all threads together, divided by the number of cores; it counts the time that
threads wait for a core. The excess is the CPU time beyond that with small textures, divided by the number of cores; it includes
reading. The exit code is 1 if bits differ, or if the render takes more than --slack seconds (default 20) longer than that with small
textures plus reading and the excess is more than --slack plus reading.
"""
import argparse
import json
import math
import os
import resource
import sys

import numpy as np
import OpenImageIO as oiio
from PIL import Image

ROOT = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))


def texture(kind, number, size):
    """Returns an image: a pattern of large and small structures, of which the last are noise."""
    random = np.random.default_rng(1000 * number + len(kind))
    y, x = np.mgrid[0:size, 0:size].astype(np.float32) / size
    waves = np.sin(x * (20 + number)) * np.cos(y * (17 + 2 * number))
    noise = random.random((size, size), np.float32)
    if kind == "normal":
        tilt = 0.2 * waves + 0.05 * noise
        rgb = np.stack([0.5 + 0.5 * tilt, 0.5 - 0.3 * tilt, np.ones_like(x) - 0.1 * np.abs(tilt)], -1)
    elif kind == "packed":
        rgb = np.stack([np.ones_like(x), 0.4 + 0.3 * waves + 0.1 * noise, (waves > 0.5).astype(np.float32)], -1)
    else:
        hue = 0.5 + 0.4 * np.cos(number + np.array([0, 2, 4], np.float32))
        rgb = hue * (0.6 + 0.2 * waves[..., None] + 0.2 * noise[..., None])
    return Image.fromarray((np.clip(rgb, 0, 1) * 255).astype(np.uint8))


def sphere(rings=32, columns=64):
    """Returns positions (and normals), texture coordinates and indices of a unit sphere."""
    p, uv, indices = [], [], []
    for i in range(rings + 1):
        for k in range(columns + 1):
            theta, phi = math.pi * i / rings, 2 * math.pi * k / columns
            p.append((math.sin(theta) * math.cos(phi), math.cos(theta), -math.sin(theta) * math.sin(phi)))
            uv.append((2 * k / columns, i / rings))
            if i < rings and k < columns:
                a, b = i * (columns + 1) + k, (i + 1) * (columns + 1) + k
                indices += [a, b, a + 1, a + 1, b, b + 1]
    return np.array(p, np.float32), np.array(uv, np.float32), np.array(indices, np.uint32)


def write_scene(folder, objects, size):
    """Writes the scene and its images, unless they are there. Returns the path of the .gltf file."""
    os.makedirs(folder, exist_ok=True)
    p, uv, indices = sphere()
    parts = [indices.tobytes(), p.tobytes(), uv.tobytes()]
    offsets = [0, len(parts[0]), len(parts[0]) + len(parts[1])]
    kinds = ("base", "packed", "normal")
    names = [f"{kind}{i}.{'jpg' if kind == 'base' else 'png'}" for i in range(objects) for kind in kinds]
    for i, name in enumerate(names):
        path = os.path.join(folder, name)
        if not os.path.exists(path):
            texture(kinds[i % 3], i // 3, size).save(path, quality=90, compress_level=1)
    columns = math.ceil(math.sqrt(objects * 4 / 3))
    materials = [{"pbrMetallicRoughness": {"baseColorTexture": {"index": 3 * i}, "metallicRoughnessTexture": {"index": 3 * i + 1}},
                  "normalTexture": {"index": 3 * i + 2}} for i in range(objects)]
    model = {
        "asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": list(range(objects))}],
        "nodes": [{"mesh": i, "translation": [2.1 * (i % columns), -2.1 * (i // columns), 0]} for i in range(objects)],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 1, "NORMAL": 1, "TEXCOORD_0": 2}, "indices": 0, "material": i}]}
                   for i in range(objects)],
        "materials": materials, "textures": [{"source": i} for i in range(3 * objects)],
        "images": [{"uri": name} for name in names],
        "accessors": [{"bufferView": 0, "componentType": 5125, "count": len(indices), "type": "SCALAR"},
                      {"bufferView": 1, "componentType": 5126, "count": len(p), "type": "VEC3",
                       "min": p.min(0).tolist(), "max": p.max(0).tolist()},
                      {"bufferView": 2, "componentType": 5126, "count": len(uv), "type": "VEC2"}],
        "bufferViews": [{"buffer": 0, "byteOffset": o, "byteLength": len(b)} for o, b in zip(offsets, parts)],
        "buffers": [{"uri": "mesh.bin", "byteLength": sum(map(len, parts))}]}
    with open(os.path.join(folder, "mesh.bin"), "wb") as file:
        file.write(b"".join(parts))
    with open(os.path.join(folder, "scene.gltf"), "w") as file:
        json.dump(model, file)
    return os.path.join(folder, "scene.gltf")


def render(args, scene, name, more=()):
    """Renders a scene. Returns its statistics, with "wall" (seconds), "peak" (bytes) and "pixels"."""
    image, stats = os.path.join(args.out, name + ".exr"), os.path.join(args.out, name + ".json")
    command = [args.strobe, scene, "--resolution", "640x480", "--spp", str(args.spp), "--quiet", "-o", image, "--stats", stats, *more]
    pid = os.fork()
    if pid == 0:
        os.execv(command[0], command)
    _, status, usage = os.wait4(pid, 0)
    if status:
        sys.exit(f"{' '.join(command)}: exit code {os.waitstatus_to_exitcode(status)}")
    with open(stats) as file:
        result = json.load(file)
    result["peak"] = usage.ru_maxrss * 1024
    result["user"] = usage.ru_utime + usage.ru_stime
    result["pixels"] = oiio.ImageBuf(image).get_pixels()
    return result


def main():
    """Runs the command line. Returns the exit code."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", required=True)
    parser.add_argument("--objects", type=int, default=20)
    parser.add_argument("--size", type=int, default=4096)
    parser.add_argument("--spp", type=int, default=16)
    parser.add_argument("--slack", type=float, default=20)
    parser.add_argument("--texture-mb", type=int, nargs="*", default=[2000, 500])
    parser.add_argument("--strobe", default=os.path.join(ROOT, "build", "release", "strobe"))
    args = parser.parse_args()
    large = write_scene(os.path.join(args.out, f"{args.objects}x3x{args.size}"), args.objects, args.size)
    small = write_scene(os.path.join(args.out, f"{args.objects}x3x1"), args.objects, 1)
    disk = sum(entry.stat().st_size for entry in os.scandir(os.path.dirname(large)))
    print(f"{3 * args.objects} textures of {args.size}x{args.size}: {disk / 1e6:.0f} MB on disk")
    print("| textures | render s | reading s (threads / cores) | CPU s | excess s | peak MB | read again MB |\n|---|---|---|---|---|---|---|")
    cores = os.cpu_count()
    runs = [("1x1", small, ())] + [("all in memory", large, ())]
    runs += [(f"--texture-mb {mb}", large, ("--texture-mb", str(mb))) for mb in args.texture_mb]
    base, first, fails = None, None, 0
    for i, (label, scene, more) in enumerate(runs):
        r = render(args, scene, f"run{i}", more)
        reading = r["textures"]["threadSecondsToRead"] / cores
        base = r if base is None else base
        excess = (r["user"] - base["user"]) / cores
        print(f"| {label} | {r['seconds']['render']:.2f} | {reading:.2f} | {r['user']:.2f} | {excess:.2f} | {r['peak'] / 1e6:.0f} | "
              f"{r['textures']['pageBytesReadAgain'] / 1e6:.0f} |", flush=True)
        if i == 0:
            continue
        first = r["pixels"] if first is None else first
        if not np.array_equal(first, r["pixels"]):
            print("the bits differ")
            fails += 1
        is_late = r["seconds"]["render"] > base["seconds"]["render"] + reading + args.slack
        fails += is_late and excess > reading + args.slack
    print("passed" if not fails else "FAILED")
    return 1 if fails else 0


if __name__ == "__main__":
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    sys.exit(main())
