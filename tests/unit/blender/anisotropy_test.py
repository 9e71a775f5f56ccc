"""Runs in Blender. Anisotropic highlights and sheen of exported documents, compared with formulas of Cycles."""
import json
import math
import os
import tempfile
import unittest

import bpy
import numpy as np

from lightmill_export.principled import SHEEN_COLOR, SHEEN_ROUGHNESS
from lightmill_export.render_engine import export

FOLDER = tempfile.mkdtemp(prefix="lightmill-anisotropy-")


def brushed(kind="ShaderNodeBsdfPrincipled", **inputs):
    """A material of one shader, and the shader."""
    made = bpy.data.materials.new("brushed")
    made.use_nodes = True
    tree = made.node_tree
    tree.nodes.clear()
    shader = tree.nodes.new(kind)
    for name, value in inputs.items():
        shader.inputs[name.replace("_", " ")].default_value = value
    tree.links.new(shader.outputs[0], tree.nodes.new("ShaderNodeOutputMaterial").inputs["Surface"])
    return made, shader


def with_tangent(made, shader, direction, name):
    node = made.node_tree.nodes.new("ShaderNodeTangent")
    node.direction_type = direction
    setattr(node, "axis" if direction == "RADIAL" else "uv_map", name)
    made.node_tree.links.new(node.outputs[0], shader.inputs["Tangent"])


def with_image(made, shader, coordinates="UV"):
    picture = bpy.data.images.new("picture", 2, 2)
    picture.pack()
    node, source = (made.node_tree.nodes.new(f"ShaderNodeTex{kind}") for kind in ("Image", "Coord"))
    node.image = picture
    made.node_tree.links.new(source.outputs[coordinates], node.inputs["Vector"])
    made.node_tree.links.new(node.outputs[0], shader.inputs["Base Color"])


def exported(made, mesh=bpy.ops.mesh.primitive_cube_add, **properties):
    """The document's material, the lines of its mesh, and the notices."""
    for item in list(bpy.data.objects):
        bpy.data.objects.remove(item)
    mesh(**properties)
    bpy.context.object.data.materials.append(made)
    export(FOLDER, 64)
    documents = []
    for name in ("scene.json", "report.json"):
        with open(os.path.join(FOLDER, name), encoding="utf-8") as file:
            documents.append(json.load(file))
    document, report = documents
    with open(os.path.join(FOLDER, document["objects"][0]["mesh"]["file"]), encoding="utf-8") as file:
        lines = [line.split() for line in file]
    return document["materials"][0], lines, report["notices"]


def alphas(principled):
    """alpha along u and v, as docs/reference/scene.md says. The rotation is a multiple of 90 degrees."""
    least, strength = principled["roughness"] ** 2, principled.get("anisotropy", 0)
    most = least + (1 - least) * strength ** 2
    return (most, least) if principled.get("anisotropy_rotation_degrees", 0) % 180 == 0 else (least, most)


def directions(lines):
    """The middle and the normal of each triangle, and the direction in which u grows and v does not."""
    vertices, coordinates = (np.array([[float(x) for x in line[1:]] for line in lines if line[0] == kind]) for kind in ("v", "vt"))
    for line in lines:
        if line[0] == "f":
            corners = [[int(i or 0) - 1 for i in corner.split("/")] for corner in line[1:]]
            p, t = (np.array([array[corner[i]] for corner in corners]) for i, array in ((0, vertices), (1, coordinates)))
            e, d = p[1:] - p[0], t[1:] - t[0]
            u = (e[0] * d[1][1] - e[1] * d[0][1]) / (d[0][0] * d[1][1] - d[0][1] * d[1][0])
            n = np.cross(e[0], e[1])
            yield p.mean(axis=0), n / np.linalg.norm(n), u / np.linalg.norm(u)


