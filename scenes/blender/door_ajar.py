"""Two pots and a carafe on a table, in a room whose only light comes through a door that is ajar."""
import math

import numpy

from kit import (aimed, box, bumped, camera, cylinder, gray, image_of, lathe, light, material, mesh, noise, plane, shader_of, smooth_below,
                 sphere, textured, tube)

LEFT, RIGHT, FRONT, BACK, HEIGHT = -2.1, 2.0, -2.4, 2.2, 2.6
WALL = 0.14
DOOR = (0.55, 1.45, 2.05)  # from, to, height
OPENED = math.radians(50)


def build():
    camera((1.2, -1.65, 1.3), (-0.006, 1.35, 1.3), 32).data.shift_y = -0.12
    blue = material("blue wall", Color=(0.56, 0.63, 0.66, 1))
    wood = grained("walnut", (0.3, 0.15, 0.08))
    white = material("white paint", "BSDF_PRINCIPLED", Base_Color=gray(0.75), Roughness=0.3)
    room(blue, white)
    bright_room()
    door(white)
    table(-0.26, 0.62, wood)
    chair(-0.02, 1.86, 0.1, wood)
    picture((-0.72, BACK, 1.6), (0.8, 0.56), 0, landscape(3))
    picture((LEFT, 1.55, 1.6), (0.5, 0.62), math.pi / 2, landscape(7))


# The rooms.

def room(paint, white):
    wide, deep = RIGHT - LEFT, BACK - FRONT
    x, y = (LEFT + RIGHT) / 2, (FRONT + BACK) / 2
    plane((wide, deep + WALL), (x, y + WALL / 2, 0), surface=tiles(wide, deep + WALL), name="floor")
    box((wide, deep, 0.1), (x, y, HEIGHT + 0.05), surface=material("ceiling", Color=gray(0.82)), name="ceiling")
    box((WALL, deep, HEIGHT), (LEFT - WALL / 2, y, HEIGHT / 2), surface=paint, name="left wall")
    box((WALL, deep, HEIGHT), (RIGHT + WALL / 2, y, HEIGHT / 2), surface=paint, name="right wall")
    box((wide + 2 * WALL, WALL, HEIGHT), (x, FRONT - WALL / 2, HEIGHT / 2), surface=paint, name="front wall")
    low, high, top = DOOR
    box((low - LEFT + WALL, WALL, HEIGHT), ((low + LEFT - WALL) / 2, BACK + WALL / 2, HEIGHT / 2), surface=paint, name="back wall")
    box((RIGHT + WALL - high, WALL, HEIGHT), ((RIGHT + WALL + high) / 2, BACK + WALL / 2, HEIGHT / 2), surface=paint, name="back wall")
    box((high - low, WALL, HEIGHT - top), ((low + high) / 2, BACK + WALL / 2, (HEIGHT + top) / 2), surface=paint, name="lintel")
    for z, tall, thick in ((0.06, 0.12, 0.018), (0.92, 0.045, 0.024)):
        box((thick, deep, tall), (LEFT + thick / 2, y, z), surface=white, bevel=0.005, name="rail")
        box((low - LEFT - 0.105, thick, tall), ((low + LEFT - 0.055) / 2, BACK - thick / 2, z), surface=white, bevel=0.005, name="rail")
        box((RIGHT - high - 0.08, thick, tall), ((RIGHT + high + 0.08) / 2, BACK - thick / 2, z), surface=white, bevel=0.005, name="rail")


