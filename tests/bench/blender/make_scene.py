"""Runs in Blender. Builds a scene that glTF can carry, saves it, and renders it with Cycles.

  blender --background --factory-startup --python make_scene.py -- SCENE.blend PICTURE.exr SAMPLES
"""
import math
import sys

import bpy

blend, picture, samples = sys.argv[sys.argv.index("--") + 1:]
bpy.ops.wm.read_factory_settings(use_empty=True)
scene = bpy.context.scene


def material(name, **inputs):
    made = bpy.data.materials.new(name)
    made.use_nodes = True
    shader = made.node_tree.nodes["Principled BSDF"]
    for key, value in inputs.items():
        shader.inputs[key.replace("_", " ")].default_value = value
    return made


def add(operator, surface, smooth=False, **where):
    operator(**where)
    bpy.context.object.data.materials.append(surface)
    if smooth:
        bpy.ops.object.shade_smooth()
    return bpy.context.object


add(bpy.ops.mesh.primitive_plane_add, material("floor", Base_Color=(0.6, 0.6, 0.6, 1), Roughness=0.9), size=20)
add(bpy.ops.mesh.primitive_cube_add, material("plastic", Base_Color=(0.7, 0.1, 0.05, 1), Roughness=0.3), size=1.5,
    location=(-2, 0.5, 0.75), rotation=(0, 0, math.radians(30)))
add(bpy.ops.mesh.primitive_uv_sphere_add, material("metal", Base_Color=(0.9, 0.7, 0.3, 1), Metallic=1, Roughness=0.25),
    smooth=True, segments=128, ring_count=64, radius=0.9, location=(0.2, 0, 0.9))
add(bpy.ops.mesh.primitive_uv_sphere_add, material("matt", Base_Color=(0.1, 0.3, 0.7, 1), Roughness=1, Specular=0),
    smooth=True, segments=128, ring_count=64, radius=0.6, location=(1.8, -0.8, 0.6))
monkey = add(bpy.ops.mesh.primitive_monkey_add,
             material("coated", Base_Color=(0.2, 0.5, 0.2, 1), Roughness=0.6, Clearcoat=1, Clearcoat_Roughness=0.1),
             smooth=True, size=1.2, location=(2, 1.5, 0.8))
monkey.modifiers.new("subdivision", "SUBSURF").render_levels = 2
monkey.modifiers["subdivision"].levels = 2

bpy.ops.object.light_add(type="POINT", location=(-3, -3, 4))
bpy.context.object.data.energy = 400
bpy.context.object.data.shadow_soft_size = 0
bpy.ops.object.light_add(type="AREA", location=(3, -2, 4), rotation=(math.radians(35), math.radians(25), 0))
bpy.context.object.data.energy = 300
bpy.context.object.data.size = 1.5
bpy.ops.object.light_add(type="SUN", rotation=(math.radians(50), 0, math.radians(60)))
bpy.context.object.data.energy = 1
bpy.context.object.data.angle = 0
scene.world = bpy.data.worlds.new("world")
scene.world.use_nodes = True
scene.world.node_tree.nodes["Background"].inputs["Color"].default_value = (0.2, 0.3, 0.5, 1)

bpy.ops.object.camera_add(location=(0.5, -7, 3), rotation=(math.radians(70), 0, math.radians(3)))
scene.camera = bpy.context.object
scene.camera.data.lens = 35

scene.render.resolution_x, scene.render.resolution_y, scene.render.resolution_percentage = 480, 270, 100
scene.render.engine = "CYCLES"
cycles = scene.cycles
cycles.samples = int(samples)
cycles.use_adaptive_sampling = False
cycles.use_denoising = False
cycles.sample_clamp_direct = cycles.sample_clamp_indirect = cycles.blur_glossy = 0
cycles.max_bounces = cycles.diffuse_bounces = cycles.glossy_bounces = cycles.transmission_bounces = 64
cycles.pixel_filter_type = "BLACKMAN_HARRIS"
cycles.filter_width = 3  # diameter in pixels, Lightmill's default
scene.render.image_settings.file_format = "OPEN_EXR"
scene.render.image_settings.color_depth = "32"
scene.render.filepath = picture
bpy.ops.wm.save_as_mainfile(filepath=blend)
bpy.ops.render.render(write_still=True)
