"""A nave with chapels at both sides, lit by a thousand small lamps: garlands, altars and a rose. Most walls see few of them."""
import math

import bpy
import numpy

from kit import (box, bumped, camera, copy_of, cylinder, gray, image_of, lathe, material, mesh, noise, place, plane, shader_of, textured,
                 tube)

BAY, BAYS, START = 4.0, 9, -4.0
END = START + BAY * BAYS
NAVE, OUTER = 3.0, 6.0  # half the widths
SPRING, CORNICE, CEILING = 3.6, 6.2, 5.5
ARCH = 1.6
RADIUS = 0.03
AMBER, PEARL, AZURE = (1, 0.45, 0.12), (1, 0.72, 0.42), (0.1, 0.4, 1)


def build():
    camera((0.75, -3.4, 1.75), (-0.12, 10, 1.75), 25).data.shift_y = 0.1
    stone = ashlar("stone", (0.82, 0.76, 0.68), 1)
    marble = polished_marble()
    floor()
    walls(stone)
    vault()
    arcades(stone, marble)
    lamps = Lamps()
    garlands(lamps)
    for side in (-1, 1):
        for bay in range(BAYS):
            chapel(lamps, side, START + (bay + 1) * BAY - 0.12, (bay * 2 + (side > 0)) % 5, marble)
    rose(lamps)
    for made in (lamps.cap, lamps.cup):
        bpy.data.objects.remove(made)


# Stone.

def ashlar(name, color, seed, size=512, rows=6):
    """Blocks of stone, in courses."""
    y, x = numpy.mgrid[0:size, 0:size] / size
    row = (y * rows).astype(int)
    along = x * 3 + 0.5 * (row % 2)
    random = numpy.random.default_rng(seed)
    tone = random.uniform(0.88, 1.04, (rows, 3))[row, along.astype(int) % 3]
    rough = noise(size, 8, seed, 6, 0.6)
    joint = numpy.minimum(numpy.minimum(y * rows % 1, 1 - y * rows % 1) / rows, numpy.minimum(along % 1, 1 - along % 1) / 3)
    depth = numpy.clip(joint / 0.008, 0, 1)
    made = material(name)
    picture = image_of(name, (tone * (0.85 + 0.25 * rough) * (0.75 + 0.25 * depth))[:, :, None] * numpy.asarray(color))
    textured(made, picture, shader_of(made).inputs["Color"], "UV")
    return bumped(made, image_of(name + " height", 0.8 * depth + 0.2 * rough, data=True), 0.012)


def polished_marble(size=512):
    vein = numpy.abs(noise(size, 4, 11, 6, 0.55) - 0.5) * 2
    value = 0.62 + 0.3 * numpy.clip(vein * 4, 0, 1)
    made = material("marble", "BSDF_PRINCIPLED", Roughness=0.2)
    picture = image_of("marble", value[:, :, None] * numpy.array((1, 0.93, 0.86)))
    textured(made, picture, shader_of(made).inputs["Base Color"], "UV", {"Scale": (1, 0.2, 1)})
    return made


def floor(size=1024):
    """Squares of three marbles, with a star in each."""
    y, x = numpy.mgrid[0:size, 0:size] / size
    u, v = numpy.abs(4 * x % 1 - 0.5), numpy.abs(4 * y % 1 - 0.5)
    vein = noise(size, 8, 3, 7, 0.55)
    colors = numpy.array(((0.8, 0.75, 0.68), (0.2, 0.22, 0.24), (0.5, 0.26, 0.2)))
    kind = numpy.where(numpy.maximum(u, v) > 0.44, 1, 0)
    kind[(u + v < 0.42) & (numpy.maximum(u, v) < 0.44)] = 1
    kind[u + v < 0.3] = 2
    kind[u + v < 0.14] = 0
    picture = colors[kind] * (0.8 + 0.4 * (vein[:, :, None] - 0.3))
    made = material("floor", "BSDF_PRINCIPLED", Roughness=0.13, Specular=0.6)
    textured(made, image_of("floor", picture), shader_of(made).inputs["Base Color"], "UV", {"Scale": (2 * OUTER / 4, (END - START) / 4, 1)})
    plane((2 * OUTER, END - START), (0, (START + END) / 2, 0), surface=made, name="floor")


