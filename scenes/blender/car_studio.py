"""A red coupé of the sixties in a photographer's studio, whose softboxes draw lines along the body."""
import math

import bpy
import numpy
from mathutils import Vector
from mathutils.bvhtree import BVHTree
from kit import aimed, camera, copy_of, cylinder, gray, lathe, light, material, mesh, mixture, sphere, subdivided, torus, tube

# Sections of the body from nose to tail: x, half width, height of the wing, (y, z) of the waist line and of the window's upper edge,
# height of the middle, and of the sill.
SECTIONS = numpy.array([
    (0.00, 0.42, 0.50, 0.34, 0.52, 0.26, 0.53, 0.54, 0.37), (0.10, 0.60, 0.59, 0.48, 0.60, 0.36, 0.60, 0.60, 0.27),
    (0.28, 0.73, 0.69, 0.57, 0.67, 0.42, 0.65, 0.65, 0.22), (0.50, 0.79, 0.75, 0.61, 0.71, 0.44, 0.69, 0.70, 0.20),
    (0.85, 0.83, 0.80, 0.63, 0.76, 0.46, 0.74, 0.76, 0.19), (1.20, 0.81, 0.80, 0.66, 0.785, 0.55, 0.785, 0.82, 0.19),
    (1.45, 0.80, 0.785, 0.69, 0.80, 0.645, 0.825, 0.87, 0.19), (1.75, 0.80, 0.785, 0.69, 0.81, 0.60, 0.97, 1.06, 0.19),
    (2.05, 0.80, 0.785, 0.69, 0.81, 0.55, 1.10, 1.20, 0.19), (2.40, 0.81, 0.79, 0.70, 0.815, 0.535, 1.135, 1.245, 0.19),
    (2.75, 0.83, 0.805, 0.71, 0.83, 0.535, 1.11, 1.225, 0.19), (2.95, 0.845, 0.83, 0.70, 0.85, 0.54, 1.06, 1.18, 0.19),
    (3.30, 0.86, 0.865, 0.69, 0.875, 0.56, 0.96, 1.06, 0.20), (3.65, 0.84, 0.855, 0.66, 0.855, 0.56, 0.88, 0.94, 0.22),
    (3.95, 0.79, 0.81, 0.62, 0.81, 0.52, 0.82, 0.85, 0.27), (4.20, 0.70, 0.74, 0.55, 0.745, 0.45, 0.75, 0.765, 0.34),
    (4.30, 0.56, 0.64, 0.46, 0.65, 0.38, 0.65, 0.66, 0.44)])
AXLES, AXLE_HEIGHT, ARCH, TRACK = (0.85, 3.30), 0.31, 0.345, 0.72
TURNS = numpy.radians((180, 150, 120, 90, 60, 30, 0))
BODY, BONNET, DOOR, WINDOW, QUARTER, SCREEN, GRILLE = range(7)
GLASS = (WINDOW, QUARTER, SCREEN)


def section(x):
    """Half of the cage's points at x, from the middle of the floor up to the middle of the roof."""
    wide, wing, y7, z7, y8, z8, top, low = (numpy.interp(x, SECTIONS[:, 0], column) for column in SECTIONS.T[1:])
    flank = [(wide - 0.005, 0.33), (wide, 0.60), (wide - 0.03 * wide, 0.86)]
    return numpy.array([(x, 0, low), (x, wide - 0.25 * wide, low), (x, wide - 0.05 * wide, low + 0.02)]
                       + [(x, y, low + share * (wing - low)) for y, share in flank]
                       + [(x, wide - 0.14 * wide, wing), (x, y7, z7), (x, y8, z8), (x, 0.88 * y8, z8 + 0.45 * (top - z8)),
                          (x, 0.48 * y8, z8 + 0.85 * (top - z8)), (x, 0, top)])


def arch_section(axle, turn):
    """A section whose lower end is on the arch of a wheel."""
    reach = ARCH / 0.955
    made = section(axle + reach * (1 - 2 * turn / math.pi))
    for row, grown, out in ((3, 1.0, 0.012), (4, 1.14, 0.012), (5, 1.24, 0.0)):
        made[row, 0] = axle + grown * reach * math.cos(turn)
        made[row, 1] += out
        made[row, 2] = max(made[row, 2] if row > 3 else 0, AXLE_HEIGHT + grown * reach * math.sin(turn))
    return made


