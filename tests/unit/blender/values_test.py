"""Runs in Blender. Numbers of exported documents, compared with Blender's own functions or with formulas of Cycles."""
import json
import math
import os
import random
import tempfile
import unittest

import bpy
import numpy as np
from bpy_extras.object_utils import world_to_camera_view
from mathutils import Euler, Matrix, Vector

from lightmill_export import camera, lights, world
from lightmill_export.images import ImageFiles
from lightmill_export.materials import MaterialMaker
from lightmill_export.notices import Notices
from lightmill_export.render_engine import export
from lightmill_export.textures import Textures

FOLDER = tempfile.mkdtemp(prefix="lightmill-values-")


def light(kind, matrix=Matrix(), **properties):
    data = bpy.data.lights.new("light", kind)
    for key, value in properties.items():
        setattr(data, key, value)
    return lights.export(bpy.data.objects.new("light", data), matrix, Notices())


def to_document(v):
    """z up in Blender, y up in documents: a turn about x."""
    return np.array(Matrix.Rotation(-math.pi / 2, 3, "X") @ Vector(v))


class Lights(unittest.TestCase):
    def test_a_light_of_p_watts_has_p_over_4_pi_per_steradian(self):
        made = light("POINT", Matrix.Translation((1, 2, 3)), energy=100, color=(1, 0.5, 0.25), shadow_soft_size=0.2)
        np.testing.assert_allclose(made["point"]["intensity"]["rgb"], np.array((1, 0.5, 0.25)) * 100 / (4 * math.pi), rtol=1e-6)
        np.testing.assert_allclose(made["point"]["position"], to_document((1, 2, 3)), atol=1e-6)
        self.assertTrue(made["hidden_from_camera"])

    def test_a_spot_falls_off_as_in_cycles_and_keeps_its_power(self):
        for size, blend in ((0.5, 0.1), (1.2, 0.6), (2.5, 1.0), (1.0, 0.0)):
            spot = light("SPOT", energy=4 * math.pi, spot_size=size, spot_blend=blend)["spot"]
            rim = math.cos(size / 2)
            ours = theirs = 0.0
            outer, inner = math.radians(spot["cutoff_degrees"]), math.radians(spot["cutoff_degrees"] * (1 - spot["blend"]))
            for i in range(4000):
                cosine = rim + (1 - rim) * (i + 0.5) / 4000
                # scene.proto: full within cutoff · (1 − blend), then t²(3 − 2t) in the cosine
                t = min((cosine - math.cos(outer)) / max(math.cos(inner) - math.cos(outer), 1e-12), 1.0)
                # Cycles: smoothstep((cos − cos(size/2)) / ((1 − cos(size/2)) blend)), times the cosine before 4.0
                s = min((cosine - rim) / max((1 - rim) * blend, 1e-12), 1.0)
                self.assertAlmostEqual(t, s, 4)
                ours += spot["intensity"]["rgb"][0] * t * t * (3 - 2 * t)
                theirs += s * s * (3 - 2 * s) * (cosine if bpy.app.version < (4, 0, 0) else 1)
            self.assertAlmostEqual(ours / theirs, 1, 3)

    def test_an_area_light_has_the_power_that_cycles_gives_it(self):
        # Radiance P/(4A) even over the hemisphere has the power πP/4. A spread concentrates it.
        for shape, properties, area in (
                ("SQUARE", {"size": 2}, 4 * 1.5 * 0.5), ("RECTANGLE", {"size": 2, "size_y": 0.5}, 1.5 * 0.5),
                ("DISK", {"size": 2}, math.pi * 1.5 * 0.5), ("ELLIPSE", {"size": 2, "size_y": 1}, math.pi / 2 * 1.5 * 0.5)):
            for spread in (math.pi, 2.0, 0.6):
                made = light("AREA", Matrix.Diagonal((1.5, 0.5, 1, 1)), energy=10, shape=shape, spread=spread, **properties)
                kind = made.get("rectangle") or made["disk"]
                own = (kind["width"] * kind["height"] if "width" in kind
                       else math.pi * kind["radius"] * kind["second_radius"])
                self.assertAlmostEqual(own / area, 1, 5)
                exitance, half = 0.0, math.radians(kind["spread_degrees"]) / 2
                for i in range(20000):
                    angle = half * (i + 0.5) / 20000
                    share = 1 - math.tan(angle) / math.tan(half) if half < math.pi / 2 - 1e-6 else 1
                    exitance += 2 * math.pi * share * math.cos(angle) * math.sin(angle) * half / 20000
                self.assertAlmostEqual(kind["radiance"]["rgb"][0] * own * exitance / (math.pi * 10 / 4), 1, 3)

    def test_an_area_light_lies_as_in_blender(self):
        turn = Euler((0.3, 0.7, -0.4)).to_matrix().to_4x4()
        made = light("AREA", turn, shape="RECTANGLE", size=3, size_y=1)["rectangle"]
        np.testing.assert_allclose(made["direction"], to_document(turn @ Vector((0, 0, -1))), atol=1e-6)
        np.testing.assert_allclose(made["up"], to_document(turn @ Vector((0, 1, 0))), atol=1e-6)
        np.testing.assert_allclose((made["width"], made["height"]), (3, 1), rtol=1e-6)


