#!/usr/bin/env python3
"""Compares documentation with the repository: code blocks, links, names of files, rooms and functions.

A code block "```LANGUAGE FILE" must consist of consecutive lines of FILE. In a block "```diff FILE", the lines that are
removed or unchanged must be in FILE. The blocks of a tutorial together contain every line of its files.
"""

import os
import re
import unittest

ROOT = os.path.normpath(os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", ".."))
PAGES = ("README.md", "CONTRIBUTING.md", "docs/architecture.md", "docs/sharing.md", "docs/tutorial-integrator.md", "docs/tutorial-material.md",
         "docs/plugins.md", "docs/embedding.md", "examples/README.md")
TUTORIALS = {
    "docs/tutorial-integrator.md": ("examples/integrator/quad.cpp",),
    "docs/tutorial-material.md": ("test/materials/minnaert.h", "test/materials/minnaert.cpp"),
}
BLOCK = re.compile(r"^```(\w+) (\S+)\n(.*?)^```$", re.M | re.S)
LINK = re.compile(r"\]\(([^)#\s]+)(?:#[^)]*)?\)")
FILE = re.compile(r"`((?:src|test|tools|docs|scenes|bench|examples)/[\w./*-]*)`")
FUNCTION = re.compile(r"`(?:\w+::)*(\w+)(?:\(\))?`")


def read(name):
    """Returns the text of a file of the repository."""
    with open(os.path.join(ROOT, name), encoding="utf-8") as file:
        return file.read()


def is_run(block, lines):
    """Returns whether `block` is a list of consecutive elements of `lines`."""
    return any(lines[i:i + len(block)] == block for i in range(len(lines) - len(block) + 1))


class Documentation(unittest.TestCase):
    def test_code_blocks_are_parts_of_files(self):
        for page in PAGES:
            for language, name, text in BLOCK.findall(read(page)):
                with self.subTest(page=page, block=text):
                    versions = [text.splitlines()]
                    if language == "diff":  # the file before or after a reader applied it
                        versions = [[line[1:] for line in versions[0] if not line.startswith(other)] for other in "+-"]
                    lines = read(name).splitlines()
                    self.assertTrue(any(is_run(version, lines) for version in versions), f"not in {name}: if it is a diff of a plugin table, see CONTRIBUTING.md, Adding a plugin")

    def test_tutorials_contain_their_files(self):
        for page, names in TUTORIALS.items():
            for name in names:
                blocks = [text.splitlines() for _, file, text in BLOCK.findall(read(page)) if file == name]
                shown = [line for block in blocks for line in block if line]
                lines = [line for line in read(name).splitlines() if line]
                if lines[0].startswith("// "):  # names the tutorial
                    lines = lines[1:]
                self.assertEqual(shown, lines, f"{page} lacks lines of {name}, or has them in another order")

    def test_links_and_files_exist(self):
        for page in PAGES:
            folder = os.path.dirname(page)
            links = [os.path.join(folder, link) for link in LINK.findall(read(page)) if not re.match(r"\w+:", link)]
            for name in links + [file for file in FILE.findall(read(page)) if "*" not in file]:
                self.assertTrue(os.path.exists(os.path.join(ROOT, name)), f"{page}: {name} does not exist")

    def test_the_architecture_lists_all_rooms(self):
        text = read("docs/architecture.md")
        for folder, _, files in os.walk(os.path.join(ROOT, "src")):
            if any(file.endswith(".cpp") for file in files):
                room = os.path.relpath(folder, ROOT)
                self.assertIn(f"`{room}`", text, "docs/architecture.md does not list the room")

    def test_functions_of_the_architecture_exist(self):
        rows = [row for row in read("docs/architecture.md").splitlines() if row.startswith("|") and ".cpp`" in row]
        self.assertGreater(len(rows), 10)
        for row in rows:
            code = "".join(read(name) for name in FILE.findall(row))
            for name in FUNCTION.findall(row.split("|")[-3]):
                self.assertTrue(re.search(rf"\b{name}\b", code), f"docs/architecture.md: {name} is not in the files of: {row}")


if __name__ == "__main__":
    unittest.main()