class Anisotropy(unittest.TestCase):
    def setUp(self):
        bpy.ops.wm.read_factory_settings(use_empty=True)

    def test_principled_shaders_have_the_alphas_of_cycles(self):
        for roughness, strength in ((0.5, 0.0), (0.5, 0.4), (0.3, 1.0), (0.9, 0.9)):
            made, _ = brushed(Metallic=1.0, Roughness=roughness, Anisotropic=strength)
            document, _, _ = exported(made)
            aspect = math.sqrt(1 - 0.9 * strength)
            np.testing.assert_allclose(alphas(document["principled"]), (min(roughness ** 2 / aspect, 1), roughness ** 2 * aspect),
                                       rtol=1e-5)

    def test_anisotropic_shaders_have_the_alphas_of_cycles(self):
        for strength in (-0.7, -0.2, 0.0, 0.4, 0.8):
            made, _ = brushed("ShaderNodeBsdfAnisotropic", Roughness=0.4, Anisotropy=strength)
            document, _, _ = exported(made)
            expected = ((0.16 / (1 + strength), 0.16 * (1 + strength)) if strength < 0
                        else (0.16 * (1 - strength), 0.16 / (1 - strength)))
            np.testing.assert_allclose(alphas(document["principled"]), expected, rtol=1e-5)

    def test_the_rotation_is_that_of_cycles(self):
        made, _ = brushed(Metallic=1.0, Anisotropic=0.5, Anisotropic_Rotation=0.125)
        document, _, _ = exported(made)
        self.assertAlmostEqual(document["principled"]["anisotropy_rotation_degrees"], 45, 4)

    def test_the_direction_goes_around_the_axis(self):
        # Of Cycles: perpendicular to the normal, and nearest to axis × p. p is the middle in the object's box, from −½ to ½.
        for name, axis in (("", (0, 0, 1)), ("X", (1, 0, 0)), ("Y", (0, -1, 0)), ("Z", (0, 0, 1))):
            made, shader = brushed(Metallic=1.0, Anisotropic=0.5)
            if name:
                with_tangent(made, shader, "RADIAL", name)
            _, lines, _ = exported(made, bpy.ops.mesh.primitive_ico_sphere_add, subdivisions=2)
            found = list(directions(lines))
            positions = np.array([[float(x) for x in line[1:]] for line in lines if line[0] == "v"])
            low, high = positions.min(axis=0), positions.max(axis=0)
            self.assertEqual(len(found), 80)
            for middle, normal, u in found:
                around = np.cross(axis, (middle - low) / (high - low) - 0.5)
                expected = around - normal * np.dot(normal, around)
                np.testing.assert_allclose(u, expected / np.linalg.norm(expected), atol=1e-3)

    def test_the_direction_is_that_of_a_uv_map(self):
        made, shader = brushed(Metallic=1.0, Anisotropic=0.5)
        with_tangent(made, shader, "UV_MAP", "UVMap")
        _, lines, notices = exported(made, bpy.ops.mesh.primitive_plane_add)
        for _, _, u in directions(lines):
            np.testing.assert_allclose(u, (1, 0, 0), atol=1e-6)
        self.assertFalse(any("anisotropy" in text for text in notices))

    def test_images_with_other_coordinates_are_named(self):
        for coordinates, tangent, is_named in (("UV", ("UV_MAP", ""), False), ("UV", ("RADIAL", "Z"), True),
                                               ("Generated", ("UV_MAP", ""), True), ("UV", None, True)):
            made, shader = brushed(Metallic=1.0, Anisotropic=0.5)
            with_image(made, shader, coordinates)
            if tangent:
                with_tangent(made, shader, *tangent)
            _, _, notices = exported(made)
            self.assertEqual(any("the direction of its anisotropy" in text for text in notices), is_named, (coordinates, tangent))

    def test_isotropic_materials_have_no_coordinates(self):
        made, _ = brushed(Metallic=1.0)
        document, lines, _ = exported(made)
        self.assertNotIn("anisotropy", document["principled"])
        self.assertFalse(any("/" in corner for line in lines if line[0] == "f" for corner in line[1:]))

    def test_what_has_no_anisotropy_is_named(self):
        made, _ = brushed(Transmission=0.5, Anisotropic=0.5)
        document, _, notices = exported(made)
        self.assertNotIn("anisotropy", document["principled"])
        self.assertTrue(any("Anisotropic 0.5 is treated as 0" in text for text in notices))


class Sheen(unittest.TestCase):
    def setUp(self):
        bpy.ops.wm.read_factory_settings(use_empty=True)

    def test_its_albedo_is_near_that_of_cycles_at_every_angle(self):
        # Cycles: (1 − cos)⁵ · cos θ, with the angle between the light and the half vector. Ours: Estevez and Kulla 2017.
        steps = (np.arange(64) + 0.5) / 64
        mu_o, root, turn = np.meshgrid((np.arange(32) + 0.5) / 32, steps, np.pi * steps, indexing="ij")
        mu_i = root ** 2
        solid_angle = 2 * root / 64 * 2 * np.pi / 64
        cosine = mu_o * mu_i + np.sqrt((1 - mu_o ** 2) * (1 - mu_i ** 2)) * np.cos(turn)
        theirs = ((1 - np.sqrt((1 + cosine) / 2)) ** 5 * mu_i * solid_angle).sum(axis=(1, 2))
        alpha = SHEEN_ROUGHNESS ** 2
        t = (1 - alpha) ** 2
        a, b, c, d, e = ((1 - t) * rough + t * smooth for rough, smooth in (
            (21.5473, 25.3245), (3.82987, 3.32435), (0.19823, 0.16801), (-1.97760, -1.27393), (-4.32054, -4.85967)))

        def fit(x):
            return a / (1 + b * x ** c) + d * x + e

        def smith(x):
            return np.where(x < 0.5, np.exp(fit(x)), np.exp(2 * fit(0.5) - fit(1 - x)))
        half = (mu_o + mu_i) / np.sqrt(2 + 2 * cosine)
        density = (2 + 1 / alpha) * np.maximum(1 - half ** 2, 0) ** (0.5 / alpha) / (2 * np.pi)
        ours = (density / ((1 + smith(mu_o) + smith(mu_i)) * 4 * mu_o) * solid_angle).sum(axis=(1, 2))
        np.testing.assert_allclose(SHEEN_COLOR * ours, theirs, atol=0.007)

    def test_it_has_the_tint_and_the_share_of_cycles(self):
        made, _ = brushed(Base_Color=(0.2, 0.4, 0.1, 1), Sheen=0.8, Sheen_Tint=0.25, Metallic=0.5)
        document, _, _ = exported(made)
        gray = 0.2126 * 0.2 + 0.7152 * 0.4 + 0.0722 * 0.1
        np.testing.assert_allclose(document["principled"]["sheen_color"]["rgb"],
                                   [0.8 * SHEEN_COLOR * 0.5 * (0.75 + 0.25 * c / gray) for c in (0.2, 0.4, 0.1)], rtol=1e-4)
        made, _ = brushed(Sheen=0.8, Sheen_Tint=0.0, Transmission=0.5)
        document, _, _ = exported(made)
        np.testing.assert_allclose(document["principled"]["sheen_color"]["rgb"], [0.8 * SHEEN_COLOR] * 3, rtol=1e-6)

    def test_metal_has_none(self):
        made, _ = brushed(Sheen=0.8, Metallic=1.0)
        document, _, _ = exported(made)
        self.assertNotIn("sheen_color", document["principled"])
