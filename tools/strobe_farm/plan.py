"""The plan of a render: what its processes share, in a folder beside the image.

The folder OUTPUT.farm contains

    plan.json           this plan
    scene.json          what `strobe --dry-run --stats` says of the scene, which each slice must have
    parts/F-S.part      the finished slice S of frame F; beside it parts and checkpoints of unfinished attempts
    state/F-S.json      what the last worker of the slice said; F.json: of the merge
    logs/F-S.log        the messages of strobe; F.log: of the merge
    finished/F          the image of the frame is written
    failed              why the render cannot go on

F is the number of the frame, with at least four digits ("still" without --frames), S that of the slice, counted from 1.
Files are replaced atomically, and none is locked, so that network file systems suffice.
"""

import dataclasses
import glob
import json
import os
import re
import shutil

ATTEMPTS = 5  # of a slice in which strobe is killed; failures of machines do not count


class FarmError(Exception):
    """An error for the user."""


def write_atomically(path, text):
    """Replaces a file. Other processes see the old or the new content."""
    temporary = "%s.%d.tmp" % (path, os.getpid())
    with open(temporary, "w", encoding="utf-8") as file:
        file.write(text)
    os.replace(temporary, path)


def read_json(path):
    """Returns the content of a JSON file; None if it is missing or incomplete."""
    try:
        with open(path, encoding="utf-8") as file:
            return json.load(file)
    except (OSError, ValueError):
        return None


def frame_text(frame):
    """Returns the name of a frame in files of the plan."""
    return "still" if frame is None else "%04d" % frame


def numbered(name, frame):
    """Returns the name of a frame's output, as strobe does: see docs/sequences.md."""
    if frame is None:
        return name
    folder, base = os.path.split(name)
    match = re.search(r"(#+)|%(0?)([0-9]?)d", base)
    if not match:
        stem, extension = os.path.splitext(base)
        return os.path.join(folder, "%s.%04d%s" % (stem, frame, extension))
    width = len(match[1]) if match[1] else int(match[3] or 0)
    number = ("%0*d" if match[1] or match[2] else "%*d") % (width, frame)
    return os.path.join(folder, base[:match.start()] + number + base[match.end():])


def folder_of(output):
    """Returns the folder of the plan of an output."""
    folder, base = os.path.split(output)
    return os.path.join(folder, re.sub(r"[._-]?(#+|%0?[0-9]?d)", "", base) + ".farm")


@dataclasses.dataclass
class Plan:
    """A render: its command, its frames and its slices."""

    name: str  # unique; of the jobs
    engine: str
    strobe: list  # the command: program and scenes and options, without outputs, --frames and --slice
    merge: list  # options of `strobe merge`
    outputs: list
    directory: str  # in which strobe runs
    frames: list  # numbers; [None] without --frames
    tasks: int  # slices of a frame
    checkpoint: float  # seconds
    folder: str

    @staticmethod
    def load(folder):
        """Reads the plan in a folder. Throws FarmError if there is none."""
        content = read_json(os.path.join(folder, "plan.json"))
        if content is None:
            raise FarmError("%s: there is no render" % folder)
        return Plan(**content, folder=folder)

    def save(self):
        """Writes the plan, and makes its folders."""
        for name in ("parts", "state", "logs", "finished"):
            os.makedirs(self.path(name), exist_ok=True)
        content = dataclasses.asdict(self)
        del content["folder"]
        write_atomically(self.path("plan.json"), json.dumps(content, indent=1))

    def is_same_render(self, other):
        """Whether the parts of both plans can be merged. The scene is compared by --expect."""
        return all(getattr(self, name) == getattr(other, name) for name in ("strobe", "outputs", "directory", "tasks"))

    def path(self, *names):
        """Returns the path of a file in the folder."""
        return os.path.join(self.folder, *names)

    def unit(self, frame, number=None):
        """Returns the name of a slice, or of a frame, in files."""
        return frame_text(frame) if number is None else "%s-%03d" % (frame_text(frame), number)

    def part(self, frame, number):
        """Returns the path of a finished slice."""
        return self.path("parts", self.unit(frame, number) + ".part")

    def attempts(self, frame, number, ending):
        """Returns the files of attempts at a slice, ".part" or ".part.checkpoint", the newest first."""
        files = glob.glob(glob.escape(self.path("parts", self.unit(frame, number))) + ".*" + ending)
        times = {}
        for file in files:
            try:
                times[file] = os.stat(file).st_mtime_ns
            except FileNotFoundError:  # another worker removed it
                pass
        return sorted(times, key=times.get, reverse=True)

    def done(self, frame):
        """Returns the numbers of the finished slices."""
        return [n for n in range(1, self.tasks + 1) if os.path.exists(self.part(frame, n))]

    def is_whole(self, frame):
        """Whether all slices of a frame are finished."""
        return all(os.path.exists(self.part(frame, n)) for n in range(1, self.tasks + 1))

    def is_finished(self, frame):
        """Whether the image of a frame is written."""
        return os.path.exists(self.path("finished", frame_text(frame)))

    def finished(self):
        """Returns the frames whose images are written."""
        return [frame for frame in self.frames if self.is_finished(frame)]

    def state(self, unit):
        """Returns what the last worker said: a dictionary, empty if there was none."""
        return read_json(self.path("state", unit + ".json")) or {}

    def set_state(self, unit, **values):
        """Says what this worker does. A folder that is gone belonged to a finished render."""
        try:
            write_atomically(self.path("state", unit + ".json"), json.dumps(values))
        except FileNotFoundError:
            pass

    def failure(self):
        """Returns why the render cannot go on; None if it can."""
        try:
            with open(self.path("failed"), encoding="utf-8") as file:
                return file.read()
        except FileNotFoundError:
            return None

    def fail(self, message):
        """Says why the render cannot go on. The first message stays."""
        if self.failure() is None:
            write_atomically(self.path("failed"), message)

    def unfinished_image(self):
        """Returns the file of the unfinished image."""
        stem, extension = os.path.splitext(self.folder[:-len(".farm")])
        return stem + ".unfinished" + (extension or ".exr")

    def keep_warnings(self, frame):
        """Appends the warnings in the logs of a frame, each once, to OUTPUT.farm.log. Makes no file if there are none."""
        lines = {}
        for file in sorted(glob.glob(glob.escape(self.path("logs", frame_text(frame))) + "[-.]*log")):
            with open(file, encoding="utf-8") as log:
                lines.update(dict.fromkeys(line.split(" ", 1)[1] for line in log if " warning: " in line))
        if lines:
            with open(self.folder + ".log", "a", encoding="utf-8") as log:
                log.writelines("%s: %s" % (frame_text(frame), line) for line in lines)

    def remove_frame(self, frame):
        """Removes the slices of a frame, its logs and its states."""
        for folder in ("parts", "state", "logs"):
            for file in glob.glob(glob.escape(self.path(folder, frame_text(frame))) + "[-.]*"):
                remove(file)

    def remove(self):
        """Removes the folder and the unfinished image."""
        shutil.rmtree(self.folder, ignore_errors=True)
        remove(self.unfinished_image())


def remove(path):
    """Removes a file that another process may have removed."""
    try:
        os.remove(path)
    except FileNotFoundError:
        pass
