"""The render engine: export of a frame, the strobe process, and the result in Blender."""
import math
import os
import time
import traceback

import bpy

from . import exr, folders, passes, preferences, process, program, properties, scene_text
from .export_scene import Exporter
from .messages import Messages

INTERVAL = 0.5  # seconds between unfinished images


class Cancelled(Exception):
    """The user cancelled the render."""


def shutter(scene):
    """Returns the times in frames, from the current frame, at which the shutter opens and closes."""
    render = scene.render
    if not render.use_motion_blur:
        return 0.0, 0.0
    if hasattr(render, "motion_blur_position"):
        position = render.motion_blur_position
    else:
        position = scene.cycles.motion_blur_position if hasattr(scene, "cycles") else "CENTER"
    length = render.motion_blur_shutter
    start = {"START": 0.0, "CENTER": -length / 2, "END": -length}[position]
    return start, start + length


def frame_size(render):
    """Returns the resolution, and the region to render as x0, x1, y0, y1 in pixels with y upwards."""
    width, height = (int(n * render.resolution_percentage / 100) for n in (render.resolution_x, render.resolution_y))
    if not render.use_border:
        return width, height, (0, width, 0, height)
    region = (int(render.border_min_x * width), int(render.border_max_x * width),
              int(render.border_min_y * height), int(render.border_max_y * height))
    return width, height, region


