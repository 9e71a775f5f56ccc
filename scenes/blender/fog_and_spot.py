"""A walker in a foggy park at night: the cone of a street lamp, and the beams of a car behind the walker."""
import math

import bpy
import numpy
from kit import aimed, box, bumped, camera, copy_of, cylinder, gray, image_of, insert, lathe, light, material, mesh, noise, plane, \
    rounded, shader_of, sky, sphere, textured, tube
from mathutils import Matrix, Vector

CAR = (-0.3, 15)
BLACK = gray(0.012)


def fog(density, anisotropy):
    """A box of fog around all, also around the camera."""
    air = bpy.data.materials.new("fog")
    air.use_nodes = True
    air.node_tree.nodes.remove(air.node_tree.nodes["Principled BSDF"])
    end = air.node_tree.nodes["Material Output"]
    insert(air, "ShaderNodeVolumeScatter", end.inputs["Volume"], Color=(0.93, 0.96, 1, 1), Density=density, Anisotropy=anisotropy)
    box((40, 44, 12), (0, 8, 5.9), surface=air, name="fog")


def cobbles():
    """Heights, colours and roughnesses of wet paving, as pictures of two square metres."""
    size, rows = 1024, 14
    y, x = (numpy.mgrid[0:size, 0:size] + 0.5) / size * rows
    row = numpy.floor(y).astype(int)
    x = (x + 0.5 * (row % 2)) * 0.75
    random = numpy.random.default_rng(3)
    shade = random.uniform(0.5, 1, (rows, 12))[row, numpy.floor(x).astype(int) % 12]
    border = numpy.minimum(0.5 - numpy.abs(x % 1 - 0.5), 0.75 * (0.5 - numpy.abs(y % 1 - 0.5)))
    stone = numpy.clip(border / 0.16, 0, 1) ** 0.5
    heights = stone * (0.6 + 0.25 * shade) + 0.15 * noise(size, 64, 1)
    puddle = numpy.clip((noise(size, 3, 5, 3) - 0.52) * 9, 0, 1)
    heights = heights * (1 - puddle) + 0.75 * puddle
    colors = (0.32 + 0.16 * shade * stone)[..., None] * numpy.array([1, 0.95, 0.9]) * (1 - 0.35 * puddle[..., None])
    return heights, colors, 0.42 - 0.36 * puddle - 0.12 * noise(size, 8, 6)


def ground():
    heights, colors, rough = cobbles()
    paving = material("paving", "BSDF_PRINCIPLED")
    scale = {"Scale": (1.6, 24, 1)}
    textured(paving, image_of("stones", colors), shader_of(paving).inputs["Base Color"], "UV", scale)
    textured(paving, image_of("wetness", rough, data=True), shader_of(paving).inputs["Roughness"], "UV", scale)
    bumped(paving, image_of("stone heights", heights, data=True), 0.02, scale["Scale"])
    plane((3.2, 48), (0, 10, 0.02), surface=paving, name="path")
    soil = material("soil", Color=(0.03, 0.035, 0.02, 1), Roughness=1)
    plane(60, (0, 8, 0), surface=soil, name="soil")
    kerb = material("kerb", Color=gray(0.12))
    for side in (-1, 1):
        box((0.14, 48, 0.14), (side * 1.67, 10, 0.03), surface=kerb, bevel=0.015)


def scatter(item, count, seed, place):
    """Copies in random places, sizes and turns."""
    random = numpy.random.default_rng(seed)
    for _ in range(count):
        x, y, z = place(random)
        copy_of(item, (x, y, z), (*item.rotation_euler[:2], random.uniform(0, 6.3)), [random.uniform(0.6, 1.3)] * 3)


def grass():
    random = numpy.random.default_rng(8)
    vertices, faces = [], []
    for _ in range(50):
        foot, turn, lean = random.normal(0, 0.09, 2), random.uniform(0, 6.3), random.normal(0, 0.05, 2)
        across = 0.005 * numpy.array([math.cos(turn), math.sin(turn)])
        faces.append(range(len(vertices), len(vertices) + 3))
        vertices += [(*(foot - across), 0), (*(foot + across), 0), (*(foot + lean), random.uniform(0.08, 0.24))]
    tuft = mesh("grass", vertices, faces, material("grass", "BSDF_PRINCIPLED", Base_Color=(0.05, 0.08, 0.02, 1), Roughness=0.4))
    tuft.location = (2, -5, 0)
    scatter(tuft, 700, 9, lambda r: (r.choice((-1, 1)) * (1.8 + 4 * r.random() ** 2), r.uniform(-6, 14), 0))
    leaf = mesh("leaf", [(0, -0.05, 0.006), (0.03, 0, 0.002), (0, 0.05, 0.012), (-0.03, 0, 0.016)], [(0, 1, 2), (0, 2, 3)],
                material("leaf", "BSDF_PRINCIPLED", Base_Color=(0.3, 0.11, 0.02, 1), Roughness=0.3))
    leaf.location = (0.4, -4, 0.03)
    scatter(leaf, 260, 10, lambda r: (r.normal(0, 1.1), r.uniform(-6, 9), 0.035))


