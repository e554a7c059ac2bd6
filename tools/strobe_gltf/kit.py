"""Runs inside Blender: objects, materials, motion; exports them as glTF and renders them by Cycles.

What glTF's materials are made of is told to the exporter by a Principled BSDF, and to Cycles, after the export, by the
nodes that are the same in its terms: Principled's diffuse part is not Lambert's, and its dielectric is not glTF's.
Materials made with `exact=False` are left Principled for both.
"""
import math

import bpy

FPS = 24
_dressers = []  # what turns each exported material into Cycles' equivalent


def reset(size=(200, 150)):
    bpy.ops.wm.read_factory_settings(use_empty=True)
    _dressers.clear()
    scene = bpy.context.scene
    scene.render.fps = FPS
    scene.render.resolution_x, scene.render.resolution_y = size
    scene.world = bpy.data.worlds.new("nothing")
    scene.world.use_nodes = True
    scene.world.node_tree.nodes["Background"].inputs["Strength"].default_value = 0
    return scene


# Materials -----------------------------------------------------------------------------------------------------------


def _output_group():
    """The exporter's own way to say how specular a dielectric is: a group of that name with an input."""
    name = "glTF Material Output"
    if name not in bpy.data.node_groups:
        group = bpy.data.node_groups.new(name, "ShaderNodeTree")
        group.inputs.new("NodeSocketFloat", "Specular").default_value = 1
        group.inputs.new("NodeSocketColor", "Specular Color").default_value = (1, 1, 1, 1)
        group.inputs.new("NodeSocketFloat", "Occlusion").default_value = 1
    return bpy.data.node_groups[name]


def material(name, color=(0.6, 0.6, 0.6), metallic=0, roughness=1, exact=True, emission=None, strength=1, alpha=None,
             cutoff=0.5):
    """A glTF material; `color`, `emission`: linear RGB. `alpha`: "MASK" or "BLEND", whose texture is linked later.
    Exact ones have no dielectric reflection."""
    made = bpy.data.materials.new(name)
    made.use_nodes = True
    nodes = made.node_tree.nodes
    bsdf = nodes["Principled BSDF"]
    bsdf.inputs["Base Color"].default_value = (*color, 1)
    bsdf.inputs["Metallic"].default_value = metallic
    bsdf.inputs["Roughness"].default_value = roughness
    if emission:
        bsdf.inputs["Emission"].default_value = (*emission, 1)
        bsdf.inputs["Emission Strength"].default_value = strength
    made.blend_method = {"MASK": "CLIP", "BLEND": "BLEND"}.get(alpha, "OPAQUE")
    made.alpha_threshold = cutoff
    if exact:
        group = nodes.new("ShaderNodeGroup")
        group.node_tree = _output_group()
        group.inputs["Specular"].default_value = 0
    _dressers.append(lambda: _dress(made, exact, alpha, cutoff))
    return made


def bsdf_of(made):
    return made.node_tree.nodes["Principled BSDF"]


def link(made, source, target):
    made.node_tree.links.new(source, target)


def image(name, texel, color=True, embedded=True, size=64):
    """An image whose texels, RGBA as encoded in the file, are a function of (x, y) in 0..1, y up."""
    made = bpy.data.images.new(name, size, size, alpha=True)
    made.colorspace_settings.name = "sRGB" if color else "Non-Color"
    made.pixels = [c for y in range(size) for x in range(size) for c in texel((x + 0.5) / size, (y + 0.5) / size)]
    if embedded:
        made.pack()
    return made


def texture(made, source, scale=None, offset=(0, 0), angle=0):
    """A texture node of an image, placed by KHR_texture_transform where a scale is given."""
    nodes = made.node_tree.nodes
    node = nodes.new("ShaderNodeTexImage")
    node.image = source
    if scale:
        mapping, uv = nodes.new("ShaderNodeMapping"), nodes.new("ShaderNodeUVMap")
        mapping.vector_type = "POINT"
        mapping.inputs["Scale"].default_value = (*scale, 1)
        mapping.inputs["Location"].default_value = (*offset, 0)
        mapping.inputs["Rotation"].default_value = (0, 0, angle)
        uv.uv_map = "UVMap"
        link(made, uv.outputs["UV"], mapping.inputs["Vector"])
        link(made, mapping.outputs["Vector"], node.inputs["Vector"])
    return node


def tint_by_attribute(made, name, tint):
    """Cycles multiplies the base color by a color of the vertices, as glTF does by COLOR_0."""
    def dress():
        nodes = made.node_tree.nodes
        color, product = nodes.new("ShaderNodeVertexColor"), nodes.new("ShaderNodeVectorMath")
        color.layer_name, product.operation = name, "MULTIPLY"
        link(made, color.outputs["Color"], product.inputs[0])
        product.inputs[1].default_value = tint
        link(made, product.outputs["Vector"], bsdf_of(made).inputs["Base Color"])

    _dressers.insert(0, dress)


def _copy_input(tree, source, target):
    target.default_value = source.default_value
    for old in source.links:
        tree.links.new(old.from_socket, target)


def _mix(tree, factor, first, second):
    node = tree.nodes.new("ShaderNodeMixShader")
    if hasattr(factor, "is_output"):
        tree.links.new(factor, node.inputs["Fac"])
    else:
        node.inputs["Fac"].default_value = factor
    tree.links.new(first, node.inputs[1])
    tree.links.new(second, node.inputs[2])
    return node.outputs[0]


