"""Runs in Blender. Reads one matte of an EXR file with the compositor's Cryptomatte node, and prints the sum of its coverage in
pixels.

  blender --background --factory-startup --python read_matte.py -- PICTURE.exr WIDTHxHEIGHT LAYER NAME MATTE.exr
"""
import array
import sys

import bpy

picture, size, layer, name, matte = sys.argv[sys.argv.index("--") + 1:]
image = bpy.data.images.load(picture)
scene = bpy.context.scene
scene.use_nodes = True
nodes = scene.node_tree.nodes
nodes.clear()
cryptomatte = nodes.new("CompositorNodeCryptomatteV2")
cryptomatte.source = "IMAGE"
cryptomatte.image = image
cryptomatte.layer_name = layer
cryptomatte.matte_id = name
output = nodes.new("CompositorNodeComposite")
scene.node_tree.links.new(cryptomatte.outputs["Matte"], output.inputs["Image"])

width, height = map(int, size.split("x"))  # Blender knows it only after it has read the layers
scene.render.resolution_x, scene.render.resolution_y, scene.render.resolution_percentage = width, height, 100
scene.render.image_settings.file_format = "OPEN_EXR"
scene.render.image_settings.color_depth = "32"
scene.render.filepath = matte
bpy.ops.render.render(write_still=True)

result = bpy.data.images.load(matte)
values = array.array("f", [0]) * len(result.pixels)
result.pixels.foreach_get(values)
print("matte", name, sum(values[0::4]))