def tree(seed, bark):
    """A bare tree, as one mesh of cones."""
    random = numpy.random.default_rng(seed)
    vertices, faces = [], []

    def limb(foot, direction, length, radius, depth):
        bends = 4 if depth < 3 else 2
        angles = numpy.arange((10, 7, 5, 4, 3)[depth]) * 2 * math.pi / (10, 7, 5, 4, 3)[depth]
        sides = len(angles)
        for bend in range(bends + 1):
            turn = Vector((0, 0, 1)).rotation_difference(direction).to_matrix()
            thick = radius * (1 - 0.55 * bend / bends) * (1.35 if depth == bend == 0 else 1)
            start = len(vertices)
            vertices.extend(foot + turn @ Vector((thick * math.cos(a), thick * math.sin(a), 0)) for a in angles)
            if bend:
                faces.extend((start - sides + i, start - sides + (i + 1) % sides, start + (i + 1) % sides, start + i) for i in range(sides))
            if depth < 4 and (bend > 1 or depth and bend):
                for _ in range(2 if depth < 3 else 1):
                    side = Matrix.Rotation(random.uniform(0, 6.3), 3, direction) @ direction.orthogonal().normalized()
                    limb(foot, (direction + side * random.uniform(0.6, 1.2)).normalized(), length * random.uniform(0.45, 0.65), thick * 0.6,
                         depth + 1)
            foot = foot + direction * (length / bends)
            direction = (direction + Vector(random.normal(0, 0.1 + 0.04 * depth, 3)) + Vector((0, 0, 0.05))).normalized()

    limb(Vector((0, 0, -0.1)), Vector((0, 0, 1)), 5.5, 0.2, 0)
    return mesh("tree", vertices, faces, bark, smooth=True)


def trees():
    bark = material("bark", Color=(0.05, 0.04, 0.03, 1))
    kinds = [tree(seed, bark) for seed in (1, 2)]
    places = [(-2.9, 1.5), (3.1, 4.5), (-3.2, 6), (2.9, 9), (-2.8, 11), (4.6, 1.2), (-5.5, 4), (5.8, 8), (-6.5, 12), (6.8, 15), (-3.6, 18),
              (3.4, 19), (-8, 18), (9, 21)]
    for i, place in enumerate(places):
        if i < 2:
            kinds[i].location = (*place, 0)
        else:
            copy_of(kinds[i % 2], (*place, 0), (0, 0, 2.4 * i), [0.85 + 0.3 * (i * 7 % 5) / 4] * 3)


def fence(iron):
    for height in (0.18, 0.95):
        box((0.03, 14, 0.03), (-2.1, 4, height), surface=iron)
    picket = lathe([(0, 0), (0.011, 0), (0.011, 1.05), (0.02, 1.08), (0, 1.2)], (-2.1, -3, 0), iron, 8, False, "picket")
    for i in range(1, 100):
        copy_of(picket, (-2.1, -3 + 0.14 * i, 0))


def street_lamp(iron):
    """A post with an arm. The bulb is a spot light within the shade."""
    lathe([(0, 0), (0.16, 0), (0.16, 0.1), (0.1, 0.16), (0.09, 0.7), (0.06, 0.8), (0.045, 1), (0.04, 4), (0, 4)], (2.3, -0.4, 0), iron, 24)
    tube([(2.3, -0.4, 3.95), (2.3, -0.4, 4.5), (1.9, -0.4, 4.6), (1.25, -0.4, 4.55), (1.25, -0.4, 4.2)], 0.025, iron)
    lathe([(0.27, 3.93), (0.2, 4.05), (0.06, 4.16), (0.03, 4.22), (0, 4.22), (0, 4.2), (0.05, 4.14), (0.185, 4.04), (0.262, 3.93),
           (0.27, 3.93)], (1.25, -0.4, 0), iron, 48)
    sphere(0.055, (1.25, -0.4, 4.05), material("bulb", "EMISSION", Color=(1, 0.6, 0.26, 1), Strength=40))
    light("SPOT", 2600, (1.25, -0.4, 3.94), spot_size=math.radians(74), spot_blend=0.25, shadow_soft_size=0.05, color=(1, 0.62, 0.28))


