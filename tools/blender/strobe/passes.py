"""Passes: the layers of strobe's EXR in the passes of Blender."""
import numpy as np

from . import export_light

CRYPTO = (("use_pass_cryptomatte_object", "cryptoobject", "CryptoObject"),
          ("use_pass_cryptomatte_material", "cryptomaterial", "CryptoMaterial"))


class Pass:
    """A pass of Blender: its name, channels, type of socket, layer of strobe, and function from the channels of an EXR to an
    array with one row per pixel."""

    def __init__(self, name, channels, kind, layer, convert, builtin=True):
        """`builtin`: Blender creates the pass itself."""
        self.name, self.channels, self.kind, self.layer, self.convert = name, channels, kind, layer, convert
        self.builtin = builtin


def _stack(image, names):
    """Returns the named channels as an array (pixels, channels)."""
    return np.stack([image[name].ravel() for name in names], 1)


def _layer(prefix, channels):
    """Returns a function that reads the channels of a layer."""
    return lambda image: _stack(image, [f"{prefix}.{c}" for c in channels])


def combined(image):
    """Returns RGBA. Without a channel A, the image is opaque."""
    rgb = _stack(image, "RGB")
    alpha = image["A"].reshape(-1, 1) if "A" in image else np.ones((len(rgb), 1), np.float32)
    return np.concatenate([rgb, alpha], 1)


def _vector(shutter):
    """Returns a function that scales motion over the shutter to a frame: previous minus current, current minus next."""
    def convert(image):
        """Returns X, Y, Z, W."""
        motion = _stack(image, ("motionvector.X", "motionvector.Y")) / max(shutter, 1e-6)
        return np.concatenate([-motion, -motion], 1)
    return convert


def wanted(scene, layer):
    """Returns the passes that a view layer asks for, apart from Combined."""
    settings, found = scene.strobe, []

    def add(condition, *facts, **options):
        """Adds a pass if a setting asks for it."""
        if condition:
            found.append(Pass(*facts, **options))

    shutter = scene.render.motion_blur_shutter
    add(layer.use_pass_z, "Depth", "Z", "VALUE", "depth", _layer("depth", "Z"))
    add(layer.use_pass_position, "Position", "XYZ", "VECTOR", "position", _layer("position", "XYZ"))
    add(layer.use_pass_normal, "Normal", "XYZ", "VECTOR", "normal", _layer("normal", "XYZ"))
    add(layer.use_pass_vector, "Vector", "XYZW", "VECTOR", "motionvector", _vector(shutter))
    add(settings.use_albedo, "Albedo", "RGB", "COLOR", "albedo", _layer("albedo", "RGB"), builtin=False)
    for name in ("direct", "indirect"):
        add(settings.use_light, name.title(), "RGB", "COLOR", name, _layer(name, "RGB"), builtin=False)
    for name, title in (("shades", "Shades"), ("hitrate", "HitRate")):
        add(settings.use_statistics, title, "X", "VALUE", name, _layer(name, "Y"), builtin=False)
    for option, name, prefix in CRYPTO:
        for i in range((layer.pass_cryptomatte_depth + 1) // 2):
            add(getattr(layer, option), f"{prefix}{i:02d}", "RGBA", "COLOR", name, _layer(f"{prefix}{i:02d}", "RGBA"),
                builtin=False)
    for group in getattr(layer, "lightgroups", ()) if settings.use_light_groups else ():
        add(True, "Combined_" + group.name, "RGB", "COLOR", "lightgroups", _group(group.name), builtin=False)
    return found


def _group(name):
    """Returns a function that reads a light group, which is black if no light has it."""
    prefix = "light_" + export_light.group_name(name)

    def convert(image):
        """Returns RGB."""
        if prefix + ".R" not in image:
            return np.zeros((image["R"].size, 3), np.float32)
        return _stack(image, [f"{prefix}.{c}" for c in "RGB"])
    return convert


def layers(passes):
    """Returns the value of --aov."""
    return ",".join(dict.fromkeys(p.layer for p in passes))


def cryptomatte_attributes(attributes):
    """Returns {name: text} of the attributes that Cryptomatte readers need."""
    return {name: value[4:].decode() if value[:4] == len(value[4:]).to_bytes(4, "little") else value.decode()
            for name, value in attributes.items() if name.startswith("cryptomatte/")}
