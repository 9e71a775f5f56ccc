"""A glass of red wine, a carafe, a tumbler with ice and a glass ball on a linen cloth, with their caustics in the evening sun."""
import math

import bpy
import numpy
from kit import bumped, box, camera, image_of, insert, lathe, light, material, mesh, noise, rounded, shader_of, smooth_below, \
    sphere, subdivided, textured

OVERLAP = 0.0002  # of a liquid and its glass
WINE = [(0, 0.0016), (0.02, 0.001), (0.034, 0), (0.0365, 0.0008), (0.035, 0.0022), (0.022, 0.005), (0.009, 0.0105), (0.0048, 0.022),
        (0.0043, 0.038), (0.0062, 0.055), (0.016, 0.064), (0.03, 0.077), (0.0395, 0.097), (0.0415, 0.115), (0.0395, 0.14),
        (0.0355, 0.165), (0.0335, 0.18), (0.0329, 0.1805)]
WINE_INSIDE = [(0, 0.0605), (0.006, 0.062), (0.015, 0.0665), (0.0288, 0.0787), (0.0382, 0.097), (0.0402, 0.115), (0.0382, 0.14),
               (0.0342, 0.165), (0.0322, 0.18)]
CARAFE = [(0, 0.004), (0.03, 0.0015), (0.05, 0), (0.054, 0.003), (0.056, 0.02), (0.058, 0.06), (0.056, 0.1), (0.046, 0.135), (0.031, 0.165),
          (0.024, 0.19), (0.0235, 0.21), (0.028, 0.235), (0.033, 0.252), (0.0328, 0.2535)]
CARAFE_INSIDE = [(0, 0.0075), (0.03, 0.0075), (0.048, 0.0095), (0.0535, 0.022), (0.0555, 0.06), (0.0535, 0.1), (0.0435, 0.135),
                 (0.0288, 0.165), (0.0218, 0.19), (0.0213, 0.21), (0.0262, 0.235), (0.0315, 0.252)]
TUMBLER = [(0, 0.0012), (0.02, 0.0006), (0.031, 0), (0.0335, 0.002), (0.0345, 0.02), (0.036, 0.05), (0.0378, 0.08), (0.0385, 0.094),
           (0.0376, 0.095)]
TUMBLER_INSIDE = [(0, 0.012), (0.02, 0.0122), (0.0292, 0.0145), (0.0312, 0.022), (0.0331, 0.05), (0.0352, 0.08), (0.0362, 0.094)]


def curve(points, steps=6):
    """Points on a smooth curve through these (Catmull and Rom's)."""
    points = numpy.array(points, float)
    ends = [2 * points[0] - points[1], *points, 2 * points[-1] - points[-2]]
    out = []
    for a, b, c, d in zip(ends, ends[1:], ends[2:], ends[3:]):
        for t in numpy.arange(steps) / steps:
            out.append(b + t / 2 * (c - a + t * (2 * a - 5 * b + 4 * c - d + t * (3 * (b - c) + d - a))))
    return [(max(radius, 0), height) for radius, height in [*out, points[-1]]]


def vessel(outside, inside, location, glass, flutes=0):
    made = lathe(curve(outside) + curve(inside)[::-1], location, glass, 128)
    if flutes:
        press_flutes(made, len(curve(outside)), flutes)
    return made


def press_flutes(made, rings, count):
    """Vertical grooves on the lower half of the outside, which is the first rings."""
    for vertex in list(made.data.vertices)[1:(rings - 1) * 128]:
        x, y, z = vertex.co
        depth = 0.035 * math.sin(math.pi * min(max((z - 0.004) / 0.05, 0), 1)) ** 0.5
        vertex.co = (*(c * (1 - depth * abs(math.cos(count / 2 * math.atan2(y, x)))) for c in (x, y)), z)


