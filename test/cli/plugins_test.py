"""Installs strobe into an empty folder and moves it; builds and tests the examples there; libraries of plugins that are refused;
parts of a plugin's integrator. Usage: plugins_test.py BUILD_FOLDER [unittest arguments]"""
import functools
import glob
import os
import shutil
import subprocess
import sys
import tempfile
import unittest

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
sys.dont_write_bytecode = True  # do not write to the source tree
BUILD = os.path.abspath(sys.argv.pop(1))
sys.argv.insert(1, os.path.join(BUILD, "strobe"))
from cli_test import OK, OPTIONS, SCENE, USAGE, WORLD, Exr  # noqa: E402

EXAMPLES = os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "..", "examples")
COMPILER = os.environ.get("CXX", "c++")
# An integrator with the samples of supersample.
COPY = """
#include <strobe/core/render/batch.h>
#include <strobe/plugin.h>
namespace {
using namespace strobe;
class Worker : public IntegratorWorker {
  public:
    explicit Worker(const Scene& scene) : m_scene(scene) {}
    void plan(const VisibilityBatch& batch, ShadingRequests& requests) override { requestForEach(m_scene, batch, requests); }
    std::span<const Rgb> resolve(const VisibilityBatch&, std::span<const Rgb> shaded, std::span<Rgb>) override { return shaded; }
  private:
    const Scene& m_scene;
};
class Copy : public Integrator {
  public:
    BiasBound biasBound(const Scene&) const override { return {}; }
    SampleDependence dependence() const override { return SampleDependence::None; }
    std::unique_ptr<IntegratorState> begin(const Scene& scene, const RenderContext&) const override {
        return std::make_unique<UnsharedState<Worker>>(scene);
    }
};
}
STROBE_PLUGIN_LIBRARY([](strobe::PluginRows& rows) {
    rows.add(IntegratorPlugin{"copy", BUILD, {}, [](const ParamSet&, const BuildContext&) { return std::make_shared<const Copy>(); }});
})
"""
EMPTY = "#include <strobe/plugin.h>\nSTROBE_PLUGIN_LIBRARY([](strobe::PluginRows&) {})\n"


def run(*command, code=0, **settings):
    """Runs a command. Returns its standard output and error."""
    done = subprocess.run([str(word) for word in command], capture_output=True, text=True, timeout=300, check=False, **settings)
    if done.returncode != code:
        raise AssertionError(f"{command} ended with {done.returncode} instead of {code}\n{done.stdout}{done.stderr}")
    return done.stdout + done.stderr


def setUpModule():
    global FOLDER, PREFIX
    temporary = tempfile.TemporaryDirectory(prefix="strobe-plugins-")
    unittest.addModuleCleanup(temporary.cleanup)
    FOLDER = temporary.name
    PREFIX = os.path.join(FOLDER, "moved")
    run("cmake", "--install", BUILD, "--prefix", os.path.join(FOLDER, "prefix"))
    os.rename(os.path.join(FOLDER, "prefix"), PREFIX)


def strobe(*arguments, code=OK, **settings):
    return run(os.path.join(PREFIX, "bin", "strobe"), *arguments, code=code, cwd=FOLDER, **settings)


@functools.cache
def example(name):
    """Builds an example and runs its tests. Returns its build folder."""
    folder = os.path.join(FOLDER, name)
    run("cmake", "-S", os.path.join(EXAMPLES, name), "-B", folder, f"-DCMAKE_PREFIX_PATH={PREFIX}")
    run("cmake", "--build", folder)
    return folder


class Tools(unittest.TestCase):
    def test_farm(self):
        with open(os.path.join(FOLDER, "f.scene"), "w") as file:
            file.write(OPTIONS + WORLD)
        run(os.path.join(PREFIX, "bin", "strobe-farm"), "local", "f.scene", "-o", "f.exr", "--tasks", "2", cwd=FOLDER)
        self.assertTrue(os.path.exists(os.path.join(FOLDER, "f.exr")))
        self.assertFalse(os.path.exists(os.path.join(FOLDER, "f.exr.farm")))
        self.assertEqual(sorted(os.listdir(os.path.join(PREFIX, "share", "strobe"))), ["strobe_farm"])