def columns():
    """The cage's sections, each with the axle of its arch."""
    made = [(section(0) * (0, 0.93, 1) + (0.13, 0, 0), None)]
    made += [(section(x), None) for x in (0.0, 0.10, 0.28)] + [(arch_section(AXLES[0], turn), 0) for turn in TURNS]
    made += [(section(x), None) for x in (1.45, 1.75, 2.05, 2.40, 2.72)] + [(arch_section(AXLES[1], turn), 1) for turn in TURNS]
    made += [(section(x), None) for x in (3.95, 4.20, 4.30)]
    return made + [((section(4.30) - (0, 0, 0.54)) * (1, 0.6, 0.5) + (0.01, 0, 0.54), None)]


def region(x, row):
    """What the face between two rows of the cage is."""
    if x < 0.04:
        return GRILLE if x < 0 else BODY
    if row >= 7 and 0.25 < x < 1.44:
        return BONNET
    if row == 7 and 1.44 < x < 3.2:
        return WINDOW if x < 2.6 else QUARTER
    if row >= 9 and (1.44 < x < 2.0 or 2.95 < x < 3.5):
        return SCREEN
    return DOOR if 1.44 < x < 2.6 and 2 <= row < 7 else BODY


def cage(paint, window, dark):
    """Half of the body, mirrored and subdivided. Panels are slots, whose borders become gaps and trims."""
    parts = columns()
    rows = len(parts[0][0])
    faces, slots = [], []
    for i, ((left, arch), (_, other)) in enumerate(zip(parts, parts[1:])):
        for row in range(3 if arch is not None and arch == other else 0, rows - 1):
            faces.append((i * rows + row, (i + 1) * rows + row, (i + 1) * rows + row + 1, i * rows + row + 1))
            slots.append(region(left[7, 0] if i else -1, row))
    used = sorted({vertex for face in faces for vertex in face})
    at = {vertex: number for number, vertex in enumerate(used)}
    points = numpy.concatenate([part for part, _ in parts])[used] * (1, -1, 1)
    first, last = [tuple(at[i * rows + row] for row in range(rows)) for i in (0, len(parts) - 1)]
    made = mesh("body", points, [tuple(at[vertex] for vertex in face) for face in faces] + [first, last[::-1]])
    for surface in (paint, paint, paint, window, window, window, dark):
        made.data.materials.append(surface)
    made.data.polygons.foreach_set("material_index", slots + [GRILLE, BODY])
    made.modifiers.new("mirror", "MIRROR").use_axis = (False, True, False)
    return subdivided(made, 3)


def borders(shape):
    """The edges between the panels of the smooth body as chains of points, each with its two slots."""
    edges = {}
    for face in shape.polygons:
        for edge in face.edge_keys:
            edges.setdefault(edge, []).append(face.material_index)
    kinds = {}
    for edge, found in edges.items():
        pair = tuple(sorted(found)) if len(found) == 2 else (-1, found[0])
        if pair[0] != pair[1]:
            kinds.setdefault(pair, []).append(edge)
    for pair, found in kinds.items():
        while found:
            chain = list(found.pop())
            while more := next((edge for edge in found if chain[-1] in edge or chain[0] in edge), None):
                found.remove(more)
                if chain[-1] not in more:
                    chain.reverse()
                chain.append(more[0] if more[1] == chain[-1] else more[1])
            yield pair, [shape.vertices[vertex].co for vertex in chain]


def trims(shape, paint, chrome, dark):
    for pair, points in borders(shape):
        open_edge, glass, mouth = pair[0] < 0, any(slot in GLASS for slot in pair), GRILLE in pair
        radius = 0.013 if mouth else 0.010 if open_edge else 0.006 if glass else 0.0035
        trim = tube(points, radius, chrome if glass or mouth else paint if open_edge else dark, 8, name="trim")
        trim.data.resolution_u = 2


def wheel_house(axle, side, dark):
    turns = numpy.radians(numpy.linspace(-15, 195, 33))
    around = [(axle + (ARCH + 0.008) * math.cos(turn), AXLE_HEIGHT + (ARCH + 0.008) * math.sin(turn)) for turn in turns]
    points = [(x, side * y, z) for y in (0.45, 0.825) for x, z in around]
    mesh("wheel house", points, [(i, i + 1, i + 34, i + 33) for i in range(32)] + [tuple(range(33))], dark)


