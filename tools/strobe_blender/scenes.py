"""The scenes of tools/blender-check, made in Blender. Each function builds one scene on top of base() and returns a dict:
"blur" (shutter in frames), "inexact" (reason for a difference from Cycles). The picture is frame 10. Runs inside Blender."""
import math

import bpy

from strobe_gltf import kit

FRAME = 10
TURN = 2 * math.pi


def nodes_of(name):
    """Returns a new material, its node tree without shaders, and its output."""
    result = bpy.data.materials.new(name)
    result.use_nodes = True
    tree = result.node_tree
    tree.nodes.remove(tree.nodes["Principled BSDF"])
    return result, tree, tree.nodes["Material Output"]


def shader(name, kind="BsdfDiffuse", **values):
    """Returns a material of one shader. Values are those of its inputs; colors have three numbers."""
    result, tree, output = nodes_of(name)
    tree.links.new(node(tree, kind, **values).outputs[0], output.inputs["Surface"])
    return result


def node(tree, kind, **values):
    """Adds a node and sets its inputs."""
    made = tree.nodes.new("ShaderNode" + kind)
    for key, value in values.items():
        made.inputs[key.replace("_", " ")].default_value = (*value, 1) if isinstance(value, tuple) else value
    return made


def matte(color=(0.6, 0.6, 0.6)):
    """Returns a Lambertian material."""
    return shader("matte", Color=color)


def world(color=(0.3, 0.4, 0.5)):
    """Sets the color of the world."""
    background = bpy.context.scene.world.node_tree.nodes["Background"]
    background.inputs["Color"].default_value, background.inputs["Strength"].default_value = (*color, 1), 1


def base(sky=True):
    """Adds a floor, a camera and a world."""
    kit.shape("plane", matte(), size=14)
    kit.camera((0, -8, 4), (66, 0, 0))
    if sky:
        world()


def lamp(kind, energy, location, rotation=(0, 0, 0), size=0.0, **options):
    """Adds a light. `size`: radius, edge, or angle of a sun."""
    data = bpy.data.lights.new(kind.lower(), kind)
    data.energy = energy
    for name, value in options.items():
        setattr(data, name, value)
    if kind == "SUN":
        data.angle = size
    elif kind == "AREA":
        data.size = size
    else:
        data.shadow_soft_size = size
    light = kit.add_object(data, kind.lower(), location, rotation)
    light.visible_camera = False
    return light


def spin(obj, start, end, path="rotation_euler"):
    """Animates a property linearly over frames 0 to 20."""
    kit.keys(obj, path, {0: start, 20: end})


def delta_lights():
    """Point, spot and sun without size."""
    base(sky=False)
    kit.shape("cube", matte((0.7, 0.3, 0.2)), (-1.2, 0, 1))
    kit.shape("uv_sphere", matte((0.2, 0.4, 0.7)), (1.4, 0.5, 1), smooth=True, segments=64, ring_count=32)
    lamp("POINT", 300, (-3, -2, 4), color=(1, 0.8, 0.6))
    lamp("SPOT", 800, (3, -3, 5), (0.6, 0.4, 0), spot_size=0.8, spot_blend=0.3)
    lamp("SUN", 0.7, (0, 0, 5), (0.5, -0.3, 0))
    return {}


def area_lights():
    """Rectangle, ellipse, a point with a radius, and a sun with an angle."""
    base(sky=False)
    kit.shape("cube", matte((0.7, 0.3, 0.2)), (-1.2, 0, 1))
    kit.shape("uv_sphere", matte((0.2, 0.4, 0.7)), (1.4, 0.5, 1), smooth=True, segments=64, ring_count=32)
    lamp("AREA", 200, (-3, -2, 4), (0.5, -0.6, 0), 2, shape="RECTANGLE", size_y=1)
    lamp("AREA", 150, (3, -1, 4), (0.3, 0.6, 0), 1, shape="ELLIPSE", size_y=2)
    lamp("POINT", 100, (0, -4, 4), size=0.5)
    lamp("SUN", 0.5, (0, 0, 5), (0.5, -0.3, 0), 0.2)
    return {}


