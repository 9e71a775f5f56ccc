"""Cameras, and the film.

A document's camera is a thin lens in perspective. Notices name the differences of orthographic and panoramic cameras, and
of the aperture's shape.
"""
import math

from mathutils import Vector

from . import space

FAR = 1000  # times the width of an orthographic view


def film(scene, notices):
    render = scene.render
    notices.about = "film"
    percent = render.resolution_percentage / 100
    width, height = max(1, int(render.resolution_x * percent)), max(1, int(render.resolution_y * percent))
    if render.pixel_aspect_x != render.pixel_aspect_y:
        notices.here(f"left out: the pixel aspect {render.pixel_aspect_x:g}:{render.pixel_aspect_y:g}. Pixels are square")
    if render.use_border:
        notices.here("left out: the render region. The whole picture is rendered")
    if render.film_transparent:
        notices.here("left out: the transparent film. The picture shows the world")
    if scene.cycles.film_exposure != 1:
        notices.here(f"left out: the exposure {scene.cycles.film_exposure:g}")
    if scene.render.use_motion_blur:
        notices.here("left out: motion blur")
    return {"width": width, "height": height, "filter": pixel_filter(scene.cycles)}


def pixel_filter(cycles):
    """Cycles' width is that of the support. Its Gaussian has the standard deviation width/12, and ours radius/3."""
    if cycles.pixel_filter_type == "BOX":
        return {"kind": "BOX"}
    width = cycles.filter_width
    if cycles.pixel_filter_type == "GAUSSIAN":
        return {"kind": "GAUSSIAN", "radius_pixels": width / 4}
    return {"kind": "BLACKMAN_HARRIS", "radius_pixels": width / 2}


def export(camera, world_matrix, scene, notices):
    """A camera object as a document's camera."""
    data = camera.data
    notices.about = f"camera {camera.name}"
    right, up, back, eye = space.axes(world_matrix)
    forward = -back.normalized()
    render = scene.render
    aspect = (render.resolution_x * render.pixel_aspect_x) / (render.resolution_y * render.pixel_aspect_y)
    fit = data.sensor_fit if data.sensor_fit != "AUTO" else ("HORIZONTAL" if aspect >= 1 else "VERTICAL")
    sensor = data.sensor_height if data.sensor_fit == "VERTICAL" else data.sensor_width
    wide = fit == "HORIZONTAL"
    if data.type == "ORTHO":
        height = data.ortho_scale / (aspect if wide else 1)
        distance = FAR * data.ortho_scale
        notices.here(f"it is orthographic, and is replaced by a perspective camera {FAR} times its width away. The picture also "
                     "shows objects behind the original camera")
        eye = eye - forward * distance
        fov = 2 * math.atan(height / 2 / distance)
        focus, lens_radius = distance + focus_distance(camera, world_matrix), 0.0
        if data.dof.use_dof:
            notices.here("left out: its depth of field")
    else:
        if data.type != "PERSP":
            notices.here("it is panoramic, and is replaced by a perspective camera")
        half = sensor / 2 / data.lens / (aspect if wide else 1)
        fov = 2 * math.atan(half)
        focus = focus_distance(camera, world_matrix)
        lens_radius = aperture(data, notices) if data.dof.use_dof else 0.0
    out = {"eye": space.vector(eye), "look_at": space.vector(eye + forward * max(focus, 1e-3)),
           "up": space.vector(up.normalized()), "vertical_fov_degrees": math.degrees(fov)}
    per_height = aspect if wide else 1  # Blender's shifts are in widths of the film, or in heights
    if data.shift_x or data.shift_y:
        out["shift_x"], out["shift_y"] = data.shift_x * per_height, data.shift_y * per_height
    if lens_radius > 0:
        out["lens_radius"], out["focus_distance"] = lens_radius, focus
    return out


def focus_distance(camera, world_matrix):
    """Distance in focus along the view, in scene units."""
    dof = camera.data.dof
    if dof.focus_object is None:
        return dof.focus_distance
    target = dof.focus_object.matrix_world.translation
    if dof.focus_subtarget and dof.focus_object.type == "ARMATURE":
        target = (dof.focus_object.matrix_world @ dof.focus_object.pose.bones[dof.focus_subtarget].matrix).translation
    return abs((target - world_matrix.translation).dot(Vector(world_matrix.col[2][:3]).normalized()))


def aperture(data, notices):
    """Radius of the lens in scene units. Cycles' focal lengths are in millimetres, its scenes in metres."""
    dof = data.dof
    if dof.aperture_blades >= 3:
        notices.here(f"left out: the {dof.aperture_blades} blades of its aperture, which is round")
    if dof.aperture_ratio != 1:
        notices.here(f"left out: the ratio {dof.aperture_ratio:g} of its aperture, which is round")
    return data.lens * 1e-3 / (2 * dof.aperture_fstop)
