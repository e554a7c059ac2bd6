"""Runs strobe and keeps what came out: a script that was killed goes on where it stopped."""

import dataclasses
import hashlib
import json
import os
import subprocess
import tempfile

from . import images


@dataclasses.dataclass(frozen=True)
class Settings:
    """One call of strobe. `text` replaces what the scene file says; `repeat` tells runs apart that are timed again."""

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
    text: str = ""
    frame_time: str = ""
    samples: bool = False
    repeat: int = 0

    def having(self, **changes):
        return dataclasses.replace(self, **changes)

    def arguments(self):
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
    """A finished run: `stats` as strobe wrote them, the picture and its layers on demand."""

    def __init__(self, stem):
        with open(stem + ".json") as file:
            self.stats = json.load(file)
        self.path = stem + ".exr"
        self.samples = stem + ".csv"  # if the settings asked for them

    @property
    def image(self):
        return images.read(self.path)

    def layer(self, name):
        return images.read(self.path, (name + ".Y",))[:, :, 0]

    @property
    def seconds(self):
        """Wall clock of the rendering alone."""
        return self.stats["seconds"]["render"]

    @property
    def shades_per_pixel(self):
        return self.stats["shadesPerPixel"]


class Failed(Exception):
    """strobe said no; the text is what it said."""


class Runs:
    """Finished runs in a folder, by what was asked of which program."""

    def __init__(self, folder, program, scenes, on_run=lambda settings: None):
        self.folder, self.program, self.scenes, self.on_run = folder, program, scenes, on_run
        os.makedirs(folder, exist_ok=True)
        with open(program, "rb") as file:
            self._program_hash = hashlib.sha256(file.read()).hexdigest()
        self.made = self.reused = 0

    def get(self, settings):
        """The result, from the folder if it is there. Files appear complete or not at all; the JSON comes last."""
        stem = os.path.join(self.folder, self._key(settings))
        if not os.path.exists(stem + ".json"):
            self.on_run(settings)
            self._run(settings, stem)
            self.made += 1
        else:
            self.reused += 1
        return Result(stem)

    def _key(self, settings):
        text = settings.text
        if not text:
            with open(settings.scene) as file:
                text = file.read()
        what = json.dumps([self._program_hash, text, dataclasses.asdict(settings)], sort_keys=True)
        name = os.path.splitext(os.path.basename(settings.scene))[0]
        return "%s-%s-%s" % (name, settings.integrator, hashlib.sha256(what.encode()).hexdigest()[:16])

    def _run(self, settings, stem):
        environment = dict(os.environ, STROBE_SCENES=self.scenes)
        scene, temporary = settings.scene, None
        try:
            if settings.text:  # its file names are absolute or begin with $STROBE_SCENES
                handle, temporary = tempfile.mkstemp(".scene", "text-", self.folder)
                with os.fdopen(handle, "w") as file:
                    file.write(settings.text)
                scene = temporary
            part = stem + ".part"
            command = [self.program, scene, "-o", part + ".exr", "--stats", part + ".json"]
            if settings.samples:
                command += ["--samples", part + ".csv"]
            done = subprocess.run(command + settings.arguments(), env=environment, capture_output=True, text=True)
            if done.returncode != 0:
                raise Failed(done.stderr.strip() or "strobe ended with %d on %s" % (done.returncode, settings.scene))
        finally:
            if temporary:
                os.remove(temporary)
        if settings.samples:
            os.replace(part + ".csv", stem + ".csv")
        os.replace(part + ".exr", stem + ".exr")
        os.replace(part + ".json", stem + ".json")
