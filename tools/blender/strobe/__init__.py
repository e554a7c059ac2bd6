"""strobe as a render engine of Blender. docs/blender.md describes the add-on."""
bl_info = {
    "name": "strobe",
    "author": "the authors of strobe",
    "version": (0, 2, 0),
    "blender": (3, 4, 0),
    "location": "Render properties > Render Engine",
    "description": "Physically based renderer with caches for motion blur and depth of field",
    "category": "Render",
}

from . import engine, panels, preferences, properties

MODULES = (preferences, properties, engine, panels)


def register():
    """Adds the engine, its settings and its panels to Blender."""
    for module in MODULES:
        module.register()


def unregister():
    """Removes what register() added."""
    for module in reversed(MODULES):
        module.unregister()
