"""A lemon tree in a terracotta pot throws its shadow on the wall of a courtyard, beside a bench under bougainvillea."""
import math

import bpy
import numpy
from kit import (aimed, blend, box, bumped, camera, copy_of, cylinder, image_of, lathe, light, material, mesh, mixture, noise, place, plane,
                 shader_of, sky, smooth_below, textured)

SUN = -0.8, -0.8, 0.62


def leaf_picture(name, colors, width=0.42, half=192):
    """Four leaves in a square, with their outlines as alpha. Each grows upwards. `colors` has a blade, its edge and its veins."""
    across, along = numpy.meshgrid((numpy.arange(half) + 0.5) / half * 2 - 1, (numpy.arange(half) + 0.5) / half)
    mottled = noise(half, 6, 3)
    leaves = []
    for shade in (0.8, 1.0, 1.15, 1.0):
        outline = 2 * width * numpy.sin(math.pi * numpy.clip(along * 1.04 - 0.02, 0, 1) ** 0.85) ** 0.75
        side = numpy.abs(numpy.sin(28 * (along - 0.45 * numpy.abs(across))))
        veins = numpy.maximum(numpy.exp(-(across / 0.05) ** 2), 0.45 * (1 - side) ** 4)
        color = blend(blend(colors[0], colors[1], numpy.clip(mottled * 1.3 * numpy.abs(across) + 0.3 * mottled, 0, 1)), colors[2], veins)
        inside = numpy.clip((outline - numpy.abs(across)) * half / 3 + 0.5, 0, 1)
        stalk = (numpy.abs(across) < 0.03) & (along < 0.1)
        leaves.append(numpy.concatenate([color * shade, numpy.maximum(inside, stalk)[..., None]], axis=2))
        mottled = numpy.roll(mottled, 57, axis=0)
    return image_of(name, numpy.concatenate([numpy.concatenate(leaves[:2], 1), numpy.concatenate(leaves[2:], 1)]))


def leaf_surface(name, picture, roughness, translucency):
    """A leaf that light shines through, cut out by the picture's alpha."""
    made = mixture(name, ("BSDF_TRANSPARENT", {}),
                   (("BSDF_PRINCIPLED", {"Roughness": roughness}), ("BSDF_TRANSLUCENT", {}), translucency), picture)
    factor = shader_of(made).inputs[0]
    made.node_tree.links.new(factor.links[0].from_node.outputs["Alpha"], factor)
    for node in list(made.node_tree.nodes):
        if node.type in ("BSDF_PRINCIPLED", "BSDF_TRANSLUCENT"):
            textured(made, picture, node.inputs[0], "UV")
    return made


def unit(vectors):
    return vectors / numpy.maximum(numpy.linalg.norm(vectors, axis=-1, keepdims=True), 1e-9)


def foliage(name, roots, directions, lengths, surface, random, breadth=0.9, curl=0.25):
    """One mesh of many leaves. Each is folded along its middle and droops. They turn their faces upwards, more or less."""
    count = len(roots)
    along = unit(directions)
    normal = unit(numpy.array([0, 0, 1.0]) + 0.5 * random.normal(size=(count, 3)))
    side = unit(numpy.cross(along, normal))
    normal = numpy.cross(side, along)
    u, v = [grid.ravel() for grid in numpy.meshgrid((-0.5, 0, 0.5), numpy.linspace(0, 1, 4))]
    bend = curl * random.uniform(0.4, 1.6, count)
    shape = (v[None, :, None] * along[:, None] + breadth * u[None, :, None] * side[:, None]
             + (0.35 * breadth * numpy.abs(u)[None, :] - bend[:, None] * v[None, :] ** 2)[..., None] * normal[:, None])
    vertices = (roots[:, None] + lengths[:, None, None] * shape).reshape(-1, 3)
    quads = numpy.array([(i, i + 1, i + 4, i + 3) for i in (0, 1, 3, 4, 6, 7)])
    faces = (quads[None] + 12 * numpy.arange(count)[:, None, None]).reshape(-1, 4)
    uvs = numpy.stack([(u + 0.5)[quads], v[quads]], axis=-1)
    cells = numpy.stack([random.integers(0, 2, count), random.integers(0, 2, count)], axis=-1)
    return mesh(name, vertices, faces, surface, (uvs[None] + cells[:, None, None]) / 2, smooth=True)


