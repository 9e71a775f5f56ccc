"""Rings of gold and platinum with a diamond, an emerald and a row of brilliants, among loose stones on slate, under small lamps."""
import math

import bmesh
import bpy
import numpy
from mathutils import Matrix, Vector
from kit import (aimed, bumped, camera, copy_of, gray, image_of, lathe, light, material, noise, plane, shader_of, sky, textured,
                 torus, tube)

MM = 0.001
CROWN, PAVILION = math.radians(34.5), math.radians(40.75)


def cut(points, surface, name):
    """The closed body with flat facets between these points in mm, whose normals point outwards."""
    data, body = bpy.data.meshes.new(name), bmesh.new()
    for point in points:
        body.verts.new(MM * Vector(point))
    bmesh.ops.convex_hull(body, input=body.verts)
    bmesh.ops.recalc_face_normals(body, faces=body.faces)
    body.to_mesh(data)
    data.materials.append(surface)
    made = bpy.data.objects.new(name, data)
    bpy.context.scene.collection.objects.link(made)
    return made


def brilliant(radius, surface):
    """A round brilliant, with the upper edge of its girdle at z = 0."""
    half, girdle = math.pi / 8, -0.04
    points = []
    for i in range(16):
        ring = [(1, 0), (1, girdle)]
        if i % 2 == 0:
            ring.append((0.56, 0.44 * math.tan(CROWN)))
        else:
            ring += [(0.76, (1 - 0.76 * math.cos(half)) * math.tan(CROWN)),
                     (0.24, girdle - (1 - 0.24 * math.cos(half)) * math.tan(PAVILION))]
        points += [(radius * r * math.cos(i * half), radius * r * math.sin(i * half), radius * z) for r, z in ring]
    return cut(points + [(0, 0, radius * (girdle - math.tan(PAVILION)))], surface, "brilliant")


def step_cut(length, width, surface):
    """A stone with steps and bevelled corners, as emeralds have, with the upper edge of its girdle at z = 0."""
    points = []
    for inset, z in ((0.34, 0.24), (0.22, 0.19), (0.09, 0.10), (0, 0), (0, -0.06), (0.16, -0.34), (0.42, -0.58), (0.75, -0.78)):
        x, y, corner = length / 2 - inset * width / 2, width / 2 * (1 - inset), 0.28 * width / 2 * (1 - inset)
        points += [(a * (x - dx), b * (y - dy), z * width) for a in (-1, 1) for b in (-1, 1) for dx, dy in ((corner, 0), (0, corner))]
    return cut(points, surface, "step cut")


def loose(stone, place, tilt, turn):
    """Lays a stone on the slate at a place in mm."""
    turned = Matrix.Rotation(turn, 3, "Z") @ Matrix.Rotation(tilt, 3, "Y")
    stone.rotation_euler = turned.to_euler()
    stone.location = (MM * place[0], MM * place[1], 0.03 * MM - min((turned @ vertex.co).z for vertex in stone.data.vertices))


def band(inner, thick, wide, metal, taper=0.0):
    """A band around the y axis, whose inside is slightly curved, and which can get narrower at the top."""
    turns = numpy.linspace(-math.pi, math.pi, 33)
    profile = [(inner + thick * (0.5 + 0.5 * math.cos(turn) * (1 if abs(turn) < math.pi / 2 else 0.6)),
                wide / 2 * math.copysign(abs(math.sin(turn)) ** 0.6, math.sin(turn))) for turn in turns]
    profile[-1] = profile[0]
    made = lathe([(MM * r, MM * z) for r, z in profile], surface=metal, segments=192)
    made.data.transform(Matrix.Rotation(-math.pi / 2, 4, "X"))
    for vertex in made.data.vertices:
        vertex.co.y *= 1 - taper * max(0.0, vertex.co.z / (MM * (inner + thick))) ** 2
    return made


def claws(corners, base, girdle, metal):
    """Wires from the band up to the girdle at these corners, and over its edge. All in mm."""
    for x, y in corners:
        out = math.hypot(x, y)
        path = [(0.25, base), (0.62, base + 0.55 * (girdle - base)), (1.0 + 0.28 / out, girdle - 0.6), (1.0 + 0.34 / out, girdle + 0.1),
                (1.0 + 0.16 / out, girdle + 0.75), (1.0 - 0.55 / out, girdle + 0.9)]
        tube([(MM * share * x, MM * share * y, MM * z) for share, z in path], 0.36 * MM, metal, name="claw").data.resolution_u = 4


def stand(parts, place, turn, lean=0.0, lift=0.0):
    """Moves the parts of a ring together, to a place in mm."""
    frame = bpy.data.objects.new("ring", None)
    bpy.context.scene.collection.objects.link(frame)
    for part in parts:
        part.parent = frame
    frame.location, frame.rotation_euler = (MM * place[0], MM * place[1], MM * lift), (lean, 0, turn)


def made_by(function, *arguments):
    """The objects that a function adds to the scene."""
    before = set(bpy.data.objects)
    function(*arguments)
    return set(bpy.data.objects) - before


def solitaire(metal, diamond):
    band(8.4, 1.7, 2.6, metal, 0.35)
    stone = brilliant(3.9, diamond)
    stone.location.z = 13.8 * MM
    turns = [math.tau * (i + 0.25) / 6 for i in range(6)]
    claws([(3.9 * math.cos(turn), 3.9 * math.sin(turn)) for turn in turns], 9.4, 13.8, metal)
    torus(2.5 * MM, 0.32 * MM, (0, 0, 11.5 * MM), surface=metal, segments=(64, 16))