class StrobeRenderEngine(bpy.types.RenderEngine):
    """Renders with strobe as a separate process."""
    bl_idname = "STROBE"
    bl_label = "strobe"
    bl_use_preview = False
    bl_use_postprocess = True
    bl_use_shading_nodes_custom = False
    bl_use_eevee_viewport = True

    def update_render_passes(self, scene=None, renderlayer=None):
        """Tells the compositor which passes there are."""
        self.register_pass(scene, renderlayer, "Combined", 4, "RGBA", "COLOR")
        for found in passes.wanted(scene, renderlayer):
            self.register_pass(scene, renderlayer, found.name, len(found.channels), found.channels, found.kind)

    def render(self, depsgraph):
        """Renders the current frame of a view layer. Errors are shown, and end the render."""
        self.seconds, self.metadata = {}, {}
        try:
            self._render(depsgraph)
        except Cancelled:
            print("strobe: cancelled")
        except (program.ProgramError, process.Failed, OSError, ValueError) as error:
            self._fail(str(error))
        except Exception as error:
            traceback.print_exc()
            self._fail(f"internal error of the add-on: {error!r}")

    def _fail(self, text):
        """Shows an error."""
        text = text if text.startswith("strobe: ") else "strobe: " + text
        print(text)
        self.report({"ERROR"}, text)
        self.error_set(text)

    def _warn(self, text):
        """Shows a replaced feature."""
        print("strobe: " + text)
        self.report({"WARNING"}, "strobe: " + text)

    def _stop(self):
        """Raises Cancelled if the user cancelled the render."""
        if self.test_break():
            raise Cancelled

    def _render(self, depsgraph):
        """Renders the current frame. Raises Cancelled, ProgramError, Failed and OSError."""
        start = time.perf_counter()
        path, folder = preferences.program_path(), folders.of_session()
        if depsgraph.scene.camera is None:
            raise ValueError("the scene has no camera")
        self.update_stats("", "Exporting")
        scene_file, lines, files = self._export(depsgraph, folder)
        self.seconds["export"] = time.perf_counter() - start
        output = os.path.join(folder, f"image-{os.getpid()}.exr")
        if os.path.exists(output):
            os.remove(output)
        try:
            self._run(depsgraph, self._command(depsgraph, path, scene_file, output), output, lines)
        finally:
            folders.remove(files)
        self.seconds["all"] = time.perf_counter() - start
        print("strobe: " + ", ".join(f"{name} {value:.2f} s" for name, value in self.seconds.items()))

    def _export(self, depsgraph, folder):
        """Writes the scene. Returns the path of its file, its lines, and the files of this frame."""
        scene = depsgraph.scene
        frame = scene.frame_current + scene.frame_subframe
        opens, closes = shutter(scene)

        def evaluate(u):
            """Moves the scene to a time of the shutter."""
            self._stop()
            when = frame + opens + u * (closes - opens)
            self.frame_set(math.floor(when), subframe=when - math.floor(when))

        exporter = Exporter(depsgraph, folder, Messages(self._warn), evaluate, self._stop,
                            depsgraph.view_layer.use_pass_cryptomatte_object)
        exporter.read(-opens / (closes - opens) if closes > opens else 0.0)
        path = os.path.join(folder, f"frame-{os.getpid()}.scene")
        moving = closes > opens
        lines = exporter.write(path, scene.strobe.motion_levels if moving else None, self._head(scene))
        if moving:
            self.frame_set(math.floor(frame), subframe=frame - math.floor(frame))
        return path, lines, exporter.frame_files

    def _head(self, scene):
        """Returns the lines of the film, the sampler and the filter."""
        width, height, (x0, x1, y0, y1) = frame_size(scene.render)
        settings, radius = scene.strobe, scene.render.filter_size / 2
        if settings.filter == "box":
            radius = 0.5
        kernel = [("float", "xradius", radius), ("float", "yradius", radius)]
        if settings.filter == "gaussian":  # the variance of Blackman-Harris
            kernel.append(("float", "sigma", 0.26 * radius))
        return [scene_text.directive("Film", "image", [
                    ("integer", "xresolution", width), ("integer", "yresolution", height),
                    ("integer", "pixelbounds", [x0, x1, height - y1, height - y0])]),
                scene_text.directive("Sampler", "sobol", [("integer", "pixelsamples", settings.samples)]),
                scene_text.directive("PixelFilter", settings.filter, kernel)]

    def _command(self, depsgraph, path, scene_file, output):
        """Returns the command line of strobe."""
        scene, settings = depsgraph.scene, depsgraph.scene.strobe
        command = [path, scene_file, "-o", output, "--exr", "float,none,scanlines,single", "--integrator", settings.integrator,
                   "--shading", settings.shader, "--seed", str(settings.seed), "--threads", str(settings.threads)]
        for _, name, parameter in properties.parameters(settings):
            value = getattr(settings, name)
            if value != "":
                command += ["-D", f"{parameter}={str(value).lower() if isinstance(value, bool) else value}"]
        for option, value in (("--time-limit", settings.time_limit), ("--noise-target", settings.noise_target),
                              ("--clamp", settings.clamp)):
            if value > 0:
                command += [option, scene_text.number(value)]
        found = passes.wanted(scene, depsgraph.view_layer)
        if found:
            command += ["--aov", passes.layers(found), "--crypto-depth", str(depsgraph.view_layer.pass_cryptomatte_depth)]
        if scene.render.film_transparent:
            command.append("--transparent")
        return command if bpy.app.background else command + ["--write-interval", str(INTERVAL)]

    def _run(self, depsgraph, command, output, lines):
        """Runs strobe, and shows its images."""
        layer = depsgraph.view_layer
        found = passes.wanted(depsgraph.scene, layer)
        for item in found:
            if not item.builtin:
                self.add_pass(item.name, len(item.channels), item.channels, layer=layer.name)
        _, _, (x0, x1, y0, y1) = frame_size(depsgraph.scene.render)
        result = self.begin_result(0, 0, x1 - x0, y1 - y0, layer=layer.name)
        finished = False
        try:
            finished = self._wait(process.Process(command, output), result, found, lines)
        finally:
            self.end_result(result, cancel=not finished)
        if not finished:
            raise Cancelled
        for name, text in self.metadata.items():
            self.get_result().stamp_data_add_field(name, text)

    def _wait(self, running, result, found, lines):
        """Shows the images of a process until it ends. Returns whether the image is finished. Raises Failed."""
        start = time.perf_counter()
        self.update_stats("", "Rendering")

        def unfinished():
            """Shows the image so far."""
            self._show(result, running.output, [])
            self.update_stats("", f"Rendering, {time.perf_counter() - start:.0f} s")
            self.update_result(result)

        try:
            if not running.wait(self.test_break, unfinished):
                return False
        except process.Failed as error:
            raise process.Failed(self._located(str(error), lines)) from error
        finally:
            running.end()
        self.seconds["render"] = time.perf_counter() - start
        self._show(result, running.output, found)
        for warning in running.warnings():
            self._warn(self._located(warning, lines))
        return True

    def _located(self, message, lines):
        """Returns a message of strobe with the name of the scene's object in place of the line."""
        head, _, text = message.partition(": ")
        place = head.rsplit(":", 2)
        if len(place) == 3 and place[1].isdigit():
            item = scene_text.item_of_line(lines, int(place[1]))
            return f"{item}: {text}" if item else message
        return message

    def _show(self, result, path, found):
        """Copies the image, and the passes if it is finished."""
        try:
            image, attributes = exr.read(path)
        except (OSError, ValueError, KeyError, IndexError):
            if found:
                raise
            return
        self.update_progress(float((image["G"] != 0).mean()))
        by_name = {item.name: item for item in result.layers[0].passes}
        self._fill(by_name["Combined"], passes.combined(image))
        for item in found:
            if item.name in by_name:
                self._fill(by_name[item.name], item.convert(image))
        if found:
            self.metadata = passes.cryptomatte_attributes(attributes)

    def _fill(self, target, pixels):
        """Copies pixels to a pass."""
        target.rect.foreach_set(pixels.astype("f4", copy=False))


def register():
    """Adds the engine."""
    bpy.utils.register_class(StrobeRenderEngine)


def unregister():
    """Removes the engine."""
    bpy.utils.unregister_class(StrobeRenderEngine)
