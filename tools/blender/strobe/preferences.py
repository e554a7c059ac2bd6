"""Preferences of the add-on."""
import bpy

from . import program


def _changed(_self, _context):
    """Reads the integrators of the program at the new path."""
    from . import properties
    properties.reload()


class StrobePreferences(bpy.types.AddonPreferences):
    """The path of the program, and the folder of exported files."""
    bl_idname = __package__

    program: bpy.props.StringProperty(name="Program", subtype="FILE_PATH", update=_changed,
                                      description="Path of strobe; empty: $STROBE, or strobe in PATH")
    folder: bpy.props.StringProperty(name="Export folder", subtype="DIR_PATH",
                                     description="Folder of exported scenes, which are kept; empty: a temporary folder")

    def draw(self, _context):
        """Shows the settings and the program that they select."""
        self.layout.prop(self, "program")
        self.layout.prop(self, "folder")
        try:
            path = program.find(bpy.path.abspath(self.program))
            self.layout.label(text=f"{path}: version {program.dotted(program.check(path))}", icon="CHECKMARK")
        except program.ProgramError as error:
            self.layout.label(text=str(error), icon="ERROR")


def get():
    """Returns the preferences, or None if the add-on is not enabled by Blender's preferences."""
    addon = bpy.context.preferences.addons.get(__package__)
    return addon.preferences if addon else None


def program_path():
    """Returns the path of a program whose version is checked. Raises ProgramError."""
    preferences = get()
    path = program.find(bpy.path.abspath(preferences.program) if preferences and preferences.program else "")
    program.check(path)
    return path


def register():
    """Adds the preferences."""
    bpy.utils.register_class(StrobePreferences)


def unregister():
    """Removes the preferences."""
    bpy.utils.unregister_class(StrobePreferences)