class Materials(unittest.TestCase):
    def test_a_principled_shader_keeps_its_colour_and_its_diffuse_part(self):
        made = bpy.data.materials.new("m")
        made.use_nodes = True
        shader = made.node_tree.nodes["Principled BSDF"]
        shader.inputs["Base Color"].default_value = (0.9, 0.5, 0.2, 1)
        for metallic, burley in ((0.0, bpy.app.version < (4, 0, 0)), (0.4, bpy.app.version < (4, 0, 0)), (1.0, False)):
            shader.inputs["Metallic"].default_value = metallic
            notices = Notices()
            document = MaterialMaker("m", Textures(ImageFiles(FOLDER), notices), notices).make(made).document["principled"]
            np.testing.assert_allclose(document["base_color"]["rgb"], (0.9, 0.5, 0.2), rtol=1e-6)
            self.assertEqual(document.get("burley_diffuse", False), burley)
            self.assertEqual(notices.texts, [])


class Tiles(unittest.TestCase):
    """A wall of tile 1001, red, and tile 1012, blue and twice as large."""

    def exported(self, folder, packed):
        from material_nodes import MaterialNodes
        n = MaterialNodes()
        for number, size, color in ((1001, 2, (1, 0, 0, 1)), (1012, 4, (0, 0, 1, 1))):
            picture = bpy.data.images.new("one", size, size)
            picture.pixels.foreach_set(color * (size * size))
            picture.filepath_raw, picture.file_format = os.path.join(folder, f"wall.{number}.png"), "PNG"
            picture.save()
        wall = bpy.data.images.load(os.path.join(folder, "wall.1001.png"))
        wall.source, wall.filepath = "TILED", os.path.join(folder, "wall.<UDIM>.png")
        wall.tiles.new(1012)
        if packed:
            wall.pack()
            for number in (1001, 1012):
                os.remove(os.path.join(folder, f"wall.{number}.png"))
        node = n.tree.nodes.new("ShaderNodeTexImage")
        node.image = wall
        n.tree.links.new(n.add("BsdfDiffuse", Color=node.outputs["Color"]), n.end.inputs["Surface"])
        out = os.path.join(folder, "out")
        os.makedirs(out)
        return n, n.document(out), out

    def check(self, packed):
        with tempfile.TemporaryDirectory() as folder:
            n, document, out = self.exported(folder, packed)
            name = document["diffuse"]["reflectance"]["texture"]
            with open(os.path.join(out, n.textures[name]), "rb") as file:
                self.assertEqual(file.readline() + file.readline(), b"PF\n8 8\n")  # two columns, two rows
                file.readline()
                pixels = np.frombuffer(file.read(), dtype="<f4").reshape(8, 8, 3)
            np.testing.assert_allclose(pixels[:4, :4], np.broadcast_to((1, 0, 0), (4, 4, 3)), atol=1e-6)
            np.testing.assert_allclose(pixels[4:, 4:], np.broadcast_to((0, 0, 1), (4, 4, 3)), atol=1e-6)
            np.testing.assert_allclose(pixels[:4, 4:], np.broadcast_to((1, 0, 1), (4, 4, 3)), atol=1e-6)  # no tile
            self.assertEqual(n.notices.texts, [])
            return n.made

    def test_tiles_become_one_image(self):
        self.check(packed=False)

    def test_packed_tiles_become_one_image(self):
        self.check(packed=True)