def wheel(tyre_surface, alloy, chrome, dark):
    """The parts of a wheel, around the axis z, with the outside up."""
    tread = [(0.215, -0.09), (0.25, -0.10), (0.285, -0.095), (0.305, -0.08), (0.31, -0.05), (0.31, 0.05), (0.305, 0.08), (0.285, 0.095),
             (0.25, 0.10), (0.215, 0.09), (0.21, 0.0), (0.215, -0.09)]
    rim = [(0.19, -0.09), (0.19, 0.0), (0.195, 0.055), (0.212, 0.085), (0.222, 0.093), (0.226, 0.088), (0.213, 0.07), (0.211, -0.09)]
    spokes, faces = [], []
    for turn in numpy.arange(10) * math.tau / 10:
        ray, across = numpy.array((math.cos(turn), math.sin(turn), 0)), numpy.array((-math.sin(turn), math.cos(turn), 0))
        start = len(spokes)
        for radius, half, low, high in ((0.03, 0.012, 0.02, 0.06), (0.10, 0.017, 0.025, 0.062), (0.196, 0.027, 0.0, 0.042)):
            spokes += [radius * ray + y * across + numpy.array((0, 0, z)) for y, z in
                       ((-half, low), (half, low), (half * 0.8, high), (-half * 0.8, high))]
        for ring in (start, start + 4):
            faces += [(ring + i, ring + (i + 1) % 4, ring + (i + 1) % 4 + 4, ring + i + 4) for i in range(4)]
    return [lathe(tread, surface=tyre_surface, segments=96), lathe(rim, surface=alloy, segments=96),
            subdivided(mesh("spokes", spokes, faces, alloy), 2), cylinder(0.05, 0.05, (0, 0, 0.04), surface=alloy, bevel=0.008),
            sphere(0.032, (0, 0, 0.062), chrome), cylinder(0.14, 0.02, (0, 0, -0.03), surface=chrome),
            cylinder(0.185, 0.02, (0, 0, -0.07), surface=dark)]


def wheels(*surfaces):
    for side in (-1, 1):
        for axle in AXLES:
            wheel_house(axle, side, surfaces[-1])
    parts = wheel(*surfaces)
    for part in parts:
        height = part.location.z
        for side in (1, -1):
            for axle in AXLES:
                last = side < 0 and axle == AXLES[1]
                made = part if last else copy_of(part, (0, 0, 0))
                made.location = (axle, side * (TRACK + height), AXLE_HEIGHT)
                made.rotation_euler = (-side * math.pi / 2, 0, 0)


def headlight(point, facing, paint, chrome, lens):
    turned = facing.to_track_quat("Z", "Y").to_euler()
    bowl = lathe([(0.0, -0.04), (0.085, -0.04), (0.085, 0.035), (0.05, 0.0), (0.0, -0.01)], surface=chrome)
    glass = lathe([(0.0, 0.03), (0.084, 0.03), (0.084, 0.037), (0.06, 0.055), (0.03, 0.064), (0.0, 0.066)], surface=lens)
    ring, pod = torus(0.088, 0.011, surface=chrome), cylinder(0.094, 0.20, surface=paint)
    for part, shift in ((bowl, 0), (glass, 0), (ring, 0.034), (pod, -0.07)):
        part.location, part.rotation_euler = point + shift * facing, turned


def fittings(shape, paint, chrome, lens, amber, dark):
    tree = BVHTree.FromPolygons([vertex.co for vertex in shape.vertices], [face.vertices for face in shape.polygons])

    def above(start, direction, distance):
        """A point at this distance above where a ray meets the body."""
        point, normal, *_ = tree.ray_cast(Vector(start), Vector(direction))
        return point + distance * normal

    for side in (-1, 1):
        point, normal, *_ = tree.ray_cast(Vector((-1, side * 0.57, 0.60)), Vector((1, 0, 0)))
        headlight(point, (normal + Vector((-1.5, 0, 0))).normalized(), paint, chrome, lens)
        signal = sphere(0.03, above((-1, side * 0.60, 0.45), (1, 0, 0), 0), amber, 32)
        signal.scale = (1, 1.5, 0.8)
        rays = [numpy.array((-math.cos(turn), side * math.sin(turn), 0)) for turn in numpy.radians(numpy.linspace(38, 74, 9))]
        tube([above((0.6, 0, 0.365) + 2 * ray, -ray, 0.02) for ray in rays], 0.02, chrome, name="bumper")
        tube([above((x, side * 2, 0.70), (0, -side, 0), height) for x, height in ((2.34, 0), (2.36, 0.02), (2.48, 0.02), (2.5, 0))],
             0.008, chrome, name="handle")
        tube([(1.74, side * 0.74, 0.77), (1.72, side * 0.80, 0.83), (1.71, side * 0.85, 0.88)], 0.008, chrome, name="stalk")
        sphere(0.05, (1.70, side * 0.87, 0.89), chrome, 32).scale = (1.5, 1.3, 0.9)
        tube([above((x, side * 0.26 + 0.34 * (1.75 - x), 2), (0, 0, -1), 0.008) for x in numpy.linspace(1.44, 1.75, 6)], 0.006, dark)
    for height in numpy.linspace(0.40, 0.51, 5):
        tube([(0.03, y, height) for y in (-0.33, 0, 0.33)], 0.004, chrome)


