"""Candles burn around a small wax bust on old books. Their light shines through the wax."""
import math

import bpy
import numpy
from kit import (aimed, box, bumped, camera, copy_of, gray, image_of, lathe, light, material, mesh, mixture, noise, plane, shader_of, sky,
                 textured, torus, tube)


def wax(name, color, reach=1.0):
    """Wax of this colour. `reach` scales how far light gets in it."""
    made = material(name, "BSDF_PRINCIPLED", Base_Color=(*color, 1), Subsurface=1.0, Subsurface_Color=(*color, 1), Roughness=0.38,
                    Subsurface_Radius=[reach * part for part in (0.06, 0.035, 0.018)])
    shader_of(made).subsurface_method = "RANDOM_WALK_FIXED_RADIUS"
    return made


def candle(location, radius, height, surface, seed, drips=7, flame=None):
    """A candle with a melted rim, wax that has run down, a wick, and a flame."""
    random = numpy.random.default_rng(seed)
    around, levels = 128, 64
    turn = numpy.linspace(0, 2 * math.pi, around, endpoint=False)
    rough = noise(256, 3, seed, 3)
    ring = rough[8, (turn / (2 * math.pi) * 256).astype(int)]
    top = height + 0.16 * radius * (ring - 0.5)
    z = numpy.linspace(0, 1, levels)[:, None] ** 0.9 * top
    dents = rough[(z / 0.2 * 255).astype(int) % 256, (turn / (2 * math.pi) * 255).astype(int)]
    r = radius * (0.975 + 0.05 * dents + 0.35 * numpy.exp(-z / 0.0035) - 0.1 * numpy.exp(-(top - z) / 0.008))
    for _ in range(drips):
        start, length, wide = random.uniform(0, 2 * math.pi), height * random.uniform(0.2, 0.85), random.uniform(0.0028, 0.0045)
        way = numpy.angle(numpy.exp(1j * (turn - start - 0.06 * numpy.sin(z * 70 + start)))) * radius
        end = height - length
        run = (0.75 + 0.25 * numpy.sin(z * 160 + start)) / (1 + numpy.exp(-(z - end) / 0.002)) + 0.7 * numpy.exp(-((z - end) / 0.005) ** 2)
        r = r + 0.75 * wide * run * numpy.exp(-(way / wide) ** 2) * numpy.clip((top - z) / 0.006, 0.25, 1)
    share = numpy.linspace(0, 1, 24)[1:-1, None]  # From the rim to the wick.
    inner = (r[-1] - 0.0015 * numpy.sin(math.pi * share)) * (1 - share)
    dish = top * (1 - share) + height * share - 0.3 * radius * (1 - (1 - share) ** 3) + 0.0025 * (numpy.exp(-share / 0.06) - 1 + share)
    rows_r, rows_z = numpy.concatenate([r, inner]), numpy.concatenate([z, dish])
    points = numpy.stack([rows_r * numpy.cos(turn), rows_r * numpy.sin(turn), rows_z], axis=-1).reshape(-1, 3)
    pool = height - 0.3 * radius
    points = numpy.concatenate([points, [(0, 0, pool), (0, 0, 0)]])
    last, faces = len(rows_r) - 1, []
    for i in range(around):
        j = (i + 1) % around
        faces += [(a * around + i, a * around + j, (a + 1) * around + j, (a + 1) * around + i) for a in range(last)]
        faces += [(last * around + i, last * around + j, len(points) - 2), (j, i, len(points) - 1)]
    made = mesh("candle", points, faces, surface, smooth=True)
    made.location = location
    x, y, base = location
    wick = base + pool
    tube([(x, y, wick - 0.004), (x, y, wick + 0.004), (x + 0.0006, y, wick + 0.008), (x + 0.0025, y, wick + 0.0115)], 0.0009,
         bpy.data.materials["wick"], 8, name="wick")
    if flame is not None:
        copy_of(flame, (x + 0.0006, y, wick + 0.004), (0, 0.03, 0), [random.uniform(0.9, 1.1)] * 3)
        light("POINT", 0.4, (x, y, wick + 0.017), shadow_soft_size=0.004, color=(1, 0.56, 0.22)).visible_camera = False


def flame_mesh():
    """A flame that is seen through. A small lamp within it gives its light."""
    t = numpy.linspace(0, 1, 40)
    glow = numpy.clip((t - 0.12) / 0.25, 0, 1)[:, None]
    tip = numpy.clip((t - 0.75) / 0.25, 0, 1)[:, None]
    foot, middle, end = (numpy.array(part) for part in ((0.12, 0.10, 0.2), (1, 0.86, 0.5), (1, 0.62, 0.2)))
    color = (foot * (1 - glow) + middle * glow) * (1 - tip) + end * tip
    made = mixture("flame", ("BSDF_TRANSPARENT", {}), ("EMISSION", {"Strength": 2.6}), 0.5)
    emission = next(node for node in made.node_tree.nodes if node.type == "EMISSION")
    textured(made, image_of("flame", numpy.repeat(color[:, None], 4, axis=1)), emission.inputs["Color"], "UV")
    radius = 0.0125 * t ** 0.55 * (1 - t) ** 0.8 * (1 - 0.25 * t)
    return lathe([(0 if i in (0, 39) else r, 0.034 * h) for i, (r, h) in enumerate(zip(radius, t))], (0, 0, -1), made, 32, name="flame")