class Cameras(unittest.TestCase):
    def test_points_are_where_blender_puts_them(self):
        bpy.ops.wm.read_factory_settings(use_empty=True)
        scene = bpy.context.scene
        chance = random.Random(1)
        item = bpy.data.objects.new("camera", bpy.data.cameras.new("camera"))
        scene.collection.objects.link(item)
        for width, height in ((300, 200), (200, 300)):
            for fit in ("AUTO", "HORIZONTAL", "VERTICAL"):
                scene.render.resolution_x, scene.render.resolution_y = width, height
                item.data.shift_x, item.data.shift_y = 0.2, -0.1
                item.data.sensor_fit, item.data.lens, item.data.sensor_width, item.data.sensor_height = fit, 30, 32, 21
                item.location, item.rotation_euler, item.scale = (1, -4, 2), (1.1, 0.2, 0.4), (2, 2, 2)
                bpy.context.view_layer.update()
                made = camera.export(item, item.matrix_world, scene, Notices())
                eye = np.array(made["eye"])
                forward = np.array(made["look_at"]) - eye
                forward /= np.linalg.norm(forward)
                right = np.cross(forward, made["up"])
                right /= np.linalg.norm(right)
                up = np.cross(right, forward)
                scale = 0.5 / math.tan(math.radians(made["vertical_fov_degrees"]) / 2)
                for _ in range(4):
                    point = item.matrix_world.normalized() @ Vector([chance.uniform(-1, 1), chance.uniform(-1, 1), -3])
                    seen = world_to_camera_view(scene, item, point)
                    to_point = to_document(point) - eye
                    depth = to_point @ forward
                    x, y = to_point @ right / depth * scale - made["shift_x"], to_point @ up / depth * scale - made["shift_y"]
                    self.assertAlmostEqual(0.5 + x * height / width, seen.x, 4)
                    self.assertAlmostEqual(0.5 + y, seen.y, 4)

    def test_the_lens_is_that_of_the_f_number(self):
        item = bpy.data.objects.new("camera", bpy.data.cameras.new("camera"))
        item.data.lens, item.data.dof.use_dof, item.data.dof.aperture_fstop, item.data.dof.focus_distance = 50, True, 2, 7
        made = camera.export(item, Matrix(), bpy.context.scene, Notices())
        self.assertAlmostEqual(made["lens_radius"], 0.05 / 2 / 2, 6)
        self.assertAlmostEqual(made["focus_distance"], 7, 5)


class Worlds(unittest.TestCase):
    def test_a_turned_sky_is_where_cycles_shows_it(self):
        chance = random.Random(2)
        for kind in ("POINT", "TEXTURE"):
            made = bpy.data.worlds.new("world")
            made.use_nodes = True
            tree = made.node_tree
            image, move, source = (tree.nodes.new(f"ShaderNode{name}") for name in ("TexEnvironment", "Mapping", "TexCoord"))
            image.image = bpy.data.images.new("sky", 4, 2, float_buffer=True)
            image.image.pixels.foreach_set([0.5] * 32)
            move.vector_type = kind
            move.inputs["Rotation"].default_value = (0, 0, 0.7)
            tree.links.new(source.outputs["Generated"], move.inputs["Vector"])
            tree.links.new(move.outputs[0], image.inputs["Vector"])
            tree.links.new(image.outputs[0], tree.nodes["Background"].inputs["Color"])
            out = world.export(made, ImageFiles(FOLDER), Notices())["environment"]
            back = Matrix.Rotation(-math.radians(out["rotation_degrees"]), 3, "Y")
            for _ in range(10):
                direction = Vector([chance.uniform(-1, 1) for _ in range(3)]).normalized()
                turn = Matrix.Rotation(0.7 if kind == "POINT" else -0.7, 3, "Z")
                x, y, z = turn @ direction
                theirs = (-math.atan2(y, x) / (2 * math.pi) + 0.5, math.asin(z) / math.pi + 0.5)
                # scene.proto: the top at +y, the centre at +x, the right half towards +z; turned about +y
                x, y, z = back @ Vector(to_document(direction))
                ours = (math.atan2(z, x) / (2 * math.pi) + 0.5, math.asin(y) / math.pi + 0.5)
                np.testing.assert_allclose(ours, theirs, atol=1e-5)


