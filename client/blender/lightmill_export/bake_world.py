"""Image of a world that only Cycles can compute, such as a Sky Texture.

Runs before the export, which then finds an environment texture instead.
"""
import math
import os
import tempfile

import bpy

from .bake import BakeScene, depends_on_ray, sources_of
from .nodes import output_of
from .notices import Notices
from .world import orientation, read_radiance

SAMPLES = 16  # a pixel, for the sun's edge
# Notices that an image makes unnecessary.
LOST = ("is replaced by a uniform grey", "is replaced by its mean colour", "is replaced by white")


def bake_world(size, notices):
    """Replaces the active scene's world by an image of 2 size × size texels, if the export would lose its variation."""
    scene = bpy.context.scene
    if scene.world is None or not needs_image(scene.world):
        return
    image = panorama(scene.world, size)
    notices.about = f"world {scene.world.name}"
    notices.here(f"it is baked into an image of {2 * size} × {size} texels")
    scene.world = showing(scene.world, image)


def needs_image(world):
    end = output_of(world.node_tree) if world.use_nodes and world.node_tree is not None else None
    if end is None or not end.inputs["Surface"].is_linked:
        return False
    notices = Notices()
    radiance, _node = read_radiance(world, notices)
    turned = radiance.image is not None and orientation(radiance.image.place) is None
    lost = turned or any(part in text for part in LOST for text in notices.texts)
    return lost and not any(depends_on_ray(node, output) for node, output in sources_of(end.inputs["Surface"]))


def panorama(world, size):
    """The world in all directions, in the projection of environment textures."""
    lens = bpy.data.cameras.new("bake")
    lens.type = "PANO"
    (lens if hasattr(lens, "panorama_type") else lens.cycles).panorama_type = "EQUIRECTANGULAR"  # the first since Blender 4.0
    camera = bpy.data.objects.new("bake", lens)
    camera.rotation_euler = math.pi / 2, 0, -math.pi / 2
    try:
        with BakeScene() as studio, tempfile.TemporaryDirectory() as folder:
            scene = studio.scene
            scene.collection.objects.link(camera)
            scene.camera, scene.world = camera, world
            scene.cycles.samples, scene.cycles.use_adaptive_sampling, scene.cycles.pixel_filter_type = SAMPLES, False, "BOX"
            render = scene.render
            render.resolution_x, render.resolution_y, render.resolution_percentage = 2 * size, size, 100
            render.image_settings.file_format, render.image_settings.color_depth = "OPEN_EXR", "32"
            render.filepath = os.path.join(folder, "world.exr")
            bpy.ops.render.render(write_still=True)
            image = bpy.data.images.load(render.filepath)
            image.pack()
            return image
    finally:
        bpy.data.cameras.remove(lens)


def showing(world, image):
    """A copy of the world that shows an image instead."""
    copy = world.copy()
    copy.name = f"{world.name} baked"
    tree = copy.node_tree
    tree.nodes.clear()
    texture, background = tree.nodes.new("ShaderNodeTexEnvironment"), tree.nodes.new("ShaderNodeBackground")
    texture.image = image
    tree.links.new(texture.outputs[0], background.inputs["Color"])
    tree.links.new(background.outputs[0], tree.nodes.new("ShaderNodeOutputWorld").inputs["Surface"])
    return copy