class Examples(unittest.TestCase):
    def check(self, name):
        self.assertIn("100% tests passed", run("ctest", "--output-on-failure", "--no-tests=error", cwd=example(name)))

    def test_integrator(self):
        self.check("integrator")

    def test_material(self):
        self.check("material")

    def test_sampler(self):
        self.check("sampler")

    def test_embed(self):
        self.check("embed")


class PluginCase(unittest.TestCase):
    def setUp(self):
        with open(self.path("s.scene"), "w") as file:
            file.write(OPTIONS + WORLD)

    @staticmethod
    def path(name):
        return os.path.join(FOLDER, name)

    def compiled(self, name, text, *options):
        """Compiles a library without the CMake package. Returns its path."""
        with open(self.path(name + ".cpp"), "w") as file:
            file.write(text)
        imath = next(folder for folder in ("/usr/include/Imath", "/usr/local/include/Imath") if os.path.isdir(folder))
        run(COMPILER, "-std=c++20", "-shared", "-fPIC", "-fvisibility=hidden", "-I", os.path.join(PREFIX, "include"), "-I", imath,
            self.path(name + ".cpp"), *options, "-o", self.path(name + ".so"))
        return self.path(name + ".so")


class Refused(PluginCase):
    def refused(self, file, *reasons):
        """Expects that an option's library is an error, and one in $STROBE_PLUGIN_PATH a warning."""
        message = strobe("s.scene", "--plugin", file, "--dry-run", code=USAGE)
        self.assertIn(f"cannot load the plugin {file}: ", message)
        for reason in reasons:
            self.assertIn(reason, message)

    def altered(self, name, alter):
        """Writes alter(content of an example's library). Returns the path."""
        with open(os.path.join(example("integrator"), "quad.so"), "rb") as file:
            content = file.read()
        self.assertNotEqual(alter(content), content)
        with open(self.path(name), "wb") as file:
            file.write(alter(content))
        return self.path(name)

    def test_another_abi(self):
        file = self.altered("version.so", lambda content: content.replace(b"abi:version=0.", b"abi:version=9."))
        self.refused(file, "it was made for another build of strobe (version=9.", "rebuild it with the CMake package of this strobe")

    def test_other_compiler_flags(self):
        self.refused(self.compiled("debug", EMPTY, "-D_GLIBCXX_DEBUG"), "(library=libstdc++-debug-1 instead of library=libstdc++-1)")
        self.refused(self.compiled("level", EMPTY, "-std=c++23"), "(c++=20", "L instead of c++=202002L)")

    def test_no_symbol(self):
        self.refused(self.compiled("none", "int f() { return 1; }"), "it has no plugins of strobe (STROBE_PLUGIN_LIBRARY)")

    def test_text(self):
        self.refused(self.path("s.scene"), "it is not a shared library")

    def test_another_processor(self):
        file = self.altered("other.so", lambda content: content[:18] + b"\xff\xff" + content[20:])  # e_machine
        self.refused(file, "it is for another processor")

    def test_truncated(self):
        for size in (100, 1000, -10000, -1):
            self.refused(self.altered("truncated.so", lambda content: content[:size]), "it is truncated or damaged")

    def test_folder_and_missing_file(self):
        self.refused(FOLDER, "it is not a file")
        self.refused(self.path("missing.so"), "there is no such file")

    def test_exceptions(self):
        text = EMPTY.replace("{}", '{ throw std::runtime_error("no license"); }')
        self.refused(self.compiled("throws", text), "its plugins cannot be added: no license")
        text = EMPTY + 'static int state = [] { if (true) throw std::runtime_error("no device"); return 1; }();\n'
        self.refused(self.compiled("starts", text), "it throws when it is loaded: no device")

    def test_missing_dependency(self):
        dependency = self.compiled("libgone", '[[gnu::visibility("default")]] int gone() { return 1; }')
        file = self.compiled("needs", EMPTY + "int gone();\nint user = gone();\n", dependency)
        os.remove(dependency)
        self.refused(file, "libgone.so: cannot open shared object file")

    def test_undefined_symbol(self):
        self.refused(self.compiled("open", EMPTY + "int gone();\nint user = gone();\n"), "undefined symbol: _Z4gonev")

    def test_names_that_exist(self):
        file = self.compiled("again", COPY.replace('"copy"', '"supersample"'), '-DBUILD=""')
        self.assertIn(f'the plugin {file} adds the integrator "supersample", which exists already',
                      strobe("s.scene", "--plugin", file, "--dry-run", code=USAGE))

    def test_in_the_search_path_they_are_warnings(self):
        os.makedirs(self.path("found"), exist_ok=True)
        shutil.copy(os.path.join(example("integrator"), "quad.so"), self.path("found"))
        with open(self.path("found/broken.so"), "w") as file:
            file.write("text")
        environment = {**os.environ, "STROBE_PLUGIN_PATH": self.path("found")}
        message = strobe("s.scene", "--integrator", "quad", "-o", "quad.exr", env=environment)
        self.assertIn("warning: cannot load the plugin", message)
        self.assertIn("\n  quad ", strobe("--list", env=environment))
        self.assertIn("quad", strobe("--print-completion", "bash", env=environment))
        self.assertNotIn("\n  quad ", strobe("--list"))


