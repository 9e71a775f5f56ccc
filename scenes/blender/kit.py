"""Building blocks of scenes that Blender's Python models: materials, lights, cameras, meshes and textures. Lengths are metres, angles
radians, colours linear Rec. 709."""
import math

import bpy
import numpy
from mathutils import Vector

# Scenes.


def begin():
    """An empty scene with a black world."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    scene.world = bpy.data.worlds.new("world")
    scene.world.use_nodes = True
    sky(0.0)
    scene.view_settings.view_transform = "Standard"
    scene.cycles.volume_bounces = 64  # the default, 0, shows light that fog scatters once
    return scene


def place(item):
    bpy.context.scene.collection.objects.link(item)
    return item


def camera(location, target, lens=50, size=(480, 320), fstop=None, focus=None):
    """The scene's camera. `lens` in mm of a sensor 36 mm wide, `size` in pixels. With `fstop` it focuses on the point `focus`, or
    else on the target."""
    data = bpy.data.cameras.new("camera")
    data.lens = lens
    made = place(bpy.data.objects.new("camera", data))
    made.location = location
    made.rotation_euler = (Vector(target) - Vector(location)).to_track_quat("-Z", "Y").to_euler()
    if fstop is not None:
        data.dof.use_dof = True
        data.dof.aperture_fstop = fstop
        data.dof.focus_distance = (Vector(focus or target) - Vector(location)).length
    scene = bpy.context.scene
    scene.camera = made
    scene.render.resolution_x, scene.render.resolution_y = size
    scene.render.resolution_percentage = 100
    return made


# Materials.

NODES = {"BSDF_DIFFUSE": "ShaderNodeBsdfDiffuse", "BSDF_GLOSSY": "ShaderNodeBsdfGlossy", "BSDF_GLASS": "ShaderNodeBsdfGlass",
         "BSDF_PRINCIPLED": "ShaderNodeBsdfPrincipled", "BSDF_ANISOTROPIC": "ShaderNodeBsdfAnisotropic", "EMISSION": "ShaderNodeEmission",
         "BSDF_TRANSPARENT": "ShaderNodeBsdfTransparent", "BSDF_TRANSLUCENT": "ShaderNodeBsdfTranslucent", "FRESNEL": "ShaderNodeFresnel",
         "SUBSURFACE_SCATTERING": "ShaderNodeSubsurfaceScattering",
         "LAYER_WEIGHT": "ShaderNodeLayerWeight"}


def gray(value):
    return value, value, value, 1


def material(name, kind="BSDF_DIFFUSE", **inputs):
    """A material of one shader. Keywords are the shader's inputs, with _ for a blank."""
    made = bpy.data.materials.new(name)
    made.use_nodes = True
    tree = made.node_tree
    tree.nodes.clear()
    end = tree.nodes.new("ShaderNodeOutputMaterial")
    shader = tree.nodes.new(NODES[kind])
    for key, value in inputs.items():
        if key == "distribution":
            shader.distribution = value
        else:
            shader.inputs[key.replace("_", " ")].default_value = value
    tree.links.new(shader.outputs[0], end.inputs["Surface"])
    return made


def shader_of(made):
    return made.node_tree.nodes["Material Output"].inputs["Surface"].links[0].from_node


def insert(made, kind, socket, **inputs):
    """A node before an input."""
    node = made.node_tree.nodes.new(kind)
    for key, value in inputs.items():
        node.inputs[key].default_value = value
    made.node_tree.links.new(node.outputs[0], socket)
    return node


def mixture(name, *tree):
    """A material that is a mixture."""
    made = material(name)
    add_shader(made, made.node_tree.nodes["Material Output"].inputs["Surface"], tree)
    return made


