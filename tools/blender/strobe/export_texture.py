"""Values of shader sockets: constants, or textures of strobe."""
import numpy as np

from . import export_image, scene_text

ORIGINS = ("UVMAP", "TEX_COORD")


def linked(socket):
    """Returns the output that feeds a socket, or None. Reroutes are skipped."""
    while socket.is_linked:
        source = socket.links[0].from_socket
        if source.node.type != "REROUTE":
            return source
        socket = source.node.inputs[0]
    return None


def rgb(value):
    """Returns a color of three numbers from the value of a socket."""
    return [float(c) for c in value][:3] if hasattr(value, "__len__") else [float(value)] * 3


class Textures:
    """Declares the textures of a material. A value is a list of three numbers, or the name of a texture."""

    def __init__(self, folder, messages):
        """`folder` receives images."""
        self.folder, self.messages, self.lines, self.owner = folder, messages, [], ""
        self._count, self._known = 0, {}

    def say(self, text):
        """Reports a replacement in the current material."""
        self.messages.add(self.owner, text)

    def value(self, socket):
        """Returns the value of a color or number socket."""
        source = linked(socket)
        if source is None:
            return rgb(socket.default_value)
        key = source.node.as_pointer(), source.identifier
        if key not in self._known:
            self._known[key] = self._converted(source)
        return self._known[key]

    def _converted(self, source):
        """Returns the value of the output of a node."""
        convert = getattr(self, "_" + source.node.type.lower(), None)
        if convert:
            return convert(source.node, source)
        return self._replaced(source.node, source)

    def _replaced(self, node, source):
        """Returns the first color or number that feeds an unsupported node, or else its default."""
        self.say(f"node '{node.name}' ({node.bl_label}) is not supported and is replaced by its input or mean")
        for socket in node.inputs:
            if socket.type in ("RGBA", "VALUE") and socket.is_linked and socket.name != "Fac":
                return self.value(socket)
        return [0.5] * 3

    def declare(self, plugin, parameters):
        """Declares a texture. Returns its name."""
        self._count += 1
        name = f"{self.owner}.{self._count}"
        self.lines.append(scene_text.directive(f"Texture {scene_text.quoted(name)} {scene_text.quoted('rgb')}", plugin, parameters))
        return name

    def parameter(self, name, value, kind="rgb"):
        """Returns a parameter of a material or texture."""
        if isinstance(value, str):
            return "texture", name, value
        return ("float", name, sum(value) / 3) if kind == "float" else ("rgb", name, value)

    def product(self, a, b):
        """Returns the product of two values."""
        if isinstance(a, str) or isinstance(b, str):
            return self.declare("scale", [self.parameter("tex1", a), self.parameter("tex2", b)])
        return [x * y for x, y in zip(a, b)]

    def mixed(self, a, b, amount):
        """Returns the value between a and b."""
        if isinstance(amount, list) and all(isinstance(v, list) for v in (a, b)):
            f = sum(amount) / 3
            return [x * (1 - f) + y * f for x, y in zip(a, b)]
        return self.declare("mix", [self.parameter("tex1", a), self.parameter("tex2", b),
                                    self.parameter("amount", amount, "float")])

    def inverted(self, value):
        """Returns 1 - value."""
        if isinstance(value, list):
            return [1 - v for v in value]
        return self.mixed([1.0] * 3, [0.0] * 3, value)

    def _rgb(self, node, source):
        """A color."""
        return rgb(source.default_value)

    _value = _rgb

    def _mapping_of(self, socket):
        """Returns the parameters of the texture coordinates that feed a vector socket."""
        source = linked(socket)
        if source is None:
            return []
        if source.node.type == "MAPPING":
            return self._mapping(source.node)
        if source.node.type == "UVMAP" or (source.node.type == "TEX_COORD" and source.name == "UV"):
            return []
        self.say(f"texture coordinates '{source.name}' of node '{source.node.name}' are replaced by UV")
        return []

    def _mapping(self, node):
        """Returns the parameters of a mapping without rotation."""
        self._mapping_of(node.inputs["Vector"])
        if node.vector_type not in ("POINT", "TEXTURE") or any(s.is_linked for s in list(node.inputs)[1:]):
            self.say(f"mapping '{node.name}' is ignored")
            return []
        if any(abs(a) > 1e-6 for a in node.inputs["Rotation"].default_value):
            self.say(f"the rotation of mapping '{node.name}' is ignored")
        place, scale = (np.array(node.inputs[n].default_value) if n in node.inputs else np.zeros(3) for n in ("Location", "Scale"))
        if node.vector_type == "TEXTURE":
            scale = 1 / np.where(scale == 0, 1, scale)
            place = -place * scale
        return [("float", "uscale", scale[0]), ("float", "vscale", scale[1]), ("float", "udelta", place[0]),
                ("float", "vdelta", place[1])]

    def _tex_image(self, node, source):
        """An image file."""
        return self.image(node, "Alpha" if source.name == "Alpha" else None)

    def image(self, node, channel=None):
        """Returns the texture of an image node."""
        if not node.image:
            return [1.0, 0.0, 1.0] if channel is None else [1.0] * 3
        found = export_image.image_file(node.image, self.folder, channel)
        if not found:
            self.say(f"image '{node.image.name}' has no pixels")
            return [1.0, 0.0, 1.0]
        if node.projection != "FLAT":
            self.say(f"projection of image '{node.image.name}' is flat")
        wrap = {"REPEAT": "repeat", "EXTEND": "clamp", "CLIP": "black"}.get(node.extension, "repeat")
        parameters = [("string", "filename", found[0]), ("string", "encoding", found[1]), ("string", "wrap", wrap)]
        if node.interpolation == "Closest":
            parameters.append(("string", "filter", "point"))
        return self.declare("imagemap", parameters + self._mapping_of(node.inputs["Vector"]))

    def _tex_checker(self, node, source):
        """A checkerboard over UV. Cycles' second color is where the sum of the squares is even."""
        scale = node.inputs["Scale"].default_value
        mapping = dict((p[1], p[2]) for p in self._mapping_of(node.inputs["Vector"]))
        if not node.inputs["Vector"].is_linked:
            self.say(f"generated texture coordinates of node '{node.name}' are replaced by UV")
        sides = [self.value(node.inputs[n]) for n in ("Color2", "Color1")]
        if source.name == "Fac":
            sides = [[0.0] * 3, [1.0] * 3]
        return self.declare("checkerboard", [("string", "aamode", "none"),
            self.parameter("tex1", sides[0]), self.parameter("tex2", sides[1]),
            *(("float", n, mapping.get(n, d) * scale) for n, d in (("uscale", 1), ("vscale", 1), ("udelta", 0), ("vdelta", 0)))])

    def _mix_rgb(self, node, source):
        """A mix or a product of colors."""
        return self._blend(node, node.blend_type, *(node.inputs[i] for i in (0, 1, 2)))

    def _mix(self, node, source):
        """The mix node of Blender 3.4 and newer."""
        sockets = [s for s in node.inputs if s.enabled]
        return self._blend(node, node.blend_type if node.data_type == "RGBA" else "MIX", *sockets[:3])

    def _blend(self, node, kind, factor, first, second):
        """Returns the blend of two sockets."""
        a, b, amount = self.value(first), self.value(second), self.value(factor)
        if kind == "MULTIPLY":
            b = self.product(a, b)
        elif kind != "MIX":
            self.say(f"blend type {kind} of node '{node.name}' is replaced by mix")
        return self.mixed(a, b, amount)

    def _math(self, node, source):
        """A product, or a threshold of constants."""
        a, b = self.value(node.inputs[0]), self.value(node.inputs[1])
        if node.operation == "MULTIPLY":
            return self.product(a, b)
        if node.operation == "SUBTRACT" and a == [1.0] * 3:
            return self.inverted(b)
        if isinstance(a, list) and isinstance(b, list) and node.operation in ("ADD", "SUBTRACT"):
            sign = 1 if node.operation == "ADD" else -1
            return [x + sign * y for x, y in zip(a, b)]
        self.say(f"operation {node.operation} of node '{node.name}' is replaced by its first input")
        return a

    def _invert(self, node, source):
        """One minus a color."""
        color = self.value(node.inputs["Color"])
        if isinstance(color, str):
            self.say(f"node '{node.name}' inverts the mean of the channels")
        return self.mixed(color, self.inverted(color), self.value(node.inputs["Fac"]))

    def _separate_color(self, node, source):
        """A channel of an image, or of a constant."""
        fed = linked(node.inputs[0])
        if fed and fed.node.type == "TEX_IMAGE":
            return self.image(fed.node, {"R": "Red", "G": "Green", "B": "Blue"}.get(source.name, source.name))
        color = self.value(node.inputs[0])
        if isinstance(color, str):
            self.say(f"node '{node.name}' is replaced by the mean of the channels")
            return color
        return [color[{"R": 0, "G": 1, "B": 2}[source.name[0]]]] * 3

    _seprgb = _separate_color
