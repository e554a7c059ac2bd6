"""The world: a color or an image."""
from mathutils import Euler, Matrix

from . import export_image, export_light, scene_text
from .export_texture import linked, rgb


def lines(world, folder, messages):
    """Returns the lines of the background, between AttributeBegin and AttributeEnd."""
    if world is None:
        return []
    group = export_light.group_parameters(getattr(world, "lightgroup", ""))
    if not world.use_nodes or not world.node_tree:
        return _constant(list(world.color), group)
    output = world.node_tree.get_output_node("CYCLES")
    source = linked(output.inputs["Surface"]) if output else None
    if source is None:
        return []
    if source.node.type != "BACKGROUND":
        messages.add(world.name, f"node '{source.node.name}' is not supported: the world is black")
        return []
    return _background(world, source.node, group, folder, messages)


def _constant(color, group):
    """Returns a light of the same radiance from all directions."""
    return [scene_text.directive("LightSource", "infinite", [("rgb", "L", color)] + group)] if any(color) else []


def _background(world, node, group, folder, messages):
    """Returns the light of a Background node."""
    if node.inputs["Strength"].is_linked:
        messages.add(world.name, "the nodes of the strength are ignored")
    strength = node.inputs["Strength"].default_value
    source = linked(node.inputs["Color"])
    if source is None:
        return _constant([c * strength for c in rgb(node.inputs["Color"].default_value)], group)
    if source.node.type == "RGB":
        return _constant([c * strength for c in rgb(source.default_value)], group)
    if source.node.type != "TEX_ENVIRONMENT" or not source.node.image:
        messages.add(world.name, f"node '{source.node.name}' is not supported: the world is gray")
        return _constant([0.5 * strength] * 3, group)
    return _image(world, source.node, strength, group, folder, messages)


def _rotation(world, node, messages):
    """Returns the rotation of the texture coordinates as a matrix."""
    source = linked(node.inputs["Vector"])
    if source is None or source.node.type == "TEX_COORD":
        return Matrix.Identity(3)
    if source.node.type == "MAPPING" and source.node.vector_type in ("POINT", "VECTOR", "TEXTURE"):
        turn = Euler(source.node.inputs["Rotation"].default_value, "XYZ").to_matrix()
        return turn.transposed() if source.node.vector_type == "TEXTURE" else turn
    messages.add(world.name, f"node '{source.node.name}' of the texture coordinates is ignored")
    return Matrix.Identity(3)


def _image(world, node, strength, group, folder, messages):
    """Returns the light of an environment image."""
    found = export_image.image_file(node.image, folder)
    if not found:
        messages.add(world.name, f"image '{node.image.name}' has no pixels: the world is black")
        return []
    if node.projection != "EQUIRECTANGULAR":
        messages.add(world.name, "the projection of the image is equirectangular")
    # Cycles: u = 1/2 - atan2(y, x) / 2 pi. strobe: u = phi / 2 pi.
    place = (_rotation(world, node, messages).transposed() @ Matrix.Diagonal((-1, 1, 1))).to_4x4()
    return [scene_text.matrix(place), scene_text.directive("LightSource", "infinite", [
        ("rgb", "L", [strength] * 3), ("string", "mapname", found[0])] + group)]
