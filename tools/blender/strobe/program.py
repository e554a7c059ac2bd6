"""The strobe program: its path, its version and its list of plugins."""
import os
import re
import shutil
import subprocess

OLDEST = (0, 2, 0)  # the first version with all options that the add-on uses
_checked = {}  # {(path, modification time): version}


class ProgramError(Exception):
    """The program is missing, too old or does not run."""


def find(configured=""):
    """Returns the path of the program: the configured one, $STROBE, or that of PATH. Raises ProgramError."""
    if configured:
        if os.path.isfile(configured) and os.access(configured, os.X_OK):
            return configured
        raise ProgramError(f"strobe: '{configured}' is not a program; set its path in the preferences of the add-on")
    found = shutil.which(os.environ.get("STROBE") or "strobe")
    if not found:
        raise ProgramError("strobe: the program is not in PATH; set its path in the preferences of the add-on")
    return found


def check(path):
    """Returns the version of a program as a tuple. Raises ProgramError if it does not run or is older than OLDEST."""
    key = path, os.path.getmtime(path)
    if key not in _checked:
        _checked[key] = _version(path)
    version = _checked[key]
    if version < OLDEST:
        raise ProgramError(f"strobe: '{path}' is version {dotted(version)}; the add-on needs {dotted(OLDEST)} or newer")
    return version


def _version(path):
    """Returns the version that a program prints."""
    found = re.match(r"strobe (\d+)\.(\d+)\.(\d+)", _output(path, "--version"))
    if not found:
        raise ProgramError(f"strobe: '{path}' does not print a version of strobe")
    return tuple(int(number) for number in found.groups())


def dotted(version):
    """Returns a version as text."""
    return ".".join(str(number) for number in version)


def _output(path, *options):
    """Returns the standard output of a program."""
    try:
        return subprocess.run([path, *options], capture_output=True, text=True, timeout=20).stdout
    except (OSError, subprocess.SubprocessError, UnicodeDecodeError) as error:
        raise ProgramError(f"strobe: '{path}' does not run: {error}") from error


def plugins(path):
    """Returns {"Integrator": {plugin: (description, parameters)}, "Shader": ...} from `strobe --list`."""
    return parse_list(_output(path, "--list"))


def parse_list(text):
    """Parses the text of `strobe --list`. A parameter is (type, name, description, default, minimum)."""
    kinds, kind, plugin = {}, None, None
    for line in text.splitlines():
        indent = len(line) - len(line.lstrip())
        if line and indent == 0:
            title = line.partition(":")[0]
            kind = kinds.setdefault("Shader" if title.startswith("SurfaceIntegrator") else title, {})
        elif kind is not None and indent == 2:
            name, _, description = line.strip().partition(" ")
            plugin = kind.setdefault(name, (description.strip(), []))
        elif kind is not None and plugin and indent == 6:
            parameter = _parameter(line.strip())
            if parameter:
                plugin[1].append(parameter)
    return kinds


def _parameter(line):
    """Parses one line of a parameter, such as `integer shades  shades per pixel [1; at least 1]`."""
    found = re.match(r"(\S+)\s+(\S+?)(?:, \S+)*\s{2,}(.*?)(?: \[([^\[\]]*)\])?$", line)
    if not found:
        return None
    kind, name, description, facts = found.groups()
    default, _, bounds = (facts or "").partition(";")
    least = re.match(r"\s*(?:at least )?(-?[\d.]+)(?: to|$)", bounds)
    return kind, name, description, default.strip().strip('"'), float(least.group(1)) if least else None