def bust(location, turn, surface, scale):
    """A head with curls, neck and shoulders: rounded parts that are joined to one body and smoothed. It looks along -y."""
    parts = [((0, 0.008, 0.02), (0.037, 0.044, 0.038)), ((0, -0.012, -0.01), (0.029, 0.030, 0.046)),
             ((0, -0.031, -0.047), (0.012, 0.010, 0.009)),
             ((0, -0.041, -0.003), (0.0045, 0.0085, 0.016)), ((0, -0.0475, -0.013), (0.0055, 0.006, 0.0055)),
             ((0, -0.0385, -0.0265), (0.0095, 0.0045, 0.0028)), ((0, -0.0375, -0.0325), (0.0075, 0.005, 0.0034)),
             ((0, 0.010, -0.06), (0.021, 0.023, 0.05)), ((0, 0.016, -0.088), (0.046, 0.022, 0.017)),
             ((0, 0.008, -0.115), (0.047, 0.033, 0.038)), ((0, 0.010, -0.155), (0.017, 0.017, 0.03)),
             ((0, 0.010, -0.172), (0.034, 0.034, 0.010))]
    for side in (-1, 1):
        parts += [((side * 0.005, -0.0435, -0.015), (0.0038, 0.0045, 0.0035)), ((side * 0.013, -0.0335, 0.0115), (0.0115, 0.006, 0.003)),
                  ((side * 0.0132, -0.0295, 0.003), (0.0075, 0.0068, 0.0062)), ((side * 0.017, -0.026, -0.014), (0.011, 0.010, 0.011)),
                  ((side * 0.0365, 0.006, -0.002), (0.004, 0.009, 0.013)), ((side * 0.017, -0.013, -0.036), (0.010, 0.016, 0.012)),
                  ((side * 0.048, 0.014, -0.108), (0.025, 0.024, 0.026))]
    golden = math.pi * (3 - math.sqrt(5))
    for i in range(190):
        up, around = 1 - 2 * (i + 0.5) / 190, golden * i
        out = numpy.array([math.sqrt(1 - up * up) * math.cos(around), math.sqrt(1 - up * up) * math.sin(around), up])
        if out[1] * 0.8 + out[2] > 0.22 or (out[1] > 0.3 and out[2] > -0.6):
            size = 0.0068 + 0.0018 * math.sin(7 * i)
            parts.append((numpy.array([0, 0.009, 0.02]) + out * (0.0375, 0.0445, 0.039), (size, size, size)))
    ball = ellipsoid(24, 32)
    points, faces = [], []
    for i, (centre, radii) in enumerate(parts):
        faces += [[len(ball[0]) * i + corner for corner in face] for face in ball[1]]
        points.append(numpy.array(centre) + ball[0] * radii)
    for side in (-1, 1):  # The sockets of the eyes.
        away = (points[1] - (side * 0.0135, -0.037, 0.003)) / (0.009, 0.02, 0.007)
        points[1][:, 1] += 0.008 * numpy.exp(-(away ** 2).sum(axis=1))
    made = mesh("bust", numpy.concatenate(points), faces, surface)
    made.location, made.rotation_euler, made.scale = location, (0, 0, turn), [scale] * 3
    joined = made.modifiers.new("joined", "REMESH")
    joined.mode, joined.voxel_size, joined.use_smooth_shade = "VOXEL", 0.00125, True
    smoothed = made.modifiers.new("smoothed", "SMOOTH")
    smoothed.factor, smoothed.iterations = 0.5, 5


def ellipsoid(rows, columns):
    """Points and faces of a unit ball."""
    points = [(0, 0, -1)]
    for i in range(1, rows):
        up = math.pi * (i / rows - 0.5)
        points += [(math.cos(up) * math.cos(2 * math.pi * j / columns), math.cos(up) * math.sin(2 * math.pi * j / columns), math.sin(up))
                   for j in range(columns)]
    points.append((0, 0, 1))
    faces = []
    for j in range(columns):
        k = (j + 1) % columns
        faces += [(0, 1 + k, 1 + j), (len(points) - 1, len(points) - 1 - columns + j, len(points) - 1 - columns + k)]
        faces += [(1 + i * columns + j, 1 + i * columns + k, 1 + (i + 1) * columns + k, 1 + (i + 1) * columns + j) for i in range(rows - 2)]
    return numpy.array(points), faces


