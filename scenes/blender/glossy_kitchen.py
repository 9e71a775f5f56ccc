"""A kitchen corner by evening: lacquered cupboards, a tiled wall under strip lights, metal pans on a hob and fruit on a stone counter."""
import math

import numpy
from kit import (aimed, box, bumped, camera, copy_of, cylinder, gray, image_of, lathe, light, material, mesh, noise, plane, shader_of,
                 sphere, textured, tube)

TOP, DEEP, WALL_UNIT = 0.90, 0.62, 1.48  # heights of the counter and of the wall units, and the counter's depth
QUARTER = math.pi / 2


def grid(size, tiles, joint):
    """Distance in tiles from the joints, from 0 on them to 1, and a number for each tile, in a running bond."""
    rows, columns = tiles
    y, x = numpy.meshgrid((numpy.arange(size) + 0.5) / size * rows, (numpy.arange(size) + 0.5) / size * columns, indexing="ij")
    x = x + 0.5 * (numpy.floor(y) % 2)
    to_x, to_y = 0.5 - numpy.abs(x % 1 - 0.5), 0.5 - numpy.abs(y % 1 - 0.5)
    edge = numpy.clip(numpy.minimum(to_x * rows / columns * 2, to_y) / joint - 0.4, 0, 1)
    numbers = (numpy.floor(x) % columns + columns * numpy.floor(y)).astype(int)
    return edge * edge * (3 - 2 * edge), numbers


def tiles():
    """Glazed tiles of 15 x 7.5 cm in a picture of 1.2 m, with hollow joints."""
    edge, numbers = grid(1024, (16, 8), 0.06)
    random = numpy.random.default_rng(3)
    tint = random.uniform(0.85, 1.0, 128)[numbers][:, :, None] * numpy.array((0.56, 0.73, 0.70))
    colors = edge[:, :, None] * tint + (1 - edge[:, :, None]) * numpy.array((0.75, 0.74, 0.70))
    made = material("tiles", "BSDF_PRINCIPLED", Roughness=0.08, Specular=0.5)
    textured(made, image_of("tiles", colors), shader_of(made).inputs["Base Color"], "UV", {"Scale": (2.5, 0.5, 1)})
    tilt = random.uniform(-1, 1, (2, 128))
    y, x = numpy.meshgrid(numpy.linspace(0, 16, 1024), numpy.linspace(0, 8, 1024), indexing="ij")
    lean = tilt[0][numbers] * (x % 1 - 0.5) + tilt[1][numbers] * (y % 1 - 0.5)
    heights = edge * (0.75 + 0.06 * lean + 0.12 * noise(1024, 24, 9, 3))
    return bumped(made, image_of("joints", heights, data=True), 0.004, (2.5, 0.5, 1))


def stone():
    veins = numpy.abs(noise(512, 3, 11, 7) - 0.5)
    tint = 0.50 + 0.12 * noise(512, 40, 12, 4, 0.8) + 0.25 * numpy.exp(-(veins / 0.012) ** 2)
    made = material("stone", "BSDF_PRINCIPLED", Roughness=0.12, Specular=0.5)
    textured(made, image_of("stone", numpy.stack([tint, tint * 0.98, tint * 0.95], axis=2)), shader_of(made).inputs["Base Color"], "UV",
             {"Scale": (2.5, 0.6, 1)})
    return made


def timber():
    grain = 0.7 * noise(512, 12, 31, 6, 0.65) + 0.3 * noise(512, 90, 32, 2)
    made = material("wood", "BSDF_PRINCIPLED", Roughness=0.42)
    picture = image_of("grain", (0.52 + 0.34 * grain)[:, :, None] * numpy.array((1.0, 0.74, 0.48)))
    textured(made, picture, shader_of(made).inputs["Base Color"], "UV", {"Scale": (1, 0.07, 1)})
    return made


def lacquer(name, color, roughness=0.03):
    return material(name, "BSDF_PRINCIPLED", Base_Color=(*color, 1), Roughness=roughness, Specular=0.6)


