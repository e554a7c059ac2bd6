"""Camera: lens, depth of field and motion."""
import math

from mathutils import Matrix

from . import scene_text

FLIP = Matrix.Diagonal((1, 1, -1, 1))  # Blender's cameras look along -z


def screen_window(camera, render, scale=1.0):
    """Returns the bounds x0 x1 y0 y1 of the image on the plane at distance 1 (perspective) or in units of the scene."""
    data = camera.data
    aspect = (render.pixel_aspect_x * render.resolution_x) / (render.pixel_aspect_y * render.resolution_y)
    fit = data.sensor_fit
    horizontal = fit == "HORIZONTAL" or (fit == "AUTO" and aspect >= 1)
    if data.type == "ORTHO":
        size = data.ortho_scale
    else:
        sensor = data.sensor_height if fit == "VERTICAL" else data.sensor_width
        size = sensor / data.lens
    half = (size / 2, size / 2 / aspect) if horizontal else (size / 2 * aspect, size / 2)
    shift_x, shift_y = data.shift_x * size, data.shift_y * size
    return [scale * v for v in (shift_x - half[0], shift_x + half[0], shift_y - half[1], shift_y + half[1])]


def focus_distance(camera):
    """Returns the distance of the plane of focus along the axis."""
    target = camera.data.dof.focus_object
    if not target:
        return camera.data.dof.focus_distance
    place = camera.matrix_world.normalized().inverted() @ target.matrix_world.translation
    return max(abs(place.z), 1e-4)


def lens_parameters(camera, messages):
    """Returns the parameters of the thin lens."""
    dof = camera.data.dof
    if not dof.use_dof:
        return []
    focal = 1.0 if camera.data.type == "ORTHO" else camera.data.lens * 1e-3
    if dof.aperture_blades or dof.aperture_ratio != 1:
        messages.add(camera.name, "the aperture is a disk: blades and ratio are ignored")
    return [("float", "lensradius", focal / (2 * dof.aperture_fstop)), ("float", "focaldistance", focus_distance(camera))]


def camera_matrix(camera):
    """Returns the camera-to-world matrix without scale."""
    return camera.matrix_world.normalized()


PANORAMA = Matrix(((0, 0, 1, 0), (-1, 0, 0, 0), (0, 1, 0, 0), (0, 0, 0, 1)))


class CameraData:
    """A camera at one time: its directive, and the transform of its space."""

    def __init__(self, camera, render, messages):
        """Reads an evaluated camera."""
        self.space = FLIP
        if camera.data.type == "PANO":
            messages.add(camera.name, "panoramic cameras are exported as latitude-longitude images")
            self.space, self.directive = FLIP @ PANORAMA, scene_text.directive("Camera", "environment")
            return
        parameters = [("float", "screenwindow", screen_window(camera, render))]
        parameters += lens_parameters(camera, messages)
        if camera.data.type == "ORTHO":
            self.directive = scene_text.directive("Camera", "orthographic", parameters)
        else:
            self.directive = scene_text.directive("Camera", "perspective", parameters + [("float", "fov", 90.0)])

    def lines(self, matrices):
        """Returns the lines with one camera-to-world matrix, or one per key."""
        return scene_text.transform([(m @ self.space).inverted() for m in matrices]) + [self.directive]


def pixel_size(camera, render):
    """Returns a function of a position: the edge of a pixel there."""
    x0, x1, _, _ = screen_window(camera, render)
    width = (x1 - x0) / max(render.resolution_x * render.resolution_percentage / 100, 1)
    eye = camera_matrix(camera).translation
    if camera.data.type == "ORTHO":
        return lambda place: width
    return lambda place: width * max(math.dist(place, eye), camera.data.clip_start)
