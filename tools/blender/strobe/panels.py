"""Panels of the render, output, view layer and material properties."""
import bpy

from . import preferences, program, properties


class StrobePanel:
    """A panel that is visible with this engine."""
    bl_space_type = "PROPERTIES"
    bl_region_type = "WINDOW"
    bl_context = "render"
    COMPAT_ENGINES = {"STROBE"}

    @classmethod
    def poll(cls, context):
        """Returns whether strobe is the engine of the scene."""
        return context.engine in cls.COMPAT_ENGINES


class RENDER_PT_strobe_sampling(StrobePanel, bpy.types.Panel):
    """Integrator, shader and samples."""
    bl_label = "Sampling"

    def draw(self, context):
        """Shows the settings; and an error if the program is missing or too old."""
        layout, settings = self.layout, context.scene.strobe
        layout.use_property_split, layout.use_property_decorate = True, False
        try:
            preferences.program_path()
        except program.ProgramError as error:
            layout.label(text=str(error), icon="ERROR")
        layout.prop(settings, "integrator")
        self._parameters(layout, settings, "Integrator")
        for name in ("samples", "time_limit", "noise_target"):
            layout.prop(settings, name)
        layout.separator()
        layout.prop(settings, "shader")
        self._parameters(layout, settings, "Shader")
        for name in ("clamp", "seed", "threads"):
            layout.prop(settings, name)

    def _parameters(self, layout, settings, wanted):
        """Shows the parameters of the selected plugin."""
        column = layout.column()
        for kind, name, _ in properties.parameters(settings):
            if kind == wanted:
                column.prop(settings, name)


class RENDER_PT_strobe_film(StrobePanel, bpy.types.Panel):
    """Film and filter."""
    bl_label = "Film"

    def draw(self, context):
        """Shows the settings."""
        layout, scene = self.layout, context.scene
        layout.use_property_split, layout.use_property_decorate = True, False
        layout.prop(scene.render, "film_transparent")
        layout.prop(scene.strobe, "filter")
        layout.prop(scene.render, "filter_size")


class RENDER_PT_strobe_motion(StrobePanel, bpy.types.Panel):
    """Motion blur, with Blender's own settings."""
    bl_label = "Motion Blur"

    def draw_header(self, context):
        """Shows the switch."""
        self.layout.prop(context.scene.render, "use_motion_blur", text="")

    def draw(self, context):
        """Shows the settings."""
        layout, scene = self.layout, context.scene
        layout.use_property_split, layout.use_property_decorate = True, False
        layout.active = scene.render.use_motion_blur
        if hasattr(scene.render, "motion_blur_position"):
            layout.prop(scene.render, "motion_blur_position", text="Position")
        elif hasattr(scene, "cycles"):
            layout.prop(scene.cycles, "motion_blur_position", text="Position")
        layout.prop(scene.render, "motion_blur_shutter")
        layout.prop(scene.strobe, "motion_levels")


class VIEWLAYER_PT_strobe_passes(StrobePanel, bpy.types.Panel):
    """Passes."""
    bl_label = "Passes"
    bl_context = "view_layer"

    def draw(self, context):
        """Shows the switches of the passes."""
        layout, layer, settings = self.layout, context.view_layer, context.scene.strobe
        layout.use_property_split, layout.use_property_decorate = True, False
        for name in ("z", "position", "normal", "vector"):
            layout.prop(layer, "use_pass_" + name)
        for name in ("use_albedo", "use_light", "use_statistics", "use_light_groups"):
            layout.prop(settings, name)
        for name in ("use_pass_cryptomatte_object", "use_pass_cryptomatte_material", "pass_cryptomatte_depth"):
            layout.prop(layer, name)


PANELS = (RENDER_PT_strobe_sampling, RENDER_PT_strobe_film, RENDER_PT_strobe_motion, VIEWLAYER_PT_strobe_passes)
EXCLUDED = {"VIEWLAYER_PT_filter", "VIEWLAYER_PT_layer_passes"}


def shared_panels():
    """Returns Blender's panels that work with any engine: output, camera, materials, lights, world, color management."""
    found = []
    for panel in bpy.types.Panel.__subclasses__():
        engines = getattr(panel, "COMPAT_ENGINES", ())
        if "BLENDER_RENDER" in engines and panel.__name__ not in EXCLUDED:
            found.append(panel)
        elif "BLENDER_EEVEE" in engines and panel.__name__.startswith((
                "EEVEE_MATERIAL_PT_context", "EEVEE_MATERIAL_PT_surface", "EEVEE_WORLD_PT_surface", "DATA_PT_EEVEE_light")):
            found.append(panel)
    return found


def register():
    """Adds the panels, and the engine to Blender's."""
    for panel in PANELS:
        bpy.utils.register_class(panel)
    for panel in shared_panels():
        panel.COMPAT_ENGINES.add("STROBE")


def unregister():
    """Removes the panels."""
    for panel in shared_panels():
        panel.COMPAT_ENGINES.discard("STROBE")
    for panel in reversed(PANELS):
        bpy.utils.unregister_class(panel)