def bench(iron):
    wood = material("bench", "BSDF_PRINCIPLED", Base_Color=(0.1, 0.05, 0.025, 1), Roughness=0.6)
    x, y = 2.15, 1.3
    for i in range(4):
        box((0.095, 1.7, 0.035), (x - 0.2 + 0.115 * i, y, 0.46), surface=wood, bevel=0.008)
    for i in range(3):
        box((0.03, 1.7, 0.1), (x + 0.235 + 0.03 * i, y, 0.6 + 0.125 * i), (0, 0.23, 0), wood, 0.008)
    for side in (-0.7, 0.7):
        tube([(x - 0.22, y + side, 0), (x - 0.2, y + side, 0.2), (x - 0.22, y + side, 0.43)], 0.022, iron)
        tube([(x - 0.22, y + side, 0.425), (x + 0.1, y + side, 0.425), (x + 0.2, y + side, 0.425)], 0.016, iron)
        tube([(x + 0.2, y + side, 0), (x + 0.22, y + side, 0.3), (x + 0.23, y + side, 0.5), (x + 0.34, y + side, 0.95)], 0.022, iron)


def walker(x, y):
    """A figure in a long coat, under an umbrella."""
    cloth = material("coat", Color=BLACK)
    coat = lathe([(0, 0.42), (0.25, 0.42), (0.21, 0.75), (0.165, 1.05), (0.19, 1.25), (0.2, 1.38), (0.13, 1.47), (0.06, 1.5), (0, 1.5)],
                 (x, y, 0), cloth, 32)
    coat.scale = (1, 0.65, 1)
    for side, step in ((-0.09, -0.12), (0.09, 0.16)):
        tube([(x + side, y, 0.6), (x + side, y + step / 2, 0.35), (x + side, y + step, 0.1)], 0.06, cloth)
        rounded(box((0.09, 0.26, 0.09), (x + side, y + step - 0.05, 0.065), surface=cloth), 0.03)
    sphere(0.105, (x, y, 1.63), cloth).scale = (0.85, 1, 1.15)
    lathe([(0, 1.67), (0.17, 1.68), (0.17, 1.69), (0.11, 1.7), (0.1, 1.78), (0.06, 1.8), (0, 1.79)], (x, y, 0), cloth, 32)
    tube([(x + 0.19, y, 1.36), (x + 0.27, y, 1.15), (x + 0.25, y - 0.1, 1.1), (x + 0.16, y - 0.18, 1.25)], 0.05, cloth)
    tube([(x - 0.19, y, 1.36), (x - 0.27, y, 1.1), (x - 0.26, y - 0.05, 0.8)], 0.05, cloth)
    cylinder(0.01, 1.05, (x + 0.15, y - 0.18, 1.6), surface=cloth)
    canopy = [(0.62 * math.sin(a), 1.72 + 0.4 * math.cos(a)) for a in numpy.linspace(1.5, 0.05, 10)]
    lathe([*canopy, (0, 2.14), (0, 2.11), *[(0.98 * r, z - 0.008) for r, z in canopy[::-1]], canopy[0]], (x + 0.15, y - 0.18, 0), cloth, 8)


def car():
    x, y = CAR
    paint = material("car", "BSDF_PRINCIPLED", Base_Color=BLACK, Roughness=0.2)
    rounded(box((1.75, 4.2, 0.62), (x, y + 2.25, 0.62), surface=paint), 0.12)
    rounded(box((1.45, 2.1, 0.55), (x, y + 2.5, 1.15), surface=paint), 0.2)
    for side in (-0.65, 0.65):
        lamp = light("SPOT", 2200, (x + side, y - 0.05, 0.66), spot_size=math.radians(50), spot_blend=0.5, shadow_soft_size=0.13,
                     color=(0.78, 0.89, 1))
        aimed(lamp, (x + side, -8, 0.9))


def build():
    sky(0.004, (0.35, 0.5, 1, 1))
    iron = material("iron", "BSDF_PRINCIPLED", Base_Color=BLACK, Roughness=0.45)
    ground()
    grass()
    trees()
    fence(iron)
    street_lamp(iron)
    bench(iron)
    walker(0.15, 2)
    car()
    fog(0.04, 0.35)
    camera((0.6, -7.4, 1.5), (0.2, 0, 2.0), 35)