def add_shader(made, socket, tree):
    """Adds a shader (kind, inputs), or a mixture (first, second, share) of shaders or mixtures. The share is a number, an image
    or a node (kind, inputs). Without it both are added."""
    first, second, *share = tree
    if isinstance(first, str):
        node = insert(made, NODES[first], socket)
        for key, value in second.items():
            node.inputs[key].default_value = value
        return
    mix = insert(made, "ShaderNodeMixShader" if share else "ShaderNodeAddShader", socket)
    if share and isinstance(share[0], bpy.types.Image):
        textured(made, share[0], mix.inputs[0], "UV")
    elif share and isinstance(share[0], tuple):
        insert(made, NODES[share[0][0]], mix.inputs[0], **share[0][1])
    elif share:
        mix.inputs[0].default_value = share[0]
    for one, part in zip(mix.inputs[-2:], (first, second)):
        add_shader(made, one, part)


def textured(made, picture, socket, coordinates=None, mapping=None, output="Color"):
    """Links an image to an input of the material's shader."""
    tree = made.node_tree
    node = tree.nodes.new("ShaderNodeTexImage")
    node.image = picture
    if coordinates is not None:
        source = tree.nodes.new("ShaderNodeTexCoord").outputs[coordinates]
        if mapping is not None:
            move = tree.nodes.new("ShaderNodeMapping")
            for key, value in mapping.items():
                move.inputs[key].default_value = value
            tree.links.new(source, move.inputs["Vector"])
            source = move.outputs[0]
        tree.links.new(source, node.inputs["Vector"])
    tree.links.new(node.outputs[output], socket)
    return node


def painted(name, colors, roughness, **inputs):
    """A principled material with a picture of its base colour."""
    made = material(name, "BSDF_PRINCIPLED", Roughness=roughness, **inputs)
    textured(made, image_of(name, colors), shader_of(made).inputs["Base Color"], "UV")
    return made


def bumped(made, picture, distance=0.01, scale=(1, 1, 1)):
    """The shader's normal by an image of heights (0 to 1), whose range is `distance` metres."""
    tree = made.node_tree
    bump = tree.nodes.new("ShaderNodeBump")
    bump.inputs["Distance"].default_value = distance
    textured(made, picture, bump.inputs["Height"], "UV", {"Scale": scale})
    tree.links.new(bump.outputs["Normal"], shader_of(made).inputs["Normal"])
    return made


# Pictures.

def image(name, size=64, value=lambda x, y: (x, y, 0.3, 1), data=False, float_buffer=False):
    """A picture by a function of x and y in (0, 1). (0, 0) is below left."""
    made = bpy.data.images.new(name, size, size, alpha=True, float_buffer=float_buffer, is_data=data)
    made.pixels.foreach_set([c for y in range(size) for x in range(size) for c in value((x + 0.5) / size, (y + 0.5) / size)])
    made.pack()
    return made


def image_of(name, values, data=False):
    """A picture of an array (height, width), or with 3 or 4 channels, of values from 0 to 1. Row 0 is below. With `data` the
    values are numbers and not colours; else they are sRGB."""
    values = numpy.clip(numpy.asarray(values, float), 0, 1)
    if values.ndim == 2:
        values = numpy.repeat(values[:, :, None], 3, axis=2)
    height, width, channels = values.shape
    if channels == 3:
        values = numpy.concatenate([values, numpy.ones((height, width, 1))], axis=2)
    made = bpy.data.images.new(name, width, height, alpha=True, is_data=data)
    made.pixels.foreach_set(values.astype(numpy.float32).ravel())
    made.pack()
    return made


def blend(a, b, share):
    """Two colours by an array of shares."""
    return numpy.asarray(a) * (1 - share[..., None]) + numpy.asarray(b) * share[..., None]


def noise(size, cells, seed, octaves=5, gain=0.5):
    """A tileable fractal noise of value, size x size, from 0 to 1, with `cells` bumps along the side in the first octave."""
    random = numpy.random.default_rng(seed)
    total = numpy.zeros((size, size))
    weight = 1.0
    for octave in range(octaves):
        count = cells * 2 ** octave
        if count > size:
            break
        grid = random.random((count, count))
        at = (numpy.arange(size) + 0.5) / size * count
        low = numpy.floor(at).astype(int)
        part = at - low
        part = part * part * part * (part * (6 * part - 15) + 10)
        low %= count
        high = (low + 1) % count
        rows = grid[low] * (1 - part[:, None]) + grid[high] * part[:, None]
        total += weight * (rows[:, low] * (1 - part) + rows[:, high] * part)
        weight *= gain
    return (total - total.min()) / (total.max() - total.min())


