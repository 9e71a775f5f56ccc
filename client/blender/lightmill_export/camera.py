"""Cameras, and the film.

A document's camera is a thin lens in perspective. A notice names what differs: orthographic and panoramic cameras, and the
shape of the aperture.
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
        notices.here(f"pixels are square here, and not {render.pixel_aspect_x:g}:{render.pixel_aspect_y:g}")
    if render.use_border:
        notices.here("the render region is left out: all of the picture is rendered")
    if render.film_transparent:
        notices.here("the transparent film is left out: the picture shows the world")
    if scene.cycles.film_exposure != 1:
        notices.here(f"the exposure {scene.cycles.film_exposure:g} is left out")
    if scene.render.use_motion_blur:
        notices.here("motion blur is left out")
    return {"width": width, "height": height, "filter": pixel_filter(scene.cycles)}


def pixel_filter(cycles):
    """Cycles' width is that of the support. Its Gaussian has a standard deviation of width/12; ours of radius/3."""
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
        notices.here(f"it is orthographic: the picture is in perspective, from {FAR} times its width away, and shows what is "
                     "behind the camera")
        eye = eye - forward * distance
        fov = 2 * math.atan(height / 2 / distance)
        focus, lens_radius = distance + focus_distance(camera, world_matrix), 0.0
        if data.dof.use_dof:
            notices.here("its depth of field is left out")
    else:
        if data.type != "PERSP":
            notices.here("it is panoramic: the picture is in perspective")
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
    """Along the view."""
    dof = camera.data.dof
    if dof.focus_object is None:
        return dof.focus_distance
    target = dof.focus_object.matrix_world.translation
    if dof.focus_subtarget and dof.focus_object.type == "ARMATURE":
        target = (dof.focus_object.matrix_world @ dof.focus_object.pose.bones[dof.focus_subtarget].matrix).translation
    return abs((target - world_matrix.translation).dot(Vector(world_matrix.col[2][:3]).normalized()))


def aperture(data, notices):
    """Cycles' lenses are in millimetres, its scenes in metres."""
    dof = data.dof
    if dof.aperture_blades >= 3:
        notices.here(f"its aperture is round here, and has not {dof.aperture_blades} blades")
    if dof.aperture_ratio != 1:
        notices.here(f"its aperture is round here: the ratio {dof.aperture_ratio:g} is left out")
    return data.lens * 1e-3 / (2 * dof.aperture_fstop)
