"""Runs in Blender. Mix Shader and Add Shader nodes as mixtures of materials, with weights computed by hand."""
import os
import tempfile
import unittest

import bpy
import numpy as np

from material_nodes import MaterialNodes
from lightmill_export.notices import Notices
from lightmill_export.principled import partly
from lightmill_export.values import ValueReader, constant

FOLDER = tempfile.mkdtemp(prefix="lightmill-mixtures-")
OLD = bpy.app.version < (4, 0, 0)
SUBSURFACE = "Subsurface" if OLD else "Subsurface_Weight"
RED, BLUE, WHITE = (0.75, 0.25, 0.125), (0.125, 0.25, 0.5), (1, 1, 1)


class Nodes(MaterialNodes):
    """Each method returns an output."""

    def mix(self, first, second, factor):
        return self.add("MixShader", first, second, Fac=factor)

    def sum(self, first, second):
        return self.add("AddShader", first, second)

    def diffuse(self, color, **inputs):
        return self.add("BsdfDiffuse", Color=color, **inputs)

    def translucent(self, color):
        return self.add("BsdfTranslucent", Color=color)

    def glossy(self, color=WHITE, roughness=0.5):
        out = self.add("BsdfGlossy", Color=color, Roughness=roughness)
        out.node.distribution = "GGX"
        return out

    def principled(self, color=WHITE, **inputs):
        return self.add("BsdfPrincipled", Base_Color=color, **inputs)

    def math(self, operation, first, second=0.0):
        node = self.tree.nodes.new("ShaderNodeMath")
        node.operation = operation
        self.tree.links.new(first, node.inputs[0])
        node.inputs[1].default_value = second
        return node.outputs[0]

    def image(self, name, *texels):
        """An image of one row."""
        picture = bpy.data.images.new(name, len(texels), 1, float_buffer=True, is_data=True)
        picture.pixels.foreach_set([float(c) for texel in texels for c in (*(texel if isinstance(texel, tuple) else (texel,) * 3), 1)])
        node = self.tree.nodes.new("ShaderNodeTexImage")
        node.image = picture
        return node.outputs[0]

    def export(self, output):
        self.tree.links.new(output, self.end.inputs["Surface"])
        return self.document(FOLDER)

    def texels(self, texture):
        """The row of a texture: its first channel."""
        with open(os.path.join(FOLDER, self.textures[texture]), "rb") as file:
            lines = file.read().split(b"\n", 3)
        return np.frombuffer(lines[3], dtype="<f4").reshape(-1, 3)[:, 0]


def parts(document, weight=1.0):
    """(weight, part) of each part of a material."""
    if "mixture" not in document:
        return [(weight, document)]
    mixed = document["mixture"]
    return parts(mixed["first"], weight * (1 - mixed["factor"])) + parts(mixed["second"], weight * mixed["factor"])


def reflected(document):
    """What a material reflects of uniform light: by diffuse parts, and by metal, whose mean is F0 + (1 − F0) / 21."""
    matt, metal = np.zeros(3), np.zeros(3)
    for weight, part in parts(document):
        if "diffuse" in part:
            matt += weight * np.array(part["diffuse"]["reflectance"]["rgb"])
        else:
            f0 = np.array(part["principled"]["base_color"]["rgb"])
            metal += weight * (f0 + (1 - f0) / 21)
    return matt, metal