# Lights.

def light(kind, energy, location=(1.5, -2, 3), rotation=(0, 0, 0), **properties):
    """A light of this kind (POINT, SUN, SPOT, AREA), with `energy` in watts, or of a sun in W/m²."""
    data = bpy.data.lights.new(kind.lower(), kind)
    data.energy = energy
    for key, value in properties.items():
        setattr(data, key, value)
    made = place(bpy.data.objects.new(kind.lower(), data))
    made.location, made.rotation_euler = location, rotation
    return made


def aimed(made, target):
    """Turns a light or camera to a point."""
    made.rotation_euler = (Vector(target) - made.location).to_track_quat("-Z", "Y").to_euler()
    return made


def sky(strength, color=(1, 1, 1, 1)):
    background = bpy.context.scene.world.node_tree.nodes["Background"]
    background.inputs["Color"].default_value, background.inputs["Strength"].default_value = color, strength
    return background


# Meshes. Each takes its material last.

def mesh(name, vertices, faces, surface=None, uvs=None, smooth=False):
    """`faces` are tuples of indices, `uvs` a pair for each corner of each face in turn."""
    data = bpy.data.meshes.new(name)
    data.from_pydata([tuple(map(float, vertex)) for vertex in vertices], [], [tuple(map(int, face)) for face in faces])
    if uvs is not None:
        data.uv_layers.new(name="UVMap").data.foreach_set("uv", numpy.asarray(uvs, numpy.float32).ravel())
    data.update()
    made = place(bpy.data.objects.new(name, data))
    if surface is not None:
        data.materials.append(surface)
    if smooth:
        data.polygons.foreach_set("use_smooth", [True] * len(data.polygons))
    return made


def finish(surface, name, smooth):
    made = bpy.context.object
    made.name = name
    if surface is not None:
        made.data.materials.append(surface)
    if smooth:
        made.data.polygons.foreach_set("use_smooth", [True] * len(made.data.polygons))
    return made


def plane(size, location=(0, 0, 0), rotation=(0, 0, 0), surface=None, name="plane"):
    """A rectangle of `size` (x, y), or a square, with texture coordinates from 0 to 1."""
    bpy.ops.mesh.primitive_plane_add(size=1, location=location, rotation=rotation)
    made = finish(surface, name, False)
    made.scale = (*(size if isinstance(size, (tuple, list)) else (size, size)), 1)
    return made


def box(size, location=(0, 0, 0), rotation=(0, 0, 0), surface=None, bevel=0.0, name="box"):
    """A cuboid of `size` (x, y, z) around `location`, with edges rounded by `bevel` metres."""
    x, y, z = (side / 2 for side in size)
    corners = [(a * x, b * y, c * z) for c in (-1, 1) for a, b in ((-1, -1), (1, -1), (1, 1), (-1, 1))]
    faces = [(3, 2, 1, 0), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7)]
    made = mesh(name, corners, faces, surface, [(0, 0), (1, 0), (1, 1), (0, 1)] * 6)
    made.location, made.rotation_euler = location, rotation
    return rounded(made, bevel) if bevel > 0 else made