def stems(name, paths, surface):
    """One curve of many round stems. Each path has points and a radius at its start, and tapers."""
    data = bpy.data.curves.new(name, "CURVE")
    data.dimensions, data.bevel_depth, data.bevel_resolution, data.resolution_u, data.use_fill_caps = "3D", 1, 2, 4, True
    for points, radius in paths:
        spline = data.splines.new("NURBS")
        spline.points.add(len(points) - 1)
        spline.order_u, spline.use_endpoint_u = min(4, len(points)), True
        for i, (point, at) in enumerate(zip(spline.points, points)):
            point.co, point.radius = (*at, 1), radius * (1 - 0.4 * i / len(points))
    data.materials.append(surface)
    return place(bpy.data.objects.new(name, data))


def grow(start, direction, length, levels, random, twigs, paths):
    """A branch that forks. It adds its twigs to `twigs` as pairs of ends, and all its parts to `paths`."""
    bent = unit(direction + 0.25 * random.normal(size=3))
    middle = start + 0.5 * length * direction
    end = middle + 0.5 * length * bent
    paths.append(([start, middle, end], 0.004 * 1.75 ** levels))
    if levels == 0:
        twigs.append((middle, end))
        return
    twigs.append((end - 0.4 * length * bent, end))
    around = random.uniform(0, 2 * math.pi)
    for i in range(4):
        turn = around + i * math.pi / 2 + random.uniform(-0.4, 0.4)
        spread = numpy.array([math.cos(turn), math.sin(turn), random.uniform(-0.1, 0.5)])
        grow(end - random.uniform(0, 0.3) * length * bent, unit(0.75 * bent + 0.85 * spread), length * random.uniform(0.6, 0.8),
             levels - 1, random, twigs, paths)


def lemon_tree(foot, random):
    bark = material("bark", "BSDF_PRINCIPLED", Base_Color=(0.16, 0.12, 0.08, 1), Roughness=0.8)
    twigs = []
    top = foot + numpy.array([0.02, 0, 0.45])
    paths = [([foot, foot + (0.04, 0.01, 0.15), foot + (-0.01, 0, 0.3), top + (0, 0, 0.06)], 0.03)]
    for turn in (0.3, 1.9, 3.2, 4.7):
        grow(top, unit(numpy.array([0.75 * math.cos(turn), 0.75 * math.sin(turn), 0.8])), 0.3, 2, random, twigs, paths)
    stems("branches", paths, bark)
    starts, ends = (numpy.array(part) for part in zip(*twigs))
    each = 30
    share = random.uniform(0, 1.05, (len(starts), each, 1))
    roots = (starts[:, None] * (1 - share) + ends[:, None] * share).reshape(-1, 3)
    outwards = numpy.repeat(unit(ends - starts), each, axis=0) * 0.7 + random.normal(size=roots.shape) * 0.6
    picture = leaf_picture("lemon leaf", ((0.30, 0.47, 0.13), (0.42, 0.56, 0.18), (0.62, 0.70, 0.34)))
    leaf = leaf_surface("lemon leaf", picture, 0.35, 0.4)
    foliage("lemon leaves", roots, outwards, random.uniform(0.07, 0.115, len(roots)), leaf, random)
    profile = [(0, -0.042), (0.008, -0.041), (0.013, -0.035), (0.024, -0.026), (0.031, -0.01), (0.031, 0.01), (0.022, 0.028),
               (0.009, 0.036), (0, 0.037)]
    peel = bumped(material("lemon", "BSDF_PRINCIPLED", Base_Color=(0.86, 0.58, 0.03, 1), Roughness=0.4),
                  image_of("pores", noise(128, 24, 5, 2), data=True), 0.0015)
    lemon = lathe(profile, (-0.3, 0.12, 0.031), peel, 32, name="lemon")
    lemon.rotation_euler = math.pi / 2, 0, 0.5
    for end in ends[random.choice(len(ends), 30, replace=False)]:
        copy_of(lemon, end + (0, 0, -0.06), random.uniform(-0.3, 0.3, 3))
    for x, y, z, turn in ((-0.2, 0.24, 0.031, 2.2), (0.52, 0.68, 0.484, 1.2), (0.6, 0.76, 0.484, 2.9)):
        copy_of(lemon, (x, y, z), (math.pi / 2, 0, turn))