class Mixtures(unittest.TestCase):
    def setUp(self):
        self.nodes = Nodes()

    def assert_notices(self, *expected):
        texts = self.nodes.notices.texts
        self.assertEqual(len(texts), len(expected), texts)
        for text, part in zip(texts, expected):
            self.assertIn(part, text)

    def assert_weights(self, document, expected):
        """`expected`: (weight, kind, its colour)."""
        found = []
        for weight, part in parts(document):
            kind = next(name for name in ("diffuse", "mirror", "principled") if name in part)
            found.append((weight, kind, part[kind].get("reflectance", part[kind].get("base_color"))["rgb"]))
        self.assertEqual([one[1] for one in found], [one[1] for one in expected])
        for (weight, _, color), (expected_weight, _, expected_color) in zip(found, expected):
            self.assertAlmostEqual(weight, expected_weight, 6)
            np.testing.assert_allclose(color, expected_color, atol=1e-6)

    def test_both_shaders_are_parts_with_their_own_fields(self):
        n = self.nodes
        document = n.export(n.mix(n.diffuse(RED, Roughness=0.5), n.glossy(roughness=0.25), 0.25))
        self.assertEqual(document["mixture"]["factor"], 0.25)
        first, second = document["mixture"]["first"], document["mixture"]["second"]
        self.assertEqual(first["diffuse"], {"reflectance": {"rgb": list(RED)}, "roughness": 0.5})
        self.assertEqual(first.get("single_scattering", False), bpy.app.version < (4, 3, 0))
        self.assertEqual((second["principled"]["metallic"], second["principled"]["roughness"]), (1, 0.25))
        self.assertEqual(second["principled"]["base_color"], {"rgb": [1, 1, 1]})
        self.assertTrue(second["single_scattering"])
        self.assertEqual(document.keys(), {"name", "mixture"})
        self.assert_notices()

    def test_nested_mixtures_multiply_their_factors(self):
        n = self.nodes
        inner = n.mix(n.diffuse(RED), n.glossy(), 0.25)
        document = n.export(n.mix(inner, n.principled(BLUE), 0.5))
        self.assert_weights(document, [(0.375, "diffuse", RED), (0.125, "principled", WHITE), (0.5, "principled", BLUE)])
        document = n.export(n.mix(n.principled(BLUE), inner, 0.5))
        self.assert_weights(document, [(0.5, "principled", BLUE), (0.375, "diffuse", RED), (0.125, "principled", WHITE)])
        self.assert_notices()

    def test_a_shader_that_counts_twice_is_one_part(self):
        n = self.nodes
        shiny = n.principled(BLUE)
        document = n.export(n.mix(n.mix(shiny, n.glossy(), 0.25), shiny, 0.5))
        self.assert_weights(document, [(0.875, "principled", BLUE), (0.125, "principled", WHITE)])
        document = n.export(n.mix(n.principled(BLUE), n.principled(BLUE), n.image("mask", 0, 0.5)))
        self.assert_weights(document, [(1, "principled", BLUE)])
        self.assert_notices()

    def test_smooth_diffuse_shaders_stay_one_material(self):
        n = self.nodes
        document = n.export(n.mix(n.mix(n.diffuse(RED), n.glossy(), 0.5), n.diffuse(BLUE), 0.5))
        self.assert_weights(document, [(0.75, "diffuse", (0.25 / 0.75 * np.array(RED) + 0.5 / 0.75 * np.array(BLUE))),
                                       (0.25, "principled", WHITE)])
        document = n.export(n.mix(n.diffuse(RED), n.diffuse(BLUE), 0.25))
        self.assert_weights(document, [(1, "diffuse", (0.59375, 0.25, 0.21875))])
        self.assert_notices()

    def test_the_factor_is_the_image_itself(self):
        n = self.nodes
        for scale in (1, 0.5):
            mask = n.image("mask", 0, 0.5, 1)
            mask = mask if scale == 1 else n.math("MULTIPLY", mask, scale)
            document = n.export(n.mix(n.diffuse(RED), n.glossy(), mask))
            name = document["mixture"]["factor_map"]["texture"]
            self.assertEqual((document["mixture"]["factor"], len(n.textures)), (scale, 1))
            np.testing.assert_allclose(n.texels(name), (0, 0.5, 1))
            self.assert_notices()

    def test_a_factor_from_alpha_names_the_channel(self):
        n = self.nodes
        mask = n.image("mask", 0, 1).node.outputs["Alpha"]
        document = n.export(n.mix(n.diffuse(RED), n.glossy(), mask))
        self.assertEqual(document["mixture"]["factor_map"]["channel"], "A")

    def test_the_alpha_of_a_premultiplied_image_is_the_opacity(self):
        n = self.nodes
        picture = bpy.data.images.new("leaf", 2, 1, alpha=True)
        picture.pixels.foreach_set([0.2, 0.2, 0.2, 0.6, 0, 0, 0, 0])
        picture.alpha_mode = "PREMUL"
        node = n.tree.nodes.new("ShaderNodeTexImage")
        node.image = picture
        document = n.export(n.principled(node.outputs["Color"], Alpha=node.outputs["Alpha"]))
        alpha = document["opacity"]["map"]
        self.assertEqual(alpha["channel"], "LUMINANCE")
        np.testing.assert_allclose(n.texels(alpha["texture"]), (0.6, 0), rtol=1e-6)

    def test_a_factor_above_1_counts_as_1(self):
        n = self.nodes
        document = n.export(n.mix(n.diffuse(RED), n.glossy(), n.math("MULTIPLY", n.image("mask", 0, 0.25, 1), 2)))
        self.assertEqual(document["mixture"]["factor"], 1)
        np.testing.assert_allclose(n.texels(document["mixture"]["factor_map"]["texture"]), (0, 0.5, 1))

    def test_factors_and_colours_of_different_sizes_are_not_averaged(self):
        n = self.nodes
        inner = n.mix(n.diffuse(n.image("bricks", RED, BLUE, RED)), n.diffuse(n.image("moss", BLUE)), n.image("dirt", 0, 1))
        document = n.export(n.mix(inner, n.glossy(), n.image("wear", 0, 0.25, 0.5, 1)))
        outer, inner = document["mixture"], document["mixture"]["first"]["mixture"]
        np.testing.assert_allclose(n.texels(outer["factor_map"]["texture"]), (0, 0.25, 0.5, 1))
        np.testing.assert_allclose(n.texels(inner["factor_map"]["texture"]), (0, 1))
        np.testing.assert_allclose(n.texels(inner["first"]["diffuse"]["reflectance"]["texture"]), (0.75, 0.125, 0.75))
        np.testing.assert_allclose(n.texels(inner["second"]["diffuse"]["reflectance"]["texture"]), (0.125,))
        self.assert_notices()

    def test_two_maps_with_the_same_texels_are_one_texture(self):
        n = self.nodes
        roots = [n.math("SQRT", n.image("mask", 0, 0.25)) for _ in range(2)]
        n.export(n.mix(n.mix(n.diffuse(RED), n.glossy(), roots[0]), n.principled(), roots[1]))
        self.assertEqual(len(n.textures), 1)

    def test_parts_keep_their_maps_and_details(self):
        n = self.nodes
        shiny = n.principled(RED, Roughness=n.image("scratches", 0.25, 0.5), Metallic=n.image("metal", 0, 1), **(
            {"Sheen": 0.5} if OLD else {}))
        brushed = n.add("BsdfAnisotropic", Color=WHITE, Roughness=0.5, Anisotropy=0.5)
        document = n.export(n.mix(n.mix(shiny, brushed, 0.5), n.diffuse(BLUE), 0.5))
        (_, first), (_, second), (_, third) = parts(document)
        self.assertEqual(n.texels(first["roughness_map"]["texture"])[1], 0.5)
        self.assertEqual(n.texels(first["metallic_map"]["texture"])[1], 1)
        self.assertEqual(first["principled"].get("burley_diffuse", False), OLD)
        self.assertEqual("sheen_color" in first["principled"], OLD)
        self.assertGreater(second["principled"]["anisotropy"], 0)
        self.assertEqual(third, {"diffuse": {"reflectance": {"rgb": list(BLUE)}}})
        self.assertFalse({"roughness_map", "metallic_map", "single_scattering"} & document.keys())
        self.assertFalse(any("of the mixture" in text for text in n.notices.texts), n.notices.texts)

    def test_images_of_gloss_and_coat_are_maps(self):
        n = self.nodes
        gloss, weight, rough = (("Specular", "Clearcoat", "Clearcoat Roughness") if OLD else
                                ("Specular IOR Level", "Coat Weight", "Coat Roughness"))
        images = {gloss: n.image("gloss", 0.25, 0.5), weight: n.image("coat", 0, 1), rough: n.image("rough", 0.5, 0.75)}
        made = n.export(n.principled(RED, **images))["principled"]
        for name, texel in (("specular", 0.5), ("coat", 1), ("coat_roughness", 0.75)):
            self.assertAlmostEqual(n.texels(made[f"{name}_map"]["texture"])[1], texel, 2)
        self.assertEqual((made["specular"], made["coat"], made["coat_roughness"]), (1, 0.25 if OLD else 1, 1))
        self.assertFalse(any("mean colour" in text for text in n.notices.texts), n.notices.texts)
        # Two such shaders are one material if they are equal.
        twice = n.export(n.mix(n.principled(RED, **images), n.principled(RED, **images), 0.5))
        self.assertEqual(twice["principled"], made)

    def test_the_specular_input_is_an_index(self):
        n = self.nodes
        name = "Specular" if OLD else "Specular IOR Level"
        for level, index in ((0.5, 1.5), (0.25, 1.329431), (1, 1.788789)):  # reflectances of 0.04, 0.02, 0.08
            made = n.export(n.principled(RED, **{name: level, "IOR": 1.5}))["principled"]
            self.assertAlmostEqual(made["ior"], index, 5)
            self.assertEqual(made["specular"], 0.5)
        matt = n.export(n.principled(RED, **{name: 0}))["principled"]
        self.assertEqual(matt["specular"], 0)
        # Glass has an index of its own.
        transmission = "Transmission" if OLD else "Transmission Weight"
        made = n.export(n.principled(RED, **{name: 0.25, "IOR": 1.5, transmission: 0.5}))["principled"]
        self.assertEqual(made["ior"], 1.5)
        self.assertAlmostEqual(made["specular"], 0.25, 6)

    def test_the_tint_of_gloss_is_its_colour(self):
        n = self.nodes
        if OLD:
            # The hue of (0.8, 0.2, 0.1) has luminance 1: over 0.31996 it is (2.5, 0.625, 0.3125), and mixed with white by a half.
            made = n.export(n.principled((0.8, 0.2, 0.1), Specular=0.5, **{"Specular Tint": 0.5}))["principled"]
            luminance = 0.2126 * 0.8 + 0.7152 * 0.2 + 0.0722 * 0.1
            color = [0.5 + 0.5 * c / luminance for c in (0.8, 0.2, 0.1)]
        else:
            made = n.export(n.principled(RED, **{"Specular IOR Level": 0.5, "Specular Tint": (0.5, 0.25, 0.125)}))["principled"]
            color = [0.5, 0.25, 0.125]
        most = max(*color, 1)  # a larger component raises the index
        for got, wanted in zip(made["specular_color"]["rgb"], color):
            self.assertAlmostEqual(got, wanted / most, 3)
        self.assertAlmostEqual(((made["ior"] - 1) / (made["ior"] + 1)) ** 2, 0.04 * most, 4)
        self.assertFalse(any("Tint" in text for text in n.notices.texts), n.notices.texts)
        self.assertNotIn("specular_color", n.export(n.principled(RED))["principled"])

    def test_another_direction_of_anisotropy_is_named(self):
        n = self.nodes
        first, second = (n.add("BsdfAnisotropic", Color=WHITE, Roughness=0.5, Anisotropy=0.5) for _ in range(2))
        tangent = n.add("Tangent")
        tangent.node.axis = "X"
        n.tree.links.new(tangent, second.node.inputs["Tangent"])
        n.export(n.mix(first, second, 0.5))
        self.assert_notices("It is that of another shader")

    def test_a_shader_that_shines_takes_its_share_of_the_reflected_light(self):
        n = self.nodes
        shining = n.add("Emission", Color=(1, 0.5, 0.25), Strength=4.0)
        document = n.export(n.mix(shining, n.mix(n.diffuse(RED), n.glossy(), 0.5), 0.75))
        np.testing.assert_allclose(document["emission"]["rgb"], (1, 0.5, 0.25))
        matt, metal = reflected(document)
        np.testing.assert_allclose(matt, 0.375 * np.array(RED))
        np.testing.assert_allclose(metal, np.full(3, 0.375))
        self.assert_notices()
        document = n.export(n.sum(shining, n.mix(n.diffuse(RED), n.glossy(), 0.5)))
        self.assert_weights(document, [(0.5, "diffuse", RED), (0.5, "principled", WHITE)])
        np.testing.assert_allclose(document["emission"]["rgb"], (4, 2, 1))
        self.assert_notices()

    def test_an_image_divides_a_surface_into_light_and_reflection(self):
        n = self.nodes
        document = n.export(n.mix(n.principled(RED), n.add("Emission", Strength=4.0), n.image("mask", 0, 0.5)))
        self.assertEqual(document["mixture"]["second"], {"diffuse": {"reflectance": {"rgb": [0, 0, 0]}}})
        self.assertEqual(document["mixture"]["first"]["principled"]["base_color"], {"rgb": list(RED)})
        for texture in (document["mixture"]["factor_map"]["texture"], document["emission"]["texture"]):
            np.testing.assert_allclose(n.texels(texture), (0, 0.5))

    def test_transparency_is_the_opacity_and_no_part(self):
        n = self.nodes
        veil, matt_and_metal = n.add("BsdfTransparent"), n.mix(n.diffuse(RED), n.glossy(), 0.25)
        document = n.export(n.mix(veil, matt_and_metal, 0.5))
        self.assertEqual(document["opacity"], {"value": 0.5})
        self.assert_weights(document, [(0.75, "diffuse", RED), (0.25, "principled", WHITE)])
        # Half of three quarters, and a quarter, are opaque: 0.625. The glossy quarter is 0.4 of it.
        document = n.export(n.mix(n.mix(veil, n.diffuse(RED), 0.5), n.glossy(), 0.25))
        self.assertAlmostEqual(document["opacity"]["value"], 0.625)
        self.assert_weights(document, [(0.6, "diffuse", RED), (0.4, "principled", WHITE)])
        mask = n.image("mask", 0, 0.5, 1)
        document = n.export(n.mix(n.mix(veil, n.diffuse(RED), mask), n.mix(veil, n.glossy(), mask), 0.25))
        np.testing.assert_allclose(n.texels(document["opacity"]["map"]["texture"]), (0, 0.5, 1))
        self.assert_weights(document, [(0.75, "diffuse", RED), (0.25, "principled", WHITE)])
        document = n.export(n.mix(n.mix(veil, n.diffuse(RED), mask), n.glossy(), 0.5))
        np.testing.assert_allclose(n.texels(document["opacity"]["map"]["texture"]), (0.5, 0.75, 1))
        np.testing.assert_allclose(n.texels(document["mixture"]["factor_map"]["texture"]), (1, 2 / 3, 0.5), rtol=1e-6)
        self.assert_notices()

    def test_a_sum_reflects_the_light_of_both(self):
        n = self.nodes
        document = n.export(n.sum(n.diffuse(BLUE), n.glossy((0.25, 0.5, 0.125))))
        matt, metal = reflected(document)
        np.testing.assert_allclose(matt, BLUE, atol=1e-6)
        np.testing.assert_allclose(metal, (0.25, 0.5, 0.125), atol=1e-6)
        self.assertFalse(any("more light" in text for text in n.notices.texts))
        document = n.export(n.sum(n.diffuse(RED), n.diffuse((0.125, 0.25, 0.5))))
        self.assert_weights(document, [(1, "diffuse", (0.875, 0.5, 0.625))])
        self.assert_notices()

    def test_a_transparent_shader_that_shines_is_seen(self):
        n = self.nodes
        clear, shining = n.add("BsdfTransparent"), n.add("Emission", Color=(1, 0.5, 0), Strength=3.0)
        for first, second in ((clear, shining), (shining, clear)):
            document = n.export(n.sum(first, second))
            opacity = document["opacity"]["value"]
            np.testing.assert_allclose(np.array(document["emission"]["rgb"]) * opacity, (3, 1.5, 0))
            self.assertLess(opacity, 0.2)
            self.assert_notices("blocks 10% of the light from behind")

    def test_a_transparent_shader_that_reflects_is_seen(self):
        n = self.nodes
        document = n.export(n.sum(n.add("BsdfTransparent"), n.diffuse((0.25, 0.5, 0.125))))
        self.assertEqual(document["opacity"]["value"], 0.5)
        np.testing.assert_allclose(document["diffuse"]["reflectance"]["rgb"], (0.5, 1, 0.25))
        self.assert_notices("lets half of the light through")

    def test_a_sum_above_1_is_scaled_down(self):
        n = self.nodes
        document = n.export(n.sum(n.diffuse(RED), n.glossy()))
        self.assert_weights(document, [(0.75 / 1.75, "diffuse", np.array(RED) / 0.75), (1 / 1.75, "principled", WHITE)])
        self.assert_notices("more light than arrives")
        document = n.export(n.sum(n.diffuse(RED), n.diffuse((0.5, 0.5, 0.5))))
        self.assert_weights(document, [(1, "diffuse", np.array((1.25, 0.75, 0.625)) / 1.25)])
        self.assert_notices("more light than arrives")

    def test_vertex_colours_tint_all_parts_or_none(self):
        n = self.nodes
        paint = n.add("VertexColor")
        paint.node.layer_name = "paint"
        document = n.export(n.mix(n.diffuse(paint), n.glossy(paint), 0.25))
        self.assertEqual(n.made.colors, "paint")
        self.assertFalse(any("white" in text for text in n.notices.texts), n.notices.texts)
        document = n.export(n.mix(n.add("Emission"), n.principled(paint), 0.25))
        self.assertEqual(n.made.colors, "paint")
        document = n.export(n.mix(n.diffuse(paint), n.glossy(), 0.25))
        self.assertIsNone(n.made.colors)
        self.assert_weights(document, [(0.75, "diffuse", WHITE), (0.25, "principled", WHITE)])
        self.assert_notices("the colour attribute paint is replaced by white")

    def test_a_translucent_shader_is_a_sheet_that_reflects_nothing(self):
        n = self.nodes
        document = n.export(n.translucent(RED))
        self.assertEqual(document["diffuse"], {"reflectance": {"rgb": [0, 0, 0]}, "transmittance": {"rgb": list(RED)}})
        self.assertEqual(document.keys(), {"name", "diffuse"})
        self.assert_notices()

    def assert_sheet(self, part, reflectance, transmittance):
        self.assertEqual(part.keys() - {"name"}, {"diffuse"})
        self.assertEqual(part["diffuse"].keys(), {"reflectance", "transmittance"})
        np.testing.assert_allclose(part["diffuse"]["reflectance"]["rgb"], reflectance, atol=1e-6)
        np.testing.assert_allclose(part["diffuse"]["transmittance"]["rgb"], transmittance, atol=1e-6)

    def test_subsurface_scattering_is_a_sheet_around_a_medium(self):
        nodes = Nodes()
        out = nodes.add("SubsurfaceScattering", Color=(0.5, 0.2, 0.0), Scale=2.0, Anisotropy=0.3)
        out.node.inputs["Radius"].default_value = (1.0, 0.5, 0.0)
        for falloff, notice in (("RANDOM_WALK_FIXED_RADIUS", 0), ("BURLEY", 1)):
            out.node.falloff = falloff
            document = nodes.export(out)
            self.assertEqual(len(nodes.notices.texts), notice)
            self.assertEqual(document["diffuse"], {"reflectance": {"rgb": [0, 0, 0]}, "transmittance": {"rgb": [1, 1, 1]}})
            self.assertEqual(document["interior"]["anisotropy"], 0 if notice else np.float32(0.3))
            mean_free_path = 2 * 0.25 / np.pi
            for given, expected in zip(document["interior"]["subsurface"]["radius"]["rgb"], (1, 0.5, 0.001)):
                self.assertAlmostEqual(given, expected * mean_free_path, 6)
            for given, expected in zip(document["interior"]["subsurface"]["color"]["rgb"], (0.5, 0.2, 0)):
                self.assertAlmostEqual(given, expected, 6)

    def test_the_radius_of_a_random_walk_depends_on_the_colour(self):
        nodes = Nodes()
        out = nodes.add("SubsurfaceScattering", Color=(0.5, 0.2, 0.0), Scale=1.0, IOR=1.4)
        out.node.inputs["Radius"].default_value = (1.0, 1.0, 1.0)
        out.node.falloff = "RANDOM_WALK"
        radius = nodes.export(out)["interior"]["subsurface"]["radius"]["rgb"]
        # The dipole's reflectance a/2 (1 + exp(-4/3 A s)) exp(-s) with s = radius = sqrt(3 (1 - a)).
        fresnel = -1.44 / 1.96 + 0.71 / 1.4 + 0.668 + 0.0636 * 1.4
        for s, reflectance in zip(radius, (0.5, 0.2, 0.0)):
            a = 1 - s * s / 3
            self.assertAlmostEqual(a / 2 * (1 + np.exp(-4 / 3 * (1 + fresnel) / (1 - fresnel) * s)) * np.exp(-s), reflectance, 5)

    def test_subsurface_scattering_without_a_radius_is_diffuse(self):
        nodes = Nodes()
        document = nodes.export(nodes.add("SubsurfaceScattering", Color=RED, Scale=0.0))
        self.assertEqual(document["diffuse"], {"reflectance": {"rgb": list(RED)}})
        self.assertNotIn("interior", document)

    def test_a_mixture_with_subsurface_scattering_has_its_medium(self):
        nodes = Nodes()
        skin = nodes.add("SubsurfaceScattering", Color=RED)
        document = nodes.export(nodes.mix(skin, nodes.glossy(), 0.25))
        self.assertIn("mixture", document)
        self.assertIn("interior", document)
        self.assertTrue(any("light from within" in text for text in nodes.notices.texts))

    def test_the_image_of_subsurface_scattering_is_on_its_surface(self):
        n = self.nodes
        document = n.export(n.add("SubsurfaceScattering", Color=n.image("freckles", 0.15, 0.6), Scale=1.0))
        most = np.array(document["interior"]["subsurface"]["color"]["rgb"])
        np.testing.assert_allclose(most, 0.6, rtol=1e-6)
        through = n.texels(document["diffuse"]["transmittance"]["texture"])
        np.testing.assert_allclose(through ** 2 * most[0], (0.15, 0.6), rtol=1e-5)
        self.assert_notices("the image of its subsurface scattering is on its surface")

    def test_a_principled_shader_with_subsurface_scattering_has_a_highlight(self):
        n = self.nodes
        if OLD:
            out = n.principled(RED, Subsurface=0.5, Subsurface_Color=BLUE, Subsurface_Anisotropy=0.25, Roughness=0.3)
            out.node.subsurface_method, shown, scale = "RANDOM_WALK_FIXED_RADIUS", (np.array(RED) + BLUE) / 2, 0.5
        else:
            out = n.principled(RED, Subsurface_Weight=1.0, Subsurface_Scale=0.5, Roughness=0.3)
            out.node.subsurface_method, shown, scale = "RANDOM_WALK", np.array(RED), 0.5
        out.node.inputs["Subsurface Radius"].default_value = (1.0, 0.5, 0.25)
        document = n.export(out)
        self.assertEqual(document["principled"]["transmittance"], {"rgb": [1, 1, 1]})
        self.assertAlmostEqual(document["principled"]["roughness"], 0.3, 6)
        np.testing.assert_allclose(document["principled"]["base_color"]["rgb"], shown, rtol=1e-6)
        medium = document["interior"]["subsurface"]
        np.testing.assert_allclose(medium["color"]["rgb"], shown, rtol=1e-6)
        np.testing.assert_allclose(medium["radius"]["rgb"], np.array((1, 0.5, 0.25)) * scale * 0.25 / np.pi, rtol=1e-6)
        self.assertEqual(document["interior"]["anisotropy"], 0.25 if OLD else 0)
        self.assertFalse(any("subsurface" in text for text in n.notices.texts), n.notices.texts)

    def test_a_principled_shader_with_an_opacity_has_diffuse_skin(self):
        n = self.nodes
        document = n.export(n.principled(RED, Alpha=0.5, **{SUBSURFACE: 1.0, **({"Subsurface_Color": BLUE} if OLD else {})}))
        self.assertNotIn("interior", document)
        self.assertNotIn("transmittance", document["principled"])
        self.assertEqual(document["opacity"]["value"], 0.5)
        np.testing.assert_allclose(document["principled"]["base_color"]["rgb"], BLUE if OLD else RED, rtol=1e-6)
        self.assert_notices("is treated as diffuse reflection, because it has an opacity")

    def test_principled_metal_and_shaders_without_a_radius_have_no_subsurface_scattering(self):
        n = self.nodes
        for inputs in ({"Metallic": 1.0}, {}):
            out = n.principled(RED, **{SUBSURFACE: 0.5}, **inputs)
            if not inputs:
                out.node.inputs["Subsurface Radius"].default_value = (0, 0, 0)
            document = n.export(out)
            self.assertNotIn("interior", document)
            self.assertNotIn("transmittance", document["principled"])

    def test_a_principled_image_is_on_the_surface_of_its_body(self):
        n = self.nodes
        spots = n.image("spots", 0.2, 0.8)
        document = n.export(n.principled(spots, **{SUBSURFACE: 1.0, **({"Subsurface_Color": spots} if OLD else {})}))
        np.testing.assert_allclose(document["interior"]["subsurface"]["color"]["rgb"], 0.8, rtol=1e-6)
        np.testing.assert_allclose(n.texels(document["principled"]["transmittance"]["texture"]), (0.5, 1), rtol=1e-5)
        np.testing.assert_array_equal(document["principled"]["base_color"]["rgb"], 0)

    def test_a_mixture_with_a_principled_body_has_its_medium(self):
        n = self.nodes
        document = n.export(n.mix(n.principled(RED, **{SUBSURFACE: 1.0, **({"Subsurface_Color": RED} if OLD else {})}), n.glossy(), 0.25))
        self.assertIn("interior", document)
        self.assertTrue(any("light from within" in text for text in n.notices.texts))

    def test_a_share_of_subsurface_scattering_shows_the_whole_colour(self):
        reader = ValueReader(Notices())
        for share in (0.1, 0.5, 0.9, 1.0):
            color = np.array((0.0, 0.4, 1.0))
            base, through = partly(reader, None, constant(*color), share)
            kept = base.rgb * (1 - through.rgb)  # what the surface reflects to both sides
            np.testing.assert_allclose(kept, (1 - share) * color, atol=1e-9)
            returned = through.rgb ** 2 * color / (1 - color * kept)
            np.testing.assert_allclose(kept + returned, color, atol=1e-9)
            self.assertTrue(np.all(base.rgb <= 1) and np.all(through.rgb <= 1))

    def test_smooth_diffuse_and_translucent_shaders_are_one_sheet(self):
        n = self.nodes
        for first, second, share in ((n.diffuse(RED), n.translucent(BLUE), 0.25), (n.translucent(BLUE), n.diffuse(RED), 0.75)):
            self.assert_sheet(n.export(n.mix(first, second, share)), 0.75 * np.array(RED), 0.25 * np.array(BLUE))
        document = n.export(n.mix(n.mix(n.diffuse(RED), n.glossy(), 0.5), n.translucent(BLUE), 0.5))
        (sheet_weight, sheet), (shiny_weight, _) = parts(document)
        self.assertAlmostEqual(sheet_weight, 0.75)
        self.assertAlmostEqual(shiny_weight, 0.25)
        self.assert_sheet(sheet, np.array(RED) / 3, np.array(BLUE) * 2 / 3)
        veil = n.mix(n.add("BsdfTransparent"), n.mix(n.diffuse(RED), n.translucent(BLUE), 0.25), n.image("mask", 0, 1))
        self.assert_sheet({key: value for key, value in n.export(veil).items() if key != "opacity"}, 0.75 * np.array(RED),
                          0.25 * np.array(BLUE))
        self.assert_notices()

    def test_a_sheet_keeps_two_textures_of_different_sizes(self):
        n = self.nodes
        front, back = n.image("front", RED, BLUE, RED), n.image("back", (0.5, 0.25, 0), (1, 0, 0))
        document = n.export(n.mix(n.diffuse(front), n.translucent(back), 0.25))
        self.assert_sheet(document, (0.75,) * 3, (0.25,) * 3)
        np.testing.assert_allclose(n.texels(document["diffuse"]["reflectance"]["texture"]), (0.75, 0.125, 0.75))
        np.testing.assert_allclose(n.texels(document["diffuse"]["transmittance"]["texture"]), (0.5, 1))
        self.assert_notices()

    def test_a_sum_of_both_sides_is_a_sheet(self):
        n = self.nodes
        self.assert_sheet(n.export(n.sum(n.diffuse(BLUE), n.translucent((0.25, 0.5, 0.125)))), BLUE, (0.25, 0.5, 0.125))
        self.assert_notices()
        self.assert_sheet(n.export(n.sum(n.diffuse(RED), n.translucent((0.5, 0.5, 0.5)))), np.array(RED) / 1.25, (0.4, 0.4, 0.4))
        self.assert_notices("more light than arrives")

    def test_an_image_mixes_a_diffuse_and_a_translucent_part(self):
        n = self.nodes
        document = n.export(n.mix(n.diffuse(RED), n.translucent(BLUE), n.image("mask", 0, 0.5, 1)))
        self.assertEqual(document["mixture"]["first"], {"diffuse": {"reflectance": {"rgb": list(RED)}}})
        self.assert_sheet(document["mixture"]["second"], (0, 0, 0), BLUE)
        np.testing.assert_allclose(n.texels(document["mixture"]["factor_map"]["texture"]), (0, 0.5, 1))
        self.assert_notices()

    def test_a_rough_diffuse_and_a_translucent_shader_are_two_parts(self):
        n = self.nodes
        document = n.export(n.mix(n.diffuse(RED, Roughness=0.5), n.translucent(BLUE), 0.25))
        self.assertEqual(document["mixture"]["factor"], 0.25)
        self.assertEqual(document["mixture"]["first"]["diffuse"], {"reflectance": {"rgb": list(RED)}, "roughness": 0.5})
        self.assert_sheet(document["mixture"]["second"], (0, 0, 0), BLUE)
        self.assert_notices()

    def test_vertex_colours_tint_the_reflectance_of_a_sheet(self):
        n = self.nodes
        paint = n.add("VertexColor")
        paint.node.layer_name = "paint"
        self.assert_sheet(n.export(n.mix(n.diffuse(paint), n.translucent(BLUE), 0.25)), (0.75,) * 3, 0.25 * np.array(BLUE))
        self.assertEqual(n.made.colors, "paint")
        self.assert_notices()
        self.assert_sheet(n.export(n.translucent(paint)), (0, 0, 0), WHITE)
        self.assert_notices("the colour attribute paint is replaced by white")

    def test_more_than_16_shaders_are_one_material(self):
        n = self.nodes
        out = n.principled((0, 0, 0))
        for i in range(1, 16):
            out = n.mix(out, n.principled((i / 16, 0, 0)), 0.5)
        document = n.export(out)
        self.assertEqual(len(parts(document)), 16)
        self.assert_notices()
        document = n.export(n.mix(out, n.diffuse((0, 1, 0)), 0.5))
        self.assertIn("principled", document)
        self.assert_notices("A mixture has at most 16 shaders")

    def test_diffuse_and_glossy_by_fresnel_are_plastic(self):
        n = self.nodes
        document = n.export(n.mix(n.diffuse(RED), n.glossy(roughness=0.25), n.add("Fresnel", IOR=1.75)))
        plastic = document["principled"]
        self.assertEqual(plastic["base_color"], {"rgb": list(RED)})
        self.assertEqual({name: plastic[name] for name in ("roughness", "ior", "specular", "metallic", "transmission", "coat")},
                         {"roughness": 0.25, "ior": 1.75, "specular": 0.5, "metallic": 0, "transmission": 0, "coat": 0})
        self.assertNotIn("burley_diffuse", plastic)
        self.assertNotIn("mixture", document)
        self.assert_notices()
        # Blend 0.5 is an index of 1 / (1 - 0.5).
        document = n.export(n.mix(n.diffuse(RED), n.glossy(), n.add("LayerWeight", Blend=0.5)))
        self.assertEqual((document["principled"]["ior"], document["principled"]["specular"]), (2, 0.5))
        self.assert_notices()

    def test_subsurface_scattering_and_white_gloss_by_fresnel_are_a_body_with_a_highlight(self):
        n = self.nodes
        skin = n.add("SubsurfaceScattering", Color=RED, Scale=1.0)
        document = n.export(n.mix(skin, n.glossy(roughness=0.25), n.add("Fresnel", IOR=1.4)))
        self.assertAlmostEqual(document["principled"]["ior"], 1.4, 6)
        self.assertEqual(document["principled"]["transmittance"], {"rgb": [1, 1, 1]})
        np.testing.assert_allclose(document["interior"]["subsurface"]["color"]["rgb"], RED)
        self.assertNotIn("burley_diffuse", document["principled"])
        self.assert_notices()
        document = n.export(n.mix(skin, n.glossy((0.5, 0.5, 0.5)), n.add("Fresnel", IOR=1.4)))
        self.assertIn("mixture", document)

    def test_a_grey_gloss_of_plastic_absorbs_light(self):
        n = self.nodes
        document = n.export(n.mix(n.diffuse(RED), n.glossy((0.5, 0.5, 0.5)), n.add("Fresnel", IOR=1.5)))
        self.assertEqual(document["principled"]["specular"], 0.25)
        # An index of 1.5 reflects 0.0918 of uniform light (Walsh). The base gets the rest.
        np.testing.assert_allclose(document["principled"]["base_color"]["rgb"], np.array(RED) * (1 - 0.0918) / (1 - 0.5 * 0.0918),
                                   rtol=1e-3)
        self.assert_notices()

    def test_plastic_keeps_images_and_is_a_part(self):
        n = self.nodes
        shiny = n.glossy(roughness=n.image("scratches", 0.25, 0.5))
        plastic = n.mix(n.diffuse(n.image("bricks", RED, BLUE)), shiny, n.add("Fresnel", IOR=1.5))
        document = n.export(n.mix(n.add("BsdfTransparent"), plastic, 0.5))
        np.testing.assert_allclose(n.texels(document["principled"]["base_color"]["texture"]), (0.75, 0.125))
        np.testing.assert_allclose(n.texels(document["roughness_map"]["texture"]), (0.25, 0.5))
        self.assertEqual(document["opacity"], {"value": 0.5})
        self.assert_notices()
        document = n.export(n.mix(plastic, n.diffuse(RED, Roughness=0.5), 0.25))
        self.assertEqual(document["mixture"]["factor"], 0.25)
        self.assertEqual(document["mixture"]["first"]["principled"]["specular"], 0.5)

    def test_plastic_has_the_normals_of_its_shaders(self):
        n = self.nodes
        bumps = n.add("NormalMap", Color=n.image("normals", (0.5, 0.5, 1)))
        fresnel = n.add("Fresnel", IOR=1.5, Normal=bumps)
        shiny = n.glossy()
        n.tree.links.new(bumps, shiny.node.inputs["Normal"])
        document = n.export(n.mix(n.diffuse(RED, Normal=bumps), shiny, fresnel))
        self.assertIn("normal_map", document)
        self.assert_notices("brighter than in Blender")
        fresnel = n.add("Fresnel", IOR=1.5, Normal=bumps)
        n.export(n.mix(n.diffuse(RED), n.glossy(), fresnel))
        self.assertTrue(any("different normals" in text for text in n.notices.texts))

    def test_the_base_of_plastic_is_smooth(self):
        n = self.nodes
        document = n.export(n.mix(n.diffuse(RED, Roughness=0.5), n.glossy(), n.add("Fresnel", IOR=1.5)))
        self.assertEqual(document["principled"]["base_color"], {"rgb": list(RED)})
        self.assert_notices("its roughness is treated as 0, because it is the base of plastic")

    def test_other_mixtures_by_fresnel_have_its_mean(self):
        n = self.nodes
        metal = n.glossy((1, 0.5, 0.25))
        anisotropic = n.add("BsdfAnisotropic", Color=WHITE, Roughness=0.5, Anisotropy=0.5)
        for first, second, ior in ((n.diffuse(RED), metal, 1.5), (n.glossy(), n.diffuse(RED), 1.5), (n.diffuse(RED), n.principled(), 1.5),
                                   (n.translucent(RED), n.glossy(), 1.5), (n.diffuse(RED), anisotropic, 1.5),
                                   (n.diffuse(RED), n.glossy(), 0.75), (n.diffuse(RED), n.glossy(), 20.0)):
            document = n.export(n.mix(first, second, n.add("Fresnel", IOR=ior)))
            self.assertIn("mixture", document)
            self.assertTrue(any("it depends on the view. Its mean" in text for text in n.notices.texts))
        document = n.export(n.mix(n.diffuse(RED), n.glossy(), n.add("LayerWeight", Blend=0.5).node.outputs["Facing"]))
        self.assertIn("mixture", document)
        # The mean of 1 - cos over the cosine-weighted hemisphere is 1 / 3.
        self.assertAlmostEqual(document["mixture"]["factor"], 1 / 3, 4)

    def glass(self, ior=1.5, color=WHITE):
        return self.nodes.add("BsdfGlass", Color=color, Roughness=0.0, IOR=ior)

    def test_glass_is_a_part_of_a_mixture(self):
        n = self.nodes
        document = n.export(n.mix(self.glass(), n.diffuse(RED), n.image("frost", 0, 0.5, 1)))
        self.assertEqual(document["mixture"]["first"], {"dielectric": {"ior": 1.5}})
        self.assertEqual(document["mixture"]["second"], {"diffuse": {"reflectance": {"rgb": list(RED)}}})
        np.testing.assert_allclose(n.texels(document["mixture"]["factor_map"]["texture"]), (0, 0.5, 1))
        self.assertEqual(document.keys(), {"name", "mixture"})
        self.assert_notices()

    def test_glass_of_one_index_keeps_its_parts(self):
        n = self.nodes
        clear = n.mix(self.glass(), self.glass(color=BLUE), 0.5)
        document = n.export(n.mix(clear, n.principled(RED, Transmission=0.75, IOR=1.5), 0.25))
        found = parts(document)
        np.testing.assert_allclose([weight for weight, _ in found], (0.375, 0.375, 0.25))
        self.assertEqual(found[0][1], {"dielectric": {"ior": 1.5}})
        for (_, part), color, transmission in zip(found[1:], (BLUE, RED), (1, 0.75)):
            self.assertEqual(part["principled"]["base_color"]["rgb"], list(color))
            self.assertEqual((part["principled"]["transmission"], part["principled"]["ior"]), (transmission, 1.5))

    def test_glass_and_emission_by_an_image_are_a_mixture_with_a_black_part(self):
        n = self.nodes
        document = n.export(n.mix(self.glass(), n.add("Emission", Strength=4.0), n.image("mask", 0, 0.5)))
        self.assertEqual(document["mixture"]["first"], {"dielectric": {"ior": 1.5}})
        self.assertEqual(document["mixture"]["second"], {"diffuse": {"reflectance": {"rgb": [0, 0, 0]}}})
        self.assertEqual(document["emission"]["rgb"], [4, 4, 4])
        self.assert_notices("darker than in Blender, by the square of the index of refraction")

    def test_glass_of_two_indices_makes_one_material(self):
        n = self.nodes
        document = n.export(n.mix(n.mix(self.glass(1.25), self.glass(1.75), 0.5), n.diffuse(RED), 0.25))
        self.assertEqual((document["principled"]["transmission"], document["principled"]["ior"]), (0.75, 0.75 * 1.5 + 0.25 * 1.5))
        np.testing.assert_allclose(document["principled"]["base_color"]["rgb"], 0.75 + 0.25 * np.array(RED))
        self.assert_notices("Glass of one mixture has one index of refraction")

    def test_a_mixture_of_glass_with_an_opacity_makes_one_material(self):
        n = self.nodes
        inner = n.mix(self.glass(), n.diffuse(RED), 0.25)
        document = n.export(n.mix(n.add("BsdfTransparent"), inner, n.image("mask", 0, 1)))
        self.assertEqual(document["principled"]["transmission"], 0.75)
        self.assertNotIn("opacity", document)
        self.assert_notices("A mixture with glass has no opacity", "left out: its opacity")

    def test_glass_that_casts_no_shadows_is_glass(self):
        n = self.nodes
        for output in ("Is Shadow Ray", "Is Diffuse Ray"):
            is_shadow = n.add("LightPath").node.outputs[output]
            for factor in (is_shadow, n.math("MULTIPLY", is_shadow, 0.5)):
                document = n.export(n.mix(self.glass(), n.add("BsdfTransparent"), factor))
                self.assertEqual(document, {"name": "the material", "dielectric": {"ior": 1.5}})
                self.assert_notices(f"{output} is treated as 0")

    def test_a_mixture_with_glass_that_casts_no_shadows_has_no_opacity(self):
        n = self.nodes
        is_shadow = n.add("LightPath").node.outputs["Is Shadow Ray"]
        document = n.export(n.mix(n.mix(self.glass(), n.diffuse(RED), 0.25), n.add("BsdfTransparent"), is_shadow))
        self.assertEqual(document["mixture"]["factor"], 0.25)
        self.assertEqual(document["mixture"]["first"], {"dielectric": {"ior": 1.5}})
        self.assert_notices("Is Shadow Ray is treated as 0")

    def test_a_translucent_shader_reflects_in_a_mean(self):
        n = self.nodes
        clear = n.mix(self.glass(1.25), self.glass(1.75), 0.5)
        document = n.export(n.mix(clear, n.translucent(RED), 0.25))
        np.testing.assert_allclose(document["principled"]["base_color"]["rgb"], 0.75 + 0.25 * np.array(RED))
        self.assert_notices("the light that it transmits is reflected", "Glass of one mixture has one index of refraction")

    def test_a_shader_without_weight_is_left_out_of_the_mean(self):
        n = self.nodes
        clear = n.mix(n.add("BsdfGlass", Color=WHITE, IOR=1.25), n.principled(Transmission=1.0), 0.5)
        document = n.export(n.mix(n.add("Emission"), clear, n.image("mask", 0, 0)))
        self.assertEqual(document["diffuse"]["reflectance"]["rgb"], [0, 0, 0])

    def test_a_metal_is_a_part_whatever_its_transmission(self):
        n = self.nodes
        document = n.export(n.mix(n.principled(RED, Metallic=1.0, Transmission=1.0), n.diffuse(BLUE), 0.25))
        self.assert_weights(document, [(0.75, "principled", RED), (0.25, "diffuse", BLUE)])
