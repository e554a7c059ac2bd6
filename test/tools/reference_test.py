"""Tests tools/make-reference: docs/reference.md is up to date and complete, and changes are found.
Usage: reference_test.py PATH_OF_STROBE [unittest arguments]"""
import os
import re
import stat
import subprocess
import sys
import tempfile
import unittest

ROOT = os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "..")
SCRIPT = os.path.join(ROOT, "tools", "make-reference")
REFERENCE = os.path.join(ROOT, "docs", "reference.md")
STROBE = os.path.abspath(sys.argv.pop(1)) if len(sys.argv) > 1 else os.environ.get("STROBE", "strobe")


def run(*arguments):
    """Runs tools/make-reference. Returns the exit code and the output."""
    done = subprocess.run([sys.executable, SCRIPT, *arguments], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, check=False)
    return done.returncode, done.stdout.decode()


def output_of(*arguments):
    """Returns the standard output of strobe."""
    return subprocess.run([STROBE, *arguments], stdout=subprocess.PIPE, check=True).stdout.decode()


class MakeReference(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory(prefix="strobe-reference-")
        self.addCleanup(folder.cleanup)
        self.file = os.path.join(folder.name, "reference.md")
        self.program = os.path.join(folder.name, "strobe")

    def write_program(self, plugins):
        """Writes a program that prints a text for --list, and nothing for other arguments."""
        with open(self.program, "w", encoding="utf-8") as file:
            file.write(f"#!/bin/sh\n[ $1 = --list ] || exit 0\ncat <<'END'\n{plugins}\nEND\n")
        os.chmod(self.program, stat.S_IRWXU)

    def test_the_reference_is_up_to_date(self):
        self.assertEqual(run(STROBE, "--check"), (0, ""))

    def test_an_outdated_reference_is_found(self):
        self.assertEqual(run(STROBE, "-o", self.file), (0, ""))
        with open(self.file, "a", encoding="utf-8") as file:
            file.write("x\n")
        code, output = run(STROBE, "-o", self.file, "--check")
        self.assertEqual(code, 1)
        self.assertIn("is out of date; run tools/make-reference", output)

    def test_every_option_and_every_plugin_is_listed(self):
        with open(REFERENCE, encoding="utf-8") as file:
            text = file.read()
        for option in re.findall(r"^  (?:-\w,)?(--?[-\w]+)", output_of("--help"), re.M):
            self.assertRegex(text, rf"`{option}[ `]")
        plugins, aovs = output_of("--list").split("\nAOV: ")
        for name in re.findall(r"^  (\S+)", plugins, re.M):
            self.assertIn(f"\n#### {name}\n", text)
        for parameter in re.findall(r"^      \S.*?  +(\S+?)[, ]", plugins, re.M):
            self.assertIn(f"`{parameter}`", text)
        for name in re.findall(r"^  (\S+)", aovs, re.M):
            self.assertIn(f"\n| `{name}` | ", text)

    def test_defaults_and_ranges_have_columns(self):
        self.write_program("Camera\n  lens  a lens\n      float  radius, r  radius of | a lens [0.5; at least 0]\n      float  f  focus [1 to 3]")
        self.assertEqual(run(self.program, "-o", self.file), (0, ""))
        with open(self.file, encoding="utf-8") as file:
            text = file.read()
        self.assertIn("### Camera\n\n#### lens\nA lens.\n", text)
        self.assertIn("| `radius`, `r` | float | `0.5` | at least 0 | radius of \\| a lens |\n", text)
        self.assertIn("| `f` | float |  | 1 to 3 | focus |\n", text)

    def test_lines_of_another_format_are_errors(self):
        self.write_program("Camera\n  lens")
        code, output = run(self.program, "-o", self.file)
        self.assertEqual((code, output), (1, "make-reference: unexpected line: '  lens'\n"))


unittest.main()
