"""Runs in Blender. Renders the open file by Cycles, as it is but for size and samples, without clamping:

  blender --background --factory-startup --disable-autoexec FILE --python cycles_beside.py -- STEM WIDTHxHEIGHT SAMPLES

Writes STEM.exr, and STEM.png with the plain sRGB curve.
"""
import sys

import bpy

stem, size, samples = sys.argv[sys.argv.index("--") + 1:]
scene = bpy.context.scene
if scene.camera is None:
    sys.exit("the file has no camera")
scene.render.engine = "CYCLES"
scene.cycles.device = "CPU"
scene.cycles.samples = int(samples)
scene.cycles.use_adaptive_sampling = scene.cycles.use_denoising = False
scene.cycles.sample_clamp_indirect = scene.cycles.sample_clamp_direct = 0
scene.render.resolution_x, scene.render.resolution_y = map(int, size.split("x"))
scene.render.resolution_percentage = 100
scene.render.use_border = scene.use_nodes = scene.render.use_sequencer = False
scene.view_settings.view_transform, scene.view_settings.look = "Standard", "None"
scene.view_settings.exposure, scene.view_settings.gamma = 0, 1
image = scene.render.image_settings
image.file_format, image.color_depth, image.color_mode = "OPEN_EXR", "32", "RGB"
scene.render.filepath = f"{stem}.exr"
bpy.ops.render.render(write_still=True)
image.file_format, image.color_depth = "PNG", "8"
bpy.data.images["Render Result"].save_render(f"{stem}.png", scene=scene)
