"""Export of an evaluated scene, with its motion over the shutter, to a scene file and PLY files."""
import os

import numpy as np

from . import export_camera, export_light, export_world, motion, scene_text
from .export_material import Materials
from .mesh_data import MeshData

MESHES = {"MESH", "CURVE", "SURFACE", "FONT", "META"}
UNSUPPORTED = {"VOLUME", "CURVES", "HAIR", "GPENCIL", "POINTCLOUD"}


class Item:
    """An object or instance of the scene: a mesh or a light."""

    def __init__(self, key, name, mesh=None, light=None):
        """`mesh`: key of Exporter.meshes. `light`: lines after the transform."""
        self.key, self.name, self.mesh, self.light = key, name, mesh, light

    def is_object(self):
        """Returns whether the item is an object of its own and no instance."""
        return len(self.key) == 1


class SharedMesh:
    """A mesh with materials, and the item whose motion is that of its vertices, if it deforms."""

    def __init__(self, name, data, materials, deforms_as, group):
        """`deforms_as`: key of an item, or None. `group`: light group of emission."""
        self.name, self.data, self.materials, self.deforms_as, self.group = name, data, materials, deforms_as, group


def instance_key(instance):
    """Returns the key of an instance of the depsgraph, which is the same at all times."""
    if not instance.is_instance:
        return (instance.object.name,)
    return instance.object.name, instance.parent.name if instance.parent else "", tuple(instance.persistent_id)


def evaluated_mesh(obj):
    """Returns (mesh, function that frees it) of an evaluated object. The mesh is None if it has no faces."""
    if obj.type == "MESH":
        return obj.data, lambda: None
    mesh = obj.to_mesh()
    return mesh, obj.to_mesh_clear


def may_deform(obj):
    """Returns whether the vertices of an object may move in its own space."""
    original = obj.original
    keys = getattr(original.data, "shape_keys", None)
    animated = getattr(original.data, "animation_data", None)
    return bool(original.modifiers or keys or animated or original.type != "MESH")