def bougainvillea(random):
    """Stems hang over the wall's top, with leaves and bracts."""
    roots, ways, paths = [], [], []
    for _ in range(46):
        x = 2.1 * random.beta(1.5, 1.0) - 0.1
        reach = random.uniform(0.2, 0.4) + 0.5 * max(0.0, x - 0.4) * random.random()
        sway = random.normal() * 0.15
        points = numpy.array([(x, 1.35, 2.0), (x + 0.2 * sway, 1.12, 2.2 + 0.1 * random.random()),
                              (x + 0.7 * sway, 0.98, 2.0 - 0.3 * reach), (x + sway, 1.02 + 0.1 * random.random(), 2.02 - reach)])
        paths.append((points, 0.004))
        at = random.random((60, 1))
        bases = (1 - at) ** 3 * points[0] + 3 * at * (1 - at) ** 2 * points[1] + 3 * at ** 2 * (1 - at) * points[2] + at ** 3 * points[3]
        roots.append(bases + random.normal(size=bases.shape) * 0.03)
        ways.append(random.normal(size=bases.shape) + (0, -0.6, 0.1))
    stems("stems", paths, material("stem", Color=(0.2, 0.13, 0.08, 1)))
    roots, ways = numpy.concatenate(roots), numpy.concatenate(ways)
    coloured = random.random(len(roots)) < 0.6
    green = leaf_picture("green leaf", ((0.2, 0.36, 0.1), (0.34, 0.46, 0.14), (0.5, 0.6, 0.3)), 0.5)
    pink = leaf_picture("bract", ((0.78, 0.07, 0.42), (0.9, 0.2, 0.55), (0.95, 0.45, 0.65)), 0.55)
    for name, picture, chosen in (("leaves", green, ~coloured), ("bracts", pink, coloured)):
        surface = leaf_surface(name, picture, 0.5, 0.45)
        foliage(name, roots[chosen], ways[chosen], random.uniform(0.035, 0.06, chosen.sum()), surface, random)
    fallen = numpy.stack([random.uniform(-0.1, 1.9, 70), random.uniform(-0.3, 1.15, 70), numpy.full(70, 0.012)], axis=1)
    foliage("fallen", fallen, random.normal(size=(70, 3)) * (1, 1, 0), numpy.full(70, 0.045), surface, random, 0.9, 0.1)


def herbs(name, centre, radius, count, height, random, colors):
    """Narrow leaves in a tuft."""
    turn, out = random.uniform(0, 2 * math.pi, count), radius * numpy.sqrt(random.random(count))
    roots = numpy.stack([centre[0] + out * numpy.cos(turn), centre[1] + out * numpy.sin(turn), numpy.full(count, centre[2])], axis=1)
    ways = numpy.stack([0.7 * numpy.cos(turn), 0.7 * numpy.sin(turn), numpy.ones(count)], axis=1) + 0.25 * random.normal(size=(count, 3))
    foliage(name, roots, ways, height * random.uniform(0.6, 1.2, count), leaf_surface(name, leaf_picture(name, colors, 0.4), 0.5, 0.4),
            random, 0.16, 0.4)