# The building.

def walls(stone):
    middle, long = (START + END) / 2, END - START
    for side in (-1, 1):
        wall(stone, (side * OUTER, middle), long, CEILING, side * math.pi / 2)
        plane((OUTER - NAVE + 0.3, long), (side * (OUTER + NAVE - 0.3) / 2, middle, CEILING), (math.pi, 0, 0),
              material("aisle ceiling", Color=(0.5, 0.45, 0.4, 1)), "aisle ceiling")
        for i in range(1, BAYS):
            for face in (-1, 1):
                wall(stone, (side * (OUTER + NAVE + 0.3) / 2, START + i * BAY + face * 0.12), OUTER - NAVE - 0.3, CEILING,
                     0 if face < 0 else math.pi)
            box((0.02, 0.24, CEILING), (side * (NAVE + 0.31), START + i * BAY, CEILING / 2), surface=stone, name="wall end")
    wall(stone, (0, END), 2 * OUTER, CORNICE + NAVE, math.pi)
    wall(stone, (0, START), 2 * OUTER, CORNICE + NAVE, 0)


def wall(stone, at, long, tall, turn):
    """An upright rectangle with texture coordinates in units of 3 m."""
    made = mesh("wall", [(-long / 2, 0, 0), (long / 2, 0, 0), (long / 2, 0, tall), (-long / 2, 0, tall)], [(0, 1, 2, 3)], stone,
                [(0, 0), (long / 3, 0), (long / 3, tall / 3), (0, tall / 3)])
    made.location, made.rotation_euler.z = (*at, 0), turn
    return made


def vault(size=256, steps=48):
    """A coffered barrel vault."""
    y, x = numpy.mgrid[0:size, 0:size] / size
    inside = numpy.minimum(numpy.minimum(x, 1 - x), numpy.minimum(y, 1 - y))
    height = numpy.clip((0.22 - inside) / 0.04, 0, 1) * 0.5 + numpy.clip((0.12 - inside) / 0.03, 0, 1) * 0.5
    blue, clay = numpy.array((0.16, 0.22, 0.38)), numpy.array((0.55, 0.44, 0.34))
    made = material("coffers")
    picture = numpy.where((inside > 0.22)[:, :, None], blue, clay) * (0.75 + 0.25 * height[:, :, None])
    textured(made, image_of("coffers", picture), shader_of(made).inputs["Color"], "UV")
    bumped(made, image_of("coffers height", height, data=True), 0.08)
    turns = [math.pi * i / steps for i in range(steps + 1)]
    vertices = [(NAVE * math.cos(turn), y, CORNICE + NAVE * math.sin(turn)) for y in (START, END) for turn in turns]
    faces = [(i + 1, i, i + steps + 1, i + steps + 2) for i in range(steps)]
    rows = (END - START) / 0.8
    uvs = [corner for i in range(steps) for corner in ((12 * (i + 1) / steps, 0), (12 * i / steps, 0), (12 * i / steps, rows),
                                                       (12 * (i + 1) / steps, rows))]
    mesh("vault", vertices, faces, made, uvs, smooth=True)


def arcades(stone, marble):
    panel = arch_panel(stone)
    column = lathe(column_profile(), surface=marble, segments=48, name="column")
    for side in (-1, 1):
        at = side * (NAVE - 0.36), (START + END) / 2, CORNICE - 0.08
        box((0.16, END - START, 0.14), at, surface=marble, bevel=0.03, name="cornice")
    rib = vault_rib(marble)
    for i in range(BAYS):
        for side in (-1, 1):
            copy_of(panel, (side * NAVE, START + (i + 0.5) * BAY, 0))
    for i in range(1, BAYS):
        y = START + i * BAY
        copy_of(rib, (0, y, 0))
        for side in (-1, 1):
            copy_of(column, (side * NAVE, y, 0))
            box((0.86, 0.86, 0.12), (side * NAVE, y, SPRING - 0.061), surface=marble, bevel=0.02, name="impost")
            box((0.9, 0.9, 0.12), (side * NAVE, y, 0.061), surface=marble, bevel=0.02, name="plinth")
    for made in (panel, column, rib):
        bpy.data.objects.remove(made)