def sphere(radius, location=(0, 0, 0), surface=None, segments=64, name="sphere"):
    bpy.ops.mesh.primitive_uv_sphere_add(segments=segments, ring_count=segments // 2, radius=radius, location=location)
    return finish(surface, name, True)


def cylinder(radius, height, location=(0, 0, 0), rotation=(0, 0, 0), surface=None, bevel=0.0, segments=64, name="cylinder"):
    """A closed cylinder around `location`, along z."""
    bpy.ops.mesh.primitive_cylinder_add(vertices=segments, radius=radius, depth=height, location=location, rotation=rotation)
    made = finish(surface, name, False)
    return rounded(made, bevel) if bevel > 0 else smooth_below(made, math.radians(40))


def torus(major, minor, location=(0, 0, 0), rotation=(0, 0, 0), surface=None, segments=(96, 32), name="torus"):
    bpy.ops.mesh.primitive_torus_add(major_radius=major, minor_radius=minor, major_segments=segments[0], minor_segments=segments[1],
                                     location=location, rotation=rotation)
    return finish(surface, name, True)


def lathe(profile, location=(0, 0, 0), surface=None, segments=64, smooth=True, name="lathe"):
    """A body of revolution around z. `profile` is a list of (radius, height), from the bottom outside to the top, and down the
    inside if it is hollow. Points of radius 0 are on the axis. The order makes the normals point outwards."""
    vertices, rings = [], []
    for radius, height in profile:
        if radius == 0:
            rings.append([len(vertices)] * segments)
            vertices.append((0, 0, height))
        else:
            rings.append(range(len(vertices), len(vertices) + segments))
            turns = [2 * math.pi * i / segments for i in range(segments)]
            vertices += [(radius * math.cos(turn), radius * math.sin(turn), height) for turn in turns]
    faces, uvs = [], []
    for level, (low, high) in enumerate(zip(rings, rings[1:])):
        for i in range(segments):
            j = (i + 1) % segments
            corners = [(low[i], i, level), (low[j], i + 1, level), (high[j], i + 1, level + 1), (high[i], i, level + 1)]
            kept = [corner for at, corner in enumerate(corners) if corner[0] not in [other[0] for other in corners[:at]]]
            if len(kept) > 2:
                faces.append([corner[0] for corner in kept])
                uvs += [(corner[1] / segments, corner[2] / (len(rings) - 1)) for corner in kept]
    made = mesh(name, vertices, faces, surface, uvs, smooth)
    made.location = location
    return made


def tube(points, radius, surface=None, segments=12, closed=False, name="tube"):
    """A round tube along a smooth curve through these points."""
    data = bpy.data.curves.new(name, "CURVE")
    data.dimensions, data.bevel_depth, data.bevel_resolution, data.use_fill_caps = "3D", radius, max(segments // 4, 1), True
    spline = data.splines.new("NURBS")
    spline.points.add(len(points) - 1)
    for point, location in zip(spline.points, points):
        point.co = (*location, 1)
    spline.use_cyclic_u, spline.use_endpoint_u, spline.order_u = closed, not closed, min(4, len(points))
    made = place(bpy.data.objects.new(name, data))
    if surface is not None:
        data.materials.append(surface)
    return made


def copy_of(item, location, rotation=None, scale=None):
    """An instance: the same mesh at another place."""
    made = place(bpy.data.objects.new(item.name, item.data))
    for modifier in item.modifiers:
        other = made.modifiers.new(modifier.name, modifier.type)
        for key in modifier.bl_rna.properties.keys():
            if not modifier.is_property_readonly(key):
                setattr(other, key, getattr(modifier, key))
    made.location = location
    made.rotation_euler = rotation if rotation is not None else item.rotation_euler
    made.scale = scale if scale is not None else item.scale
    return made


def rounded(item, width, segments=3):
    """Rounds the edges of a mesh."""
    modifier = item.modifiers.new("bevel", "BEVEL")
    modifier.width, modifier.segments, modifier.limit_method, modifier.harden_normals = width, segments, "ANGLE", True
    return smooth_below(item, math.radians(40))


def smooth_below(item, angle):
    """Smooth shading where faces meet at less than this angle."""
    item.data.polygons.foreach_set("use_smooth", [True] * len(item.data.polygons))
    item.data.use_auto_smooth, item.data.auto_smooth_angle = True, angle
    return item


def subdivided(item, levels=2):
    """A Catmull-Clark subdivision surface."""
    modifier = item.modifiers.new("subdivision", "SUBSURF")
    modifier.levels = modifier.render_levels = levels
    item.data.polygons.foreach_set("use_smooth", [True] * len(item.data.polygons))
    return item
