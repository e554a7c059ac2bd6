"""Runs strobe and keeps the results, so that an interrupted script continues where it stopped."""

import dataclasses
import hashlib
import json
import os
import re
import resource
import subprocess
import tempfile

from . import images

FORMAT = 2  # of the stored results; results of another format are rendered again


@dataclasses.dataclass(frozen=True)
class Settings:
    """The options of one render."""

    scene: str
    integrator: str = "supersample"
    spp: int = 16
    seed: int = 0
    defines: tuple = ()
    shading: str = ""
    resolution: tuple = ()
    threads: int = 0
    tile: int = 32
    layers: tuple = ()
    crop: tuple = ()
    text: str = ""  # replaces the content of the scene file; its file names are absolute or begin with $STROBE_SCENES
    frame_time: str = ""
    samples: bool = False  # also write the table of visibility samples
    repeat: int = 0  # distinguishes repeated renders that are timed

    def with_changes(self, **changes):
        """Returns a copy with some members replaced."""
        return dataclasses.replace(self, **changes)

    def arguments(self):
        """Returns the command line arguments of strobe, without the scene and the outputs."""
        words = ["--integrator", self.integrator, "--spp", str(self.spp), "--seed", str(self.seed),
                 "--threads", str(self.threads), "--tile", str(self.tile), "--quiet"]
        for define in self.defines:
            words += ["-D", define]
        if self.shading:
            words += ["--shading", self.shading]
        if self.resolution:
            words += ["--resolution", "%dx%d" % self.resolution]
        if self.layers:
            words += ["--aov", ",".join(self.layers)]
        if self.frame_time:
            words += ["--frame-time", self.frame_time]
        if self.crop:
            words += ["--crop"] + [str(x) for x in self.crop]
        return words


class Result:
    """The files of a finished render: `stats` is the content of --stats; image and layers are read on demand."""

    def __init__(self, stem):
        with open(stem + ".json") as file:
            self.stats = json.load(file)
        self.path = stem + ".exr"
        self.samples = stem + ".csv"  # exists if the settings have samples=True

    @property
    def image(self):
        """The linear RGB pixels."""
        return images.read(self.path)

    def layer(self, name):
        """Returns a layer of one channel as an array [height, width]."""
        return images.read(self.path, (name + ".Y",))[:, :, 0]

    @property
    def seconds(self):
        """Wall-clock seconds of rendering, without parsing and building."""
        return self.stats["seconds"]["render"]

    @property
    def cpu_seconds(self):
        """CPU seconds of the whole process over all threads, with parsing, building and writing."""
        return self.stats["processCpuSeconds"]

    @property
    def shades_per_pixel(self):
        """The mean number of shades of a pixel."""
        return self.stats["shadesPerPixel"]


class Failed(Exception):
    """A render that failed, with strobe's error message, or an input of a figure that does not exist."""


def hash_of_program(program):
    """Returns the hash of a program and of the libraries of strobe that it loads, which have most of its code."""
    libraries = subprocess.run(["ldd", program], capture_output=True, text=True).stdout
    files = [program] + sorted(re.findall(r"^\s*libstrobe\S* => (/.+) \(0x", libraries, re.MULTILINE))
    content = hashlib.sha256()
    for name in files:
        with open(name, "rb") as file:
            content.update(hashlib.sha256(file.read()).digest())
    return content.hexdigest()


class Runs:
    """Finished renders in a folder, keyed by settings, scene text and program."""

    def __init__(self, folder, program, scenes, on_run=lambda settings: None):
        self.folder = folder
        self.program = program
        self.scenes = scenes
        self.on_run = on_run
        os.makedirs(folder, exist_ok=True)
        self._program_hash = hash_of_program(program)
        self.rendered = 0
        self.reused = 0

    def get(self, settings):
        """Returns the result of a render, from the folder if it exists there. Files are written under temporary names and
        renamed, the JSON last, so an interrupted render leaves no result. Raises Failed."""
        stem = os.path.join(self.folder, self._key(settings))
        if not os.path.exists(stem + ".json"):
            self.on_run(settings)
            self._run(settings, stem)
            self.rendered += 1
        else:
            self.reused += 1
        return Result(stem)

    def _key(self, settings):
        text = settings.text
        if not text:
            with open(settings.scene) as file:
                text = file.read()
        content = json.dumps([FORMAT, self._program_hash, text, dataclasses.asdict(settings)], sort_keys=True)
        name = os.path.splitext(os.path.basename(settings.scene))[0]
        return "%s-%s-%s" % (name, settings.integrator, hashlib.sha256(content.encode()).hexdigest()[:16])

    def _run(self, settings, stem):
        environment = dict(os.environ, STROBE_SCENES=self.scenes)
        scene = settings.scene
        temporary = None
        try:
            if settings.text:
                handle, temporary = tempfile.mkstemp(".scene", "text-", self.folder)
                with os.fdopen(handle, "w") as file:
                    file.write(settings.text)
                scene = temporary
            part = stem + ".part"
            command = [self.program, scene, "-o", part + ".exr", "--stats", part + ".json"]
            if settings.samples:
                command += ["--samples", part + ".csv"]
            before = _children_seconds()
            done = subprocess.run(command + settings.arguments(), env=environment, capture_output=True, text=True)
            seconds = _children_seconds() - before
            if done.returncode != 0:
                raise Failed(done.stderr.strip() or "%s: strobe exited with code %d" % (settings.scene, done.returncode))
        finally:
            if temporary:
                os.remove(temporary)
        if settings.samples:
            os.replace(part + ".csv", stem + ".csv")
        os.replace(part + ".exr", stem + ".exr")
        _add_cpu_seconds(part + ".json", seconds)
        os.replace(part + ".json", stem + ".json")


def _children_seconds():
    """Returns the CPU seconds of all finished child processes."""
    usage = resource.getrusage(resource.RUSAGE_CHILDREN)
    return usage.ru_utime + usage.ru_stime


def _add_cpu_seconds(path, seconds):
    """Adds the CPU seconds of the process to the statistics in a JSON file."""
    with open(path) as file:
        stats = json.load(file)
    stats["processCpuSeconds"] = seconds
    with open(path, "w") as file:
        json.dump(stats, file)