def metal(name, color, roughness):
    return material(name, "BSDF_PRINCIPLED", Base_Color=(*color, 1), Metallic=1, Roughness=roughness)


def fronts(at, across, widths, low, high, surface, turn=0.0):
    """A row of doors with narrow gaps, from the place `at` along `across`, whose faces look along -y before the turn."""
    x, y = at
    for width in widths:
        middle = (x + across[0] * width / 2, y + across[1] * width / 2, (low + high) / 2)
        box((width - 0.003, 0.02, high - low - 0.003), middle, (0, 0, turn), surface, 0.0015, "door")
        x, y = x + across[0] * width, y + across[1] * width


def units(base, wall_surface, dark, aluminium, counter):
    """Cupboards along the back wall (y = 0) and the right one (x = 1.25)."""
    box((3.0, 0.55, 0.10), (-0.25, -0.275, 0.05), surface=dark)
    box((3.0, 0.575, 0.76), (-0.25, -0.2875, 0.48), surface=dark)
    box((0.575, 1.6, 0.76), (0.9625, -1.37, 0.48), surface=dark)
    fronts((-1.75, -0.587), (1, 0), (0.58, 0.60, 0.60, 0.60), 0.10, 0.46, base)
    fronts((-1.75, -0.587), (1, 0), (0.58, 0.60, 0.60, 0.60), 0.46, 0.82, base)
    fronts((0.663, -0.61), (0, -1), (0.60, 0.60, 0.40), 0.10, 0.82, base, -QUARTER)
    box((2.40, 0.006, 0.03), (-0.55, -0.579, 0.843), surface=aluminium)
    box((3.0, DEEP, 0.04), (-0.25, -DEEP / 2, TOP - 0.02), surface=counter, bevel=0.003)
    box((DEEP, 1.6, 0.04), (1.25 - DEEP / 2, -DEEP - 0.8005, TOP - 0.02), surface=counter, bevel=0.003)
    for left, right, doors in ((-1.75, -0.55, 3), (0.05, 1.25, 3)):
        box((right - left, 0.33, 0.72), ((left + right) / 2, -0.165, WALL_UNIT + 0.36), surface=wall_surface)
        fronts((left, -0.341), (1, 0), [(right - left) / doors] * doors, WALL_UNIT - 0.02, 2.20, wall_surface)


def hood(steel, dark):
    rings = ((0.298, 0.46, 1.52), (0.298, 0.46, 1.56), (0.14, 0.28, 1.78))
    points = [point for half, deep, z in rings for point in ((-half, -0.001, z), (half, -0.001, z), (half, -deep, z), (-half, -deep, z))]
    faces = [(i + j, i + j + 4, i + (j + 1) % 4 + 4, i + (j + 1) % 4) for i in (0, 4) for j in range(4)] + [(0, 1, 2, 3), (11, 10, 9, 8)]
    made = mesh("hood", points, faces, steel)
    made.location.x = -0.25
    box((0.279, 0.279, 0.8), (-0.25, -0.1405, 2.18), surface=steel)
    box((0.5, 0.34, 0.004), (-0.25, -0.22, 1.5175), surface=dark)


def pan(place, radius, height, outside, handle, turn):
    """A saucepan with a long handle."""
    wall = 0.003
    lathe([(0, 0), (radius - 0.012, 0), (radius - 0.004, 0.003), (radius, 0.012), (radius, height - 0.006), (radius + 0.004, height),
           (radius + 0.001, height + 0.002), (radius - wall, height - 0.006), (radius - wall, 0.012), (radius - 0.012, 0.005), (0, 0.004)],
          place, outside, 96)
    ray = numpy.array((math.cos(turn), math.sin(turn), 0))
    path = [numpy.array(place) + (radius + out) * ray + (0, 0, height * 0.72 + up) for out, up in
            ((-0.002, 0), (0.03, 0.002), (0.07, 0.018), (0.13, 0.03), (0.19, 0.034))]
    tube(path, 0.008, handle)