def flagstones(size=1024, cells=9):
    """Colours and heights of paving stones of irregular shapes, with gravel in the joints."""
    random = numpy.random.default_rng(8)
    centres = random.uniform(0.12, 0.88, (cells, cells, 2))
    tint = random.random((cells, cells))
    rough = noise(size, 24, 2)
    warp = 0.25 * (noise(size, 16, 4, 3) - 0.5)
    y, x = numpy.mgrid[0:size, 0:size] / size * cells
    x, y = x + warp, y + warp.T
    row, column = numpy.floor(y).astype(int), numpy.floor(x).astype(int)
    first, second, stone = numpy.full(x.shape, 9.0), numpy.full(x.shape, 9.0), numpy.zeros(x.shape)
    for down in (-1, 0, 1):
        for right in (-1, 0, 1):
            i, j = (row + down) % cells, (column + right) % cells
            away = numpy.hypot(column + right + centres[i, j, 0] - x, row + down + centres[i, j, 1] - y)
            nearer = away < first
            second = numpy.where(nearer, first, numpy.minimum(second, away))
            first, stone = numpy.where(nearer, away, first), numpy.where(nearer, tint[i, j], stone)
    top = numpy.clip((second - first - 0.07) / 0.08, 0, 1)
    pebbles = noise(size, 128, 6, 2)
    color = blend(blend((0.40, 0.36, 0.28), (0.55, 0.50, 0.40), pebbles), blend((0.60, 0.53, 0.44), (0.76, 0.69, 0.58), stone)
                  * (0.72 + 0.42 * rough)[..., None], top)
    return color, 0.35 * pebbles * (1 - top) + top * (0.75 + 0.25 * rough)


def plaster(size=512):
    """Old ochre plaster for a wall, damp at its foot, with pale patches."""
    stains, patches, grain = noise(size, 4, 21), noise(size, 6, 24), noise(size, 40, 22, 4)
    height = (numpy.arange(size)[:, None] + 0.5) / size
    damp = numpy.clip(1.1 - 4.5 * height + 1.2 * (stains - 0.5), 0, 1)
    color = blend((0.87, 0.73, 0.53), (0.78, 0.60, 0.43), numpy.clip(2.2 * stains - 0.6, 0, 1))
    color = blend(blend(color, (0.90, 0.84, 0.74), numpy.clip(9 * patches - 5.9, 0, 0.75)), (0.50, 0.43, 0.33), 0.75 * damp)
    made = material("plaster", "BSDF_PRINCIPLED", Roughness=0.9)
    picture = image_of("plaster", color * (0.86 + 0.16 * grain)[..., None])
    textured(made, picture, shader_of(made).inputs["Base Color"], "UV", {"Scale": (2, 1, 1)})
    relief = 0.6 * noise(size, 12, 23) + 0.4 * grain - 0.12 * numpy.clip(9 * patches - 5.9, 0, 1)
    return bumped(made, image_of("trowel", relief, data=True), 0.012, (2, 1, 1))


def pot(height, radius, location, clay, earth):
    """A flower pot, filled with earth."""
    outside = [(0, 0), (0.66, 0), (0.7, 0.03), (0.88, 0.6), (0.96, 0.8), (1.08, 0.81), (1.1, 0.84), (1.1, 0.96), (1.07, 1), (0.98, 1),
               (0.95, 0.97), (0.93, 0.86), (0.9, 0.8), (0, 0.8)]
    smooth_below(lathe([(radius * r, height * h) for r, h in outside], location, clay, 96, name="pot"), 0.7)
    x, y, z = location
    cylinder(radius * 0.925, 0.05, (x, y, z + height * 0.89), surface=earth, name="earth")
    return z + height * 0.89 + 0.025


def bench(location, paint):
    x, y, _ = location
    for i in range(4):
        box((1.25, 0.09, 0.025), (x, y - 0.17 + 0.105 * i, 0.44), surface=paint, bevel=0.006, name="slat")
    for z in (0.62, 0.76):
        box((1.25, 0.025, 0.1), (x, y + 0.235, z), (-0.12, 0, 0), paint, 0.006, "back")
    for side in (-0.5, 0.5):
        box((0.06, 0.42, 0.05), (x + side, y - 0.01, 0.402), surface=paint, bevel=0.006, name="bearer")
        box((0.055, 0.055, 0.377), (x + side, y - 0.18, 0.1885), surface=paint, bevel=0.006, name="leg")
        box((0.055, 0.04, 0.86), (x + side, y + 0.21, 0.43), (-0.06, 0, 0), paint, 0.006, "post")


