"""Runs in Blender. Renders a scene with Cycles at several sample counts and seeds.

  blender --background --factory-startup --python cycles_render.py -- SCENE FOLDER THREADS SAMPLES,SAMPLES,... SEED,SEED,...

Writes FOLDER/cycles-SAMPLES-SEED.exr, and for each a line "PEER {json}" with the seconds of the render call alone. SCENE is a Blender
file, or the document of a Cornell box: OBJ meshes with Kd and Ka, spheres, diffuse, mirror and smooth glass, and emission on the front
only."""
import json
import math
import os
import resource
import sys
import time

import bpy
from mathutils import Matrix, Vector

source, folder, threads, sample_counts, seeds = sys.argv[sys.argv.index("--") + 1:]


def shader_of(tree, material):
    """The BSDF node for a material's reflection."""
    nodes = tree.nodes
    if "mirror" in material:
        node = nodes.new("ShaderNodeBsdfGlossy")
        node.distribution = "SHARP"
        node.inputs["Color"].default_value = (*material["mirror"].get("reflectance", {}).get("rgb", [1, 1, 1]), 1)
    elif "dielectric" in material:
        node = nodes.new("ShaderNodeBsdfGlass")
        node.distribution = "SHARP"
        node.inputs["Color"].default_value = (1, 1, 1, 1)
        node.inputs["IOR"].default_value = material["dielectric"]["ior"]
    else:
        node = nodes.new("ShaderNodeBsdfDiffuse")
        node.inputs["Color"].default_value = (*material["diffuse"]["reflectance"]["rgb"], 1)
        node.inputs["Roughness"].default_value = 0
    return node


def make_material(material):
    made = bpy.data.materials.new(material["name"])
    made.use_nodes = True
    tree = made.node_tree
    tree.nodes.clear()
    output = tree.nodes.new("ShaderNodeOutputMaterial")
    surface = shader_of(tree, material).outputs[0]
    emission = material.get("emission", {}).get("rgb", [0, 0, 0])
    strength = max(emission)
    if strength > 0:
        light = tree.nodes.new("ShaderNodeEmission")
        light.inputs["Color"].default_value = (*(value / strength for value in emission), 1)
        light.inputs["Strength"].default_value = strength
        side = tree.nodes.new("ShaderNodeNewGeometry")
        mix = tree.nodes.new("ShaderNodeMixShader")
        tree.links.new(side.outputs["Backfacing"], mix.inputs["Fac"])
        tree.links.new(light.outputs[0], mix.inputs[1])
        tree.links.new(surface, mix.inputs[2])
        surface = mix.outputs[0]
    tree.links.new(surface, output.inputs["Surface"])
    return made


def read_mtl(path, materials):
    """Materials of an MTL file, as `--mtl course` reads them. Materials of the document take precedence."""
    name = None
    with open(path, encoding="utf-8") as lines:
        for words in map(str.split, lines):
            if words[:1] == ["newmtl"]:
                name = words[1]
                found = {"name": name, "diffuse": {"reflectance": {"rgb": [0, 0, 0]}}}
                materials.setdefault(name, found)
            elif words[:1] in (["Kd"], ["Ka"]) and materials[name] is found:
                key = ("diffuse", "reflectance") if words[0] == "Kd" else ("emission",)
                at = found
                for step in key:
                    at = at.setdefault(step, {})
                at["rgb"] = [float(word) for word in words[1:4]]


def read_obj(path, materials):
    vertices, faces, used, current = [], [], [], None
    with open(path, encoding="utf-8") as lines:
        for words in map(str.split, lines):
            if words[:1] == ["mtllib"]:
                read_mtl(os.path.join(os.path.dirname(path), words[1]), materials)
            elif words[:1] == ["v"]:
                vertices.append([float(word) for word in words[1:4]])
            elif words[:1] == ["usemtl"]:
                current = words[1]
            elif words[:1] == ["f"]:
                faces.append([int(word.split("/")[0]) - 1 for word in words[1:]])
                used.append(current)
    return vertices, faces, used