def lid(place, radius, surface, knob):
    lathe([(0, 0.003), (radius - 0.006, 0.003), (radius + 0.004, 0.0), (radius + 0.005, 0.004), (radius * 0.9, 0.012),
           (radius * 0.5, 0.024), (0, 0.029)], place, surface, 96)
    lathe([(0, 0.027), (0.008, 0.027), (0.008, 0.04), (0.018, 0.046), (0.02, 0.053), (0.016, 0.059), (0, 0.06)], place, knob)


def bowl(place, radius, height, surface):
    """A ceramic bowl with a foot."""
    inside = [(radius * math.sin(turn), 0.016 + (height - 0.016) * (1 - math.cos(turn))) for turn in numpy.linspace(0.06, QUARTER, 16)]
    outside = [(0.0, 0.003), (radius * 0.36, 0.003), (radius * 0.38, 0.0), (radius * 0.42, 0.0), (radius * 0.43, 0.01)]
    outside += [(r + 0.006, z - 0.005) for r, z in inside if r > radius * 0.44]
    lathe(outside + [(radius + 0.005, height + 0.002), (radius + 0.002, height + 0.003)] + inside[::-1] + [(0, 0.016)], place, surface, 96)


def orange_peel():
    made = material("orange", "BSDF_PRINCIPLED", Base_Color=(0.85, 0.27, 0.015, 1), Roughness=0.35)
    return bumped(made, image_of("peel", noise(256, 40, 21, 3), data=True), 0.0012)


def fruits(middle):
    """Oranges, lemons and apples in and beside a bowl."""
    x, y, z = middle
    orange = sphere(0.037, (x - 0.045, y - 0.01, z + 0.068), orange_peel())
    copy_of(orange, (x + 0.042, y - 0.025, z + 0.070), (1, 0.4, 2))
    copy_of(orange, (x + 0.0, y + 0.05, z + 0.069), (2, 1, 0))
    copy_of(orange, (x - 0.24, y - 0.10, TOP + 0.037), (0.5, 2, 1))
    lemon_skin = material("lemon", "BSDF_PRINCIPLED", Base_Color=(0.88, 0.62, 0.03, 1), Roughness=0.3)
    outline = [(0, -0.043), (0.006, -0.042), (0.010, -0.037), (0.021, -0.029), (0.028, -0.012), (0.029, 0.005), (0.024, 0.022),
               (0.013, 0.034), (0.007, 0.039), (0.005, 0.043), (0, 0.045)]
    lemon = lathe(outline, (x - 0.155, y - 0.155, TOP + 0.029), lemon_skin)
    lemon.rotation_euler = (QUARTER, 0, 0.6)
    copy_of(lemon, (x + 0.005, y - 0.005, z + 0.123), (QUARTER, 0.2, 1.9))
    skin = material("apple", "BSDF_PRINCIPLED", Base_Color=(0.42, 0.02, 0.02, 1), Roughness=0.18)
    apple = [(0, 0.012), (0.008, 0.006), (0.018, 0.0), (0.028, 0.008), (0.036, 0.026), (0.039, 0.042), (0.036, 0.058), (0.026, 0.069),
             (0.015, 0.070), (0.006, 0.064), (0, 0.058)]
    lathe(apple, (x - 0.30, y - 0.005, TOP), skin)


