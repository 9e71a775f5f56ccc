"""A tinkerer's desk at night by a lamp of 10 W, and in the window a building site under floodlights of 10 kW."""
import math

import numpy
from kit import aimed, box, camera, copy_of, cylinder, gray, image_of, lathe, light, material, mesh, noise, plane, shader_of, sky, \
    textured, torus, tube
from mathutils import Vector

TOP = 0.75  # height of the desk
SITE = -4  # height of the ground outside


def plastic(name, color, roughness=0.4, **more):
    return material(name, "BSDF_PRINCIPLED", Base_Color=(*color, 1), Roughness=roughness, **more)


def metal(name, color, roughness=0.25):
    return plastic(name, color, roughness, Metallic=1)


def wood(name, dark, bright, planks, seed):
    """Planks along u."""
    rows, columns = numpy.mgrid[0:512, 0:512]
    plank = rows * planks // 512
    shift = numpy.random.default_rng(seed).integers(0, 512, planks)[plank]
    large = noise(512, 4, seed)[rows, (columns // 4 + shift) % 512]
    fine = noise(512, 128, seed + 1, 2)[rows, (columns // 16 + shift) % 512]
    share = 0.5 + 0.25 * numpy.sin(40 * large + rows * planks / 80) + 0.35 * (fine - 0.5)
    share = share * numpy.clip(numpy.minimum(rows * planks % 512, 511 - rows * planks % 512) / planks / 1.5 + 0.3, 0, 1)
    colors = numpy.array(dark) + (numpy.array(bright) - numpy.array(dark)) * share[..., None]
    made = plastic(name, (0.2, 0.1, 0.05), 0.38)
    textured(made, image_of(name, colors), shader_of(made).inputs["Base Color"], "UV")
    return made


def printed(name, picture):
    made = material(name, "BSDF_PRINCIPLED", Roughness=0.7, Specular=0.3)
    textured(made, image_of(name, picture), shader_of(made).inputs["Base Color"], "UV")
    return made


# The room.

def room():
    plaster = material("plaster", Color=(0.46, 0.42, 0.37, 1))
    left, right, low, high = -0.78, 0.18, 1.0, 1.95
    for x0, x1, z0, z1 in ((-2, left, 0, 2.6), (right, 2, 0, 2.6), (left, right, 0, low), (left, right, high, 2.6)):
        box((x1 - x0, 0.3, z1 - z0), ((x0 + x1) / 2, 0.57, (z0 + z1) / 2), surface=plaster)
    for side in (-1, 1):
        box((0.1, 4, 2.6), (side * 2.05, -1.28, 1.3), surface=plaster)
    box((4.2, 0.1, 2.6), (0, -3.33, 1.3), surface=plaster)
    box((4.2, 4.2, 0.1), (0, -1.3, 2.65), surface=plaster)
    plane(4.2, (0, -1.3, 0), surface=wood("floor", (0.2, 0.12, 0.07), (0.42, 0.28, 0.17), 8, 31))
    white = plastic("window frame", (0.62, 0.6, 0.55), 0.35)
    box((right - left + 0.1, 0.2, 0.03), ((left + right) / 2, 0.45, low + 0.005), surface=white, bevel=0.006)
    for x in (left + 0.025, (left + right) / 2, right - 0.025):
        box((0.05, 0.05, high - low - 0.02), (x, 0.6, (low + high) / 2), surface=white, bevel=0.005)
    for z in (low + 0.045, 1.55, high - 0.025):
        box((right - left, 0.04, 0.045), ((left + right) / 2, 0.6, z), surface=white, bevel=0.005)


def drawings():
    """Two sheets on the wall."""
    rows, columns = (numpy.mgrid[0:256, 0:256] + 0.5) / 256
    pins = metal("pin", (0.8, 0.1, 0.08), 0.3)
    for i, (x, z, turn) in enumerate(((0.42, 1.33, 0.04), (0.66, 1.42, -0.05))):
        sheet = 0.85 * numpy.ones((256, 256)) - 0.06 * ((rows * 16 % 1 < 0.06) | (columns * 16 % 1 < 0.06))
        for x0, y0, radius in ((0.42, 0.55, 0.28), (0.42, 0.55, 0.12), (0.75, 0.28, 0.13), (0.75, 0.28, 0.04)):
            wave = 0.012 * numpy.sign(numpy.sin(18 * numpy.arctan2(rows - y0, columns - x0))) * (radius > 0.125)
            sheet[numpy.abs(numpy.hypot(rows - y0, columns - x0) - radius - wave) < 0.006] = 0.25
        sheet[(rows < 0.1) & (rows > 0.06) & (columns > 0.55) & (columns < 0.93)] = 0.4
        paper = printed(f"drawing {i}", sheet[..., None] * (numpy.array([0.62, 0.76, 1]) if i else numpy.array([1, 0.96, 0.86])))
        plane((0.21, 0.28), (x, 0.417, z), (math.pi / 2, turn, 0), paper)
        cylinder(0.006, 0.008, (x, 0.412, z + 0.125), (math.pi / 2, 0, 0), pins, 0.002, 16)


# Things on the desk.

def lamp(x, y):
    """It stands at x, y. Its bulb of 10 W is over the notebook."""
    enamel, steel = plastic("enamel", (0.02, 0.12, 0.09), 0.2), metal("steel", (0.6, 0.6, 0.6), 0.22)
    foot, elbow, head = Vector((x, y, TOP + 0.02)), Vector((x + 0.1, y + 0.06, TOP + 0.34)), Vector((x - 0.2, y - 0.1, TOP + 0.53))
    lathe([(0, 0), (0.09, 0), (0.09, 0.012), (0.07, 0.022), (0.02, 0.03), (0.016, 0.05), (0, 0.05)], (x, y, TOP + 0.0005), enamel, 48)
    tube([foot, elbow], 0.008, steel)
    tube([elbow, head], 0.008, steel)
    for joint in (elbow, head):
        cylinder(0.016, 0.035, joint, (math.pi / 2, 0, 0.5), steel, 0.003, 24)
    shade = lathe([(0.085, -0.13), (0.083, -0.11), (0.066, -0.07), (0.035, -0.035), (0.026, -0.03), (0.024, 0.02), (0, 0.022)], head,
                  enamel, 64)
    lining = plastic("lining", (0.75, 0.73, 0.68), 0.5)
    inside = lathe([(0, -0.03), (0.03, -0.034), (0.064, -0.072), (0.0815, -0.111), (0.0835, -0.13)], head, lining, 64)
    for part in (shade, inside):
        part.rotation_euler = (0.1, 0.3, 0)
    bulb = head + shade.rotation_euler.to_matrix() @ Vector((0, 0, -0.08))
    light("POINT", 10, bulb, shadow_soft_size=0.022, color=(1, 0.7, 0.4))


def notebook(location, turn):
    width, height = 1024, 724
    page = numpy.full((height, width), 0.76)
    random = numpy.random.default_rng(5)
    for line in range(40, height - 60, 26):
        page[line:line + 2] = 0.62
        x = 60
        while x < 440 and line > 90:
            length = int(random.integers(14, 60))
            at = numpy.arange(x, min(x + length, 450))
            stroke = 4.5 * numpy.sin(at * random.uniform(0.7, 0.9) + random.uniform(0, 6)) + 3 * numpy.sin(at * 0.31 + random.uniform(0, 6))
            for thick in range(4):
                page[(line + 8 + stroke + thick).astype(int), at] = 0.15
            x += length + 12
    rows, columns = numpy.mgrid[0:height, 0:width]
    for x, y, radius, teeth in ((720, 440, 110, 16), (720, 440, 40, 0), (870, 290, 85, 12), (870, 290, 26, 0)):
        around = numpy.hypot(columns - x, rows - y) - radius - (7 * numpy.sign(numpy.sin(teeth * numpy.arctan2(rows - y, columns - x))))
        page[numpy.abs(around) < 3.5] = 0.15
    page[:, 508:516] *= 0.8
    paper = printed("page", page[..., None] * numpy.array([1, 0.96, 0.87]))
    us = numpy.linspace(-1, 1, 49)
    heights = 0.004 + 0.022 * numpy.abs(us) ** 0.45 * (1 - 0.62 * numpy.abs(us))
    vertices = [(0.15 * u, y, z) for y in (-0.105, 0.105) for u, z in zip(us, heights)]
    vertices += [(0.15 * u, y, 0.003) for y in (-0.105, 0.105) for u in (-1, 1)]
    faces = [(i, i + 1, i + 50, i + 49) for i in range(48)]
    uvs = [((us[j] + 1) / 2, v) for i in range(48) for j, v in ((i, 0), (i + 1, 0), (i + 1, 1), (i, 1))]
    sides = [(98, 99, *range(48, -1, -1)), (101, 100, *range(49, 98)), (100, 98, 0, 49), (99, 101, 97, 48)]
    uvs += [(0.02, 0.99)] * sum(map(len, sides))
    parts = [mesh("pages", vertices, faces + sides, paper, uvs),
             box((0.312, 0.222, 0.003), surface=plastic("cover", (0.03, 0.03, 0.035), 0.5), bevel=0.001)]
    for part, lift in zip(parts, (0.0005, 0.002)):
        part.location, part.rotation_euler = (*location, TOP + lift), (0, 0, turn)


def book(size, location, turn, color, upright=False):
    """Lying, or standing on its lower edge with its back to the room."""
    x, y, z = size
    cloth, paper = plastic("book", color, 0.6), plastic("book pages", (0.7, 0.64, 0.5), 0.9)
    gold = metal("gold", (0.9, 0.65, 0.25), 0.3)
    boards = [((x, y, 0.003), (0, 0, 0.0015)), ((x, y, 0.003), (0, 0, z - 0.0015)), ((x, 0.004, z), (0, -y / 2, z / 2))]
    made = [box(one, at, surface=cloth, bevel=0.001) for one, at in boards]
    made.append(box((x - 0.008, y - 0.007, z - 0.006), (0, 0, z / 2), surface=paper))
    for at in (-0.36, -0.3, 0.3):
        made.append(box((0.004 if at > -0.35 else 0.012, 0.001, z * 0.8), (at * x, -y / 2 - 0.0021, z / 2), surface=gold))
    for part in made:
        if upright:
            part.location = (part.location.z, part.location.y, part.location.x)
            part.rotation_euler = (0, math.pi / 2, 0)
        cosine, sine = math.cos(turn), math.sin(turn)
        across, along, up = part.location
        part.location = (location[0] + cosine * across - sine * along, location[1] + sine * across + cosine * along, location[2] + up)
        part.rotation_euler.z = turn


def books():
    up = TOP + 0.0005
    for size, color, turn in (((0.24, 0.17, 0.034), (0.05, 0.09, 0.16), 0.1), ((0.22, 0.155, 0.026), (0.3, 0.05, 0.03), -0.06),
                              ((0.19, 0.13, 0.022), (0.3, 0.2, 0.06), 0.22)):
        book(size, (-0.5, 0.16, up), turn, color)
        up += size[2] + 0.0003
    x = 0.5
    for size, color in (((0.235, 0.16, 0.03), (0.16, 0.03, 0.03)), ((0.21, 0.15, 0.022), (0.04, 0.12, 0.07)),
                        ((0.225, 0.16, 0.04), (0.07, 0.08, 0.16)), ((0.2, 0.14, 0.025), (0.34, 0.24, 0.12)),
                        ((0.24, 0.16, 0.035), (0.05, 0.05, 0.05))):
        book(size, (x, 0.31, TOP + size[0] / 2 + 0.0005), 0, color, True)
        x += size[2] + 0.0008
    return up


def mug(x, y, z):
    glaze = plastic("glaze", (0.1, 0.2, 0.3), 0.12)
    lathe([(0, 0.001), (0.03, 0), (0.036, 0.004), (0.039, 0.02), (0.04, 0.092), (0.0385, 0.0945), (0.037, 0.092), (0.036, 0.02),
           (0.03, 0.007), (0, 0.006)], (x, y, z), glaze, 64)
    torus(0.025, 0.0055, (x - 0.045, y, z + 0.05), (math.pi / 2, 0, 0), glaze, (48, 16)).scale = (0.9, 1.15, 1)
    lathe([(0, 0.07), (0.0368, 0.07), (0.0368, 0.078), (0, 0.078)], (x, y, z), plastic("coffee", (0.02, 0.008, 0.003), 0.05), 48, False)


def pencils(x, y):
    lathe([(0, 0), (0.036, 0), (0.037, 0.1), (0.0355, 0.1), (0.0345, 0.003), (0, 0.003)], (x, y, TOP + 0.0005),
          metal("tin", (0.65, 0.62, 0.55), 0.3), 48, False)
    bare, lead = plastic("cedar", (0.5, 0.3, 0.15), 0.6), gray(0.03)[:3]
    for i, color in enumerate(((0.6, 0.35, 0.02), (0.5, 0.03, 0.02), (0.03, 0.12, 0.3), lead, (0.6, 0.35, 0.02))):
        turn, length = 1.3 * i + 0.4, 0.17 - 0.008 * (i * 3 % 5)
        lean = Vector((0.011 * math.cos(turn), 0.011 * math.sin(turn), 0))
        direction = Vector((0.2 * math.cos(turn), 0.2 * math.sin(turn), 1))
        parts = [lathe([(0, 0), (0.0037, 0), (0.0037, length), (0, length)], surface=plastic("pencil", color, 0.3), segments=6,
                       smooth=False),
                 lathe([(0.0036, length), (0.001, length + 0.016), (0, length + 0.016)], surface=bare, segments=12),
                 lathe([(0.001, length + 0.016), (0, length + 0.021)], surface=plastic("lead", lead, 0.4), segments=12)]
        for part in parts:
            part.location = Vector((x, y, TOP + 0.006)) + lean
            part.rotation_euler = direction.to_track_quat("Z", "Y").to_euler()


def gear(teeth, radius, location, turn, brass):
    """A wheel with a hole, 4 mm thick."""
    outline = []
    for i in range(teeth):
        for part, grow in ((0, 0), (0.3, 0), (0.4, 1), (0.6, 1), (0.7, 0)):
            angle = 2 * math.pi * (i + part) / teeth
            reach = radius * (1 + 1.9 * grow / teeth)
            outline.append((reach * math.cos(angle), reach * math.sin(angle)))
    hole = [(0.28 * radius * math.cos(math.atan2(y, x)), 0.28 * radius * math.sin(math.atan2(y, x))) for x, y in outline]
    count = len(outline)
    vertices = [(*point, z) for z in (0, 0.004) for ring in (outline, hole) for point in ring]
    faces = []
    for i in range(count):
        j = (i + 1) % count
        faces += [(2 * count + i, 2 * count + j, 3 * count + j, 3 * count + i), (j, i, count + i, count + j),
                  (i, j, 2 * count + j, 2 * count + i), (count + j, count + i, 3 * count + i, 3 * count + j)]
    made = mesh("gear", vertices, faces, brass)
    made.location, made.rotation_euler = (*location[:2], TOP + location[2]), (0, 0, turn)


def tools():
    steel, brass = metal("tool steel", (0.62, 0.62, 0.64), 0.36), metal("brass", (0.8, 0.56, 0.2), 0.36)
    gear(16, 0.03, (0.232, -0.16, 0.0005), 0.1, brass)
    gear(12, 0.02, (0.286, -0.13, 0.0005), 0.36, brass)
    gear(20, 0.024, (0.25, -0.235, 0.0005), 0.5, steel)
    driver = lathe([(0, 0), (0.011, 0.002), (0.014, 0.02), (0.013, 0.06), (0.009, 0.078), (0.011, 0.09), (0, 0.091)], surface=plastic(
        "handle", (0.55, 0.06, 0.02), 0.2))
    blade = lathe([(0.0035, 0.09), (0.0033, 0.185), (0.0045, 0.19), (0.0008, 0.205), (0, 0.205)], surface=steel, segments=24)
    for part in (driver, blade):
        part.location, part.rotation_euler = (0.41, -0.17, TOP + 0.0145), (math.pi / 2, 0, math.radians(215))
    for at in (-0.07, 0.07):
        ring = lathe([(0.009, 0), (0.0165, 0), (0.0165, 0.009), (0.009, 0.009), (0.009, 0)], surface=steel, segments=32, smooth=False)
        ring.location = (-0.27 + at * 0.94, -0.2 + at * 0.34, TOP + 0.0005)
    box((0.112, 0.011, 0.005), (-0.27, -0.2, TOP + 0.005), (0, 0, 0.35), steel, 0.002)
    columns = numpy.arange(512)
    ticks = numpy.full((64, 512), 0.75)
    for step, length in ((512 / 100, 14), (512 / 20, 24)):
        ticks[64 - length:, columns % step < 1.2] = 0.1
    scale = printed("ruler", ticks[..., None] * numpy.array([1, 0.85, 0.45]))
    box((0.21, 0.028, 0.0012), (0.09, -0.235, TOP + 0.001), (0, 0, -0.08), scale)
    pen = lathe([(0, 0), (0.0045, 0.001), (0.0055, 0.02), (0.0058, 0.085), (0.0058, 0.125), (0.004, 0.138), (0, 0.14)],
                surface=plastic("pen", (0.01, 0.01, 0.015), 0.15))
    pen.location, pen.rotation_euler = (0.13, 0.05, TOP + 0.0235), (math.radians(92), 0, math.radians(28))


def plant(x, y, z):
    lathe([(0, 0), (0.035, 0), (0.045, 0.07), (0.048, 0.07), (0.048, 0.085), (0.043, 0.085), (0.041, 0.07), (0, 0.07)], (x, y, z),
          plastic("clay", (0.35, 0.13, 0.06), 0.8), 48, False)
    leaf_color = plastic("plant", (0.04, 0.13, 0.03), 0.35)
    random = numpy.random.default_rng(2)
    for i in range(22):
        turn, reach, rise = 2.4 * i, random.uniform(0.05, 0.11), random.uniform(0.09, 0.17)
        at = numpy.linspace(0, 1, 8)
        out = reach * at ** 1.4
        middle = numpy.stack([out * math.cos(turn), out * math.sin(turn), rise * (1.5 * at - 0.75 * at ** 2.5)], axis=1)
        across = numpy.outer(0.011 * numpy.sin(math.pi * at ** 0.7) + 0.0005, [-math.sin(turn), math.cos(turn), 0])
        faces = [(j, j + 1, j + 9, j + 8) for j in range(7)]
        made = mesh("leaf", [*(middle - across), *(middle + across)], faces, leaf_color, smooth=True)
        made.location = (x, y, z + 0.068)


# Outside.

def site():
    """A shell of concrete with scaffolding, lit from the ground."""
    rows, columns = numpy.mgrid[0:512, 0:512]
    holes = (rows % 171 > 40) & (rows % 171 < 135) & (columns % 64 > 14) & (columns % 64 < 50)
    concrete = (0.52 + 0.16 * (noise(512, 8, 3) - 0.5)) * numpy.where(holes, 0.12, 1) * numpy.where(rows % 171 < 8, 0.7, 1)
    plane((34, 7), (-9, 46, SITE + 3.5), (math.pi / 2, 0, 0), printed("concrete", concrete))
    plane(120, (0, 61, SITE), surface=material("ground", Color=(0.16, 0.13, 0.1, 1)))
    pole = cylinder(0.05, 9.5, (-25, 44.5, SITE + 4.75), surface=metal("pole", (0.6, 0.6, 0.6), 0.5), segments=10)
    for i in range(1, 16):
        copy_of(pole, (-25 + 2.1 * i, 44.5, SITE + 4.75))
    deck = box((32, 1, 0.08), (-9.5, 45, SITE + 2.6), surface=plastic("deck", (0.5, 0.3, 0.12), 0.8))
    rail = box((32, 0.06, 0.06), (-9.5, 44.5, SITE + 3.6), surface=plastic("rail", (0.75, 0.28, 0.03), 0.5))
    for i in range(1, 3):
        copy_of(deck, (-9.5, 45, SITE + 2.6 + 2.7 * i))
        copy_of(rail, (-9.5, 44.5, SITE + 3.6 + 2.7 * i))
    for x in (-12, 0, 14):
        flood = light("SPOT", 10000, (x, 28, SITE + 0.6), spot_size=math.radians(62), spot_blend=0.8, shadow_soft_size=0.2,
                      color=(0.72, 0.86, 1))
        aimed(flood, (x - 1, 46, SITE + 4))


def build():
    sky(0.01, (0.25, 0.4, 1, 1))
    room()
    drawings()
    box((1.7, 0.98, 0.035), (0, -0.085, TOP - 0.0175), surface=wood("oak", (0.3, 0.17, 0.08), (0.66, 0.45, 0.26), 5, 11), bevel=0.006)
    lamp(0.36, 0.16)
    notebook((0.03, -0.06), 0.12)
    mug(-0.3, 0.06, TOP + 0.0005)
    books()
    pencils(-0.12, 0.25)
    tools()
    plant(-0.48, 0.44, 1.021)
    site()
    camera((-0.09, -1.25, 1.19), (-0.01, 0.06, 0.965), 38, fstop=5.6, focus=(0, -0.05, TOP))