def nodes():
    """Diffuse, white glossy, mirror, glass, emission, mix, transparent, translucent."""
    base()
    mixed, tree, output = nodes_of("mix")
    mix = node(tree, "MixShader", Fac=0.3)
    tree.links.new(node(tree, "BsdfDiffuse", Color=(0.8, 0.2, 0.2)).outputs[0], mix.inputs[1])
    tree.links.new(node(tree, "BsdfDiffuse", Color=(0.1, 0.2, 0.8)).outputs[0], mix.inputs[2])
    tree.links.new(mix.outputs[0], output.inputs["Surface"])
    clear, tree, output = nodes_of("half clear")
    mix = node(tree, "MixShader", Fac=0.6)
    tree.links.new(node(tree, "BsdfTransparent").outputs[0], mix.inputs[1])
    tree.links.new(node(tree, "BsdfDiffuse", Color=(0.2, 0.7, 0.3)).outputs[0], mix.inputs[2])
    tree.links.new(mix.outputs[0], output.inputs["Surface"])
    glossy = shader("glossy", "BsdfGlossy", Color=(1, 1, 1), Roughness=0.4)
    glossy.node_tree.nodes["Glossy BSDF"].distribution = "GGX"
    mirror = shader("mirror", "BsdfGlossy", Color=(0.9, 0.7, 0.4), Roughness=0)
    mirror.node_tree.nodes["Glossy BSDF"].distribution = "SHARP"
    glass = shader("glass", "BsdfGlass", Color=(1, 1, 1), Roughness=0, IOR=1.45)
    glass.node_tree.nodes["Glass BSDF"].distribution = "SHARP"
    glow = shader("glow", "Emission", Color=(1, 0.6, 0.3), Strength=3.0)
    thin = shader("thin", "BsdfTranslucent", Color=(0.7, 0.7, 0.3))
    for i, material in enumerate((glossy, mirror, glass, mixed, clear, thin)):
        kit.shape("uv_sphere", material, (-3 + 3 * (i % 3), 1.5 - 2.4 * (i // 3), 0.9), smooth=True, segments=64, ring_count=32,
                  radius=0.9)
    kit.shape("cube", glow, (0, 0.3, 0.25), size=0.5)
    return {"bounces": 6}


def principled():
    """Principled: dielectrics, metals, and emission; and a normal map."""
    base()
    for i, values in enumerate((dict(Base_Color=(0.8, 0.3, 0.2), Roughness=0.5), dict(Base_Color=(0.9, 0.7, 0.4), Metallic=1,
                                Roughness=0.2), dict(Base_Color=(0.9, 0.9, 0.9), Metallic=1, Roughness=0.5),
                                dict(Base_Color=(0.2, 0.4, 0.8), Roughness=0.8, Specular=0.2),
                                dict(Base_Color=(0.5, 0.5, 0.5), Emission=(0.5, 0.2, 0.1), Roughness=0.6),
                                dict(Base_Color=(0.1, 0.6, 0.3), Roughness=0.3))):
        material = shader(f"principled{i}", "BsdfPrincipled", **values)
        kit.shape("uv_sphere", material, (-3 + 3 * (i % 3), 1.5 - 2.4 * (i // 3), 0.9), smooth=True, segments=64, ring_count=32,
                  radius=0.9)
    kit.shape("plane", bumpy(), (0, 4, 3), rotation=(1.2, 0, 0.2), size=2.6)
    return {"inexact": "Principled has Disney's diffuse lobe and another dielectric than glTF's model; "
            "Cycles darkens mapped normals"}


def textures():
    """An image, a checkerboard and an alpha map; the world is an image."""
    kit.camera((0, -8, 4), (66, 0, 0))
    kit.shape("plane", checkered(), size=14)
    sphere = kit.shape("uv_sphere", pictured(), (-1.6, 0, 1.2), smooth=True, segments=64, ring_count=32, radius=1.2)
    sphere.rotation_euler.z = 0.5
    kit.shape("plane", cut_out(), (0.6, -1.5, 0.7), rotation=(1.4, 0, -0.2), size=1.4)
    world_image()
    return {"inexact": "at silhouettes, strobe filters images over the footprint, and Cycles interpolates texels"}


def _image_node(tree, name, texel, color=True, size=64):
    """Adds a node of a generated image."""
    made = node(tree, "TexImage")
    made.image = kit.image(name, texel, color, size=size)
    return made


def checkered():
    """Returns a checkerboard over UV."""
    result, tree, output = nodes_of("checker")
    checker, uv = node(tree, "TexChecker", Color1=(0.7, 0.7, 0.7), Color2=(0.2, 0.3, 0.5), Scale=10.0), node(tree, "TexCoord")
    diffuse = node(tree, "BsdfDiffuse")
    tree.links.new(uv.outputs["UV"], checker.inputs["Vector"])
    tree.links.new(checker.outputs["Color"], diffuse.inputs["Color"])
    tree.links.new(diffuse.outputs[0], output.inputs["Surface"])
    return result


def pictured():
    """Returns an image, scaled and moved by a mapping."""
    result, tree, output = nodes_of("picture")
    image = _image_node(tree, "picture", lambda x, y: (0.5 + 0.4 * math.sin(TURN * x), 0.5 + 0.4 * math.cos(TURN * y),
                                                       0.5 + 0.4 * math.sin(3 * TURN * x), 1))
    mapping, uv, diffuse = node(tree, "Mapping"), node(tree, "UVMap"), node(tree, "BsdfDiffuse")
    mapping.inputs["Scale"].default_value, mapping.inputs["Location"].default_value = (3, 2, 1), (0.2, 0.1, 0)
    uv.uv_map = "UVMap"
    tree.links.new(uv.outputs[0], mapping.inputs["Vector"])
    tree.links.new(mapping.outputs[0], image.inputs["Vector"])
    tree.links.new(image.outputs["Color"], diffuse.inputs["Color"])
    tree.links.new(diffuse.outputs[0], output.inputs["Surface"])
    return result


def bumpy():
    """Returns a normal map of strength 0.7."""
    result, tree, output = nodes_of("bumpy")
    image = _image_node(tree, "normals", lambda x, y: (0.5 + 0.3 * math.sin(12 * x), 0.5 + 0.2 * math.cos(9 * y), 0.9, 1), False)
    normal, diffuse = node(tree, "NormalMap", Strength=0.7), node(tree, "BsdfDiffuse", Color=(0.7, 0.5, 0.4))
    tree.links.new(image.outputs["Color"], normal.inputs["Color"])
    tree.links.new(normal.outputs[0], diffuse.inputs["Normal"])
    tree.links.new(diffuse.outputs[0], output.inputs["Surface"])
    return result


def cut_out():
    """Returns a material whose alpha channel cuts a disk."""
    result, tree, output = nodes_of("cut")
    image = _image_node(tree, "leaf", lambda x, y: (0.2, 0.7, 0.2, float((x - 0.5) ** 2 + (y - 0.5) ** 2 < 0.16)), size=128)
    mix, diffuse = node(tree, "MixShader"), node(tree, "BsdfDiffuse")
    tree.links.new(image.outputs["Color"], diffuse.inputs["Color"])
    tree.links.new(image.outputs["Alpha"], mix.inputs[0])
    tree.links.new(node(tree, "BsdfTransparent").outputs[0], mix.inputs[1])
    tree.links.new(diffuse.outputs[0], mix.inputs[2])
    tree.links.new(mix.outputs[0], output.inputs["Surface"])
    return result


def world_image():
    """Makes the world a turned image with a bright patch."""
    tree = bpy.context.scene.world.node_tree
    image = bpy.data.images.new("sky", 64, 32, float_buffer=True)
    image.pixels = [c for y in range(32) for x in range(64) for c in (
        0.2 + 0.3 * x / 64 + 8 * (abs(x - 40) < 3 and abs(y - 24) < 3), 0.3 + 0.4 * y / 32, 0.6 - 0.3 * x / 64, 1)]
    image.pack()
    source, mapping, place = (tree.nodes.new("ShaderNode" + k) for k in ("TexEnvironment", "Mapping", "TexCoord"))
    source.image = image
    mapping.inputs["Rotation"].default_value = (0, 0, 1.0)
    tree.links.new(place.outputs["Generated"], mapping.inputs["Vector"])
    tree.links.new(mapping.outputs[0], source.inputs["Vector"])
    tree.links.new(source.outputs["Color"], tree.nodes["Background"].inputs["Color"])
    tree.nodes["Background"].inputs["Strength"].default_value = 1


def rigid():
    """A spinning cube, a flying sphere, and a cube that scales."""
    base()
    spin(kit.shape("cube", matte((0.7, 0.3, 0.2)), (-2, 0, 1.3)), (0, 0, 0), (3, 0, 12))
    ball = kit.shape("uv_sphere", matte((0.2, 0.4, 0.7)), smooth=True, segments=64, ring_count=32)
    spin(ball, (0, 2, 1), (10, 0, 3), "location")
    spin(kit.shape("cube", matte((0.3, 0.6, 0.2)), (1.4, -1, 0.6), size=1), (1, 1, 1), (1, 6, 1), "scale")
    lamp("SUN", 1.5, (0, 0, 5), (0.5, -0.3, 0))
    return {"blur": 0.7}


def armature():
    """A tube that two bones bend."""
    base()
    tube = kit.shape("cylinder", matte((0.7, 0.4, 0.2)), (0, 0, 1.7), vertices=32, depth=3, radius=0.4)
    bpy.ops.object.select_all(action="DESELECT")
    tube.select_set(True)
    bpy.context.view_layer.objects.active = tube
    bpy.ops.object.mode_set(mode="EDIT")
    bpy.ops.mesh.select_all(action="SELECT")
    bpy.ops.mesh.subdivide(number_cuts=8)
    bpy.ops.object.mode_set(mode="OBJECT")
    rig = kit.add_object(bpy.data.armatures.new("rig"), "rig")
    bpy.context.view_layer.objects.active = rig
    bpy.ops.object.mode_set(mode="EDIT")
    lower, upper = (rig.data.edit_bones.new(n) for n in ("lower", "upper"))
    lower.head, lower.tail, upper.head, upper.tail = (0, 0, 0), (0, 0, 1.5), (0, 0, 1.5), (0, 0, 3)
    upper.parent = lower
    bpy.ops.object.mode_set(mode="OBJECT")
    for name, sign in (("lower", -1), ("upper", 1)):
        group = tube.vertex_groups.new(name=name)
        for v in tube.data.vertices:
            group.add([v.index], min(max(0.5 + sign * v.co.z, 0), 1), "REPLACE")
    tube.modifiers.new("rig", "ARMATURE").object = rig
    bone = rig.pose.bones["upper"]
    bone.rotation_mode = "XYZ"
    spin(bone, (0, 0, -2.5), (0, 0, 2.5))
    return {"blur": 0.7}


def shape_keys():
    """A sphere that becomes a cube-like body."""
    base()
    ball = kit.shape("uv_sphere", matte((0.3, 0.5, 0.7)), (0, 0, 1.3), smooth=True, segments=48, ring_count=24, radius=1.2)
    ball.shape_key_add(name="Basis")
    key = ball.shape_key_add(name="wide")
    for point in key.data:
        point.co.x *= 2.5
        point.co.z *= 0.5
    for frame, value in ((0, 0.0), (20, 5.0)):
        key.slider_max = 10
        key.value = value
        key.keyframe_insert("value", frame=frame)
    return {"blur": 0.7}


def ocean():
    """A wave modifier on a grid, above an ocean modifier."""
    base()
    grid = kit.shape("grid", matte((0.7, 0.4, 0.3)), (0, 2, 2.4), smooth=True, x_subdivisions=80, y_subdivisions=80, size=4)
    wave = grid.modifiers.new("wave", "WAVE")
    wave.height, wave.width, wave.speed, wave.narrowness, wave.time_offset = 0.6, 1.5, 0.3, 1.5, -40
    sea = kit.shape("plane", matte((0.2, 0.5, 0.6)), (0, -1, 0.4), size=1)
    waves = sea.modifiers.new("sea", "OCEAN")
    waves.geometry_mode, waves.resolution, waves.spatial_size, waves.size = "GENERATE", 6, 8, 0.6
    waves.wave_scale, waves.wind_velocity, waves.choppiness = 0.4, 8, 0.5
    for frame, time in ((0, 1.0), (20, 5.0)):
        waves.time = time
        waves.keyframe_insert("time", frame=frame)
    return {"blur": 0.8}


def particles():
    """Flying particles, which are instances of a cube, and instances of a collection."""
    base()
    cube = kit.shape("cube", matte((0.8, 0.5, 0.2)), (0, 0, -20), size=1)
    emitter = kit.shape("uv_sphere", matte((0.4, 0.4, 0.4)), (0, 0, 2), smooth=True, radius=0.4, segments=32, ring_count=16)
    system = emitter.modifiers.new("spray", "PARTICLE_SYSTEM").particle_system
    s = system.settings
    s.count, s.frame_start, s.frame_end, s.lifetime = 60, 1, 9, 100
    s.normal_factor, s.render_type, s.instance_object, s.particle_size = 6, "OBJECT", cube, 0.25
    s.use_rotations, s.angular_velocity_mode, s.angular_velocity_factor = True, "RAND", 5
    group = bpy.data.collections.new("pair")
    for x in (-0.3, 0.3):
        obj = kit.shape("uv_sphere", matte((0.2, 0.3, 0.7)), (x, 0, 0.3), smooth=True, radius=0.3, segments=32, ring_count=16)
        for old in list(obj.users_collection):
            old.objects.unlink(obj)
        group.objects.link(obj)
    for x in (-3, 3):
        empty = kit.add_object(None, "pair", (x, -1, 0))
        empty.instance_type, empty.instance_collection = "COLLECTION", group
    return {"blur": 0.5}


def camera_move():
    """A camera that turns and moves."""
    base()
    for i in range(5):
        kit.shape("cube", matte((0.2 + 0.15 * i, 0.5, 0.7 - 0.1 * i)), (-3 + 1.5 * i, 1 - 0.5 * (i % 2), 0.6), size=1.1)
    camera = bpy.context.scene.camera
    spin(camera, (-4, -8, 4), (4, -7, 3), "location")
    spin(camera, (math.radians(66), 0, -0.5), (math.radians(70), 0.2, 0.5))
    return {"blur": 1.0}


def depth_of_field():
    """A thin lens focused on the middle of three rows."""
    base()
    for i in range(9):
        x, y = i % 3, i // 3
        kit.shape("uv_sphere", matte((0.2 + 0.3 * x, 0.5, 0.8 - 0.3 * x)), (-2.4 + 2.4 * x, -3 + 3 * y, 0.7), smooth=True,
                  radius=0.6, segments=48, ring_count=24)
    lens = bpy.context.scene.camera.data
    lens.dof.use_dof, lens.dof.focus_distance, lens.dof.aperture_fstop = True, 8.2, 0.1
    return {}


NAMES = ("delta_lights", "area_lights", "nodes", "principled", "textures", "rigid", "armature", "shape_keys", "ocean",
         "particles", "camera_move", "depth_of_field")