def board_and_tools(wood, metal_surface, ceramic):
    """A board that leans on the wall, and spoons in a jar."""
    lean = 0.16
    board = box((0.30, 0.022, 0.40), (0.36, -0.046, TOP + 0.2 * math.cos(lean) + 0.003), (-lean, 0, 0), wood, 0.006, "board")
    board.location.y = -0.011 / math.cos(lean) - 0.2 * math.sin(lean) - 0.002
    place = (0.10, -0.12, TOP)
    lathe([(0, 0), (0.046, 0), (0.05, 0.004), (0.052, 0.14), (0.0505, 0.143), (0.048, 0.14), (0.046, 0.008), (0, 0.007)], place, ceramic)
    for turn, length, surface in ((0.4, 0.27, wood), (2.2, 0.29, wood), (3.6, 0.28, metal_surface), (5.2, 0.26, wood)):
        ray = numpy.array((math.cos(turn), math.sin(turn), 0))
        start, end = numpy.array(place) - 0.028 * ray + (0, 0, 0.012), numpy.array(place) + 0.06 * ray + (0, 0, length)
        tube([start, (start + end) / 2, end], 0.006, surface)
        spoon = sphere(0.03, end, surface, 32)
        spoon.scale, spoon.rotation_euler = (0.75, 0.25, 1.1), (0, 0.28, turn)


def hanging(steel):
    """A rail under the hood, with two ladles and a turner."""
    tube([(-0.60, -0.045, 1.40), (-0.25, -0.045, 1.40), (0.10, -0.045, 1.40)], 0.006, steel, name="rail")
    for x in (-0.58, 0.08):
        cylinder(0.012, 0.045, (x, -0.0225, 1.40), (QUARTER, 0, 0), steel)
    cup = [(0.04 * math.sin(turn), -0.04 * math.cos(turn)) for turn in numpy.linspace(0, QUARTER, 12)]
    cup += [(0.95 * radius, 0.95 * z) for radius, z in cup[::-1]]
    for x, length, size in ((-0.08, 0.27, 1.0), (0.0, 0.23, 0.8)):
        tube([(x, -0.046, 1.385), (x, -0.06, 1.405), (x, -0.066, 1.39), (x, -0.060, 1.36), (x, -0.056, 1.40 - length)], 0.0035, steel)
        ladle = lathe(cup, (x, -0.058 - 0.04 * size, 1.40 - length), steel)
        ladle.scale = (size, size, size)
    tube([(0.06, -0.046, 1.385), (0.06, -0.06, 1.405), (0.06, -0.066, 1.39), (0.06, -0.06, 1.36), (0.06, -0.056, 1.22)], 0.0035, steel)
    box((0.07, 0.003, 0.09), (0.06, -0.056, 1.18), surface=steel, bevel=0.001, name="turner")


def bottle(place):
    """Olive oil in glass, with a cork."""
    glass = material("glass", "BSDF_GLASS", Color=gray(1), Roughness=0, IOR=1.5)
    oil = material("oil", "BSDF_PRINCIPLED", Base_Color=(0.80, 0.66, 0.10, 1), Transmission=1, Roughness=0, IOR=1.47)
    outside = [(0, 0), (0.031, 0), (0.034, 0.003), (0.034, 0.17), (0.031, 0.19), (0.018, 0.215), (0.013, 0.235), (0.013, 0.29)]
    inside = [(0.010, 0.29), (0.010, 0.235), (0.015, 0.215), (0.028, 0.19), (0.031, 0.17), (0.031, 0.007), (0.028, 0.004), (0, 0.004)]
    lathe(outside + inside, place, glass)
    lathe([(0, 0.0038), (0.0281, 0.0038), (0.0312, 0.0069), (0.0312, 0.15), (0, 0.15)], place, oil)
    x, y, z = place
    cylinder(0.0098, 0.03, (x, y, z + 0.29), surface=material("cork", Color=(0.45, 0.30, 0.17, 1)), bevel=0.002)


def window(frame, glow):
    """In the right wall, with a bright evening sky behind it."""
    plane((1.3, 1.1), (1.40, -1.05, 1.60), (0, -QUARTER, 0), glow).rotation_euler = (QUARTER, 0, -QUARTER)
    for y in (-0.45, -1.05, -1.65):
        box((0.10, 0.05, 1.10), (1.27, y, 1.60), surface=frame, bevel=0.004)
    for z in (1.05, 2.15):
        box((0.14, 1.25, 0.05), (1.27, -1.05, z), surface=frame, bevel=0.004)


