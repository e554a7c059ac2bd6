#!/usr/bin/env python3
"""tools/check-rooms must be able to fail: it is run on small made-up trees."""

import os
import subprocess
import sys
import tempfile
import unittest

SCRIPT = os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "..", "tools", "check-rooms")
GOOD = {
    "src/core/math.h": "#pragma once\n#include <vector>\n",
    "src/core/embree_tracer.cpp": '#include <embree3/rtcore.h>\n#include "core/math.h"\n',
    "src/images/openimageio.cpp": "#include <OpenImageIO/imageio.h>\n",
    "src/shapes/sphere.h": '#include "core/math.h"\n',
    "src/shapes/sphere.cpp": '#include "shapes/sphere.h"\n#include <opensubdiv/far/x.h>\n',
    "src/scene/builder.cpp": '#include "shapes/sphere.h"\n',
    "src/main/main.cpp": '#include "shapes/sphere.h"\n#include <CLI/CLI.hpp>\n',
}


def run(changes):
    with tempfile.TemporaryDirectory() as root:
        for name, text in {**GOOD, **changes}.items():
            os.makedirs(os.path.dirname(os.path.join(root, name)), exist_ok=True)
            with open(os.path.join(root, name), "w", encoding="utf-8") as file:
                file.write(text)
        done = subprocess.run([sys.executable, SCRIPT, root], capture_output=True, text=True, check=False)
        return done.returncode, done.stdout


class CheckRooms(unittest.TestCase):
    def test_order_passes(self):
        self.assertEqual(run({}), (0, "check-rooms: rooms are in order\n"))

    def test_each_violation_is_found_where_it_stands(self):
        for file, line in {
            "src/core/bad.h": '#include "shapes/sphere.h"',         # upwards
            "src/shapes/bad.h": '#include "scene/builder.h"',       # upwards
            "src/lights/bad.cpp": '#include "shapes/sphere.h"',     # sideways
            "src/scene/bad.cpp": '#include "main/main.h"',
            "src/core/relative.cpp": '#include "../shapes/sphere.h"',
            "src/core/short.cpp": '#include "math.h"',
            "src/core/test.cpp": '#include "test/support/x.h"',
            "src/core/gone.cpp": '#include "core/gone.h"',
            "src/shapes/embree.cpp": "#  include <embree4/rtcore.h>",
            "src/core/pixels.cpp": "#include <OpenEXR/ImfRgbaFile.h>",
            "src/core/planes.cpp": "#include <ImfHeader.h>",
            "src/core/film.cpp": "#include <OpenColorIO/OpenColorIO.h>",
            "src/core/loop.cpp": "#include <opensubdiv/far/x.h>",
        }.items():
            with self.subTest(file=file):
                code, out = run({file: "// first\n/* two\nlines */\n" + line + "\n"})
                self.assertEqual(code, 1)
                self.assertTrue(out.startswith(file + ":4: "), out)
                self.assertTrue(out.endswith("check-rooms: 1 violations\n"), out)

    def test_file_outside_of_rooms(self):
        self.assertEqual(run({"src/util/x.h": "\n"})[0], 1)
        self.assertEqual(run({"src/x.h": "\n"})[0], 1)

    def test_comments_are_not_includes(self):
        self.assertEqual(run({"src/core/x.h": '// #include "scene/y.h"\n/*\n#include "scene/y.h"\n*/\n'})[0], 0)


unittest.main()