def summer_sky():
    """The world: a blue sky that is pale and bright near the sun and the horizon, over pale ground."""
    height, width = 256, 512
    up, turn = numpy.meshgrid((numpy.arange(height) + 0.5) / height * math.pi - math.pi / 2,
                              math.pi - (numpy.arange(width) + 0.5) / width * 2 * math.pi, indexing="ij")
    ways = numpy.stack([numpy.cos(up) * numpy.cos(turn), numpy.cos(up) * numpy.sin(turn), numpy.sin(up)], axis=-1)
    glow = numpy.exp(-4 * (1 - ways @ unit(numpy.array(SUN))))
    haze = numpy.exp(-3.5 * numpy.maximum(ways[..., 2], 0))
    color = blend(blend((0.30, 0.49, 0.80), (0.72, 0.82, 0.93), haze), (1.0, 0.96, 0.88), 0.8 * glow)
    tree = bpy.context.scene.world.node_tree
    node = tree.nodes.new("ShaderNodeTexEnvironment")
    node.image = image_of("sky", numpy.where(ways[..., 2:] > 0, color, (0.6, 0.54, 0.46)))
    tree.links.new(node.outputs["Color"], sky(0.9).inputs["Color"])


def ground():
    color, height = flagstones()
    stone = material("flagstones", "BSDF_PRINCIPLED", Roughness=0.75)
    textured(stone, image_of("stones", color), shader_of(stone).inputs["Base Color"], "UV")
    plane(6, (0, -1.5, 0), surface=bumped(stone, image_of("stone heights", height, data=True), 0.012), name="ground")


def terracotta():
    made = material("terracotta", "BSDF_PRINCIPLED", Roughness=0.8)
    lime = numpy.clip(2.4 * noise(256, 6, 31) - 1.2, 0, 1)
    burnt = image_of("terracotta", blend((0.74, 0.40, 0.25), (0.80, 0.62, 0.50), 0.6 * lime))
    textured(made, burnt, shader_of(made).inputs["Base Color"], "UV", {"Scale": (2, 1, 1)})
    return made


def worn_paint():
    made = material("paint", "BSDF_PRINCIPLED", Roughness=0.45)
    worn = numpy.clip(3.5 * noise(256, 8, 41) - 2.3, 0, 1)
    textured(made, image_of("paint", blend((0.25, 0.46, 0.52), (0.62, 0.55, 0.45), worn)), shader_of(made).inputs["Base Color"], "UV")
    return made


def build():
    random = numpy.random.default_rng(11)
    ground()
    clay = terracotta()
    box((8, 0.3, 2.0), (0, 1.35, 1.0), surface=plaster(), name="wall")
    tile = lathe([(0.1, 0), (0.11, 0), (0.11, 0.42), (0.1, 0.42), (0.1, 0)], (-3.1, 1.35, 2.0), clay, 32, name="tile")
    tile.rotation_euler = 0, math.pi / 2, 0
    for i in range(14):
        copy_of(tile, (-2.7 + 0.4 * i, 1.35, 2.0))

    earth = bumped(material("earth", Color=(0.07, 0.045, 0.03, 1)), image_of("crumbs", noise(128, 20, 7, 3), data=True), 0.01)
    lemon_tree(numpy.array([-0.65, 0.3, pot(0.46, 0.27, (-0.65, 0.3, 0), clay, earth)]), random)
    bench((0.85, 0.75, 0), worn_paint())
    soil = pot(0.17, 0.09, (1.2, 0.73, 0.453), clay, earth)
    herbs("lavender", (1.2, 0.73, soil), 0.05, 170, 0.16, random, ((0.40, 0.50, 0.36), (0.52, 0.58, 0.45), (0.6, 0.66, 0.55)))
    for i, x in enumerate((-1.7, -1.35, -0.2, 0.1, 1.55, 1.8)):
        herbs(f"grass {i}", (x, 1.16, 0), 0.09, 70, 0.2 + 0.06 * (i % 3), random, ((0.28, 0.42, 0.1), (0.42, 0.5, 0.18), (0.5, 0.58, 0.28)))
    bougainvillea(random)

    summer_sky()
    aimed(light("SUN", 5, SUN, angle=0.0093, color=(1, 0.85, 0.64)), (0, 0, 0))
    camera((0.16, -3.55, 1.22), (0.09, 0.6, 0.96), 45)
