#!/usr/bin/env python3
"""Tests tools/check-rooms with small synthetic source trees: a valid tree passes, and each kind of violation is reported."""

import os
import subprocess
import sys
import tempfile
import unittest

SCRIPT = os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "..", "tools", "check-rooms")
GOOD = {
    "src/core/math/math.h": "#pragma once\n#include <vector>\n",
    "src/core/scene/embree_tracer.cpp": '#include <embree3/rtcore.h>\n#include "core/math/math.h"\n',
    "src/images/openimageio.cpp": "#include <OpenImageIO/imageio.h>\n",
    "src/shapes/sphere.h": '#include "core/math/math.h"\n',
    "src/shapes/sphere.cpp": '#include "shapes/sphere.h"\n#include <opensubdiv/far/x.h>\n',
    "src/loader/build/builder.cpp": '#include "shapes/sphere.h"\n',
    "src/cli/main.cpp": '#include "loader/build/builder.h"\n#include <CLI/CLI.hpp>\n',
    "src/loader/build/builder.h": "#pragma once\n",
}


def run(changes, *options):
    """Runs check-rooms on the valid tree with changed files. Returns the exit code and the output."""
    with tempfile.TemporaryDirectory() as root:
        for name, text in {**GOOD, **changes}.items():
            os.makedirs(os.path.dirname(os.path.join(root, name)), exist_ok=True)
            with open(os.path.join(root, name), "w", encoding="utf-8") as file:
                file.write(text)
        done = subprocess.run([sys.executable, SCRIPT, root, *options], capture_output=True, text=True, check=False)
        return done.returncode, done.stdout


def function(lines, head="int f(int x) {"):
    """Returns a function of this many lines."""
    return head + "\n" + "    ++x;\n" * (lines - 2) + "}\n"


class CheckRooms(unittest.TestCase):
    def test_a_valid_tree_passes(self):
        self.assertEqual(run({}), (0, "check-rooms: 0 violations\n"))

    def test_each_invalid_include_is_reported_with_its_line(self):
        for file, line in {
            "src/core/math/bad.h": '#include "shapes/sphere.h"',       # upwards
            "src/core/math/up.h": '#include "core/scene/scene.h"',     # upwards between sub-rooms
            "src/core/params/side.h": '#include "core/film/film.h"',   # sideways between sub-rooms
            "src/shapes/bad.h": '#include "loader/build/builder.h"',   # upwards
            "src/lights/bad.cpp": '#include "shapes/sphere.h"',        # sideways
            "src/loader/parser/bad.cpp": '#include "loader/build/builder.h"',
            "src/core/film/relative.cpp": '#include "../math/math.h"',
            "src/core/film/short.cpp": '#include "math.h"',
            "src/core/film/test.cpp": '#include "test/support/x.h"',
            "src/core/film/gone.cpp": '#include "core/film/gone.h"',
            "src/shapes/embree.cpp": "#  include <embree4/rtcore.h>",
            "src/core/image/pixels.cpp": "#include <OpenEXR/ImfRgbaFile.h>",
            "src/core/film/planes.cpp": "#include <ImfHeader.h>",
            "src/core/film/film.cpp": "#include <OpenColorIO/OpenColorIO.h>",
            "src/core/scene/loop.cpp": "#include <opensubdiv/far/x.h>",
            "src/core/scene/log.cpp": "#include <spdlog/spdlog.h>",
        }.items():
            with self.subTest(file=file):
                code, out = run({file: "// first\n/* two\nlines */\n" + line + "\n"})
                self.assertEqual(code, 1)
                self.assertTrue(out.startswith(file + ":4: "), out)
                self.assertTrue(out.endswith("check-rooms: 1 violations\n"), out)

    def test_a_file_outside_of_rooms_is_a_violation(self):
        self.assertEqual(run({"src/util/x.h": "\n"})[0], 1)
        self.assertEqual(run({"src/x.h": "\n"})[0], 1)
        self.assertEqual(run({"src/core/x.h": "\n"})[0], 1)

    def test_includes_in_comments_are_ignored(self):
        text = '// #include "loader/build/y.h"\n/*\n#include "loader/build/y.h"\n*/\n'
        self.assertEqual(run({"src/core/math/x.h": text})[0], 0)

    def test_files_of_more_than_400_lines_are_violations(self):
        self.assertEqual(run({"src/core/math/x.h": "\n" * 400})[0], 0)
        code, out = run({"src/core/math/x.h": "\n" * 401})
        self.assertEqual((code, out.split("\n")[0]), (1, "src/core/math/x.h:1: the file has 401 lines, more than 400"))

    def test_functions_of_more_than_60_lines_are_violations(self):
        for before in ("", "namespace strobe {\nnamespace {\n", "struct A {\n", 'const char* s = R"({)";\n// {\n',
                       "int a[] = {1, 2};\n", "class B : public A {\n  public:\n"):
            for head in ("int f(int x) {", "A::A(int x) : m_x{x}, m_y(x) {", "template <class T>\nauto f(T x) -> int {",
                         "bool operator()(int x) const {"):
                with self.subTest(before=before, head=head):
                    extra = head.count("\n")
                    self.assertEqual(run({"src/core/math/x.h": before + function(60 - extra, head)})[0], 0)
                    code, out = run({"src/core/math/x.h": before + function(61 - extra, head)})
                    expected = f"src/core/math/x.h:{before.count(chr(10)) + 1}: the function has 61 lines, more than 60"
                    self.assertEqual((code, out.split("\n")[0]), (1, expected))

    def test_large_folders_are_violations(self):
        files = {f"src/core/math/x{i}.h": "\n" for i in range(25)}
        code, out = run(files)
        self.assertEqual(code, 1)
        self.assertTrue(out.startswith("src/core/math:1: the folder has 26 files and "), out)
        code, out = run({f"src/core/math/x{i}.h": "\n" * 390 for i in range(9)})
        self.assertEqual(code, 1)

    def test_the_table_has_the_sizes_of_functions(self):
        code, out = run({"src/core/math/x.h": function(3) + function(5) + function(9)}, "--table")
        self.assertEqual(code, 0)
        self.assertIn("| core/math | 2 | 19 | 3 | 5 | 9 | 9 |\n", out)


unittest.main()