def liquid(inside, level, location, surface):
    """What fills a vessel up to this height. It reaches a little into the wall."""
    wall = numpy.array(curve(inside))
    rim = float(numpy.interp(level, wall[:, 1], wall[:, 0]))
    sides = [(radius + OVERLAP, height) for radius, height in wall if 0 < radius and height < level - 1e-4]
    made = lathe([(0, wall[0, 1] - OVERLAP), *sides, (rim + OVERLAP, level), (0, level)], location, surface, 128)
    return smooth_below(made, math.radians(40))


def absorbing(made, density, color):
    insert(made, "ShaderNodeVolumeAbsorption", made.node_tree.nodes["Material Output"].inputs["Volume"], Density=density, Color=color)
    return made


def ice_cubes(location, ice):
    """Three cubes. Two float above the third."""
    random = numpy.random.default_rng(4)
    for at, turn in (((-0.0143, 0.001, 0.066), (0.12, -0.1, 0.15)), ((0.015, -0.002, 0.07), (-0.15, 0.08, -0.1)),
                     ((0.001, 0.001, 0.03), (0.1, 0.05, 0.9))):
        place = tuple(a + b for a, b in zip(location, at))
        side = 0.023
        cube = subdivided(rounded(box((side, side, side), place, turn, ice), 0.003, 2), 3)
        for vertex in cube.data.vertices:
            vertex.co *= 1 + random.uniform(-0.06, 0.06)


def lemon(location, turn):
    peel = bumped(material("peel", "BSDF_PRINCIPLED", Base_Color=(0.83, 0.56, 0.03, 1), Roughness=0.35),
                  image_of("pores", noise(256, 64, 3, 2), data=True), 0.0006)
    profile = [(0, -0.042), (0.006, -0.0405), (0.011, -0.036), (0.02, -0.029), (0.0275, -0.014), (0.029, 0), (0.027, 0.015), (0.019, 0.029),
               (0.01, 0.0365), (0.007, 0.041), (0, 0.0425)]
    made = lathe(curve(profile), location, peel)
    made.rotation_euler = turn
    return made


def half_lemon(location):
    """It stands on its end, with the cut towards the camera."""
    rows, columns = (numpy.mgrid[0:512, 0:512] + 0.5) / 256 - 1
    radius, angle = numpy.hypot(rows, columns), numpy.arctan2(rows, columns)
    wall = numpy.abs((angle / (2 * math.pi) * 9) % 1 - 0.5) * radius * 4
    flesh = numpy.clip((wall - 0.16) * 9, 0, 1) * numpy.clip((0.84 - radius) * 16, 0, 1) * numpy.clip((radius - 0.09) * 16, 0, 1)
    streaks = 0.8 + 0.2 * noise(512, 24, 9)
    colors = numpy.array([0.97, 0.93, 0.76]) * (1 - flesh[..., None]) + numpy.array([0.95, 0.78, 0.22]) * (flesh * streaks)[..., None]
    colors[radius > 0.94] = 0.94, 0.77, 0.16
    cut = material("cut lemon", "BSDF_PRINCIPLED", Roughness=0.22)
    textured(cut, image_of("cut lemon", colors), shader_of(cut).inputs["Base Color"], "UV")
    turns = numpy.arange(64) / 64 * 2 * math.pi
    ring = [(0.029 * math.cos(a), 0.029 * math.sin(a), 0) for a in turns]
    disc = mesh("cut", ring, [range(64)], cut, [(0.5 + 0.5 * math.cos(a), 0.5 + 0.5 * math.sin(a)) for a in turns])
    shell = lathe(curve([(0, -0.042), (0.006, -0.0405), (0.011, -0.036), (0.02, -0.029), (0.0275, -0.014), (0.029, 0)]), location,
                  bpy.data.materials["peel"])
    for one in (disc, shell):
        one.location, one.rotation_euler = location, (math.radians(62), 0, math.radians(20))


