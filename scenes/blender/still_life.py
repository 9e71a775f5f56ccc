"""Fruit in a painted bowl, a brass jug, bread, wine and a peeled lemon on an old table, in the light of a window on the left."""
import math

import numpy
from kit import (aimed, blend, box, bumped, camera, copy_of, image_of, lathe, light, material, mesh, noise, painted, plane, shader_of,
                 sky, smooth_below, sphere, subdivided, tube)

EDGE = -0.36  # y of the table's front edge
BOWL = -0.17, 0.02


def wood(size=1024, boards=4):
    """Boards along x: their colours and heights."""
    row = numpy.arange(size)
    stretched = noise(size, 8, 1)[:, row // 8 % size]
    fibres = noise(size, 64, 2, 4, 0.7)[:, row // 16 % size]
    waves = noise(size, 4, 3, 3)[:, row // 3 % size]
    board = row[:, None] * boards // size
    rings = 0.5 + 0.5 * numpy.sin(2 * math.pi * (7 * waves + 2.5 * board + row[:, None] / size * 18))
    tone = numpy.array([0.35, 0.6, 0.2, 0.5])[board]
    share = numpy.clip(0.4 * rings + 0.5 * fibres + 0.4 * (stretched - 0.5) + 0.6 * (tone - 0.4), 0, 1)
    across = numpy.abs((row / size * boards + 0.5) % 1 - 0.5)[:, None] * numpy.ones(size)
    gap = numpy.exp(-(across / 0.012) ** 2)
    color = blend((0.27, 0.16, 0.09), (0.53, 0.35, 0.20), share) * (1 - 0.75 * gap)[..., None]
    return color, 0.25 * fibres + 0.15 * rings + 0.6 * (1 - gap)


def table():
    color, height = wood()
    made = bumped(painted("wood", color, 0.42), image_of("grain", height, data=True), 0.003)
    box((1.9, 0.8, 0.045), (0, EDGE + 0.4, -0.0225), surface=made, bevel=0.006, name="table")
    box((1.7, 0.025, 0.12), (0, EDGE + 0.09, -0.105), surface=made, bevel=0.003, name="apron")


def linen(size=1024):
    """A weave with blue stripes near two ends: its colours and heights."""
    row, column = numpy.mgrid[0:size, 0:size]
    over = (row // 4 + column // 4) % 2
    thread = numpy.where(over, numpy.abs(numpy.sin(math.pi * (row + 0.5) / 4)), numpy.abs(numpy.sin(math.pi * (column + 0.5) / 4)))
    v = row / size
    stripe = sum(numpy.where(abs(v - at) < wide, 1.0, 0.0) for at, wide in ((0.08, 0.012), (0.11, 0.004), (0.05, 0.004)))
    color = blend((0.86, 0.82, 0.74), (0.20, 0.29, 0.47), 0.85 * stripe)
    return color * (0.82 + 0.1 * thread + 0.08 * noise(size, 64, 5, 3))[..., None], thread


def cloth(left, right, back, hanging):
    """Linen that lies in folds on the table and hangs over its front edge. Things press it flat."""
    across, along = 220, 260
    s, t = numpy.meshgrid(numpy.linspace(0, 1, across), numpy.linspace(0, back - EDGE + hanging, along))
    creases = noise(256, 3, 12, 3)
    at = creases[(t / 0.9 * 255).astype(int) % 256, (s * 255).astype(int) % 256]
    # t is the length from the back to the edge, around it, and down.
    corner, flat = 0.012, back - EDGE
    turn = numpy.clip((t - flat) / corner, 0, math.pi / 2)
    down = numpy.maximum(t - flat - corner * math.pi / 2, 0)
    x = left + (right - left) * s + 0.02 * (at - 0.5) + 0.03 * numpy.minimum(t, flat) * (0.5 - s)
    y = back - numpy.minimum(t, flat) - corner * numpy.sin(turn)
    z = -corner * (1 - numpy.cos(turn)) - down
    pressed = numpy.ones(s.shape)
    for px, py, radius in ((*BOWL, 0.1), (-0.13, -0.21, 0.09), (-0.36, -0.17, 0.05)):
        pressed *= 1 - numpy.exp(-(numpy.hypot(x - px, y - py) / radius) ** 4)
    ridges = (0.5 + 0.5 * numpy.sin(2 * math.pi * (3.2 * s + 1.6 * at + 1.1 * t))) ** 3 * at
    folds = 0.5 + 0.5 * numpy.sin(2 * math.pi * (4.3 * s + 0.9 * at + 0.2))
    lift = 0.002 + pressed * 0.03 * ridges * numpy.exp(-8 * down) + (0.004 + 0.05 * numpy.minimum(down / 0.12, 1)) * folds * numpy.clip(
        (t - flat + 0.06) / 0.08, 0, 1)
    points = numpy.stack([x, y - lift * numpy.sin(turn), z + lift * numpy.cos(turn)], axis=-1).reshape(-1, 3)
    first = (numpy.arange(along - 1)[:, None] * across + numpy.arange(across - 1)).ravel()
    faces = numpy.stack([first, first + across, first + across + 1, first + 1], axis=-1)
    uvs = numpy.stack([s, 1 - t / t.max()], axis=-1).reshape(-1, 2)[faces]
    color, height = linen()
    surface = bumped(painted("linen", color, 0.85), image_of("weave", height, data=True), 0.0003)
    mesh("cloth", points, faces, surface, uvs, smooth=True)


def settled(points, radii, hold, rounds=400):
    """Balls that have fallen into a heap. `hold` moves them back to where they may be."""
    points = numpy.array(points)
    for _ in range(rounds):
        points[:, 2] -= 0.0006
        apart = points[:, None] - points[None]
        gap = numpy.linalg.norm(apart, axis=2) + 1e-9
        overlap = numpy.clip(radii[:, None] + radii[None] - gap, 0, None) * (1 - numpy.eye(len(points)))
        points += 0.5 * ((overlap / gap).clip(0, 1)[..., None] * apart).sum(axis=1)
        points = hold(points)
    return points


def apple_skin(seed):
    """Red streaks on yellow, from the stalk (v = 1) down."""
    size = 256
    v = (numpy.arange(size)[:, None] + 0.5) / size
    streaks = noise(size, 32, seed, 3)[numpy.arange(size)[:, None] // 6, numpy.arange(size)]
    blush = noise(size, 3, seed + 1, 3)
    share = numpy.clip(1.9 * blush + 0.9 * streaks - 0.75 - 0.5 * numpy.exp(-((1 - v) / 0.2) ** 2), 0, 1)
    color = blend((0.82, 0.70, 0.26), (0.66, 0.10, 0.09), share)
    dots = numpy.clip(6 * noise(size, 48, seed + 2, 1) - 5, 0, 1)
    return blend(color, (0.9, 0.8, 0.55), 0.6 * dots)


def stalk(item, height, bark, random):
    lean = random.uniform(-0.006, 0.006)
    tube([(0, 0, height - 0.012), (0.001, 0, height), (lean, 0.004, height + 0.016)], 0.0013, bark, 8, name="stalk").parent = item


def apples(random):
    bark = material("stalk", Color=(0.12, 0.07, 0.03, 1))
    angles = numpy.linspace(-math.pi / 2, math.pi / 2, 25)
    radius = 0.04 * numpy.cos(angles) ** 0.75
    height = 0.037 * numpy.sin(angles) - 0.011 * numpy.sign(angles) * numpy.exp(-(radius / 0.012) ** 2)
    profile = [(0 if i in (0, 24) else r, h) for i, (r, h) in enumerate(zip(radius, height * (1 - 0.06 * (angles < 0))))]
    skins = [painted(f"apple {seed}", apple_skin(seed), 0.28) for seed in (30, 40, 50)]
    kinds = [lathe(profile, surface=skin, segments=48, name="apple") for skin in skins]
    centre = numpy.array([*BOWL, 0.03 + 0.17])

    def inside(points):
        out = points - centre
        away = numpy.linalg.norm(out, axis=1, keepdims=True)
        return centre + out * numpy.minimum(1, (0.17 - 0.041) / away)
    start = centre + random.normal(size=(8, 3)) * (0.05, 0.05, 0.03) + (0, 0, 0.03)
    places = [*settled(start, numpy.full(8, 0.0402), inside), (-0.36, -0.17, 0.037)]
    for i, place in enumerate(places):
        turn = (random.normal() * 0.6, random.normal() * 0.6, random.uniform(0, 6)) if i < 8 else (0.25, 0.1, 1)
        item = kinds[i] if i < 3 else copy_of(kinds[i % 3], place)
        item.location, item.rotation_euler = place, turn
        stalk(item, 0.03, bark, random)


def grape_skin(name, color):
    made = material(name, "BSDF_PRINCIPLED", Base_Color=color, Subsurface=1.0, Subsurface_Color=color, Roughness=0.22,
                    Subsurface_Radius=(0.012, 0.010, 0.003))
    shader_of(made).subsurface_method = "RANDOM_WALK_FIXED_RADIUS"
    return made


def grapes(random):
    """A cluster on the cloth before the bowl."""
    radius, count = 0.0108, 64
    along = random.random(count) ** 1.2
    axis = numpy.stack([-0.24 + 0.2 * along, -0.205 - 0.05 * along], axis=1)
    wide = 0.03 * (1.15 - along)
    start = numpy.column_stack([axis + random.normal(size=(count, 2)) * wide[:, None], random.uniform(0.02, 0.09, count)])

    def above(points):
        points[:, 2] = numpy.maximum(points[:, 2], radius + 0.003)
        away = points[:, :2] - axis
        points[:, :2] -= 0.3 * away * numpy.clip(1 - wide / numpy.maximum(numpy.linalg.norm(away, axis=1), 1e-6), 0, 1)[:, None]
        return points
    kinds = [sphere(radius, surface=grape_skin(f"grape {i}", color), segments=32, name="grape")
             for i, color in enumerate(((0.40, 0.42, 0.07, 1), (0.46, 0.38, 0.07, 1), (0.42, 0.20, 0.07, 1)))]
    for i, place in enumerate(settled(start, numpy.full(count, radius), above)):
        item = kinds[i] if i < 3 else copy_of(kinds[random.choice(3, p=(0.5, 0.3, 0.2))], place)
        item.location = place
    bark = material("vine", Color=(0.2, 0.15, 0.05, 1))
    tube([(-0.16, -0.225, 0.035), (-0.2, -0.21, 0.05), (-0.24, -0.2, 0.055), (-0.275, -0.2, 0.04), (-0.295, -0.185, 0.035)], 0.002, bark, 8,
         name="vine")


def bowl():
    """White glaze, painted in blue."""
    size = 512
    v, u = (numpy.mgrid[0:size, 0:size] + 0.5) / size
    petals = numpy.cos(12 * 2 * math.pi * u)
    flower = numpy.clip(8 * (0.09 * (0.6 + 0.4 * numpy.cos(5 * numpy.arctan2((v - 0.22) * 4, (u * 8 % 1 - 0.5))))
                             - numpy.hypot(u * 8 % 1 - 0.5, (v - 0.22) * 4) * 0.28), 0, 1)
    bands = sum(numpy.exp(-((v - at) / wide) ** 2) for at, wide in ((0.06, 0.008), (0.40, 0.006), (0.43, 0.012), (0.60, 0.012)))
    vine = numpy.exp(-((v - 0.33 - 0.03 * petals) / 0.01) ** 2)
    blue = numpy.clip(bands + flower + vine, 0, 1) * (0.65 + 0.35 * noise(size, 24, 61, 3))
    glaze = painted("glaze", blend((0.88, 0.87, 0.82), (0.10, 0.18, 0.42), blue), 0.12)
    angles = numpy.linspace(0.3, 1.02, 24)
    inner = [(0.17 * math.sin(a), 0.2 - 0.17 * math.cos(a)) for a in angles]
    outer = [(0.176 * math.sin(a), 0.2 - 0.176 * math.cos(a)) for a in angles]
    profile = [(0, 0.006), (0.05, 0.006), (0.052, 0), (0.058, 0.001), *outer[1:], (0.1535, 0.112), *inner[::-1], (0, 0.03)]
    smooth_below(lathe(profile, (*BOWL, 0.0025), glaze, 96, name="bowl"), 0.9)


def jug(location):
    brass = bumped(material("brass", "BSDF_PRINCIPLED", Base_Color=(0.70, 0.47, 0.18, 1), Metallic=1.0, Roughness=0.24),
                   image_of("dents", noise(256, 6, 71, 3), data=True), 0.002)
    outside = [(0, 0), (0.058, 0), (0.06, 0.006), (0.054, 0.014), (0.05, 0.022), (0.062, 0.04), (0.08, 0.075), (0.085, 0.105),
               (0.078, 0.14), (0.058, 0.175), (0.044, 0.2), (0.041, 0.22), (0.046, 0.245), (0.056, 0.262), (0.058, 0.266)]
    body = subdivided(lathe([*outside, (0.055, 0.266), (0.043, 0.245), (0.038, 0.22), (0.041, 0.2), (0.055, 0.173), (0.07, 0.1), (0, 0.02)],
                            location, brass, 48, name="jug"), 1)
    for vertex in body.data.vertices:  # A spout to the left.
        x, y, z = vertex.co
        if z > 0.21:
            pull = ((z - 0.21) / 0.056) ** 2 * math.exp(-(math.atan2(y, -x) / 0.5) ** 2)
            vertex.co = (x - 0.026 * pull, y, z + 0.012 * pull)
    x, y, z = location
    bend = [(0.05, 0.252), (0.085, 0.262), (0.125, 0.24), (0.13, 0.19), (0.108, 0.14), (0.085, 0.115), (0.078, 0.112)]
    tube([(x + dx, y, z + dz) for dx, dz in bend], 0.0065, brass, 16, name="handle")


def goblet(location):
    """A glass of white wine."""
    glass = material("glass", "BSDF_GLASS", IOR=1.5, Roughness=0.0)
    wine = material("wine", "BSDF_PRINCIPLED", Base_Color=(0.93, 0.68, 0.22, 1), IOR=1.34, Roughness=0.0, Transmission=1.0)
    inner = [(0.0, 0.078), (0.016, 0.081), (0.028, 0.09), (0.036, 0.105), (0.0385, 0.125), (0.037, 0.145), (0.034, 0.17)]
    outer = [(0, 0), (0.034, 0), (0.0355, 0.0015), (0.033, 0.004), (0.012, 0.011), (0.006, 0.02), (0.0055, 0.04), (0.01, 0.05),
             (0.006, 0.06), (0.008, 0.07), (0.018, 0.077), (0.03, 0.087), (0.038, 0.104), (0.0405, 0.125), (0.039, 0.145), (0.0355, 0.17),
             (0.0348, 0.1708)]
    subdivided(lathe(outer + inner[::-1], location, glass, 48, name="goblet"), 2)
    level = [(0, 0.0778), (0.0162, 0.0808), (0.0282, 0.0898), (0.0362, 0.1049), (0.0387, 0.125), (0.0385, 0.13), (0.0384, 0.1302),
             (0, 0.1302)]
    subdivided(lathe(level, location, wine, 48, name="wine"), 2)


def bread(location):
    crumb = noise(256, 6, 81)
    crust = numpy.clip(1.6 * crumb - 0.3, 0, 1)
    loaf = sphere(0.1, location, None, 128, "bread")
    colors = blend((0.42, 0.22, 0.09), (0.74, 0.50, 0.25), crust)
    flour = blend(colors, (0.9, 0.84, 0.72), numpy.clip(3 * noise(256, 10, 82) - 1.9, 0, 0.7))
    loaf.data.materials.append(bumped(painted("crust", flour, 0.75), image_of("crust heights", noise(256, 24, 83), data=True), 0.006))
    for vertex in loaf.data.vertices:
        x, y, z = vertex.co
        cut = sum(math.exp(-((x - 0.7 * y - at) / 0.007) ** 2) for at in (-0.06, -0.005, 0.05)) if z > 0 else 0
        size = 1 - 0.09 * cut * max(z / 0.1, 0) + 0.03 * math.sin(31 * x + 2) * math.sin(27 * y)
        vertex.co = (1.3 * x * size, 1.0 * y * size, (0.68 if z > 0 else 0.4) * z * size + 0.039)


def lemons(plate_x, plate_y):
    pewter = bumped(material("pewter", "BSDF_PRINCIPLED", Base_Color=(0.42, 0.41, 0.39, 1), Metallic=1.0, Roughness=0.27),
                    image_of("scratches", noise(256, 16, 91, 4), data=True), 0.001)
    lathe([(0, 0), (0.07, 0), (0.078, 0.003), (0.088, 0.011), (0.118, 0.016), (0.12, 0.018), (0.118, 0.0195), (0.087, 0.0145),
           (0.076, 0.006), (0.07, 0.003), (0, 0.003)], (plate_x, plate_y, 0.0005), pewter, 96, name="plate")
    peel = bumped(material("peel", "BSDF_PRINCIPLED", Base_Color=(0.88, 0.60, 0.04, 1), Roughness=0.38),
                  image_of("pores", noise(128, 20, 92, 2), data=True), 0.0012)
    outline = [(0, -0.042), (0.008, -0.041), (0.013, -0.035), (0.023, -0.026), (0.029, -0.012), (0.0305, 0)]
    whole = lathe([*outline, (0.029, 0.012), (0.022, 0.026), (0.009, 0.036), (0, 0.037)], surface=peel, segments=48, name="lemon")
    whole.location = plate_x + 0.035, plate_y + 0.03, 0.0345
    whole.rotation_euler = 1.45, 0, 0.9
    half = lathe(outline, (plate_x - 0.035, plate_y - 0.02, 0.034), peel, 48, name="half lemon")
    half.rotation_euler = math.radians(62), 0, math.radians(-25)
    pulp(half, 0.0305)
    spiral(plate_x + 0.04, plate_y - 0.085, peel)


def pulp(half, radius):
    """The cut face of half a lemon: its parts, the white between them, and the rim."""
    size = 512
    y, x = (numpy.mgrid[0:size, 0:size] + 0.5) / size * 2 - 1
    away, turn = numpy.hypot(x, y), numpy.arctan2(y, x) / (2 * math.pi) * 10
    between = numpy.abs(turn % 1 - 0.5) * away * 2 * math.pi / 10
    skin = numpy.clip((0.5 * away * 2 * math.pi / 10 - between) / 0.02, 0, 1) * numpy.clip((0.84 - away) / 0.03, 0, 1) * numpy.clip(
        (away - 0.08) / 0.03, 0, 1)
    cells = noise(size, 40, 95, 3)
    color = blend(blend((0.96, 0.93, 0.76), (0.92, 0.78, 0.30), skin * (0.55 + 0.45 * cells)), (0.93, 0.78, 0.16),
                  numpy.clip((away - 0.94) / 0.02, 0, 1))
    surface = bumped(painted("pulp", color, 0.15), image_of("cells", 0.5 * cells + 0.5 * (1 - skin), data=True), 0.001)
    turns = numpy.linspace(0, 2 * math.pi, 49)[:-1]
    rim = numpy.stack([numpy.cos(turns), numpy.sin(turns)], axis=1)
    face = mesh("pulp", [(*point, 0.0) for point in radius * rim], [range(48)], surface, rim * 0.5 + 0.5)
    face.parent = half


def spiral(x, y, peel):
    """Peel that winds from the plate over the table's edge."""
    pith = material("pith", "BSDF_PRINCIPLED", Base_Color=(0.85, 0.76, 0.5, 1), Roughness=0.6)
    t = numpy.linspace(0, 1, 120)
    turn = 2 * math.pi * 3.3 * t + 2.4
    wide = 0.027 - 0.007 * t
    drop = 0.030 - 0.02 * t - 0.14 * numpy.maximum(t - 0.4, 0) ** 1.2
    middle = numpy.stack([x + 0.03 * t, y - 0.25 * numpy.minimum(t, 0.45) - 0.03 * t, drop], axis=1)
    out = numpy.stack([numpy.cos(turn), numpy.sin(turn), 0 * t], axis=1)
    ring = middle + wide[:, None] * out
    lean = numpy.array([0, 0, 1.0]) * 0.007
    for name, depth, surface in (("peel", 0.0, peel), ("pith", -0.0018, pith)):
        points = numpy.concatenate([ring + depth * out - lean, ring + depth * out + lean])
        faces = [(i, i + 1, i + 121, i + 120) for i in range(119)]
        mesh(name, points, faces, surface, [(0, 0), (1, 0), (1, 1), (0, 1)] * 119, smooth=True)


def build():
    random = numpy.random.default_rng(3)
    backdrop = noise(512, 4, 7)
    wall = painted("wall", blend((0.40, 0.33, 0.24), (0.51, 0.43, 0.32), backdrop), 0.9)
    plane((5, 3), (0, 0.75, 0.6), (math.pi / 2, 0, 0), wall, "wall")
    table()
    cloth(-0.47, 0.0, 0.22, 0.2)
    bowl()
    apples(random)
    grapes(random)
    jug((0.06, 0.19, 0.0))
    bread((0.33, 0.19, 0.0))
    lemons(0.17, -0.2)
    goblet((0.25, 0.02, 0.0005))
    box((0.02, 1.0, 1.6), (-1.08, 0.33, 0.8), surface=material("board", Color=(0.05, 0.04, 0.03, 1)), name="board")
    aimed(light("AREA", 72, (-1.5, -0.7, 1.1), shape="RECTANGLE", size=0.8, size_y=1.1, color=(1, 0.92, 0.8)), (0, 0.05, 0.05))
    sky(0.03, (1, 0.8, 0.6, 1))
    camera((0.0, -1.5, 0.42), (-0.015, 0, 0.07), 61)
