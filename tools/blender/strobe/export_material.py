"""Materials: trees of shader nodes become materials of strobe, emission, and opacity."""
import math

from . import scene_text
from .export_texture import Textures, linked

BLACK, WHITE = [0.0] * 3, [1.0] * 3
IGNORED = {"Subsurface": 0, "Sheen": 0, "Sheen Weight": 0, "Subsurface Weight": 0, "Anisotropic": 0, "Coat Weight": 0}


class Surface:
    """What a shader becomes. `plugin` is None if nothing is reflected. `emission` and `opacity` are values of Textures."""

    def __init__(self, plugin=None, parameters=(), emission=None, opacity=None):
        """`opacity` None: opaque."""
        self.plugin, self.parameters, self.emission, self.opacity = plugin, list(parameters), emission, opacity


class Materials:
    """Declares the materials of a scene, each once."""

    def __init__(self, folder, messages):
        """`folder` receives images."""
        self.messages, self.textures, self.lines = messages, Textures(folder, messages), []
        self._known, self._mixes = {}, 0

    def surface(self, material):
        """Returns (lines that select the material, Surface). None: Blender's default material."""
        name = material.name if material else "default"
        if name not in self._known:
            self.textures.owner = name
            self.textures.lines = self.lines
            found = self._tree(material)
            self.declare(name, found)
            self._known[name] = found
        return scene_text.directive("NamedMaterial", name), self._known[name]

    def declare(self, name, surface):
        """Writes MakeNamedMaterial."""
        plugin = surface.plugin or "matte"
        parameters = surface.parameters if surface.plugin else [("rgb", "Kd", BLACK)]
        self.lines.append(scene_text.directive("MakeNamedMaterial", name, [("string", "type", plugin)] + parameters))

    def _tree(self, material):
        """Converts the nodes of a material."""
        if material is None:
            return Surface("matte", [("rgb", "Kd", [0.8] * 3)])
        if not material.use_nodes or not material.node_tree:
            return Surface("matte", [("rgb", "Kd", list(material.diffuse_color)[:3])])
        output = material.node_tree.get_output_node("CYCLES")
        if output is None:
            return Surface()
        for name in ("Volume", "Displacement"):
            if output.inputs[name].is_linked:
                self.textures.say(f"{name.lower()} of the material is ignored")
        source = linked(output.inputs["Surface"])
        return self._shader(source.node) if source else Surface()

    def _shader(self, node):
        """Converts a shader node."""
        convert = getattr(self, "_" + node.type.lower(), None)
        if convert:
            return convert(node)
        self.textures.say(f"shader '{node.name}' ({node.bl_label}) is replaced by diffuse")
        color = node.inputs.get("Color")
        return Surface("matte", [self._color("Kd", color) if color else ("rgb", "Kd", [0.5] * 3)])

    def _input(self, socket):
        """Converts the shader that feeds a socket."""
        source = linked(socket)
        return self._shader(source.node) if source else Surface()

    def _color(self, name, socket):
        """Returns a color parameter."""
        return self.textures.parameter(name, self.textures.value(socket))

    def _number(self, name, socket):
        """Returns a float parameter."""
        return self.textures.parameter(name, self.textures.value(socket), "float")

    def _normal(self, node):
        """Returns the parameters of normal and bump maps."""
        source = linked(node.inputs["Normal"]) if "Normal" in node.inputs else None
        if source is None:
            return []
        if source.node.type == "NORMAL_MAP":
            return self._normal_map(source.node)
        if source.node.type == "BUMP":
            return self._bump(source.node)
        self.textures.say(f"node '{source.node.name}' is not supported as normal and is ignored")
        return []

    def _normal_map(self, node):
        """A map of normals in tangent space. A strength other than 1 mixes it with the unperturbed normal."""
        if node.space != "TANGENT":
            self.textures.say(f"normal map '{node.name}' is not in tangent space and is ignored")
            return []
        value, strength = self.textures.value(node.inputs["Color"]), self.textures.value(node.inputs["Strength"])
        if strength != WHITE:
            value = self.textures.mixed([0.5, 0.5, 1.0], value, strength)
        return [self.textures.parameter("normalmap", value)]

    def _bump(self, node):
        """A map of heights."""
        if node.inputs["Normal"].is_linked:
            self.textures.say(f"the normal input of bump '{node.name}' is ignored")
        height = self.textures.value(node.inputs["Height"])
        if isinstance(height, list):
            return []
        sign = -1.0 if node.invert else 1.0
        size = [sign * node.inputs["Strength"].default_value * node.inputs["Distance"].default_value] * 3
        return [("texture", "bumpmap", self.textures.product(height, size))]

    def _bsdf_diffuse(self, node):
        """Lambertian, or Oren-Nayar."""
        roughness = self.textures.value(node.inputs["Roughness"])
        parameters = [self._color("Kd", node.inputs["Color"])]
        if roughness != BLACK:
            self.textures.say("Cycles' Oren-Nayar is replaced by pbrt's")
            sigma = roughness if isinstance(roughness, str) else [math.degrees(r) for r in roughness]
            parameters.append(self.textures.parameter("sigma", sigma, "float"))
        return Surface("matte", parameters + self._normal(node))

    def _bsdf_glossy(self, node):
        """GGX without Fresnel: a metal, whose reflectance rises to white at grazing angles; or a mirror."""
        roughness = self.textures.value(node.inputs["Roughness"])
        if roughness == BLACK or getattr(node, "distribution", "") == "SHARP":
            return Surface("mirror", [self._color("Kr", node.inputs["Color"])] + self._normal(node))
        return Surface("metallicroughness", [
            self._color("basecolor", node.inputs["Color"]), ("float", "metallic", 1.0),
            self.textures.parameter("roughness", roughness, "float")] + self._normal(node))

    _bsdf_anisotropic = _bsdf_glossy

    def _glass(self, color, roughness, ior, normal, reflection=None):
        """Returns a dielectric. The roughness is the square root of alpha."""
        parameters = [self.textures.parameter("Kr", color if reflection is None else reflection),
                      self.textures.parameter("Kt", color), ior, ("bool", "remaproughness", False),
                      self.textures.parameter("roughness", self.textures.product(roughness, roughness), "float")]
        return Surface("glass", parameters + normal)

    def _bsdf_glass(self, node):
        """A dielectric, smooth or rough."""
        roughness = BLACK if getattr(node, "distribution", "") == "SHARP" else self.textures.value(node.inputs["Roughness"])
        return self._glass(self.textures.value(node.inputs["Color"]), roughness, self._number("eta", node.inputs["IOR"]),
                           self._normal(node))

    def _bsdf_refraction(self, node):
        """A dielectric without reflection."""
        self.textures.say("refraction loses the fraction of light that Fresnel reflects")
        surface = self._bsdf_glass(node)
        surface.parameters[0] = ("rgb", "Kr", BLACK)
        return surface

    def _bsdf_translucent(self, node):
        """Diffuse transmission."""
        return Surface("diffusetransmission", [("rgb", "reflectance", BLACK),
                                               self._color("transmittance", node.inputs["Color"])] + self._normal(node))

    def _bsdf_transparent(self, node):
        """A surface that rays pass."""
        if self.textures.value(node.inputs["Color"]) != WHITE:
            self.textures.say("the color of transparency is replaced by white")
        return Surface(opacity=BLACK)

    def _emission(self, node):
        """Light of both sides."""
        return Surface(emission=self.textures.product(self.textures.value(node.inputs["Color"]),
                                                      self.textures.value(node.inputs["Strength"])))

    def _holdout(self, node):
        """A black surface."""
        self.textures.say("holdout is replaced by black")
        return Surface()

    def _add_shader(self, node):
        """A shader with emission. The sum of two reflecting shaders is replaced by their mix."""
        first, second = (self._input(node.inputs[i]) for i in (0, 1))
        if first.plugin and second.plugin:
            self.textures.say("the sum of two shaders is replaced by their mean")
            return self._mixture(first, second, [0.5] * 3)
        main = first if first.plugin else second
        emissions = [s.emission for s in (first, second) if s.emission is not None]
        if len(emissions) == 2 and not any(isinstance(e, str) for e in emissions):
            emissions = [[a + b for a, b in zip(*emissions)]]
        opacity = None if None in (first.opacity, second.opacity) else first.opacity
        return Surface(main.plugin, main.parameters, emissions[0] if emissions else None, opacity)

    def _mix_shader(self, node):
        """Opacity, if one of the shaders is transparent; else a mix."""
        factor = self.textures.value(node.inputs[0])
        return self._mixture(self._input(node.inputs[1]), self._input(node.inputs[2]), factor)

    def _mixture(self, first, second, factor):
        """Returns the mix of two surfaces; `factor` is the weight of the second."""
        for clear, other, weight in ((first, second, factor), (second, first, self.textures.inverted(factor))):
            if clear.opacity == BLACK and clear.plugin is None:
                opacity = weight if other.opacity is None else self.textures.product(weight, other.opacity)
                return Surface(other.plugin, other.parameters, other.emission, opacity)
        names = []
        for surface in (first, second):
            self._mixes += 1
            names.append(f"{self.textures.owner}.mix{self._mixes}")
            self.declare(names[-1], surface)
        emission = self._mixed_emission(first, second, factor)
        if first.plugin is None and second.plugin is None:
            return Surface(emission=emission)
        if first.opacity is not None or second.opacity is not None:
            self.textures.say("partial transparency in a mix of shaders is ignored")
        return Surface("mix", [("string", "materials", names), self.textures.parameter("amount", factor, "float")], emission)

    def _mixed_emission(self, first, second, factor):
        """Returns the emission of a mix."""
        if first.emission is None and second.emission is None:
            return None
        return self.textures.mixed(first.emission or BLACK, second.emission or BLACK, factor)

    def _bsdf_principled(self, node):
        """glTF's metallic-roughness model, or a dielectric."""
        def socket(*names):
            """Returns the input that has one of the names."""
            return next((node.inputs[n] for n in names if n in node.inputs), None)
        for name, neutral in IGNORED.items():
            if name in node.inputs and (node.inputs[name].is_linked or node.inputs[name].default_value > neutral):
                self.textures.say(f"'{name}' of Principled is ignored")
        surface = self._body(node, socket)
        emission, strength = socket("Emission", "Emission Color"), socket("Emission Strength")
        light = self.textures.product(self.textures.value(emission), self.textures.value(strength))
        surface.emission = None if light == BLACK else light
        alpha = self.textures.value(node.inputs["Alpha"])
        surface.opacity = None if alpha == WHITE else alpha
        return surface

    def _body(self, node, socket):
        """Returns the reflection and transmission of a Principled node."""
        color, roughness = self.textures.value(node.inputs["Base Color"]), self.textures.value(node.inputs["Roughness"])
        transmission = self.textures.value(socket("Transmission", "Transmission Weight"))
        opaque = Surface("metallicroughness", [
            self.textures.parameter("basecolor", color), self._number("metallic", node.inputs["Metallic"]),
            self.textures.parameter("roughness", roughness, "float"), *self._specular(node, socket)] + self._normal(node))
        if transmission == BLACK:
            return opaque
        glass = self._glass(color, roughness, self._number("eta", node.inputs["IOR"]), self._normal(node), WHITE)
        return glass if transmission == WHITE else self._mixture(opaque, glass, transmission)

    def _specular(self, node, socket):
        """Returns the parameters of the reflectance of the dielectric and of the clearcoat."""
        parameters = []
        old = node.inputs.get("Specular")
        if old is not None:
            value = self.textures.value(old)
            if isinstance(value, str):
                self.textures.say("the texture of 'Specular' is replaced by 0.5")
                value = [0.5] * 3
            root = math.sqrt(0.08 * min(max(value[0], 0), 10))
            parameters += [("float", "ior", 2 / (1 - root) - 1)] if value[0] > 0 else [("float", "specular", 0.0)]
        else:
            parameters.append(self._number("ior", node.inputs["IOR"]))
        coat = node.inputs.get("Clearcoat")
        if coat is not None and (coat.is_linked or coat.default_value > 0):
            value = self.textures.product(self.textures.value(coat), [0.25] * 3)
            parameters += [self.textures.parameter("clearcoat", value, "float"),
                           self._number("clearcoatroughness", node.inputs["Clearcoat Roughness"])]
        return parameters

    def _group(self, node):
        """The shader that feeds the output of a group. Values of the group's inputs are its defaults."""
        output = next((n for n in node.node_tree.nodes if n.type == "GROUP_OUTPUT" and n.is_active_output), None)
        source = next((linked(s) for s in output.inputs if s.type == "SHADER"), None) if output else None
        self.textures.say(f"inputs of group '{node.name}' are replaced")
        return self._shader(source.node) if source else Surface()