class Materials:
    def __init__(self, document):
        self.documents = {material["name"]: material for material in document["materials"]}
        self.made = {}

    def named(self, name):
        if name not in self.made:
            self.made[name] = make_material(self.documents[name])
        return self.made[name]


def add_objects(scene, document):
    materials = Materials(document)
    for thing in document["objects"]:
        if "sphere" in thing:
            sphere = thing["sphere"]
            bpy.ops.mesh.primitive_uv_sphere_add(segments=512, ring_count=256, radius=sphere["radius"],
                                                 location=sphere["center"])
            bpy.ops.object.shade_smooth()
            bpy.context.object.data.materials.append(materials.named(thing["material"]))
            continue
        vertices, faces, used = read_obj(os.path.join(os.path.dirname(source), thing["mesh"]["file"]), materials.documents)
        mesh = bpy.data.meshes.new(thing["name"])
        mesh.from_pydata(vertices, [], faces)
        slots = sorted(set(used))
        for name in slots:
            mesh.materials.append(materials.named(thing.get("material", name)))
        for polygon, name in zip(mesh.polygons, used):
            polygon.material_index = slots.index(name)
        scene.collection.objects.link(bpy.data.objects.new(thing["name"], mesh))


def add_camera(scene, view):
    eye = Vector(view["eye"])
    forward = (Vector(view["look_at"]) - eye).normalized()
    right = forward.cross(Vector(view["up"])).normalized()
    up = right.cross(forward)
    camera = bpy.data.cameras.new("camera")
    camera.sensor_fit = "VERTICAL"
    camera.angle = math.radians(view["vertical_fov_degrees"])
    camera.clip_start, camera.clip_end = 1e-3, 1e6
    viewer = bpy.data.objects.new("camera", camera)
    viewer.matrix_world = Matrix.Translation(eye) @ Matrix((right, up, -forward)).transposed().to_4x4()
    scene.collection.objects.link(viewer)
    scene.camera = viewer


def build_box(path):
    """The box of a document, as Lightmill renders it."""
    with open(path, encoding="utf-8") as file:
        document = json.load(file)
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    scene.world = bpy.data.worlds.new("black")
    scene.world.color = (0, 0, 0)
    add_objects(scene, document)
    add_camera(scene, document["camera"])
    scene.render.resolution_x, scene.render.resolution_y = document["film"]["width"], document["film"]["height"]
    scene.cycles.pixel_filter_type = "BOX"  # one pixel wide, as in the boxes


if source.endswith(".blend"):
    bpy.ops.wm.open_mainfile(filepath=source, use_scripts=False)
else:
    build_box(source)
render, cycles = bpy.context.scene.render, bpy.context.scene.cycles
render.engine = "CYCLES"
render.use_border = render.use_sequencer = bpy.context.scene.use_nodes = False
render.resolution_percentage = 100
render.threads_mode, render.threads = "FIXED", int(threads)
render.image_settings.file_format, render.image_settings.color_depth = "OPEN_EXR", "32"
cycles.use_adaptive_sampling = cycles.use_denoising = False
cycles.sample_clamp_direct = cycles.sample_clamp_indirect = cycles.blur_glossy = cycles.light_sampling_threshold = 0
cycles.max_bounces = cycles.diffuse_bounces = cycles.glossy_bounces = cycles.transmission_bounces = cycles.volume_bounces = 1024
cycles.transparent_max_bounces = 1024


def cpu_seconds():
    usage = resource.getrusage(resource.RUSAGE_SELF)
    return usage.ru_utime + usage.ru_stime


cycles.samples = 1
bpy.ops.render.render()  # loads everything that is loaded only once
for samples in map(int, sample_counts.split(",")):
    for seed in map(int, seeds.split(",")):
        cycles.samples, cycles.seed = samples, seed
        cpu, wall = cpu_seconds(), time.monotonic()
        bpy.ops.render.render()
        cpu, wall = cpu_seconds() - cpu, time.monotonic() - wall
        picture = os.path.join(folder, f"cycles-{samples}-{seed}.exr")
        bpy.data.images["Render Result"].save_render(picture)
        print("PEER " + json.dumps({"samples": samples, "seed": seed, "cpu": cpu, "wall": wall, "picture": picture}),
              flush=True)
