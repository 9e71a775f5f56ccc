"""A living room in the morning: sun through a tall window on an oak floor, a rug and a sofa."""
import math

import numpy

from kit import (aimed, box, bumped, camera, copy_of, cylinder, gray, image_of, lathe, light, material, mesh, mixture, noise, plane,
                 shader_of, sky, textured, torus, tube)

WIDTH, DEPTH, HEIGHT = 4.8, 5.2, 2.7
WINDOWS = ((-2.2, -1.0), (-0.45, 1.55))  # along y, in the wall at the left
SILL, LINTEL = 0.25, 2.35
WALL = 0.24


def build():
    camera((0.8, -2.3, 1.42), (-0.3, 1.6, 1.42), 25).data.shift_y = -0.11
    blue_sky(5.5)
    aimed(light("SUN", 28, (-4, -0.9, 3.1), angle=0.012, color=(1, 0.93, 0.82)), (0, 0, 0))
    white = material("white paint", "BSDF_PRINCIPLED", Base_Color=gray(0.8), Roughness=0.35)
    room()
    skirting(white)
    for low, high in WINDOWS:
        window(low, high, white)
    garden()
    curtains()
    linen = fabric("linen", (0.72, 0.65, 0.54), 1)
    sofa(-0.05, 2.1, linen)
    rug()
    coffee_table(0.2, 0.8)
    cushion((0.62, 0.62, 0.4), (-1.05, 0.25, 0.205), 0, fabric("wool", (0.52, 0.34, 0.1), 6), 0.75, 1)
    plant(-1.82, 2.02)
    floor_lamp(1.25, 2.2)
    bookcase(1.86, 2.41, white)
    pictures()


def blue_sky(strength, size=64):
    """A clear sky, paler towards the horizon, over a dim ground."""
    rise = numpy.repeat(numpy.linspace(-1, 1, size)[:, None], 2 * size, 1)[:, :, None]
    haze = numpy.exp(-4 * numpy.clip(rise, 0, 1))
    picture = haze * (0.88, 0.93, 0.97) + (1 - haze) * (0.52, 0.71, 0.95)
    node = sky(strength).id_data.nodes.new("ShaderNodeTexEnvironment")
    node.image = image_of("sky", numpy.where(rise > 0, picture, (0.35, 0.38, 0.3)))
    node.id_data.links.new(node.outputs["Color"], node.id_data.nodes["Background"].inputs["Color"])


# The room.

def room():
    sage = material("sage paint", Color=(0.5, 0.58, 0.5, 1))
    chalk = material("chalk paint", Color=(0.82, 0.79, 0.73, 1))
    floor = plane((WIDTH, DEPTH), surface=planks("oak floor"), name="floor")
    floor.scale = (WIDTH + 2 * WALL, DEPTH + 2 * WALL, 1)
    box((WIDTH + 2 * WALL, DEPTH + 2 * WALL, 0.1), (0, 0, HEIGHT + 0.05), surface=material("ceiling", Color=gray(0.85)), name="ceiling")
    box((WIDTH + 2 * WALL, WALL, HEIGHT), (0, (DEPTH + WALL) / 2, HEIGHT / 2), surface=sage, name="back wall")
    box((WIDTH + 2 * WALL, WALL, HEIGHT), (0, -(DEPTH + WALL) / 2, HEIGHT / 2), surface=chalk, name="front wall")
    box((WALL, DEPTH, HEIGHT), ((WIDTH + WALL) / 2, 0, HEIGHT / 2), surface=chalk, name="right wall")
    x = -(WIDTH + WALL) / 2
    box((WALL, DEPTH, SILL), (x, 0, SILL / 2), surface=chalk, name="wall below")
    box((WALL, DEPTH, HEIGHT - LINTEL), (x, 0, (HEIGHT + LINTEL) / 2), surface=chalk, name="wall above")
    edges = [-DEPTH / 2, *(edge for pair in WINDOWS for edge in pair), DEPTH / 2]
    for low, high in zip(edges[::2], edges[1::2]):
        box((WALL, high - low, LINTEL - SILL), (x, (low + high) / 2, (LINTEL + SILL) / 2), surface=chalk, name="pier")