def car(paint_surface):
    chrome = material("chrome", "BSDF_PRINCIPLED", Base_Color=gray(0.75), Metallic=1, Roughness=0.06)
    alloy = material("alloy", "BSDF_PRINCIPLED", Base_Color=gray(0.75), Metallic=1, Roughness=0.25)
    rubber = material("rubber", "BSDF_PRINCIPLED", Base_Color=gray(0.02), Roughness=0.55)
    dark = material("dark", Color=gray(0.008))
    window = material("dark glass", "BSDF_PRINCIPLED", Base_Color=gray(0.006), Roughness=0.0, Specular=0.6)
    lens = material("lens", "BSDF_GLASS", Roughness=0, IOR=1.45)
    amber = material("amber", "BSDF_PRINCIPLED", Base_Color=(0.8, 0.2, 0.01, 1), Roughness=0.1)
    body = cage(paint_surface, window, dark)
    shape = body.evaluated_get(bpy.context.evaluated_depsgraph_get()).data
    trims(shape, paint_surface, chrome, dark)
    fittings(shape, paint_surface, chrome, lens, amber, dark)
    wheels(rubber, alloy, chrome, dark)


def cyclorama(surface):
    bend = [(4.0 + 2.5 * math.sin(turn), 2.5 - 2.5 * math.cos(turn)) for turn in numpy.radians(numpy.linspace(0, 90, 33))]
    profile = [(-12, 0)] + bend + [(6.5, 7)]
    points = [(x, y, z) for y, z in profile for x in (-14, 14)]
    mesh("cyclorama", points, [(2 * i, 2 * i + 1, 2 * i + 3, 2 * i + 2) for i in range(len(profile) - 1)], surface, smooth=True)


def paint():
    """Metal flakes in a glossy pigment."""
    flakes = {"Base Color": (0.55, 0.012, 0.012, 1), "Metallic": 1, "Roughness": 0.36}
    pigment = {"Base Color": (0.16, 0.003, 0.004, 1), "Roughness": 0.0, "Specular": 1}
    return mixture("paint", ("BSDF_PRINCIPLED", flakes), ("BSDF_PRINCIPLED", pigment), 0.6)


def build():
    before = set(bpy.data.objects)
    car(paint())
    stand = bpy.data.objects.new("car", None)
    bpy.context.scene.collection.objects.link(stand)
    for part in set(bpy.data.objects) - before - {stand}:
        part.parent = stand
    turn = math.radians(38)
    stand.location, stand.rotation_euler = (-2.15 * math.cos(turn), -2.15 * math.sin(turn), 0), (0, 0, turn)
    cyclorama(material("backdrop", "BSDF_PRINCIPLED", Base_Color=gray(0.18), Roughness=0.38, Specular=0.4))
    camera((-0.3, -8.2, 1.25), (0.02, 0, 0.62), 60)
    aimed(light("AREA", 420, (0, 2.0, 3.0), shape="RECTANGLE", size=6.0, size_y=1.4), (0, 0, 0.8))
    aimed(light("AREA", 220, (6.0, -1.6, 1.4), shape="RECTANGLE", size=4.5, size_y=0.7), (0.5, 0, 0.7))
    aimed(light("AREA", 330, (-4.2, -5.0, 2.0), shape="RECTANGLE", size=2.0, size_y=2.6), (-1.2, -1, 0.5))
    aimed(light("AREA", 350, (-1.5, 3.6, 5.0), shape="RECTANGLE", size=6.0, size_y=0.6), (-1, 6.4, 1.0))
