"""Folders of exported files."""
import atexit
import os
import re
import shutil
import tempfile

import bpy

from . import preferences

_temporary = []  # the temporary folder of the session


def chosen():
    """Returns the folder of the preferences, or None for a temporary one."""
    settings = preferences.get()
    return bpy.path.abspath(settings.folder) if settings and settings.folder else None


def of_session():
    """Returns the folder of exported files, which keeps meshes and images during the session. Raises OSError."""
    folder = chosen()
    if folder:
        try:
            os.makedirs(folder, exist_ok=True)
            with tempfile.TemporaryFile(dir=folder):
                return folder
        except OSError as error:
            raise OSError(f"the export folder '{folder}' cannot be written: {error.strerror}") from error
    if not _temporary:
        _remove_stale()
        _temporary.append(tempfile.mkdtemp(prefix=f"strobe-blender-{os.getpid()}-"))
        atexit.register(shutil.rmtree, _temporary[0], True)
    return _temporary[0]


def remove(names):
    """Removes files of a frame from the temporary folder. The folder of the preferences keeps them."""
    for name in names if not chosen() and _temporary else ():
        try:
            os.remove(os.path.join(_temporary[0], name))
        except OSError:
            pass


def _is_running(pid):
    """Returns whether a process exists."""
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return False
    except OSError:
        pass
    return True


def _remove_stale():
    """Removes the folders of sessions that were killed."""
    for name in os.listdir(tempfile.gettempdir()):
        found = re.fullmatch(r"strobe-blender-(\d+)-\w+", name)
        if found and not _is_running(int(found.group(1))):
            shutil.rmtree(os.path.join(tempfile.gettempdir(), name), ignore_errors=True)