def tiles(wide, deep, size=512, count=4):
    """A floor of dark and pale stone, in squares of 30 cm."""
    y, x = numpy.mgrid[0:size, 0:size]
    column, row = x * count // size, y * count // size
    random = numpy.random.default_rng(2)
    vein = noise(size, 6, 3, 6, 0.6)
    tone = random.uniform(0.9, 1.05, (count, count))[row, column] * (0.85 + 0.25 * vein)
    dark = (column + row) % 2 == 0
    picture = numpy.where(dark[:, :, None], (0.3, 0.25, 0.23), (0.88, 0.84, 0.77)) * tone[:, :, None]
    inside = numpy.minimum(*(numpy.minimum(at * count % size, size - 1 - at * count % size) for at in (x, y)))
    joint = inside < 7
    picture[joint] = (0.42, 0.4, 0.37)
    made = material("tiles", "BSDF_PRINCIPLED", Roughness=0.16)
    scale = (wide / 1.2, deep / 1.2, 1)
    textured(made, image_of("tiles", picture), shader_of(made).inputs["Base Color"], "UV", {"Scale": scale})
    return bumped(made, image_of("joints", numpy.clip(inside / 14, 0, 1), data=True), 0.0015, scale)


def bright_room():
    """The room behind. Its lamp is where nobody in front of the door sees it."""
    cream = material("cream wall", Color=(0.85, 0.81, 0.74, 1))
    start, end, left, right = BACK + WALL, 5.2, -1.4, 3.6
    middle = (left + right) / 2, (start + end) / 2
    plane((right - left, end - start), (*middle, -0.001), surface=material("parquet", Color=(0.5, 0.36, 0.22, 1)), name="far floor")
    plane((right - left, end - start), (*middle, HEIGHT), (math.pi, 0, 0), cream, "far ceiling")
    plane((right - left, HEIGHT), (middle[0], end, HEIGHT / 2), (math.pi / 2, 0, 0), cream, "far wall")
    for x in (left, right):
        plane((HEIGHT, end - start), (x, middle[1], HEIGHT / 2), (0, math.pi / 2, 0), cream, "side wall")
    for low, high in ((left, LEFT), (RIGHT, right)):
        if high > low:
            plane((high - low, HEIGHT), ((low + high) / 2, start, HEIGHT / 2), (math.pi / 2, 0, 0), cream, "side wall")
    aimed(light("AREA", 1900, (-0.85, 2.75, 2.2), shape="DISK", size=0.5, color=(1, 0.93, 0.82)), (1.6, 4.6, 1.0))


def door(white):
    """A panelled leaf, hinged at the right, in its frame."""
    low, high, top = DOOR
    for x in (low - 0.04, high + 0.04):
        box((0.09, WALL + 0.04, top + 0.04), (x, BACK + WALL / 2, (top + 0.04) / 2), surface=white, bevel=0.008, name="jamb")
    box((high - low + 0.17, WALL + 0.042, 0.09), ((low + high) / 2, BACK + WALL / 2, top + 0.044), surface=white, bevel=0.008, name="head")
    wide, thick, tall = high - low - 0.02, 0.042, top - 0.015
    parts = [box((0.1, thick, tall), (-0.05, 0, tall / 2), surface=white, bevel=0.004),
             box((0.1, thick, tall), (0.05 - wide, 0, tall / 2), surface=white, bevel=0.004),
             box((wide, 0.016, tall - 0.04), (-wide / 2, 0, tall / 2), surface=white)]
    for z, height in ((0.1, 0.2), (0.92, 0.16), (tall - 0.06, 0.12)):
        parts.append(box((wide - 0.19, thick - 0.001, height), (-wide / 2, 0, z), surface=white, bevel=0.004))
    for z, height in ((0.52, 0.54), (1.455, 0.8)):
        for x in (-0.32 * wide, -0.68 * wide):
            parts.append(box((wide * 0.27, 0.032, height), (x, 0, z), surface=white, bevel=0.012))
    brass = material("brass", "BSDF_PRINCIPLED", Base_Color=(0.85, 0.62, 0.3, 1), Metallic=1, Roughness=0.22)
    for side in (-1, 1):
        y = side * thick / 2
        parts.append(cylinder(0.025, 0.008, (0.05 - wide, y + side * 0.004, 1.03), (math.pi / 2, 0, 0), brass, name="rose"))
        parts.append(cylinder(0.008, 0.05, (0.05 - wide, y + side * 0.03, 1.03), (math.pi / 2, 0, 0), brass, name="neck"))
        parts.append(box((0.12, 0.014, 0.018), (0.1 - wide, y + side * 0.055, 1.03), surface=brass, bevel=0.006, name="handle"))
    for part in parts:
        turned(part, OPENED, (high - 0.01, BACK - 0.02, 0.008))