def planks(name, rows=16, size=1024):
    """An oak floor of boards, 2.4 m square."""
    random = numpy.random.default_rng(4)
    y, x = numpy.mgrid[0:size, 0:size]
    row = y * rows // size
    joint = random.random(rows)[row]
    along = (x / size + joint) * 2
    board = row * 2 + along.astype(int) % 2
    tone = random.uniform(0.82, 1.1, 2 * rows)[board]
    veins = noise(size, 4, 5, 8, 0.6)[:, numpy.arange(size) // 16]
    fine = noise(size, 64, 6, 4, 0.7)[:, numpy.arange(size) // 24]
    seam = (numpy.abs((y * rows / size) % 1 - 0.5) > 0.485) | (along % 1 < 0.004)
    value = tone * (0.82 + 0.25 * (veins - 0.5) + 0.2 * fine) * numpy.where(seam, 0.45, 1)
    made = material(name, "BSDF_PRINCIPLED", Roughness=0.3, Specular=0.5)
    picture = image_of(name, value[:, :, None] * numpy.array([0.86, 0.68, 0.48]))
    scale = (WIDTH / 2.4, DEPTH / 2.4, 1)
    textured(made, picture, shader_of(made).inputs["Base Color"], "UV", {"Scale": scale})
    return bumped(made, image_of(name + " height", numpy.where(seam, 0.0, 0.8 + 0.2 * fine), data=True), 0.0012, scale)


def skirting(white):
    box((WIDTH, 0.02, 0.12), (0, DEPTH / 2 - 0.01, 0.06), surface=white, bevel=0.006, name="skirting")
    box((0.02, DEPTH - 0.04, 0.12), (-WIDTH / 2 + 0.01, 0, 0.06), surface=white, bevel=0.006, name="skirting")
    box((0.02, DEPTH - 0.04, 0.12), (WIDTH / 2 - 0.01, 0, 0.06), surface=white, bevel=0.006, name="skirting")


def window(low, high, white):
    """A frame with open leaves' bars, and a sill."""
    x, middle, tall = -WIDTH / 2 - 0.12, (low + high) / 2, LINTEL - SILL
    for y in (low + 0.03, middle, high - 0.03):
        box((0.06, 0.058, tall - 0.002), (x, y, (SILL + LINTEL) / 2), surface=white, bevel=0.006, name="post")
    for z in (SILL + 0.03, LINTEL - 0.62, LINTEL - 0.03):
        box((0.05, high - low - 0.002, 0.05), (x, middle, z), surface=white, bevel=0.006, name="bar")
    box((0.2, high - low + 0.1, 0.03), (-WIDTH / 2 + 0.02, middle, SILL - 0.01), surface=white, bevel=0.008, name="sill")


def garden():
    leaf = mixture("foliage", ("BSDF_DIFFUSE", {"Color": (0.09, 0.18, 0.04, 1)}), ("BSDF_TRANSLUCENT", {"Color": (0.2, 0.32, 0.05, 1)}),
                   0.4)
    plane((60, 60), (-33, 0, -0.3), surface=material("lawn", Color=(0.07, 0.1, 0.035, 1)), name="lawn")
    random = numpy.random.default_rng(8)
    shrub = shrub_mesh(leaf, random)
    for i in range(26):
        size = random.uniform(1.1, 2.2)
        copy_of(shrub, (random.uniform(-17, -11), -4 + 1.25 * i + random.uniform(-0.5, 0.5), size * 0.45), (0, 0, random.uniform(0, 6)),
                (size, size, size * random.uniform(0.8, 1.2)))
    shrub.location = (-14, -6, 0.3)


def shrub_mesh(surface, random, leaves=1800):
    """A round cloud of leaves."""
    vertices, faces = [], []
    for i in range(leaves):
        out = random.normal(size=3)
        middle = out / numpy.linalg.norm(out) * random.uniform(0.6, 1.0)
        a, b = 0.075 * random.normal(size=3), 0.055 * random.normal(size=3)
        vertices += [middle - a, middle + b, middle + a, middle - b]
        faces.append(tuple(range(4 * i, 4 * i + 4)))
    return mesh("shrub", vertices, faces, surface)


def curtains():
    voile = mixture("voile", (("BSDF_TRANSLUCENT", {"Color": gray(0.86)}), ("BSDF_DIFFUSE", {"Color": gray(0.86)}), 0.4),
                    ("BSDF_TRANSPARENT", {"Color": gray(1)}), 0.25)
    brass = material("brass", "BSDF_PRINCIPLED", Base_Color=(0.8, 0.58, 0.28, 1), Metallic=1, Roughness=0.25)
    x = -WIDTH / 2 + 0.12
    cylinder(0.012, 4.55, (x, -0.28, 2.5), (math.pi / 2, 0, 0), brass, segments=24, name="curtain rod")
    for low, high, seed in ((-0.72, -0.14, 1), (1.18, 1.78, 2), (-1.25, -0.8, 3)):
        curtain(x, low, high, voile, seed)
        for i in range(8):
            torus(0.018, 0.003, (x, low + (i + 0.5) * (high - low) / 8, 2.494), (math.pi / 2, 0, 0), brass, (24, 8), "ring")


def curtain(x, low, high, surface, seed, columns=120, rows=40):
    random = numpy.random.default_rng(seed)
    phases, speeds = random.uniform(0, 6, 4), random.uniform(0.8, 1.2, 4)
    vertices, faces = [], []
    for i in range(rows + 1):
        drop = i / rows
        for j in range(columns + 1):
            t = j / columns
            fold = math.sin(8 * math.tau * t + phases[0]) + 0.4 * math.sin(13 * speeds[1] * t + phases[1] + 2 * drop)
            shift = 0.012 * drop * math.sin(9 * t + phases[2])
            vertices.append((x + (0.02 + 0.018 * drop) * fold, low + (high - low) * t + shift, 2.475 - 2.46 * drop))
    for i in range(rows):
        for j in range(columns):
            at = i * (columns + 1) + j
            faces.append((at, at + 1, at + columns + 2, at + columns + 1))
    return mesh("curtain", vertices, faces, surface, smooth=True)


# Upholstery.

def fabric(name, color, seed):
    """A woven cloth."""
    size = 256
    y, x = numpy.mgrid[0:size, 0:size] / size
    weave = 0.5 + 0.25 * (numpy.sin(32 * math.tau * x) * numpy.sign(numpy.sin(16 * math.tau * y)) + numpy.sin(32 * math.tau * y))
    made = material(name, "BSDF_PRINCIPLED", Roughness=0.9, Specular=0.15)
    shade = 0.9 + 0.1 * weave + 0.08 * (noise(size, 16, seed) - 0.5)
    srgb = numpy.asarray(color) ** (1 / 2.2)
    textured(made, image_of(name, shade[:, :, None] * srgb), shader_of(made).inputs["Base Color"], "UV", {"Scale": (4, 4, 1)})
    return bumped(made, image_of(name + " height", weave, data=True), 0.002, (4, 4, 1))


def cushion(size, location, rotation, surface, round_side=0.5, round_plan=0.3, wrinkle=0.0):
    """A superellipsoid. It is a box with soft edges at 0.2, and an ellipsoid at 1."""
    def power(value, exponent):
        return numpy.sign(value) * numpy.abs(value) ** exponent
    rows, columns = 28, 72
    v = numpy.linspace(-math.pi / 2, math.pi / 2, rows + 1)[:, None]
    u = numpy.linspace(0, math.tau, columns, endpoint=False)[None, :]
    x, y = (power(numpy.cos(v), round_side) * power(turn, round_plan) for turn in (numpy.cos(u), numpy.sin(u)))
    z = power(numpy.sin(v), round_side) * (1 + wrinkle * numpy.sin(7 * x + 3 * y) * (1 - x * x) * (1 - y * y)) + 0 * u
    points = numpy.stack([x, y, z], -1).reshape(-1, 3) * numpy.asarray(size) / 2
    faces = [(i * columns + j, i * columns + (j + 1) % columns, (i + 1) * columns + (j + 1) % columns, (i + 1) * columns + j)
             for i in range(rows) for j in range(columns)]
    uvs = [(points[at][0] * 2 + points[at][2], points[at][1] * 2 + points[at][2]) for face in faces for at in face]
    made = mesh("cushion", points, faces, surface, uvs, smooth=True)
    made.location = location
    made.rotation_euler = rotation if isinstance(rotation, tuple) else (0, 0, rotation)
    return made


def sofa(x, y, linen):
    walnut = material("walnut", "BSDF_PRINCIPLED", Base_Color=(0.16, 0.08, 0.04, 1), Roughness=0.35)
    cushion((2.1, 0.86, 0.2), (x, y, 0.24), 0, linen, 0.25, 0.1)
    cushion((2.1, 0.2, 0.62), (x, y + 0.36, 0.48), 0, linen, 0.25, 0.2)
    for side in (-1, 1):
        cushion((0.2, 0.88, 0.42), (x + side * 0.99, y, 0.38), 0, linen, 0.3, 0.2)
        cushion((0.9, 0.68, 0.18), (x + side * 0.445, y - 0.08, 0.41), 0, linen, 0.35, 0.15, 0.06)
        cushion((0.88, 0.22, 0.44), (x + side * 0.44, y + 0.2, 0.68), (-0.16, 0, 0), linen, 0.4, 0.3)
        for front in (-0.34, 0.34):
            cylinder(0.022, 0.16, (x + side * 0.95, y + front, 0.08), surface=walnut, segments=24, name="foot")
    for at, turn, name, color, seed in ((-0.68, 0.2, "terracotta", (0.55, 0.17, 0.08), 2), (-0.35, -0.12, "mustard", (0.72, 0.46, 0.1), 3),
                                        (0.66, -0.2, "teal", (0.04, 0.2, 0.22), 4)):
        cushion((0.46, 0.44, 0.17), (x + at, y - 0.02, 0.7), (math.radians(68), 0, turn), fabric(name, color, seed), 0.9, 0.3)


def rug():
    """Rows of diamonds in a border, with fringes."""
    size = 512
    y, x = numpy.mgrid[0:size, 0:size] / size
    u, v = (6 * x) % 1 - 0.5, (4 * y) % 1 - 0.5
    diamond = numpy.abs(u) + numpy.abs(v)
    picture = numpy.empty((size, size, 3))
    picture[:] = (0.9, 0.85, 0.75)
    picture[diamond < 0.46] = (0.28, 0.36, 0.45)
    picture[diamond < 0.34] = (0.9, 0.85, 0.75)
    picture[diamond < 0.2] = (0.72, 0.36, 0.22)
    edge = numpy.minimum(numpy.minimum(x, 1 - x) * 1.5, numpy.minimum(y, 1 - y))
    picture[edge < 0.09] = (0.9, 0.85, 0.75)
    picture[edge < 0.07] = (0.28, 0.36, 0.45)
    picture[edge < 0.03] = (0.9, 0.85, 0.75)
    pile = noise(size, 128, 3, 2)
    made = material("rug", "BSDF_PRINCIPLED", Roughness=1.0, Specular=0.1)
    textured(made, image_of("rug", picture * (0.85 + 0.15 * pile[:, :, None])), shader_of(made).inputs["Base Color"], "UV")
    box((2.7, 1.8, 0.012), (0.05, 0.75, 0.0065), (0, 0, 0.03), bumped(made, image_of("pile", pile, data=True), 0.006), 0.005, "rug")


# Furniture and things.

def wood(name, color, scale=(1, 1, 1)):
    size = 256
    grain = noise(size, 32, 12, 4, 0.6)[:, numpy.arange(size) // 20]
    made = material(name, "BSDF_PRINCIPLED", Roughness=0.32)
    shade = 0.75 + 0.4 * grain
    picture = image_of(name, shade[:, :, None] * numpy.asarray(color) ** (1 / 2.2))
    textured(made, picture, shader_of(made).inputs["Base Color"], "UV", {"Scale": scale})
    return made


def coffee_table(x, y):
    walnut = wood("table", (0.3, 0.15, 0.07))
    box((0.95, 0.6, 0.035), (x, y, 0.4), surface=walnut, bevel=0.012, name="table top")
    box((0.8, 0.46, 0.02), (x, y, 0.16), surface=walnut, bevel=0.006, name="shelf")
    for a in (-0.42, 0.42):
        for b in (-0.25, 0.25):
            box((0.04, 0.04, 0.37), (x + a, y + b, 0.1985), surface=walnut, bevel=0.006, name="leg")
    top = 0.4175
    glaze = material("glaze", "BSDF_PRINCIPLED", Base_Color=(0.1, 0.28, 0.36, 1), Roughness=0.15)
    lathe([(0, 0), (0.06, 0), (0.07, 0.008), (0.12, 0.04), (0.15, 0.085), (0.152, 0.09), (0.147, 0.088), (0.115, 0.05),
           (0.06, 0.02), (0, 0.015)], (x + 0.22, y - 0.08, top), glaze, name="bowl")
    for a, b, z, color in ((0.18, -0.1, 0.075, (0.75, 0.3, 0.03, 1)), (0.265, -0.09, 0.075, (0.8, 0.33, 0.03, 1)),
                           (0.22, -0.03, 0.08, (0.5, 0.55, 0.08, 1)), (0.215, -0.085, 0.125, (0.78, 0.32, 0.03, 1))):
        skin = material("fruit", "BSDF_PRINCIPLED", Base_Color=color, Roughness=0.35)
        cushion((0.08, 0.08, 0.076), (x + a, y + b, top + z), 0, skin, 1, 1)
    covers = ((0.55, 0.12, 0.1), (0.85, 0.8, 0.7), (0.1, 0.18, 0.3))
    for i, color in enumerate(covers):
        book((0.26 - 0.02 * i, 0.19, 0.026), (x - 0.25, y - 0.08, top + 0.0135 + 0.0265 * i), 0.15 - 0.2 * i, color)
    vase(x - 0.1, y + 0.13, top)


def book(size, location, turn, color):
    cover = material("cover", "BSDF_PRINCIPLED", Base_Color=(*color, 1), Roughness=0.45)
    paper = material("paper", Color=(0.8, 0.76, 0.66, 1))
    box(size, location, (0, 0, turn), cover, 0.002, "book")
    slope = (location[0] + 0.004 * math.sin(turn), location[1] - 0.004 * math.cos(turn), location[2])
    box((size[0] - 0.012, size[1], size[2] - 0.006), slope, (0, 0, turn), paper, name="pages")


def vase(x, y, z):
    """Stems with blossoms in a white vase."""
    white = material("porcelain", "BSDF_PRINCIPLED", Base_Color=gray(0.82), Roughness=0.12)
    lathe([(0, 0), (0.035, 0), (0.05, 0.03), (0.062, 0.08), (0.05, 0.14), (0.028, 0.18), (0.033, 0.205), (0.029, 0.204), (0.023, 0.18),
           (0.04, 0.14), (0.05, 0.08), (0.04, 0.03), (0, 0.02)], (x, y, z), white, name="vase")
    stem = material("stem", Color=(0.1, 0.2, 0.05, 1))
    petal = mixture("petal", ("BSDF_DIFFUSE", {"Color": (0.85, 0.5, 0.5, 1)}), ("BSDF_TRANSLUCENT", {"Color": (0.85, 0.4, 0.45, 1)}), 0.4)
    random = numpy.random.default_rng(5)
    blossom = flower(petal)
    for i in range(9):
        turn, lean = i * 2.4, random.uniform(0.03, 0.14)
        tip = (x + lean * math.cos(turn), y + lean * math.sin(turn), z + random.uniform(0.3, 0.42))
        tube([(x, y, z + 0.03), (x + 0.1 * (tip[0] - x), y + 0.1 * (tip[1] - y), z + 0.19), tip], 0.002, stem, 8, name="stem")
        copy_of(blossom, tip, (0.5 * math.sin(turn), 0.5 * math.cos(turn), turn))
    blossom.location = (x + 0.02, y - 0.01, z + 0.36)


def flower(surface):
    """Two rings of petals."""
    vertices, faces = [], []
    for ring, (count, long, rise) in enumerate(((6, 0.036, 0.012), (5, 0.026, 0.026))):
        for i in range(count):
            turn = math.tau * (i + ring / 2) / count
            for out, side, up in ((0, 0, 0), (0.6, 0.45, 0.5), (1, 0, 1), (0.6, -0.45, 0.5)):
                a, b = out * long, side * long
                vertices.append((a * math.cos(turn) - b * math.sin(turn), a * math.sin(turn) + b * math.cos(turn), up * rise))
            start = len(vertices) - 4
            faces += [(start, start + 1, start + 2), (start, start + 2, start + 3)]
    return mesh("blossom", vertices, faces, surface)


def plant(x, y):
    """A rubber fig in a basket."""
    basket = wood("basket", (0.6, 0.42, 0.22), (8, 8, 1))
    lathe([(0, 0), (0.15, 0), (0.19, 0.1), (0.2, 0.25), (0.18, 0.36), (0.17, 0.36), (0.18, 0.3), (0, 0.29)], (x, y, 0.002), basket,
          name="basket")
    bark = material("bark", Color=(0.2, 0.13, 0.08, 1))
    green = mixture("leaf", ("BSDF_PRINCIPLED", {"Base Color": (0.06, 0.17, 0.05, 1), "Roughness": 0.3}),
                    ("BSDF_TRANSLUCENT", {"Color": (0.25, 0.5, 0.08, 1)}), 0.3)
    random = numpy.random.default_rng(21)
    leaf = leaf_mesh(green)
    for trunk in range(3):
        lean = 0.25 * numpy.array([math.cos(2.1 * trunk + 5), math.sin(2.1 * trunk + 5)])
        tall = (1.75, 1.4, 1.15)[trunk]
        way = [(x + lean[0] * t * t, y + lean[1] * t * t, 0.27 + (tall - 0.27) * t) for t in numpy.linspace(0, 1, 5)]
        tube(way, 0.009, bark, 12, name="trunk")
        for i in range(15):
            t = 0.28 + 0.72 * i / 14
            turn = 2.4 * i + trunk
            size = random.uniform(1.0, 1.4) * (1.1 - 0.35 * t)
            at = (x + lean[0] * t * t, y + lean[1] * t * t, 0.27 + (tall - 0.27) * t)
            copy_of(leaf, at, (0, random.uniform(-0.9, -0.1), turn), (size, size, size))
    leaf.location, leaf.rotation_euler = (x, y, 0.8), (0, -0.4, 1)


def leaf_mesh(surface, rows=10):
    """A leaf of 30 cm along x, with a stalk, a fold and a droop."""
    vertices = [(0, -0.003, 0), (0, 0, 0), (0, 0.003, 0)]
    for i in range(rows + 1):
        t = i / rows
        wide = 0.003 + 0.075 * math.sin(math.pi * t ** 0.8) ** 0.8
        along, down = 0.06 + 0.24 * t, -0.12 * t * t
        vertices += [(along, -wide, down + 0.3 * wide), (along, 0, down), (along, wide, down + 0.3 * wide)]
    faces = [(3 * i + k, 3 * i + 3 + k, 3 * i + 4 + k, 3 * i + 1 + k) for i in range(rows + 1) for k in (0, 1)]
    return mesh("leaf", vertices, faces, surface, smooth=True)


def floor_lamp(x, y):
    brass = material("lamp brass", "BSDF_PRINCIPLED", Base_Color=(0.8, 0.58, 0.28, 1), Metallic=1, Roughness=0.2)
    shade = mixture("shade", ("BSDF_DIFFUSE", {"Color": (0.85, 0.8, 0.7, 1)}), ("BSDF_TRANSLUCENT", {"Color": (0.85, 0.8, 0.7, 1)}), 0.5)
    cylinder(0.14, 0.024, (x, y, 0.013), surface=brass, bevel=0.005, name="lamp foot")
    cylinder(0.01, 1.42, (x, y, 0.73), surface=brass, segments=24, name="lamp stand")
    cylinder(0.02, 0.07, (x, y, 1.46), surface=brass, segments=24, name="socket")
    lathe([(0.2, 1.4), (0.15, 1.68)], (x, y, 0), shade, name="lamp shade")


def bookcase(x, y, white):
    wide, deep, tall, shelves = 0.84, 0.32, 1.95, 5
    for side in (-1, 1):
        box((0.024, deep, tall), (x + side * (wide / 2 - 0.012), y, tall / 2 + 0.001), surface=white, bevel=0.002, name="bookcase side")
    box((wide - 0.05, 0.012, tall - 0.02), (x, y + deep / 2 - 0.01, tall / 2), surface=white, name="bookcase back")
    random = numpy.random.default_rng(17)
    for i in range(shelves + 1):
        z = 0.06 + i * (tall - 0.08) / shelves
        box((wide - 0.05, deep - 0.012, 0.022), (x, y - 0.005, z), surface=white, bevel=0.002, name="bookcase shelf")
        if i < shelves:
            books(x - wide / 2 + 0.03, x + wide / 2 - random.uniform(0.08, 0.35), y - 0.02, z + 0.0115, random)


def books(start, end, y, z, random):
    colors = ((0.5, 0.12, 0.08), (0.75, 0.68, 0.55), (0.08, 0.16, 0.28), (0.12, 0.25, 0.18), (0.7, 0.45, 0.12), (0.3, 0.28, 0.26),
              (0.55, 0.6, 0.6))
    covers = [material("spine", "BSDF_PRINCIPLED", Base_Color=(*color, 1), Roughness=0.5) for color in colors]
    while start < end:
        thick, tall = random.uniform(0.018, 0.045), random.uniform(0.19, 0.29)
        deep = tall * 0.72
        cover = covers[random.integers(len(covers))]
        box((thick, deep, tall), (start + thick / 2, y + random.uniform(-0.02, 0.0), z + tall / 2), surface=cover, bevel=0.003, name="book")
        start += thick + 0.001


def pictures():
    oak = wood("frame", (0.5, 0.33, 0.17))
    mat = material("mat", Color=gray(0.85))
    for x, z, wide, tall, seed in ((-0.78, 1.62, 0.5, 0.66, 1), (-0.05, 1.62, 0.66, 0.66, 2), (0.68, 1.62, 0.5, 0.66, 3)):
        y = DEPTH / 2
        box((wide, 0.008, tall), (x, y - 0.006, z), surface=mat, name="mat")
        for side in (-1, 1):
            box((0.025, 0.028, tall + 0.048), (x + side * (wide + 0.024) / 2, y - 0.0145, z), surface=oak, bevel=0.003, name="frame")
            box((wide - 0.002, 0.027, 0.025), (x, y - 0.014, z + side * (tall + 0.024) / 2), surface=oak, bevel=0.003, name="frame")
        art = material("art")
        textured(art, image_of("art", painting(seed)), shader_of(art).inputs["Color"], "UV")
        plane((wide - 0.14, tall - 0.16), (x, y - 0.011, z), (math.pi / 2, 0, 0), art, "art")


def painting(seed, size=192):
    """Hills under a sun, in flat colours."""
    random = numpy.random.default_rng(seed)
    y, x = numpy.mgrid[0:size, 0:size] / size
    picture = numpy.empty((size, size, 3))
    picture[:] = ((0.93, 0.87, 0.76), (0.9, 0.82, 0.74), (0.92, 0.9, 0.84))[seed % 3]
    picture[(x - random.uniform(0.3, 0.7)) ** 2 + (y - 0.7) ** 2 < 0.02] = (0.84, 0.45, 0.25)
    for i, color in enumerate(((0.75, 0.72, 0.6), (0.5, 0.6, 0.58), (0.25, 0.42, 0.45), (0.12, 0.24, 0.3))):
        line = 0.6 - 0.14 * i + 0.07 * numpy.sin(random.uniform(3, 9) * x + random.uniform(0, 6)) + 0.02 * numpy.sin(17 * x + i)
        picture[y < line] = color
    return picture
