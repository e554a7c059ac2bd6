"""Objects, materials and motion in Blender, their export as glTF, and their render by Cycles. Runs inside Blender.

The glTF exporter reads materials from a Principled BSDF, whose diffuse lobe is not Lambertian and whose dielectric differs
from glTF. After the export, each material is therefore replaced by equivalent nodes for Cycles. Materials made with
exact=False remain Principled.
"""
import math

import bpy

FPS = 24
_conversions = []  # functions that convert the exported materials and lights for Cycles


def reset(size=(200, 150)):
    """Empties the scene and sets the frame rate, the resolution and a black background. Returns the scene."""
    bpy.ops.wm.read_homefile(use_empty=True)
    _conversions.clear()
    scene = bpy.context.scene
    scene.render.fps = FPS
    scene.render.resolution_x, scene.render.resolution_y = size
    scene.world = bpy.data.worlds.new("black")
    scene.world.use_nodes = True
    scene.world.node_tree.nodes["Background"].inputs["Strength"].default_value = 0
    return scene


# Materials -----------------------------------------------------------------------------------------------------------


def _output_group():
    """Returns the node group from which the exporter reads the specular factor of a dielectric."""
    name = "glTF Material Output"
    if name not in bpy.data.node_groups:
        group = bpy.data.node_groups.new(name, "ShaderNodeTree")
        group.inputs.new("NodeSocketFloat", "Specular").default_value = 1
        group.inputs.new("NodeSocketColor", "Specular Color").default_value = (1, 1, 1, 1)
        group.inputs.new("NodeSocketFloat", "Occlusion").default_value = 1
        group.inputs.new("NodeSocketFloat", "Thickness").default_value = 0
    return bpy.data.node_groups[name]


def material(name, color=(0.6, 0.6, 0.6), metallic=0, roughness=1, exact=True, emission=None, strength=1, alpha=None,
             cutoff=0.5):
    """Returns a glTF material. `color` and `emission` are linear RGB. `alpha` is "MASK" or "BLEND"; the caller links its
    texture. Exact materials have no dielectric reflection."""
    result = bpy.data.materials.new(name)
    result.use_nodes = True
    nodes = result.node_tree.nodes
    bsdf = nodes["Principled BSDF"]
    bsdf.inputs["Base Color"].default_value = (*color, 1)
    bsdf.inputs["Metallic"].default_value = metallic
    bsdf.inputs["Roughness"].default_value = roughness
    if emission:
        bsdf.inputs["Emission"].default_value = (*emission, 1)
        bsdf.inputs["Emission Strength"].default_value = strength
    result.blend_method = {"MASK": "CLIP", "BLEND": "BLEND"}.get(alpha, "OPAQUE")
    result.alpha_threshold = cutoff
    if exact:
        group = nodes.new("ShaderNodeGroup")
        group.node_tree = _output_group()
        group.inputs["Specular"].default_value = 0
    _conversions.append(lambda: _convert(result, exact, alpha, cutoff))
    return result


def _shader(tree, kind, **values):
    """Makes a shader node the surface of a material. Returns the node."""
    node = tree.nodes.new(kind)
    for name, value in values.items():
        node.inputs[name.replace("_", " ")].default_value = value
    tree.links.new(node.outputs[0], tree.nodes["Material Output"].inputs["Surface"])
    return node


def glass(name, color, density, ior):
    """Returns smooth glass that absorbs light: `color` is what is left after a distance of 1 / `density`."""
    result = bpy.data.materials.new(name)
    result.use_nodes = True
    tree = result.node_tree
    bsdf = tree.nodes["Principled BSDF"]
    bsdf.inputs["Base Color"].default_value = (1, 1, 1, 1)
    for input_name, value in (("Roughness", 0), ("Transmission", 1), ("IOR", ior)):
        bsdf.inputs[input_name].default_value = value
    group = tree.nodes.new("ShaderNodeGroup")
    group.node_tree = _output_group()
    group.inputs["Thickness"].default_value = 1
    volume = tree.nodes.new("ShaderNodeVolumeAbsorption")
    volume.inputs["Color"].default_value = (*color, 1)
    volume.inputs["Density"].default_value = density
    tree.links.new(volume.outputs[0], tree.nodes["Material Output"].inputs["Volume"])

    def convert():
        """glTF's coefficient is -log(color) times density, that of Cycles is (1 - color) times density."""
        coefficients = [-math.log(c) * density for c in color]
        most = max(*coefficients, 1e-6)
        volume.inputs["Color"].default_value = (*(1 - c / most for c in coefficients), 1)
        volume.inputs["Density"].default_value = most
        _shader(tree, "ShaderNodeBsdfGlass", Color=(1, 1, 1, 1), Roughness=0, IOR=ior).distribution = "SHARP"

    _conversions.append(convert)
    return result