def turned(part, angle, origin):
    """Turns a part around the origin, and moves the origin there."""
    x, y, z = part.location
    cosine, sine = math.cos(angle), math.sin(angle)
    part.location = (origin[0] + x * cosine - y * sine, origin[1] + x * sine + y * cosine, origin[2] + z)
    part.rotation_euler.z += angle


# Furniture.

def grained(name, color, size=256):
    grain = noise(size, 32, 12, 4, 0.6)[:, numpy.arange(size) // 20]
    made = material(name, "BSDF_PRINCIPLED", Roughness=0.28)
    picture = image_of(name, (0.72 + 0.45 * grain)[:, :, None] * numpy.asarray(color) ** (1 / 2.2))
    textured(made, picture, shader_of(made).inputs["Base Color"], "UV")
    return made


def table(x, y, wood):
    top = 0.74
    box((1.2, 0.76, 0.035), (x, y, top - 0.0175), surface=wood, bevel=0.01, name="table top")
    for side in (-1, 1):
        box((0.96, 0.02, 0.08), (x, y + side * 0.3, top - 0.076), surface=wood, bevel=0.003, name="apron")
        box((0.02, 0.56, 0.08), (x + side * 0.5, y, top - 0.076), surface=wood, bevel=0.003, name="apron")
        for end in (-1, 1):
            lathe([(0, 0.001), (0.016, 0.001), (0.022, 0.1), (0.026, 0.5), (0.032, 0.58), (0.032, 0.703), (0, 0.703)],
                  (x + side * 0.5, y + end * 0.3, 0), wood, 24, name="leg")
    glaze = material("glaze", "BSDF_PRINCIPLED", Base_Color=(0.03, 0.2, 0.22, 1), Roughness=0.06, Specular=0.7)
    copper = material("copper", "BSDF_PRINCIPLED", Base_Color=(0.93, 0.53, 0.37, 1), Metallic=1, Roughness=0.13)
    teapot(x + 0.02, y - 0.08, top + 0.001, glaze)
    coffee_pot(x + 0.38, y + 0.06, top + 0.001, copper)
    carafe(x - 0.36, y + 0.02, top + 0.0005)


def teapot(x, y, z, glaze):
    lathe([(0, 0.004), (0.05, 0.004), (0.055, 0), (0.062, 0.004), (0.088, 0.03), (0.104, 0.065), (0.1, 0.1), (0.078, 0.132), (0.055, 0.145),
           (0.05, 0.148), (0, 0.148)], (x, y, z), glaze, 96, name="pot")
    lathe([(0, 0.146), (0.054, 0.146), (0.056, 0.149), (0.046, 0.158), (0.02, 0.166), (0.01, 0.17), (0.009, 0.178), (0.016, 0.186),
           (0.017, 0.194), (0.01, 0.202), (0, 0.204)], (x, y, z), glaze, 64, name="lid")
    spout(x, y, z, glaze, [(0.085, 0.05, 0.026), (0.12, 0.065, 0.021), (0.145, 0.095, 0.016), (0.16, 0.13, 0.013), (0.178, 0.15, 0.012)])
    tube([(x - 0.075, y, z + 0.13), (x - 0.12, y, z + 0.15), (x - 0.165, y, z + 0.135), (x - 0.17, y, z + 0.09), (x - 0.14, y, z + 0.055),
          (x - 0.09, y, z + 0.045)], 0.0085, glaze, 16, name="handle")


def coffee_pot(x, y, z, metal):
    lathe([(0, 0), (0.072, 0), (0.078, 0.006), (0.076, 0.012), (0.082, 0.05), (0.076, 0.1), (0.06, 0.16), (0.05, 0.2), (0.052, 0.212),
           (0.056, 0.216), (0, 0.218)], (x, y, z), metal, 96, name="coffee pot")
    lathe([(0, 0.217), (0.052, 0.217), (0.05, 0.226), (0.034, 0.246), (0.012, 0.256), (0.008, 0.262), (0.014, 0.272), (0.009, 0.284),
           (0, 0.286)], (x, y, z), metal, 64, name="lid")
    spout(x, y, z, metal, [(0.07, 0.07, 0.02), (0.1, 0.09, 0.016), (0.118, 0.13, 0.012), (0.13, 0.175, 0.0095), (0.15, 0.2, 0.009)])
    black = material("ebony", "BSDF_PRINCIPLED", Base_Color=(0.03, 0.025, 0.02, 1), Roughness=0.25)
    tube([(x - 0.05, y, z + 0.195), (x - 0.1, y, z + 0.21), (x - 0.13, y, z + 0.17), (x - 0.125, y, z + 0.1), (x - 0.1, y, z + 0.07),
          (x - 0.075, y, z + 0.07)], 0.009, black, 16, name="handle")


def spout(x, y, z, surface, path, segments=32):
    """A tapering tube through points (x, z, radius)."""
    t = numpy.linspace(0, len(path) - 1, 8 * len(path))
    out, up, radius = (numpy.interp(t, range(len(path)), [point[i] for point in path]) for i in range(3))
    out, up, radius = (numpy.convolve(numpy.pad(one, 4, "edge"), numpy.ones(9) / 9, "valid") for one in (out, up, radius))
    ends = [(x + out[i], z + up[i], radius[i]) for i in range(len(t))]
    lean = numpy.arctan2(numpy.gradient(out), numpy.gradient(up))
    inner = [(*ends[i][:2], radius[i] * 0.75) for i in reversed(range(len(t) // 2, len(t)))]
    rings = [*zip(ends, lean), *zip(inner, lean[::-1])]
    turns = [math.tau * i / segments for i in range(segments)]
    vertices = [(a + r * math.cos(turn) * math.cos(tilt), y + r * math.sin(turn), b - r * math.cos(turn) * math.sin(tilt))
                for (a, b, r), tilt in rings for turn in turns]
    faces = [(i * segments + j, i * segments + (j + 1) % segments, (i + 1) * segments + (j + 1) % segments, (i + 1) * segments + j)
             for i in range(len(rings) - 1) for j in range(segments)]
    return smooth_below(mesh("spout", vertices, faces, surface), math.radians(60))


def carafe(x, y, z):
    """A carafe of glass with cordial, and its stopper."""
    glass = material("glass", "BSDF_GLASS", Color=gray(1), Roughness=0, IOR=1.5)
    cordial = material("cordial", "BSDF_PRINCIPLED", Base_Color=(0.85, 0.35, 0.12, 1), Roughness=0, IOR=1.34, Transmission=1)
    outside = [(0, 0.001), (0.06, 0), (0.076, 0.006), (0.086, 0.03), (0.088, 0.07), (0.076, 0.115), (0.045, 0.15), (0.025, 0.18),
               (0.021, 0.21), (0.024, 0.24), (0.034, 0.262)]
    inside = [(0.031, 0.2635), (0.0205, 0.24), (0.0175, 0.21), (0.0215, 0.181), (0.041, 0.153), (0.072, 0.117), (0.084, 0.07),
              (0.082, 0.03), (0.072, 0.012), (0.055, 0.009), (0, 0.01)]
    lathe(smooth_line(outside) + smooth_line(inside), (x, y, z), glass, 96, name="carafe")
    hair = 0.0002
    wet = [(radius + hair, height - hair) for radius, height in inside[:-6:-1]]
    lathe([(0, wet[0][1]), *smooth_line(wet)[1:], (0, wet[-1][1])], (x, y, z), cordial, 96, name="cordial")
    sphere(0.024, (x, y, z + 0.292), glass, 48, "stopper")


def smooth_line(points, steps=6):
    """A Catmull-Rom curve through these points."""
    points = numpy.asarray(points, float)
    padded = numpy.vstack([2 * points[0] - points[1], points, 2 * points[-1] - points[-2]])
    line = []
    for a, b, c, d in zip(padded, padded[1:], padded[2:], padded[3:]):
        for t in numpy.arange(steps) / steps:
            line.append(0.5 * (2 * b + (c - a) * t + (2 * a - 5 * b + 4 * c - d) * t * t + (3 * b - a - 3 * c + d) * t ** 3))
    line.append(points[-1])
    return [(max(float(radius), 0.0), float(height)) for radius, height in line]


def chair(x, y, turn, wood):
    parts = [box((0.42, 0.42, 0.03), (0, 0, 0.45), surface=wood, bevel=0.01, name="seat")]
    for side in (-1, 1):
        parts.append(box((0.035, 0.035, 0.434), (side * 0.18, -0.18, 0.218), surface=wood, bevel=0.005, name="chair leg"))
        parts.append(box((0.035, 0.035, 0.92), (side * 0.18, 0.19, 0.461), surface=wood, bevel=0.005, name="chair post"))
        parts.append(box((0.02, 0.34, 0.025), (side * 0.18, 0, 0.2), surface=wood, bevel=0.004, name="stretcher"))
    for z in (0.6, 0.73, 0.86):
        parts.append(box((0.33, 0.018, 0.06), (0, 0.19, z), surface=wood, bevel=0.005, name="slat"))
    for part in parts:
        turned(part, turn, (x, y, 0))


# Pictures.

def picture(location, size, turn, texels):
    """A framed picture on a wall. With turn 0 it faces the front."""
    gilt = material("gilt", "BSDF_PRINCIPLED", Base_Color=(0.8, 0.56, 0.25, 1), Metallic=1, Roughness=0.3)
    art = material("canvas")
    textured(art, image_of("canvas", texels), shader_of(art).inputs["Color"], "UV")
    wide, tall = size
    parts = [plane(size, (0, -0.014, 0), (math.pi / 2, 0, 0), art, "canvas")]
    for side in (-1, 1):
        parts.append(box((0.05, 0.035, tall + 0.098), (side * (wide + 0.05) / 2, -0.0185, 0), surface=gilt, bevel=0.012, name="frame"))
        parts.append(box((wide + 0.097, 0.034, 0.05), (0, -0.018, side * (tall + 0.05) / 2), surface=gilt, bevel=0.012, name="frame"))
    for part in parts:
        turned(part, turn, location)


def landscape(seed, size=256):
    """Ridges of mountains over a lake, under clouds."""
    y, x = numpy.mgrid[0:size, 0:size] / size
    cloud = noise(size, 4, seed)[:, :, None]
    rise = numpy.clip(2.2 * y - 1.2, 0, 1)[:, :, None]
    picture = (1 - rise) * (1.0, 0.82, 0.6) + rise * (0.5, 0.68, 0.88) + 0.3 * (cloud - 0.5)
    for i, color in enumerate(((0.66, 0.62, 0.68), (0.46, 0.54, 0.58), (0.36, 0.44, 0.32))):
        ridge = 0.62 - 0.11 * i + 0.22 * (noise(size, 3, seed + i, 6, 0.5)[0] - 0.5)
        picture[y < ridge] = color
    picture = picture * (0.9 + 0.2 * noise(size, 32, seed + 9, 3)[:, :, None])
    lake = int(0.28 * size)
    picture[:lake] = 0.75 * picture[lake:2 * lake][::-1] + (0.02, 0.05, 0.08)
    return picture