def _dress(made, exact, alpha, cutoff):
    tree = made.node_tree
    metal = bsdf_of(made)
    metal.distribution = "GGX"  # one scattering: glTF's
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
    opacity = [l.from_socket for l in metal.inputs["Alpha"].links]
    for socket in ("Emission", "Alpha"):
        for old in list(metal.inputs[socket].links):
            tree.links.remove(old)
    metal.inputs["Emission Strength"].default_value = 0
    metal.inputs["Alpha"].default_value, through = 1, metal.inputs["Alpha"].default_value
    add = tree.nodes.new("ShaderNodeAddShader")
    tree.links.new(shader, add.inputs[0])
    tree.links.new(glow.outputs[0], add.inputs[1])
    shader = add.outputs[0]
    if alpha:
        factor = opacity[0] if opacity else through
        if alpha == "MASK":
            cut = tree.nodes.new("ShaderNodeMath")
            cut.operation = "GREATER_THAN"
            tree.links.new(factor, cut.inputs[0])
            cut.inputs[1].default_value = cutoff
            factor = cut.outputs[0]
        shader = _mix(tree, factor, tree.nodes.new("ShaderNodeBsdfTransparent").outputs[0], shader)
    tree.links.new(shader, tree.nodes["Material Output"].inputs["Surface"])


# Objects -------------------------------------------------------------------------------------------------------------


def shape(kind, made, at=(0, 0, 0), smooth=False, rotation=(0, 0, 0), scale=(1, 1, 1), parent=None, name=None, **how):
    """One of Blender's primitives ("cube", "uv_sphere", …)."""
    getattr(bpy.ops.mesh, f"primitive_{kind}_add")(**how)
    thing = bpy.context.object
    if kind == "monkey":  # its faces are large: Cycles leaves normals alone that lean away from the eye, strobe does not
        thing.modifiers.new("fine", "SUBSURF").levels = 2
        bpy.ops.object.modifier_apply(modifier="fine")
    thing.location, thing.rotation_euler, thing.scale = at, rotation, scale
    thing.parent = parent
    if name:
        thing.name = name
    if made:
        thing.data.materials.append(made)
    for polygon in thing.data.polygons:
        polygon.use_smooth = smooth
    return thing


def put(data, name, at=(0, 0, 0), rotation=(0, 0, 0), parent=None, scale=(1, 1, 1)):
    thing = bpy.data.objects.new(name, data)
    bpy.context.scene.collection.objects.link(thing)
    thing.location, thing.rotation_euler, thing.parent, thing.scale = at, rotation, parent, scale
    return thing


def floor(color=(0.6, 0.6, 0.6), size=12):
    return shape("plane", material("floor", color), size=size)


def light(kind, energy, at=(0, 0, 0), rotation=(0, 0, 0), color=(1, 1, 1), cone=None, blend=0.0):
    """A light without size. `energy`: watts, of suns watts per square meter. `cone`: the whole angle, degrees."""
    data = bpy.data.lights.new(kind.lower(), kind)
    data.energy, data.color = energy, color
    if kind == "SUN":
        data.angle = 0
    else:
        data.shadow_soft_size = 0
    if cone:
        data.spot_size, data.spot_blend = math.radians(cone), blend
        _dressers.append(lambda: _level_spot(data))
    return put(data, kind.lower(), at, rotation)


def _level_spot(data):
    """Cycles' spots fade with the cosine off their axis, glTF's do not before the inner cone ends."""
    data.use_nodes = True
    tree = data.node_tree
    place, parts, inverse = (tree.nodes.new("ShaderNode" + kind) for kind in ("TexCoord", "SeparateXYZ", "Math"))
    inverse.operation, inverse.inputs[0].default_value = "DIVIDE", -1
    tree.links.new(place.outputs["Normal"], parts.inputs[0])
    tree.links.new(parts.outputs["Z"], inverse.inputs[1])
    tree.links.new(inverse.outputs[0], tree.nodes["Emission"].inputs["Strength"])


def camera(at=(0, -8, 4), rotation=(65, 0, 0), width=None):
    """`rotation`: degrees; `width`: of an orthographic view, in meters."""
    data = bpy.data.cameras.new("camera")
    if width:
        data.type, data.ortho_scale = "ORTHO", width
    bpy.context.scene.camera = put(data, "camera", at, [math.radians(a) for a in rotation])
    return bpy.context.scene.camera


# Motion --------------------------------------------------------------------------------------------------------------


def keys(thing, path, by_frame, interpolation="LINEAR"):
    """Keyframes of one property. "BEZIER": with handles a third of the way off, where a Bézier curve over time is a
    cubic polynomial, and flat."""
    for frame, value in by_frame.items():
        setattr(thing, path, value)
        thing.keyframe_insert(path, frame=frame)
    owner = thing.id_data
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


def export(path, first=None, last=None, **how):
    scene = bpy.context.scene
    if last:
        scene.frame_start, scene.frame_end = first, last
    settings = dict(filepath=path, export_lights=True, export_cameras=True, export_original_specular=True,
                    export_force_sampling=True, convert_lighting_mode="SPEC",
                    export_animations=bool(last))
    settings.update(how)
    bpy.ops.export_scene.gltf(**settings)


def render(path, samples, bounces, frame=None, shutter=None):
    """A box filter of one pixel, no clamps, no thresholds; as many motion steps as Cycles has."""
    for dress in _dressers:
        dress()
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
    for thing in bpy.data.objects:
        thing.cycles.shadow_terminator_geometry_offset = 0
        thing.cycles.use_motion_blur = thing.cycles.use_deform_motion = True
        thing.cycles.motion_steps = 5
    if frame is not None:
        scene.frame_set(frame)
    render.filepath = path
    bpy.ops.render.render(write_still=True)