def brushed(name, color, roughness, strength):
    """Returns a metal whose GGX is stretched along the tangent, as by KHR_materials_anisotropy of this strength."""
    result = material(name, color, 1, roughness, exact=False)
    tree = result.node_tree

    def convert():
        across = roughness ** 2
        along = across + (1 - across) * strength ** 2
        node = _shader(tree, "ShaderNodeBsdfAnisotropic", Color=(*color, 1), Roughness=math.sqrt(math.sqrt(across * along)),
                       Anisotropy=math.sqrt(across / along) - 1)
        node.distribution = "GGX"
        tangent = tree.nodes.new("ShaderNodeTangent")
        tangent.direction_type, tangent.uv_map = "UV_MAP", "UVMap"
        tree.links.new(tangent.outputs[0], node.inputs["Tangent"])

    _conversions.append(convert)
    return result


def bsdf_of(material):
    """Returns the Principled BSDF of a material."""
    return material.node_tree.nodes["Principled BSDF"]


def link(material, source, target):
    """Links two sockets of a material."""
    material.node_tree.links.new(source, target)


def image(name, texel, color=True, embedded=True, size=64):
    """Returns an image. texel(x, y) returns RGBA as encoded in the file, with x and y in [0,1] and y up."""
    result = bpy.data.images.new(name, size, size, alpha=True)
    result.colorspace_settings.name = "sRGB" if color else "Non-Color"
    result.pixels = [c for y in range(size) for x in range(size) for c in texel((x + 0.5) / size, (y + 0.5) / size)]
    if embedded:
        result.pack()
    return result


def texture(material, source, scale=None, offset=(0, 0), angle=0):
    """Returns a texture node of an image, with KHR_texture_transform if a scale is given."""
    nodes = material.node_tree.nodes
    node = nodes.new("ShaderNodeTexImage")
    node.image = source
    if scale:
        mapping, uv = nodes.new("ShaderNodeMapping"), nodes.new("ShaderNodeUVMap")
        mapping.vector_type = "POINT"
        mapping.inputs["Scale"].default_value = (*scale, 1)
        mapping.inputs["Location"].default_value = (*offset, 0)
        mapping.inputs["Rotation"].default_value = (0, 0, angle)
        uv.uv_map = "UVMap"
        link(material, uv.outputs["UV"], mapping.inputs["Vector"])
        link(material, mapping.outputs["Vector"], node.inputs["Vector"])
    return node


def tint_by_attribute(material, name, tint):
    """Multiplies the base color by vertex colors in Cycles, as glTF does with COLOR_0."""
    def convert():
        nodes = material.node_tree.nodes
        color, product = nodes.new("ShaderNodeVertexColor"), nodes.new("ShaderNodeVectorMath")
        color.layer_name, product.operation = name, "MULTIPLY"
        link(material, color.outputs["Color"], product.inputs[0])
        product.inputs[1].default_value = tint
        link(material, product.outputs["Vector"], bsdf_of(material).inputs["Base Color"])

    _conversions.insert(0, convert)


def _copy_input(tree, source, target):
    """Copies the value and the links of a socket."""
    target.default_value = source.default_value
    for old in source.links:
        tree.links.new(old.from_socket, target)


def _mix(tree, factor, first, second):
    """Returns a mix of two shaders by a factor, which is a number or a socket."""
    node = tree.nodes.new("ShaderNodeMixShader")
    if hasattr(factor, "is_output"):
        tree.links.new(factor, node.inputs["Fac"])
    else:
        node.inputs["Fac"].default_value = factor
    tree.links.new(first, node.inputs[1])
    tree.links.new(second, node.inputs[2])
    return node.outputs[0]