class Parts(PluginCase):
    def pixels(self, name):
        picture = Exr(self.path(name))
        return picture.window, picture.rows

    def test_the_bits_of_supersample_and_builds_that_differ(self):
        first, second = (self.compiled(name, COPY, f'-DBUILD="{name}"') for name in ("first", "second"))
        copy = ("s.scene", "--quiet", "--integrator", "copy", "--plugin", first)
        strobe("s.scene", "--quiet", "--integrator", "supersample", "-o", "expected.exr")
        strobe(*copy, "-o", "whole.exr")
        self.assertEqual(self.pixels("whole.exr"), self.pixels("expected.exr"))
        strobe(*copy, "--sample-range", "0:6", "-o", "a.part")
        strobe(*copy, "--sample-range", "6:16", "-o", "b.part")
        strobe("merge", "a.part", "b.part", "-o", "merged.exr")
        self.assertEqual(self.pixels("merged.exr"), self.pixels("expected.exr"))
        strobe(*copy[:-1], second, "--sample-range", "6:16", "-o", "c.part")
        self.assertIn("it is a part of another scene: plugin first.so is new, plugin second.so is no longer used",
                      strobe("merge", "a.part", "c.part", "-o", "wrong.exr", code=USAGE))
        self.assertFalse(os.path.exists(self.path("wrong.exr")))

    def test_an_integrator_of_a_scene(self):
        shutil.copy(self.compiled("copy", COPY, '-DBUILD=""'), self.path("named.so"))
        with open(self.path("named.scene"), "w") as file:
            file.write(OPTIONS + 'Integrator "copy"\n' + WORLD)
        self.assertIn('error: unknown integrator "copy"', strobe("named.scene", code=SCENE))
        strobe("named.scene", "--plugin", self.path("named.so"), "-o", "named.exr")


class Installation(unittest.TestCase):
    def test_pngs_need_the_library_for_images(self):
        """The library for images is found in the moved installation."""
        with open(os.path.join(FOLDER, "p.scene"), "w") as file:
            file.write(OPTIONS + WORLD)
        strobe("p.scene", "--quiet", "-o", "p.png")
        self.assertTrue(os.path.getsize(os.path.join(FOLDER, "p.png")) > 100)

    def test_exported_symbols(self):
        library = os.path.realpath(glob.glob(os.path.join(PREFIX, "lib*", "**", "libstrobe.so"), recursive=True)[0])
        names = [line.split(maxsplit=2)[2] for line in run("nm", "-D", "-C", "--defined-only", library).splitlines()]
        self.assertGreater(len(names), 100)
        foreign = [name for name in names if not any(start in name for start in ("strobe::", "strobe_", "STROBE_0", "LIBSTROBE"))]
        self.assertEqual(foreign, [])


if __name__ == "__main__":
    unittest.main()
