#include "client/cli/blender_script.h"

namespace lightmill::cli {

const std::string_view kBlenderScript = R"python(
import json
import math
import sys

import bpy

glb, report_file = sys.argv[sys.argv.index("--") + 1:]
scene = bpy.context.scene
left_out = []


def leave_out(what):
    if what not in left_out:
        left_out.append(what)


def sky_color():
    """The world's radiance where it is the same from everywhere, as Cycles takes it."""
    world = scene.world
    if world is None:
        return [0, 0, 0]
    if not world.use_nodes:
        return list(world.color)
    output = next((n for n in world.node_tree.nodes if n.type == "OUTPUT_WORLD" and n.is_active_output), None)
    if output is None or not output.inputs["Surface"].is_linked:
        return [0, 0, 0]
    if output.inputs["Volume"].is_linked:
        leave_out("the world's volume")
    node = output.inputs["Surface"].links[0].from_node
    if node.type != "BACKGROUND" or node.inputs["Strength"].is_linked:
        leave_out("the world's nodes: its sky is black")
        return [0, 0, 0]
    if node.inputs["Color"].is_linked:
        leave_out("the image or nodes that colour the world: its sky is black")
        return [0, 0, 0]
    return [node.inputs["Strength"].default_value * c for c in node.inputs["Color"].default_value[:3]]


def area_as_mesh(light):
    """A face that emits along -z what Cycles' area light of this size does."""
    data = light.data
    width = data.size
    height = data.size_y if data.shape in ("RECTANGLE", "ELLIPSE") else width
    if data.shape in ("DISK", "ELLIPSE"):
        turns = [2 * math.pi * i / 64 for i in range(64)]
        corners = [(width / 2 * math.cos(a), -height / 2 * math.sin(a), 0) for a in turns]
        area = math.pi * width * height / 4
    else:
        corners = [(-width / 2, -height / 2, 0), (-width / 2, height / 2, 0), (width / 2, height / 2, 0),
                   (width / 2, -height / 2, 0)]
        area = width * height
    # The light's scale stretches its face. Cycles keeps the power.
    scale = light.matrix_world.to_scale()
    area *= abs(scale.x * scale.y)
    mesh = bpy.data.meshes.new(light.name)
    mesh.from_pydata(corners, [], [range(len(corners))])
    material = bpy.data.materials.new(light.name)
    material.use_nodes = True
    material.use_backface_culling = True
    nodes = material.node_tree.nodes
    nodes.clear()
    emission, output = nodes.new("ShaderNodeEmission"), nodes.new("ShaderNodeOutputMaterial")
    emission.inputs["Color"].default_value = (*data.color, 1)
    emission.inputs["Strength"].default_value = data.energy / (4 * area) if area > 0 else 0
    material.node_tree.links.new(emission.outputs[0], output.inputs["Surface"])
    mesh.materials.append(material)
    stand_in = bpy.data.objects.new(light.name, mesh)
    stand_in.matrix_world = light.matrix_world
    scene.collection.objects.link(stand_in)


def shows_colors(material):
    return material.use_nodes and any(n.type in ("VERTEX_COLOR", "ATTRIBUTE") for n in material.node_tree.nodes)


def drop_unused_colors(item):
    """Blender shows colours of vertices only through nodes. In glTF they always multiply the base colour."""
    if item.type != "MESH" or item.data.library is not None:
        return
    if not any(slot.material and shows_colors(slot.material) for slot in item.material_slots):
        for name in [attribute.name for attribute in item.data.color_attributes]:
            item.data.color_attributes.remove(item.data.color_attributes[name])


def look_at_object(item):
    if item.hide_render:
        return
    drop_unused_colors(item)
    if item.type == "LIGHT" and item.data.type == "AREA":
        area_as_mesh(item)
    elif item.type == "LIGHT":
        if item.data.use_nodes:
            leave_out(f"the nodes of light {item.name}")
        if (item.data.angle if item.data.type == "SUN" else item.data.shadow_soft_size) > 0:
            leave_out(f"the size of light {item.name}: its shadows are sharp")
    elif item.type in ("META", "VOLUME", "GPENCIL", "POINTCLOUD", "CURVES"):
        leave_out(f"object {item.name} ({item.type.lower()})")
    elif item.type == "CAMERA" and item == scene.camera and item.data.dof.use_dof:
        leave_out("depth of field")
    if any(modifier.type == "PARTICLE_SYSTEM" for modifier in item.modifiers):
        leave_out(f"particles and hair of {item.name}")


def look_at_material(material):
    if not material.use_nodes:
        return
    output = next((n for n in material.node_tree.nodes if n.type == "OUTPUT_MATERIAL" and n.is_active_output), None)
    if output is None or not output.inputs["Surface"].is_linked:
        return
    kind = output.inputs["Surface"].links[0].from_node.type
    if kind not in ("BSDF_PRINCIPLED", "EMISSION", "BACKGROUND"):
        leave_out(f"the shader of material {material.name} ({kind.lower()}, not a principled one)")
    if output.inputs["Volume"].is_linked:
        leave_out(f"the volume of material {material.name}")
    if output.inputs["Displacement"].is_linked:
        leave_out(f"the displacement of material {material.name}")


for item in list(scene.objects):
    look_at_object(item)
for material in {slot.material for item in scene.objects for slot in item.material_slots if slot.material}:
    look_at_material(material)
if scene.use_nodes:
    leave_out("compositing")
bpy.context.view_layer.update()

bpy.ops.export_scene.gltf(filepath=glb, export_format="GLB", export_cameras=True, export_lights=True, export_apply=True,
                          export_animations=False, use_renderable=True, use_active_scene=True)
percent = scene.render.resolution_percentage / 100
with open(report_file, "w", encoding="utf-8") as file:
    json.dump({"width": max(1, round(scene.render.resolution_x * percent)),
               "height": max(1, round(scene.render.resolution_y * percent)),
               "camera": scene.camera.name if scene.camera else "",
               "sky": sky_color(),
               "left_out": sorted(left_out)}, file)
)python";

}  // namespace lightmill::cli