def cocktail_ring(metal, emerald):
    band(8.4, 1.9, 3.4, metal, 0.2)
    stone = step_cut(9.0, 7.0, emerald)
    stone.location.z = 15.4 * MM
    claws([(a * 3.95, b * 2.95) for a in (-1, 1) for b in (-1, 1)], 9.6, 15.4, metal)
    rail = torus(2.6 * MM, 0.38 * MM, (0, 0, 12.0 * MM), surface=metal, segments=(64, 16))
    rail.scale = (1.3, 1, 1)


def eternity_ring(metal, diamond):
    """A band around z with stones all around it."""
    inner = band(8.6, 0.7, 2.9, metal)
    inner.rotation_euler.x = math.pi / 2
    for side in (-1, 1):
        torus(10.15 * MM, 0.36 * MM, (0, 0, side * 1.28 * MM), surface=metal, segments=(128, 16))
    stone, count = brilliant(1.13, diamond), 27
    for i in range(count):
        turn = math.tau * i / count
        made = stone if i == 0 else copy_of(stone, (0, 0, 0))
        made.location = (10.45 * MM * math.cos(turn), 10.45 * MM * math.sin(turn), 0)
        made.rotation_euler = (0, math.pi / 2, turn)


def rings(platinum, gold, diamond, emerald):
    stand(made_by(solitaire, platinum, diamond), (-9, 4), math.radians(28), math.radians(9), 10.1)
    stand(made_by(cocktail_ring, gold, emerald), (15, 11), math.radians(-32), lift=10.3)
    stand(made_by(eternity_ring, gold, diamond), (12.5, -9.5), 0.1, lift=1.65)


def stones(diamond, ruby, sapphire):
    for radius, surface, place, turn in ((3.6, ruby, (-10, -13), 2.2), (2.2, diamond, (-2.5, -19), 0.6), (3.0, sapphire, (-23, -9), -0.6),
                                         (1.6, diamond, (-19, -17), 4.0), (1.5, ruby, (3, -24), 1.0)):
        loose(brilliant(radius, surface), place, PAVILION, turn)
    random = numpy.random.default_rng(7)
    for number in range(16):
        surface = (diamond, ruby, sapphire)[number % 3]
        place = (-75 + 10 * number + random.uniform(-4, 4), random.uniform(45, 115))
        loose(brilliant(random.uniform(1.6, 3.0), surface), place, PAVILION, random.uniform(0, 6))


def slate():
    clefts = noise(1024, 5, 3, 8, 0.55)
    clefts = 0.6 * numpy.round(clefts * 7) / 7 + 0.4 * noise(1024, 24, 4, 6, 0.6)
    made = material("slate", "BSDF_PRINCIPLED", Roughness=0.6, Specular=0.2)
    tint = 0.15 + 0.17 * noise(1024, 9, 5, 7, 0.6)
    picture = image_of("slate", numpy.stack([tint * 0.94, tint, tint * 1.07], axis=2))
    textured(made, picture, shader_of(made).inputs["Base Color"], "UV", {"Scale": (5, 5, 5)})
    return bumped(made, image_of("clefts", clefts, data=True), 0.003, (5, 5, 5))


def lamps():
    warm, cool = (1, 0.82, 0.62), (0.78, 0.88, 1)
    for power, place, size, color in ((2.3, (0.16, 0.12, 0.30), 0.022, warm), (0.7, (-0.22, 0.10, 0.24), 0.018, cool),
                                      (0.4, (-0.06, -0.14, 0.36), 0.02, warm), (0.3, (0.10, -0.20, 0.28), 0.016, cool),
                                      (1.2, (0.02, 0.30, 0.22), 0.02, warm)):
        aimed(light("AREA", power, place, shape="DISK", size=size, color=color), (0, 0, 0.01))
    aimed(light("AREA", 0.35, (-0.30, -0.02, 0.20), shape="RECTANGLE", size=0.16, size_y=0.24), (0, 0, 0.01))
    aimed(light("AREA", 0.2, (0.32, 0.04, 0.14), shape="RECTANGLE", size=0.10, size_y=0.20), (0, 0, 0.01))


def gem(name, ior, color=gray(1)):
    return material(name, "BSDF_PRINCIPLED", Base_Color=color, Transmission=1, Roughness=0, IOR=ior)


def build():
    platinum = material("platinum", "BSDF_PRINCIPLED", Base_Color=(0.74, 0.72, 0.69, 1), Metallic=1, Roughness=0.07)
    gold = material("gold", "BSDF_PRINCIPLED", Base_Color=(0.98, 0.65, 0.24, 1), Metallic=1, Roughness=0.08)
    diamond, emerald = gem("diamond", 2.42), gem("emerald", 1.58, (0.25, 0.92, 0.55, 1))
    ruby, sapphire = gem("ruby", 1.77, (0.97, 0.22, 0.30, 1)), gem("sapphire", 1.77, (0.28, 0.46, 0.97, 1))
    plane(0.8, surface=slate())
    rings(platinum, gold, diamond, emerald)
    stones(diamond, ruby, sapphire)
    sky(0.02)
    lamps()
    camera((0.0, -0.155, 0.098), (0.001, 0.003, 0.0102), 88, fstop=13, focus=(-0.009, 0.002, 0.021))