def column_profile():
    base = [(0, 0.122), (0.42, 0.122), (0.44, 0.16), (0.42, 0.2), (0.37, 0.22), (0.36, 0.26), (0.38, 0.29), (0.36, 0.32), (0.31, 0.34)]
    shaft = [(0.31 - 0.05 * t * t, 0.34 + 2.66 * t) for t in numpy.linspace(0.05, 1, 12)]
    capital = [(0.29, 3.02), (0.3, 3.05), (0.27, 3.08), (0.28, 3.16), (0.31, 3.28), (0.37, 3.4), (0.42, 3.45), (0.42, 3.477), (0, 3.477)]
    return base + shaft + capital


def arch_panel(stone, steps=24, thick=0.3):
    """The wall over one arch, with its reveal."""
    turns = [math.pi * (1 - i / steps) for i in range(steps + 1)]
    curve = [(-BAY / 2, SPRING), *((ARCH * math.cos(turn), SPRING + ARCH * math.sin(turn)) for turn in turns), (BAY / 2, SPRING)]
    vertices, faces, uvs = [], [], []
    for x in (-thick, thick):
        vertices += [(x, y, z) for y, z in curve] + [(x, y, CORNICE + 0.001) for y, z in curve]
    count = len(curve)
    for i in range(count - 1):
        front = (i, i + count, i + count + 1, i + 1)
        back = tuple(at + 2 * count for at in reversed(front))
        reveal = (i, i + 1, i + 1 + 2 * count, i + 2 * count)
        faces += [front, back, reveal]
        uvs += [(vertices[at][1] / 3, vertices[at][2] / 3) for at in front + back]
        uvs += [(vertices[at][0] / 3, at % count / 16) for at in reveal]
    return mesh("arcade", vertices, faces, stone, uvs)