class Exporter:
    """Exports a depsgraph. `evaluate(u)` moves it to a time of the shutter; `stop()` raises if the user cancels."""

    def __init__(self, depsgraph, folder, messages, evaluate, stop, names_objects=False):
        """`folder` receives the files. `names_objects`: objects that share a mesh keep their names, and become meshes."""
        self.names_objects = names_objects
        self.depsgraph, self.folder, self.messages = depsgraph, folder, messages
        self.evaluate, self.stop = evaluate, stop
        self.materials = Materials(folder, messages)
        self.items, self.meshes, self.radii = [], {}, {}
        self.frame_files = set()  # names of files that other frames do not use
        self.base, self.current_time, self.camera = motion.Snapshot(), 0.0, None

    def visible(self):
        """Yields the visible instances."""
        for instance in self.depsgraph.object_instances:
            self.stop()
            if instance.show_self:
                yield instance

    def read(self, time):
        """Reads all data at the current time."""
        self.current_time = time
        scene = self.depsgraph.scene
        camera = scene.camera.evaluated_get(self.depsgraph)
        self.camera = export_camera.CameraData(camera, scene.render, self.messages)
        self.pixel_size = export_camera.pixel_size(camera, scene.render)
        for instance in self.visible():
            try:
                self._read_instance(instance)
            except (AttributeError, RuntimeError, TypeError, KeyError, IndexError) as error:
                raise ValueError(f"{instance.object.name}: cannot be exported: {error!r}") from error
        self.base.matrices["camera", 0] = export_camera.camera_matrix(camera)

    def _read_instance(self, instance):
        """Reads a mesh or a light."""
        obj = instance.object
        if obj.type in UNSUPPORTED:
            self.messages.add(obj.name, f"objects of type {obj.type} are not exported")
        if obj.type == "MESH" and not instance.is_instance:
            self._say_unsupported(obj)
        if obj.type == "LIGHT":
            self._read_light(instance)
        if obj.type not in MESHES:
            return
        key = instance_key(instance)
        materials = [slot.material for slot in obj.material_slots] or list(getattr(obj.data, "materials", []))
        shared = (obj.data.as_pointer() if obj.type == "MESH" else (obj.original.data.name, obj.original.name)), tuple(
            m.name if m else "" for m in materials), getattr(obj, "lightgroup", "")
        if shared not in self.meshes and not self._read_mesh(obj, key, shared, materials):
            return
        self.items.append(Item(key, obj.name, mesh=shared))
        self.base.matrices[key] = instance.matrix_world.copy()
        self.radii[key] = self.meshes[shared].radius

    def _read_mesh(self, obj, key, shared, materials):
        """Reads the mesh of an evaluated object. Returns whether it has faces."""
        mesh, free = evaluated_mesh(obj)
        if mesh is None or not len(mesh.polygons):
            free()
            return False
        data = MeshData(mesh)
        free()
        self.meshes[shared] = found = SharedMesh(obj.name, data, materials, key if may_deform(obj) else None, shared[2])
        found.radius = float(np.sqrt((data.points.astype(np.float64) ** 2).sum(1).max()))
        return True

    def _say_unsupported(self, obj):
        """Reports settings of an object that strobe does not have."""
        if obj.is_holdout or obj.is_shadow_catcher:
            self.messages.add(obj.name, "holdout and shadow catcher are ignored")
        if not (obj.visible_camera and obj.visible_diffuse and obj.visible_glossy and obj.visible_shadow):
            self.messages.add(obj.name, "ray visibility is ignored")
        if any(s.settings.render_type == "PATH" and s.settings.type == "HAIR" for s in obj.particle_systems):
            self.messages.add(obj.name, "hair is not exported")

    def _read_light(self, instance):
        """Reads a light."""
        obj, key = instance.object, instance_key(instance)
        matrix = instance.matrix_world.copy()
        self.items.append(Item(key, obj.name, light=export_light.lines(obj, matrix, self.folder, self.messages)))
        self.base.matrices[key] = matrix

    def snapshot_at(self, time):
        """Returns what moves at a time of the shutter."""
        if time != self.current_time:
            self.evaluate(time)
            self.current_time = time
        shot, wanted = motion.Snapshot(), {m.deforms_as: m for m in self.meshes.values() if m.deforms_as}
        for instance in self.visible():
            key = instance_key(instance)
            if key not in self.base.matrices:
                continue
            shot.matrices[key] = instance.matrix_world.copy()
            if key in wanted:
                shot.meshes[key] = self._mesh_key(instance.object, wanted[key])
        camera = self.depsgraph.scene.camera.evaluated_get(self.depsgraph)
        shot.matrices["camera", 0] = export_camera.camera_matrix(camera)
        return shot

    def _mesh_key(self, obj, shared):
        """Returns (positions, normals) of a deforming mesh, or None if its topology differs."""
        mesh, free = evaluated_mesh(obj)
        found = shared.data.key(mesh) if mesh is not None else None
        free()
        if found is None:
            self.messages.add(obj.name, "the number of vertices changes in the shutter: the mesh does not deform")
        return found

    def write(self, path, levels, head):
        """Writes the scene file. `levels`: see motion.collect, None without motion blur; `head`: lines before the camera."""
        if levels is None:
            shots = {0.0: self.base}
        else:
            shots = motion.collect(self.snapshot_at, levels, self.radii, lambda place: 0.1 * self.pixel_size(place))
        self.times = sorted(shots)
        self.shots = [shots[t] for t in self.times]
        lines = [scene_text.directive("TransformTimes") + " " + " ".join(map(scene_text.number, self.times))] * (len(shots) > 1)
        lines += head + self.camera.lines(self.matrices(("camera", 0))) + ["WorldBegin"]
        world = export_world.lines(self.depsgraph.scene.world, self.folder, self.messages)
        if world:
            lines += ["# item: " + self.depsgraph.scene.world.name, "AttributeBegin", *world, "AttributeEnd"]
        shapes = self._item_lines()
        lines += self.materials.lines + shapes
        with open(path + ".tmp", "w", encoding="utf-8") as file:
            file.write("\n".join(lines) + "\n")
        os.replace(path + ".tmp", path)
        return lines

    def matrices(self, key):
        """Returns one matrix of an item, or one per key if it moves."""
        found = [shot.matrices.get(key, self.base.matrices[key]) for shot in self.shots]
        return found if motion.moves(found) else found[:1]

    def _item_lines(self):
        """Returns the lines of all items. Meshes with several items are objects with instances."""
        users = {}
        for item in self.items:
            if item.mesh and not (self.names_objects and item.is_object()):
                users.setdefault(item.mesh, []).append(item)
        bodies = {item.mesh: self._shape_lines(self.meshes[item.mesh]) for item in self.items if item.mesh}
        objects, lines = {}, []
        for key, items in users.items():
            if len(items) > 1 and not any(line.startswith("AreaLight") for line in bodies[key]):
                objects[key] = self._object_name(self.meshes[key].name, objects)
                shapes = [line.replace(self._name_parameter(self.meshes[key].name), "") for line in bodies[key]]
                lines += ["# item: " + self.meshes[key].name, scene_text.directive("ObjectBegin", objects[key]), *shapes,
                          "ObjectEnd"]
        for item in self.items:
            lines += ["# item: " + item.name, "AttributeBegin", *scene_text.transform(self.matrices(item.key))]
            lines += item.light or self._mesh_lines(item, objects, bodies)
            lines.append("AttributeEnd")
        return lines

    def _mesh_lines(self, item, objects, bodies):
        """Returns the lines of a mesh after its transform."""
        if item.mesh in objects and not (self.names_objects and item.is_object()):
            return [scene_text.directive("ObjectInstance", objects[item.mesh])]
        own, shared = self._name_parameter(item.name), self._name_parameter(self.meshes[item.mesh].name)
        return [line.replace(shared, own) for line in bodies[item.mesh]]

    def _name_parameter(self, name):
        """Returns the parameter that names a shape."""
        return " " + scene_text.parameter("string", "name", name)

    def _object_name(self, name, objects):
        """Returns the name of an object: that of the mesh, and a number if another object has it."""
        taken = set(objects.values())
        return next(n for n in [name, *(f"{name}@{i}" for i in range(2, len(taken) + 3))] if n not in taken)

    def _shape_lines(self, shared):
        """Returns the lines of the shapes of a mesh: one per material."""
        keys = self._deformation(shared)
        lines = []
        for slot in shared.data.used_slots:
            material = shared.materials[min(slot, len(shared.materials) - 1)] if shared.materials else None
            select, surface = self.materials.surface(material)
            if keys:
                files = [shared.data.write(self.folder, slot, *key) for _, key in keys]
                self.frame_files.update(files)
                shape = [("string", "filename", files), ("float", "keytimes", [t for t, _ in keys])]
            else:
                shape = [("string", "filename", shared.data.write(self.folder, slot))]
            shape.append(("string", "name", shared.name))
            lines += [select, *self._emission(surface, shared.group), self._shape(surface, shape)]
        return lines

    def _shape(self, surface, parameters):
        """Returns the line of a shape."""
        if surface.opacity is not None:
            parameters = parameters + [self.materials.textures.parameter("alpha", surface.opacity, "float")]
        return scene_text.directive("Shape", "plymesh", parameters)

    def _emission(self, surface, group):
        """Returns the line of an area light, or of none."""
        if surface.emission is None:
            return []
        value = surface.emission
        light = [("texture", "texture", value)] if isinstance(value, str) else [("rgb", "L", value)]
        return [scene_text.directive("AreaLightSource", "diffuse", light + [
            ("bool", "twosided", True)] + export_light.group_parameters(group))]

    def _deformation(self, shared):
        """Returns [(time, (positions, normals))] of a deforming mesh, as few as reproduce it, or [] if it is static."""
        if len(self.shots) < 2 or shared.deforms_as is None:
            return []
        keys = [shot.meshes.get(shared.deforms_as) for shot in self.shots]
        if any(key is None for key in keys) or all(np.array_equal(keys[0][0], key[0]) for key in keys[1:]):
            return []
        return list(zip(self.times, keys))
