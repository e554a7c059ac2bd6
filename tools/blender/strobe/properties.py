"""Render settings. Integrators, shaders and their parameters are those of the program (`strobe --list`)."""
import zlib

import bpy

from . import preferences, program

FALLBACK = {"Integrator": {"supersample": ("one shade per visibility sample", [])},
            "Shader": {"path": ("path tracing", [("integer", "maxdepth", "maximum number of vertices", "5", 0.0)])}}
DEFAULTS = {"transparentdepth": "16"}  # cut-out leaves need it
_groups = []  # registered classes of parameters
listing = FALLBACK


def identifier(kind, plugin, name):
    """Returns the identifier of a parameter."""
    return f"{kind}_{plugin}_{name}".lower().replace("-", "_")


def _property(parameter):
    """Returns a property of Blender for a parameter of a plugin, or None if its type has none."""
    kind, name, description, default, least = parameter
    default = DEFAULTS.get(name, default)
    options = {"name": name, "description": description}
    if kind == "integer":
        return bpy.props.IntProperty(default=int(default or 0), min=int(least or 0), **options)
    if kind == "float":
        return bpy.props.FloatProperty(default=float(default or 0), min=least or 0, precision=3, **options)
    if kind == "bool":
        return bpy.props.BoolProperty(default=default == "true", **options)
    return bpy.props.StringProperty(default=default, **options) if kind == "string" else None


def _items(kind):
    """Returns the items of a menu of plugins, whose numbers depend on their names alone."""
    return [(name, name, about, zlib.crc32(name.encode()) & 0xffffff) for name, (about, _) in listing[kind].items()]


def _make_group():
    """Returns a class with one property per parameter of each integrator and shader."""
    fields = {}
    for kind in ("Integrator", "Shader"):
        for plugin, (_, parameters) in listing[kind].items():
            for parameter in parameters:
                made = _property(parameter)
                if made:
                    fields[identifier(kind, plugin, parameter[1])] = made
    fields["integrator"] = bpy.props.EnumProperty(
        name="Integrator", items=_items("Integrator"), description="Mapping of visibility samples to shades",
        default="supersample" if "supersample" in listing["Integrator"] else None)
    fields["shader"] = bpy.props.EnumProperty(name="Shader", items=_items("Shader"), description="Estimate of radiance",
                                              default="path" if "path" in listing["Shader"] else None)
    return type("StrobeSettings", (bpy.types.PropertyGroup,), {"__annotations__": {**fields, **FIXED}})


FIXED = {
    "samples": bpy.props.IntProperty(name="Samples", default=64, min=1, max=1 << 20, description="Visibility samples per pixel"),
    "time_limit": bpy.props.FloatProperty(name="Time limit", default=0, min=0, unit="TIME_ABSOLUTE",
                                          description="Seconds of the program per frame; 0: no limit"),
    "noise_target": bpy.props.FloatProperty(name="Noise target", default=0, min=0, max=1, precision=3,
                                            description="Render passes of the samples until the noise of 95 % of the pixels "
                                            "is at most this; 0: one pass"),
    "seed": bpy.props.IntProperty(name="Seed", default=0, min=0, description="Seed of the random numbers"),
    "threads": bpy.props.IntProperty(name="Threads", default=0, min=0, description="0: one per core"),
    "clamp": bpy.props.FloatProperty(name="Clamp", default=0, min=0,
                                     description="Scale down samples with a channel above this value; 0: unbiased"),
    "filter": bpy.props.EnumProperty(name="Filter", default="gaussian", items=[
        ("gaussian", "Gaussian", "Close to the Blackman-Harris filter of Cycles"), ("box", "Box", "Box"),
        ("triangle", "Triangle", "Tent"), ("mitchell", "Mitchell", "Mitchell-Netravali")]),
    "motion_levels": bpy.props.IntProperty(
        name="Motion keys", default=4, min=0, max=7,
        description="The exporter halves the intervals between motion keys up to this many times where motion needs it"),
    "use_albedo": bpy.props.BoolProperty(name="Albedo", description="Directional albedo"),
    "use_light": bpy.props.BoolProperty(name="Direct and indirect", description="Direct and indirect light"),
    "use_statistics": bpy.props.BoolProperty(name="Sharing", description="Shades per pixel and hit rate of the caches"),
    "use_light_groups": bpy.props.BoolProperty(name="Light groups", default=True,
                                               description="One pass per light group of the view layer"),
}


def parameters(settings):
    """Returns [(label, identifier, name)] of the parameters of the selected integrator and shader."""
    found = []
    for kind, plugin in (("Integrator", settings.integrator), ("Shader", settings.shader)):
        for parameter in listing[kind].get(plugin, ("", []))[1]:
            name = identifier(kind, plugin, parameter[1])
            if hasattr(settings, name):
                found.append((kind, name, parameter[1]))
    return found


def reload():
    """Registers the settings again, with the plugins of the current program."""
    unregister()
    register()


def register():
    """Adds scene.strobe. Without a program, it has the integrators of FALLBACK."""
    global listing
    listing = FALLBACK
    try:
        found = program.plugins(preferences.program_path())
        if found.get("Integrator") and found.get("Shader"):
            listing = found
    except program.ProgramError as error:
        print(error)
    group = _make_group()
    bpy.utils.register_class(group)
    _groups.append(group)
    bpy.types.Scene.strobe = bpy.props.PointerProperty(type=group)


def unregister():
    """Removes scene.strobe. Its values stay in the file."""
    del bpy.types.Scene.strobe
    bpy.utils.unregister_class(_groups.pop())