def cloth():
    """Linen with blue stripes."""
    rows, columns = numpy.mgrid[0:1024, 0:1024]
    threads = 0.5 * numpy.random.default_rng(1).random((1024, 1)) + 0.5 * numpy.random.default_rng(2).random((1, 1024))
    weave = 0.87 + 0.035 * ((rows + columns) % 2) + 0.07 * (threads - 0.5) + 0.03 * (noise(1024, 8, 5) - 0.5)
    colors = weave[..., None] * numpy.array([0.9, 0.87, 0.81])
    across = columns % 205
    stripe = ((across > 30) & (across < 52)) | ((across > 62) & (across < 67)) | ((across > 15) & (across < 20))
    colors[stripe] *= numpy.array([0.45, 0.58, 0.78])
    linen = material("linen", Roughness=0.6)
    textured(linen, image_of("linen", colors), shader_of(linen).inputs["Color"], "UV")
    return box((1.7, 1.2, 0.05), (0, 0.05, -0.0255), surface=linen, bevel=0.012, name="table")


def garden():
    """The world: evening sky over dark leaves, with spots of light out of focus."""
    height, width = 512, 1024
    rows, columns = numpy.mgrid[0:height, 0:width]
    up = ((rows + 0.5) / height - 0.5) * math.pi
    leaves = noise(1024, 64, 7)[:height] * 0.4 + noise(1024, 20, 8)[:height] * 0.6
    shares = numpy.clip((up - 0.3 - 0.25 * noise(1024, 16, 6)[0]) * 6, 0, 1)[..., None]
    colors = numpy.array([0.17, 0.23, 0.09]) * (2.6 * leaves[..., None] ** 1.5) * (1 - shares)
    colors += shares * (numpy.array([0.98, 0.86, 0.72]) * (1 - up[..., None] / 2) + numpy.array([0.5, 0.7, 0.95]) * up[..., None] / 2)
    random = numpy.random.default_rng(12)
    for _ in range(900):
        x, y, size = random.integers(0, width), random.integers(205, 290), random.uniform(2, 5)
        disc = numpy.clip(size - numpy.hypot((columns - x + width / 2) % width - width / 2, rows - y), 0, 1.5)[..., None] / 1.5
        colors += disc * random.uniform(0.05, 0.6) ** 1.5 * numpy.array([1, random.uniform(0.7, 0.95), random.uniform(0.25, 0.5)])
    tree = bpy.context.scene.world.node_tree
    node = tree.nodes.new("ShaderNodeTexEnvironment")
    node.image = image_of("garden", colors)
    tree.links.new(node.outputs["Color"], tree.nodes["Background"].inputs["Color"])
    tree.nodes["Background"].inputs["Strength"].default_value = 0.8


def build():
    glass, water = material("glass", "BSDF_GLASS", Roughness=0, IOR=1.5), material("water", "BSDF_GLASS", Roughness=0, IOR=1.333)
    wine = absorbing(material("wine", "BSDF_GLASS", Roughness=0, IOR=1.345), 50, (0.88, 0.06, 0.17, 1))
    ice = material("ice", "BSDF_GLASS", Roughness=0, IOR=1.31)
    at = {"wine": (-0.078, 0.09, 0), "carafe": (0.055, 0.19, 0), "tumbler": (0.108, 0.02, 0)}
    vessel(WINE, WINE_INSIDE, at["wine"], glass)
    liquid(WINE_INSIDE, 0.118, at["wine"], wine)
    vessel(CARAFE, CARAFE_INSIDE, at["carafe"], glass)
    liquid(CARAFE_INSIDE, 0.128, at["carafe"], water)
    vessel(TUMBLER, TUMBLER_INSIDE, at["tumbler"], glass, 16)
    liquid(TUMBLER_INSIDE, 0.068, at["tumbler"], water)
    ice_cubes(at["tumbler"], ice)
    sphere(0.026, (0.012, -0.05, 0.0262), glass, 96)
    lemon((-0.215, 0.1, 0.0288), (math.radians(90), 0, math.radians(60)))
    half_lemon((-0.158, -0.02, 0.0268))
    cloth()
    garden()
    light("SUN", 7, rotation=(math.radians(-57), 0, math.radians(20)), angle=math.radians(0.53), color=(1, 0.82, 0.6))
    camera((-0.03, -0.98, 0.37), (-0.012, 0.02, 0.085), 61, fstop=11, focus=(0, 0.05, 0.08))