def _convert(material, exact, alpha, cutoff):
    """Replaces the Principled BSDF of a material by the nodes of glTF's model: diffuse or GGX metal, emission and alpha."""
    tree = material.node_tree
    metal = bsdf_of(material)
    metal.distribution = "GGX"  # single scattering, as in glTF
    if not exact:
        return
    metallic = metal.inputs["Metallic"]
    factor = metallic.links[0].from_socket if metallic.is_linked else metallic.default_value
    for old in list(metallic.links):
        tree.links.remove(old)
    metallic.default_value = 1
    diffuse = tree.nodes.new("ShaderNodeBsdfDiffuse")
    _copy_input(tree, metal.inputs["Base Color"], diffuse.inputs["Color"])
    _copy_input(tree, metal.inputs["Normal"], diffuse.inputs["Normal"])
    shader = _mix(tree, factor, diffuse.outputs[0], metal.outputs[0])
    glow = tree.nodes.new("ShaderNodeEmission")
    _copy_input(tree, metal.inputs["Emission"], glow.inputs["Color"])
    _copy_input(tree, metal.inputs["Emission Strength"], glow.inputs["Strength"])
    opacity = [old.from_socket for old in metal.inputs["Alpha"].links]
    for socket in ("Emission", "Alpha"):
        for old in list(metal.inputs[socket].links):
            tree.links.remove(old)
    metal.inputs["Emission Strength"].default_value = 0
    alpha_value = metal.inputs["Alpha"].default_value
    metal.inputs["Alpha"].default_value = 1
    add = tree.nodes.new("ShaderNodeAddShader")
    tree.links.new(shader, add.inputs[0])
    tree.links.new(glow.outputs[0], add.inputs[1])
    shader = add.outputs[0]
    if alpha:
        factor = opacity[0] if opacity else alpha_value
        if alpha == "MASK":
            cut = tree.nodes.new("ShaderNodeMath")
            cut.operation = "GREATER_THAN"
            tree.links.new(factor, cut.inputs[0])
            cut.inputs[1].default_value = cutoff
            factor = cut.outputs[0]
        shader = _mix(tree, factor, tree.nodes.new("ShaderNodeBsdfTransparent").outputs[0], shader)
    tree.links.new(shader, tree.nodes["Material Output"].inputs["Surface"])


# Objects -------------------------------------------------------------------------------------------------------------


def shape(kind, material, location=(0, 0, 0), smooth=False, rotation=(0, 0, 0), scale=(1, 1, 1), parent=None, name=None,
          **options):
    """Adds one of Blender's mesh primitives ("cube", "uv_sphere", ...) and returns it."""
    getattr(bpy.ops.mesh, f"primitive_{kind}_add")(**options)
    obj = bpy.context.object
    if kind == "monkey":  # on large faces, the renderers differ in shading normals that face away from the camera
        obj.modifiers.new("fine", "SUBSURF").levels = 2
        bpy.ops.object.modifier_apply(modifier="fine")
    obj.location, obj.rotation_euler, obj.scale = location, rotation, scale
    obj.parent = parent
    if name:
        obj.name = name
    if material:
        obj.data.materials.append(material)
    for polygon in obj.data.polygons:
        polygon.use_smooth = smooth
    return obj


def add_object(data, name, location=(0, 0, 0), rotation=(0, 0, 0), parent=None, scale=(1, 1, 1)):
    """Adds an object with data, or an empty object, and returns it."""
    obj = bpy.data.objects.new(name, data)
    bpy.context.scene.collection.objects.link(obj)
    obj.location, obj.rotation_euler, obj.parent, obj.scale = location, rotation, parent, scale
    return obj


def floor(color=(0.6, 0.6, 0.6), size=12):
    """Adds a square floor at z = 0 and returns it."""
    return shape("plane", material("floor", color), size=size)


def light(kind, energy, location=(0, 0, 0), rotation=(0, 0, 0), color=(1, 1, 1), cone=None, blend=0.0):
    """Adds a light without size and returns it. `energy`: watts; for a sun, watts per square meter. `cone`: the full angle of
    a spot in degrees."""
    data = bpy.data.lights.new(kind.lower(), kind)
    data.energy, data.color = energy, color
    if kind == "SUN":
        data.angle = 0
    else:
        data.shadow_soft_size = 0
    if cone:
        data.spot_size, data.spot_blend = math.radians(cone), blend
        _conversions.append(lambda: _level_spot(data))
    return add_object(data, kind.lower(), location, rotation)