class Meshes(unittest.TestCase):
    def test_corners_have_mapped_coordinates_and_instances_share_a_file(self):
        bpy.ops.wm.read_factory_settings(use_empty=True)
        scene = bpy.context.scene
        scene.camera = bpy.data.objects.new("view", bpy.data.cameras.new("view"))
        bpy.ops.mesh.primitive_plane_add(size=2)
        plane = bpy.context.object
        made = bpy.data.materials.new("tiles")
        made.use_nodes = True
        tree = made.node_tree
        tree.nodes.clear()
        end, shader, image, move, source = (tree.nodes.new(f"ShaderNode{name}") for name in (
            "OutputMaterial", "BsdfDiffuse", "TexImage", "Mapping", "TexCoord"))
        image.image = bpy.data.images.new("picture", 2, 2)
        image.image.pack()
        move.inputs["Scale"].default_value, move.inputs["Rotation"].default_value = (2, 3, 1), (0, 0, 0.5)
        move.inputs["Location"].default_value = (0.1, 0.2, 0)
        for a, b in ((source.outputs["UV"], move.inputs[0]), (move.outputs[0], image.inputs["Vector"]),
                     (image.outputs[0], shader.inputs[0]), (shader.outputs[0], end.inputs[0])):
            tree.links.new(a, b)
        plane.data.materials.append(made)
        other = bpy.data.objects.new("other", plane.data)
        other.location = (0, 0, 1)
        scene.collection.objects.link(other)
        export(FOLDER, 64)
        with open(os.path.join(FOLDER, "scene.json"), encoding="utf-8") as file:
            document = json.load(file)
        self.assertEqual(len(document["objects"]), 2)
        self.assertEqual(document["objects"][0]["mesh"], document["objects"][1]["mesh"])
        with open(os.path.join(FOLDER, document["objects"][0]["mesh"]["file"]), encoding="utf-8") as file:
            lines = [line.split() for line in file]
        positions = [[float(x) for x in line[1:4]] for line in lines if line[0] == "v"]
        coordinates = [[float(x) for x in line[1:3]] for line in lines if line[0] == "vt"]
        corners = [[int(i) - 1 for i in corner.split("/")] for line in lines if line[0] == "f" for corner in line[1:]]
        self.assertEqual(len(corners), 6)
        for position, coordinate in corners:
            x, y, _ = positions[position]
            uv = Vector(((x + 1) / 2 * 2, (y + 1) / 2 * 3, 0))  # the plane's own coordinates, scaled
            expected = Euler((0, 0, 0.5)).to_matrix() @ uv + Vector((0.1, 0.2, 0))
            np.testing.assert_allclose(coordinates[coordinate], expected[:2], atol=1e-5)

    def test_a_normal_map_under_different_scales_is_named(self):
        bpy.ops.wm.read_factory_settings(use_empty=True)
        scene = bpy.context.scene
        scene.camera = bpy.data.objects.new("view", bpy.data.cameras.new("view"))
        made = bpy.data.materials.new("bumpy")
        made.use_nodes = True
        tree = made.node_tree
        image, bent = tree.nodes.new("ShaderNodeTexImage"), tree.nodes.new("ShaderNodeNormalMap")
        image.image = bpy.data.images.new("picture", 2, 2)
        image.image.pack()
        tree.links.new(image.outputs[0], bent.inputs["Color"])
        tree.links.new(bent.outputs[0], tree.nodes["Principled BSDF"].inputs["Normal"])
        for name, scale, bumpy in (("even", (2, 2, -2), True), ("long", (1, 1, 3), True), ("smooth", (1, 1, 3), False)):
            bpy.ops.mesh.primitive_plane_add(size=2)
            plane = bpy.context.object
            plane.name, plane.scale = name, scale
            if bumpy:
                plane.data.materials.append(made)
        bpy.context.view_layer.update()
        export(FOLDER, 64)
        with open(os.path.join(FOLDER, "report.json"), encoding="utf-8") as file:
            notices = json.load(file)["notices"]
        self.assertEqual([text.split(":")[0] for text in notices if "same scale" in text], ["object long"])
