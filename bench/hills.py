"""Landscapes with any number of triangles, for benchmarks."""

import numpy

# A scene of hills.ply, which is in the same folder.
SCENE = """Film "image" "integer xresolution" 1600 "integer yresolution" 1600
Sampler "sobol" "integer pixelsamples" 4
Integrator "directlighting"
LookAt 0 1.2 -1.2  0 0 0  0 1 0
Camera "perspective" "float fov" 60
WorldBegin
LightSource "point" "rgb I" [5 5 5] "point from" [1 3 -1]
Material "matte"
Shape "plymesh" "string filename" "hills.ply"
"""


def write_hills(path, triangles):
    """Writes a square landscape of about `triangles` triangles as binary PLY with normals. Returns the number of triangles."""
    n = int(round((triangles / 2) ** 0.5)) + 1
    x, z = numpy.meshgrid(numpy.linspace(-1, 1, n, dtype="f4"), numpy.linspace(-1, 1, n, dtype="f4"))
    y = 0.1 * numpy.sin(9 * x) * numpy.sin(7 * z)
    normals = numpy.stack([-0.9 * numpy.cos(9 * x) * numpy.sin(7 * z), numpy.ones_like(x),
                           -0.7 * numpy.sin(9 * x) * numpy.cos(7 * z)], -1)
    vertices = numpy.concatenate([numpy.stack([x, y, z], -1), normals], -1).astype("<f4").reshape(-1, 6)
    corner = (numpy.arange(n - 1)[:, None] * n + numpy.arange(n - 1)).reshape(-1)
    faces = numpy.stack([numpy.stack([corner, corner + n, corner + 1], -1),
                         numpy.stack([corner + 1, corner + n, corner + n + 1], -1)], 1).reshape(-1, 3)
    records = numpy.empty(len(faces), dtype=[("count", "u1"), ("index", "<i4", 3)])
    records["count"] = 3
    records["index"] = faces
    with open(path, "wb") as file:
        file.write(("ply\nformat binary_little_endian 1.0\nelement vertex %d\n" % len(vertices)).encode())
        for name in ("x", "y", "z", "nx", "ny", "nz"):
            file.write(("property float %s\n" % name).encode())
        file.write(("element face %d\nproperty list uchar int vertex_indices\nend_header\n" % len(faces)).encode())
        vertices.tofile(file)
        records.tofile(file)
    return len(faces)