def _level_spot(data):
    """Divides a spot by the cosine to its axis: spots have this factor in Cycles, but not in glTF inside the inner cone."""
    data.use_nodes = True
    tree = data.node_tree
    coordinates, components, inverse = (tree.nodes.new("ShaderNode" + kind)
                                        for kind in ("TexCoord", "SeparateXYZ", "Math"))
    inverse.operation, inverse.inputs[0].default_value = "DIVIDE", -1
    tree.links.new(coordinates.outputs["Normal"], components.inputs[0])
    tree.links.new(components.outputs["Z"], inverse.inputs[1])
    tree.links.new(inverse.outputs[0], tree.nodes["Emission"].inputs["Strength"])


def camera(location=(0, -8, 4), rotation=(65, 0, 0), width=None):
    """Adds the camera and returns it. `rotation`: degrees; `width`: of an orthographic view, in meters."""
    data = bpy.data.cameras.new("camera")
    if width:
        data.type, data.ortho_scale = "ORTHO", width
    bpy.context.scene.camera = add_object(data, "camera", location, [math.radians(a) for a in rotation])
    return bpy.context.scene.camera


# Motion --------------------------------------------------------------------------------------------------------------


def keys(obj, path, by_frame, interpolation="LINEAR"):
    """Adds keyframes {frame: value} of one property. "BEZIER": horizontal handles at a third of the distance, with which the
    Bézier curve is a cubic polynomial of time."""
    for frame, value in by_frame.items():
        setattr(obj, path, value)
        obj.keyframe_insert(path, frame=frame)
    owner = obj.id_data
    for curve in owner.animation_data.action.fcurves:
        if not curve.data_path.endswith(path):
            continue
        points = curve.keyframe_points
        for i, point in enumerate(points):
            point.interpolation = interpolation
            if interpolation != "BEZIER":
                continue
            before = points[max(i - 1, 0)].co.x
            after = points[min(i + 1, len(points) - 1)].co.x
            point.handle_left_type = point.handle_right_type = "FREE"
            point.handle_left = (point.co.x - (point.co.x - before) / 3, point.co.y)
            point.handle_right = (point.co.x + (after - point.co.x) / 3, point.co.y)


# Export and render ---------------------------------------------------------------------------------------------------


def export(path, first=None, last=None, **options):
    """Exports the scene as glTF, with animation of frames first to last if given."""
    scene = bpy.context.scene
    if last:
        scene.frame_start, scene.frame_end = first, last
    settings = dict(filepath=path, export_lights=True, export_cameras=True, export_original_specular=True,
                    export_force_sampling=True, convert_lighting_mode="SPEC",
                    export_animations=bool(last))
    settings.update(options)
    bpy.ops.export_scene.gltf(**settings)


def render(path, samples, bounces, frame=None, shutter=None):
    """Renders the scene with Cycles: box filter of one pixel, no clamping, no thresholds, the maximum of motion steps."""
    for convert in _conversions:
        convert()
    scene = bpy.context.scene
    render, cycles = scene.render, scene.cycles
    render.engine, render.resolution_percentage = "CYCLES", 100
    render.threads_mode, render.threads = "FIXED", 2
    render.image_settings.file_format, render.image_settings.color_depth = "OPEN_EXR", "32"
    render.image_settings.color_mode = "RGB"
    scene.view_settings.view_transform = "Raw"
    cycles.samples, cycles.use_adaptive_sampling, cycles.use_denoising = samples, False, False
    cycles.pixel_filter_type = "BOX"
    cycles.max_bounces = cycles.diffuse_bounces = cycles.glossy_bounces = cycles.transmission_bounces = bounces
    cycles.transparent_max_bounces = 64
    cycles.sample_clamp_direct = cycles.sample_clamp_indirect = cycles.blur_glossy = 0
    cycles.light_sampling_threshold = 0
    render.use_motion_blur = shutter is not None
    if shutter:
        cycles.motion_blur_position, render.motion_blur_shutter = "START", shutter
    for obj in bpy.data.objects:
        obj.cycles.shadow_terminator_geometry_offset = 0
        obj.cycles.use_motion_blur = obj.cycles.use_deform_motion = True
        obj.cycles.motion_steps = 5
    if frame is not None:
        scene.frame_set(frame)
    render.filepath = path
    bpy.ops.render.render(write_still=True)