def book(size, location, turn, color):
    """A closed book with a leather cover. Its back is on the left."""
    x, y, z = size
    leather = bumped(material("leather", "BSDF_PRINCIPLED", Base_Color=(*color, 1), Roughness=0.5),
                     image_of("leather", noise(256, 32, 4, 3), data=True), 0.0008)
    rows = numpy.random.default_rng(5).uniform(0.6, 1, 128)[:, None] * numpy.ones(4)
    paper = material("paper", "BSDF_PRINCIPLED", Roughness=0.9)
    textured(paper, image_of("pages", rows[..., None] * (0.82, 0.74, 0.58)), shader_of(paper).inputs["Base Color"], "UV")
    parts = [box((x, y, 0.003), (0, 0, 0.0015), surface=leather, bevel=0.001, name="cover"),
             box((x, y, 0.003), (0, 0, z - 0.0015), surface=leather, bevel=0.001, name="cover"),
             box((0.004, y, z - 0.007), (-x / 2 + 0.0022, 0, z / 2), surface=leather, bevel=0.001, name="back"),
             box((x - 0.009, y - 0.01, z - 0.0064), (0.0, 0, z / 2), surface=paper, name="pages")]
    for part in parts:
        cos, sin = math.cos(turn), math.sin(turn)
        dx, dy, dz = part.location
        part.location = location[0] + cos * dx - sin * dy, location[1] + sin * dx + cos * dy, location[2] + dz
        part.rotation_euler = 0, 0, turn


def holder(location, brass):
    """A brass dish for a candle, with a ring to carry it by."""
    x, y, z = location
    lower = [(0, 0), (0.045, 0), (0.052, 0.004), (0.062, 0.012), (0.064, 0.0135)]
    lathe([*lower, (0.062, 0.0145), (0.05, 0.006), (0.044, 0.003), (0, 0.003)], location, brass, 96, name="holder")
    torus(0.016, 0.0028, (x - 0.074, y - 0.018, z + 0.016), (math.pi / 2, 0, 0.3), brass, name="ring")


def build():
    material("wick", Color=gray(0.015))
    grain = noise(512, 4, 1)[:, numpy.arange(512) // 6]
    wood = material("wood", "BSDF_PRINCIPLED", Roughness=0.33)
    textured(wood, image_of("wood", grain[..., None] * (0.28, 0.20, 0.14) + (0.36, 0.23, 0.14)), shader_of(wood).inputs["Base Color"], "UV")
    bumped(wood, image_of("wood heights", grain, data=True), 0.003)
    plane((1.6, 1.0), (0, 0.1, 0), surface=wood, name="table")
    wall = material("wall", "BSDF_PRINCIPLED", Roughness=0.9)
    plaster = image_of("wall", noise(512, 5, 2)[..., None] * (0.14, 0.11, 0.08) + (0.40, 0.31, 0.23))
    textured(wall, plaster, shader_of(wall).inputs["Base Color"], "UV")
    plane((2.4, 1.4), (0, 0.42, 0.5), (math.pi / 2, 0, 0), wall, "wall")

    ivory, honey, red = wax("ivory", (0.78, 0.70, 0.56)), wax("honey", (0.74, 0.50, 0.17)), wax("red", (0.55, 0.05, 0.035), 0.8)
    book((0.2, 0.15, 0.028), (0.075, 0.06, 0.0), 0.12, (0.26, 0.05, 0.03))
    book((0.17, 0.13, 0.022), (0.07, 0.06, 0.0282), -0.1, (0.06, 0.14, 0.10))
    bust((0.07, 0.05, 0.0502 + 0.145), -0.35, wax("bust", (0.78, 0.68, 0.54), 0.5), 0.8)
    brass = material("brass", "BSDF_PRINCIPLED", Base_Color=(0.70, 0.47, 0.18, 1), Metallic=1.0, Roughness=0.25)
    holder((-0.115, 0.0, 0.0), brass)
    flame = flame_mesh()
    candle((-0.115, 0.0, 0.0032), 0.022, 0.15, ivory, 11, 8, flame)
    candle((-0.025, -0.085, 0.0), 0.026, 0.055, red, 12, 5, flame)
    candle((-0.19, 0.09, 0.0), 0.03, 0.11, honey, 13, 7, flame)
    candle((0.165, -0.07, 0.0), 0.028, 0.085, honey, 14, 6, flame)
    candle((0.185, 0.16, 0.0), 0.026, 0.17, ivory, 15, 7, flame)
    bpy.data.objects.remove(flame)
    aimed(light("AREA", 3.5, (0.7, -1.0, 0.8), size=0.6, color=(1, 0.68, 0.42)), (0, 0, 0.1))
    sky(0.008, (0.6, 0.7, 1, 1))
    camera((0.0, -0.78, 0.21), (0.0, 0.0, 0.115), 62, fstop=8, focus=(0.05, 0.0, 0.15))