def vault_rib(surface, steps=48, wide=0.22, deep=0.14):
    """A half ring below the vault."""
    outline = [(-wide, NAVE - 0.002), (-wide, NAVE - deep), (wide, NAVE - deep), (wide, NAVE - 0.002)]
    turns = [math.pi * i / steps for i in range(steps + 1)]
    vertices = [(r * math.cos(turn), y, CORNICE + r * math.sin(turn)) for turn in turns for y, r in outline]
    faces = [(4 * i + k, 4 * i + k + 1, 4 * i + k + 5, 4 * i + k + 4) for i in range(steps) for k in range(3)]
    uvs = [(vertices[at][1] + 0.5, at // 4 / 6) for face in faces for at in face]
    return mesh("rib", vertices, faces, surface, uvs)


# The lamps.

class Lamps:
    """Small spheres of light. Those of one colour and power share their data."""

    def __init__(self):
        self.kinds = {}
        self.random = numpy.random.default_rng(1)
        self.black = material("iron", "BSDF_PRINCIPLED", Base_Color=gray(0.05), Metallic=0, Roughness=0.4)
        self.brass = material("brass", "BSDF_PRINCIPLED", Base_Color=(0.8, 0.55, 0.25, 1), Metallic=1, Roughness=0.25)
        self.cap = cylinder(0.014, 0.03, (0, 0, -10), surface=self.black, segments=12, name="cap")
        profile = [(0, 0), (0.022, 0), (0.008, 0.012), (0.01, 0.05), (0.026, 0.07), (0.02, 0.07), (0, 0.055)]
        self.cup = lathe(profile, (0, 0, -10), self.brass, 16, name="cup")

    def add(self, color, watts, location):
        watts = watts * (0.5, 1, 1.5)[self.random.integers(3)]
        if (color, watts) not in self.kinds:
            data = self.kinds[color, watts] = bpy.data.lights.new("lamp", "POINT")
            data.energy, data.color, data.shadow_soft_size = watts, color, RADIUS
        place(bpy.data.objects.new("lamp", self.kinds[color, watts])).location = location

    def hang(self, color, watts, x, y, z):
        """A lamp under a wire at z."""
        self.add(color, watts, (x, y, z - 0.03 - RADIUS))
        copy_of(self.cap, (x, y, z - 0.014))

    def stand(self, color, watts, x, y, z):
        """A lamp on a cup at z."""
        self.add(color, watts, (x, y, z + 0.072 + RADIUS))
        copy_of(self.cup, (x, y, z + 0.001))

    def string(self, color, watts, start, end, sag, count):
        """A garland."""
        start, end = numpy.asarray(start), numpy.asarray(end)
        at = [start + (end - start) * t - (0, 0, 4 * sag * t * (1 - t)) for t in numpy.linspace(0, 1, 2 * count + 1)]
        line(at, 0.005, self.black)
        for x, y, z in at[1::2]:
            self.hang(color, watts, x, y, z)


def line(points, radius, surface):
    """A thin wire with straight parts between points."""
    made = tube(points, radius, surface, 6, name="wire")
    made.data.splines[0].type = "POLY"
    return made


def garlands(lamps):
    """264 across the nave, 288 along the arcades."""
    for i in range(1, BAYS):
        y = START + i * BAY
        lamps.string(PEARL, 2.6, (-NAVE + 0.4, y, 6.0), (NAVE - 0.4, y, 6.0), 1.5, 33)
    for side in (-1, 1):
        for i in range(BAYS):
            y = START + i * BAY
            lamps.string(AMBER, 1.8, (side * (NAVE - 0.42), y, 3.75), (side * (NAVE - 0.42), y + BAY, 3.75), 0.75, 16)


def chapel(lamps, side, wall, kind, marble):
    """20 lamps on two steps before a vase, against the chapel's far wall."""
    color = (AMBER, AZURE, PEARL, AZURE, AMBER)[kind]
    x = side * (OUTER + NAVE + 0.3) / 2
    for step, (deep, tall) in enumerate(((0.7, 1.2), (1.1, 0.75))):
        box((2.3 - 0.01 * step, deep, tall), (x, wall - deep / 2 - 0.002, tall / 2 + 0.001), surface=marble, bevel=0.02, name="altar")
        for i in range(10):
            lamps.stand(color, 1.5, x - 1.035 + 0.23 * i, wall - deep + 0.12, tall)
    glaze = material("vase", "BSDF_PRINCIPLED", Base_Color=((0.05, 0.2, 0.22, 1), (0.45, 0.12, 0.06, 1), (0.6, 0.5, 0.3, 1))[kind % 3],
                     Roughness=0.1)
    lathe([(0, 0), (0.13, 0), (0.14, 0.03), (0.1, 0.06), (0.12, 0.15), (0.24, 0.45), (0.27, 0.62), (0.22, 0.78), (0.1, 0.88), (0.09, 0.98),
           (0.15, 1.06), (0.13, 1.06), (0.07, 0.98), (0, 0.95)], (x, wall - 0.29, 1.202), glaze, 48, name="vase")


def rose(lamps):
    """88 lamps in rings on the end wall."""
    for ring, (count, color) in enumerate(((8, PEARL), (16, AMBER), (24, AZURE), (40, PEARL))):
        radius = 0.45 * (ring + 1)
        points = [(radius * math.cos(math.tau * i / 64), END - 0.06, 5.9 + radius * math.sin(math.tau * i / 64)) for i in range(65)]
        line(points, 0.02, lamps.brass)
        for i in range(count):
            turn = math.tau * (i + 0.5 * (ring % 2)) / count
            lamps.add(color, 0.8, (radius * math.cos(turn), END - 0.12, 5.9 + radius * math.sin(turn)))