def walls(paint):
    plane((3.2, 2.6), (-0.35, 0, 1.3), (QUARTER, 0, 0), paint)
    for y, z, size in ((-0.225, 1.3, (0.45, 2.6)), (-2.825, 1.3, (2.35, 2.6)), (-1.05, 0.525, (1.2, 1.05)), (-1.05, 2.375, (1.2, 0.45))):
        plane(size, (1.25, y, z), (QUARTER, 0, -QUARTER), paint)
    plane((2.6, 4.0), (-1.95, -2.0, 1.3), surface=paint).rotation_euler = (0, QUARTER, 0)
    plane((3.2, 2.6), (-0.35, -4.0, 1.3), (-QUARTER, 0, 0), paint)
    plane((3.2, 4.0), (-0.35, -2.0, 2.6), (math.pi, 0, 0), paint)


def build():
    chrome, copper = metal("steel", (0.70, 0.69, 0.67), 0.07), metal("copper", (0.93, 0.50, 0.33), 0.10)
    brushed = material("brushed steel", "BSDF_PRINCIPLED", Base_Color=gray(0.6), Metallic=1, Roughness=0.28)
    dark, ceramic = lacquer("black", (0.006, 0.006, 0.007)), lacquer("ceramic", (0.75, 0.72, 0.66), 0.1)
    glaze = lacquer("glaze", (0.03, 0.10, 0.13), 0.08)
    wood = timber()
    paint = material("wall", Color=(0.72, 0.68, 0.61, 1))
    walls(paint)
    plane((3.2, 4.0), (-0.35, -2.0, 0), surface=material("floor", "BSDF_PRINCIPLED", Base_Color=(0.42, 0.32, 0.22, 1), Roughness=0.25))
    plane((3.0, 0.62), (-0.25, -0.004, TOP + 0.31), (QUARTER, 0, 0), tiles())
    units(lacquer("blue lacquer", (0.010, 0.055, 0.085)), lacquer("cream lacquer", (0.70, 0.66, 0.57)), dark, brushed, stone())
    hood(brushed, dark)
    box((0.58, 0.50, 0.006), (-0.25, -0.31, TOP + 0.003), surface=dark, bevel=0.002, name="hob")
    hob = TOP + 0.0062
    pan((-0.40, -0.22, hob), 0.10, 0.12, chrome, chrome, -2.4)
    lid((-0.40, -0.22, hob + 0.122), 0.10, chrome, dark)
    pan((-0.11, -0.34, hob), 0.08, 0.085, copper, brushed, -0.9)
    hanging(chrome)
    bottle((0.93, -0.17, TOP))
    for height, radius, surface in ((0, 0.09, ceramic), (0.025, 0.09, glaze), (0.05, 0.09, ceramic)):
        bowl((0.96, -0.62, TOP + height), radius, 0.065, surface)
    bowl((0.62, -0.36, TOP), 0.135, 0.085, ceramic)
    fruits((0.62, -0.36, TOP))
    board_and_tools(wood, brushed, glaze)
    window(lacquer("frame", (0.75, 0.74, 0.72), 0.2), material("dusk", "EMISSION", Color=(0.36, 0.55, 1, 1), Strength=1.15))
    warm = (1, 0.78, 0.55)
    for x in (-1.15, 0.65):
        light("AREA", 12, (x, -0.20, WALL_UNIT - 0.005), shape="RECTANGLE", size=1.1, size_y=0.02, color=warm)
    light("AREA", 5, (-0.25, -0.26, 1.51), shape="RECTANGLE", size=0.3, size_y=0.05, color=warm)
    light("AREA", 20, (-0.6, -2.0, 2.58), shape="RECTANGLE", size=0.9, size_y=0.9, color=(1, 0.86, 0.70))
    aimed(light("AREA", 35, (-0.2, -3.9, 1.5), shape="RECTANGLE", size=1.4, size_y=1.9, color=(0.75, 0.86, 1)), (0, -1.4, 0.2))
    camera((-0.62, -1.95, 1.40), (0.19, -0.25, 1.09), 31)
