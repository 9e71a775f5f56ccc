"""Runs in Blender. Volume shaders as media, with coefficients computed by hand."""
import tempfile
import unittest

import bpy

from material_nodes import MaterialNodes

FOLDER = tempfile.mkdtemp(prefix="lightmill-volumes-")


class Nodes(MaterialNodes):
    def __init__(self):
        super().__init__()
        bpy.context.scene.cycles.volume_bounces = 64

    def export(self, volume, surface=None):
        """The document and the notices."""
        self.tree.links.new(volume, self.end.inputs["Volume"])
        if surface is not None:
            self.tree.links.new(surface, self.end.inputs["Surface"])
        return self.document(FOLDER), self.notices.texts


class VolumesTest(unittest.TestCase):
    def close_to(self, rgb, expected):
        for one, other in zip(rgb["rgb"], expected):
            self.assertAlmostEqual(one, other, 6)

    def test_glass_absorbs_what_the_color_leaves(self):
        nodes = Nodes()
        document, notices = nodes.export(nodes.add("VolumeAbsorption", Color=(0.75, 0.5, 0), Density=4),
                                         nodes.add("BsdfGlass", Color=(1, 1, 1), Roughness=0))
        self.assertEqual(notices, [])
        self.assertIn("dielectric", document)
        self.assertEqual(set(document["interior"]), {"absorption"})
        self.close_to(document["interior"]["absorption"], (1, 2, 4))

    def test_a_volume_without_surface_is_fog(self):
        for surface in (None, "BsdfTransparent"):
            nodes = Nodes()
            document, notices = nodes.export(nodes.add("VolumeScatter", Color=(0.5, 0.25, 1), Density=2, Anisotropy=0.5),
                                             surface and nodes.add(surface))
            self.assertEqual(notices, [])
            self.assertEqual(document["dielectric"], {"ior": 1})
            self.close_to(document["interior"]["absorption"], (0, 0, 0))
            self.close_to(document["interior"]["scattering"], (1, 0.5, 2))
            self.assertEqual(document["interior"]["anisotropy"], 0.5)

    def test_principled_volumes_absorb_and_scatter(self):
        nodes = Nodes()
        document, notices = nodes.export(nodes.add("VolumePrincipled", Color=(0.5, 0.25, 1), Density=4, Absorption_Color=(0.25, 0, 1)))
        self.assertEqual(notices, [])
        self.close_to(document["interior"]["scattering"], (2, 1, 4))
        self.close_to(document["interior"]["absorption"], (4 * 0.5 * (1 - 0.5), 4 * 0.75 * 1, 0))

    def test_sums_and_mixtures_add_up(self):
        nodes = Nodes()
        first = nodes.add("VolumeScatter", Color=(1, 1, 1), Density=1, Anisotropy=0.8)
        second = nodes.add("VolumeScatter", Color=(1, 1, 1), Density=3, Anisotropy=0)
        mixed = nodes.add("MixShader", first, second, Fac=0.5)
        document, _ = nodes.export(nodes.add("AddShader", mixed, nodes.add("VolumeAbsorption", Color=(0, 0.5, 1), Density=1)))
        self.close_to(document["interior"]["scattering"], (2, 2, 2))
        self.close_to(document["interior"]["absorption"], (1, 0.5, 0))
        self.assertAlmostEqual(document["interior"]["anisotropy"], 0.2, 6)

    def test_fog_of_few_bounces_is_named(self):
        nodes = Nodes()
        bpy.context.scene.cycles.volume_bounces = 2
        _, notices = nodes.export(nodes.add("VolumeScatter", Density=1))
        self.assertEqual(notices, ["material the material: left out: the limit of 2 bounces in volumes. Fog is brighter than in Blender"])

    def test_what_cannot_be_said_is_named(self):
        nodes = Nodes()
        document, notices = nodes.export(nodes.add("VolumeAbsorption"), nodes.add("BsdfDiffuse"))
        self.assertNotIn("interior", document)
        self.assertIn("left out: its surface is no glass", notices[0])
        nodes = Nodes()
        _, notices = nodes.export(nodes.add("VolumePrincipled", Emission_Strength=1))
        self.assertTrue(any("left out: the light of its volume" in text for text in notices), notices)
        nodes = Nodes()
        _, notices = nodes.export(nodes.add("Emission"))
        self.assertTrue(any("left out: Lightmill has no such volume shader" in text for text in notices), notices)
