"""Runs in Blender. Values that only Cycles can compute become images; others stay as they are."""
import json
import os
import tempfile
import unittest

import bpy
import numpy as np

from lightmill_export import bake, bake_world
from lightmill_export.closures import SHADERS
from lightmill_export.math_nodes import COMPUTED
from lightmill_export.notices import Notices
from lightmill_export.render_engine import export

FOLDER = tempfile.mkdtemp(prefix="lightmill-bake-")
SIZE = 64
# Nodes without a value that an image can have.
NOT_BAKED = {
    "TEX_IES": "of lights", "HAIR_INFO": "of hair", "PARTICLE_INFO": "differs between instances", "POINT_INFO": "of point clouds",
    "VOLUME_INFO": "of volumes", "SCRIPT": "scripts do not run", "UVALONGSTROKE": "of Freestyle", "TEX_POINTDENSITY": "of volumes",
    "SQUEEZE": "of Freestyle",
}


def material(kind="ShaderNodeBsdfDiffuse"):
    made = bpy.data.materials.new("the material")
    made.use_nodes = True
    made.node_tree.nodes.clear()
    end, shader = made.node_tree.nodes.new("ShaderNodeOutputMaterial"), made.node_tree.nodes.new(kind)
    made.node_tree.links.new(shader.outputs[0], end.inputs["Surface"])
    return made, made.node_tree, shader


class Baking(unittest.TestCase):
    def setUp(self):
        bpy.ops.wm.read_factory_settings(use_empty=True)

    def add_plane(self, made):
        bpy.ops.mesh.primitive_plane_add()
        bpy.context.object.data.materials.append(made)
        return bpy.context.object

    def export(self):
        export(FOLDER, SIZE)
        with open(os.path.join(FOLDER, "scene.json"), encoding="utf-8") as file:
            document = json.load(file)
        with open(os.path.join(FOLDER, "report.json"), encoding="utf-8") as file:
            return document, json.load(file)["notices"]

    def texels(self, document, texture):
        """(height, width, 3) from the lowest row, of a PFM file."""
        name = next(one for one in document["textures"] if one["name"] == texture)["file"]
        with open(os.path.join(FOLDER, name), "rb") as file:
            kind, size, _scale = (file.readline().split() for _ in range(3))
            self.assertEqual((kind, size), ([b"PF"], [b"64", b"64"]))
            return np.frombuffer(file.read(), dtype="<f4").reshape(SIZE, SIZE, 3)

    def corners(self, document):
        """(position, texture coordinates) of the corners of the first object's mesh."""
        with open(os.path.join(FOLDER, document["objects"][0]["mesh"]["file"]), encoding="utf-8") as file:
            lines = [line.split() for line in file]
        v, vt = ([[float(x) for x in line[1:4]] for line in lines if line[0] == kind] for kind in ("v", "vt"))
        for line in lines:
            for corner in line[1:] if line[0] == "f" else ():
                at, uv = corner.split("/")[:2]
                yield np.array(v[int(at) - 1]), np.array(vt[int(uv) - 1][:2])

    def test_an_image_has_the_value_at_each_place(self):
        # A gradient along x from 0 to 1 over the plane, in generated coordinates.
        made, tree, shader = material()
        gradient, place = tree.nodes.new("ShaderNodeTexGradient"), tree.nodes.new("ShaderNodeTexCoord")
        tree.links.new(place.outputs["Generated"], gradient.inputs["Vector"])
        tree.links.new(gradient.outputs["Color"], shader.inputs["Color"])
        self.add_plane(made)
        document, notices = self.export()
        self.assertTrue(any("Color is baked into an image of 64 × 64 texels" in text for text in notices), notices)
        reflectance = document["materials"][0]["diffuse"]["reflectance"]
        texels = self.texels(document, reflectance["texture"])
        for position, (u, v) in self.corners(document):
            column, row = (min(int(x * SIZE), SIZE - 1) for x in (u, v))
            self.assertAlmostEqual(texels[row, column].mean(), (position[0] + 1) / 2, delta=0.03)
        self.assertAlmostEqual(float(texels[SIZE // 2, SIZE // 2].mean()), 0.5, delta=0.03)

    def test_what_can_be_exported_is_not_baked(self):
        made, tree, shader = material()
        image = bpy.data.images.new("picture", 4, 4)
        texture, invert = tree.nodes.new("ShaderNodeTexImage"), tree.nodes.new("ShaderNodeInvert")
        texture.image = image
        tree.links.new(texture.outputs["Color"], invert.inputs["Color"])
        tree.links.new(invert.outputs["Color"], shader.inputs["Color"])
        self.assertEqual(list(bake.cuts_of(made)), [])

    def test_values_of_the_view_are_not_baked(self):
        made, tree, shader = material()
        noise, weight, mix = (tree.nodes.new(kind) for kind in ("ShaderNodeTexNoise", "ShaderNodeLayerWeight", "ShaderNodeMixRGB"))
        tree.links.new(weight.outputs["Facing"], mix.inputs["Fac"])
        tree.links.new(noise.outputs["Color"], mix.inputs["Color1"])
        tree.links.new(mix.outputs["Color"], shader.inputs["Color"])
        self.assertEqual(list(bake.cuts_of(made)), [])

    def test_each_input_has_its_own_image(self):
        made, tree, shader = material("ShaderNodeBsdfPrincipled")
        noise = tree.nodes.new("ShaderNodeTexNoise")
        bump = tree.nodes.new("ShaderNodeBump")
        tree.links.new(noise.outputs["Color"], shader.inputs["Base Color"])
        tree.links.new(noise.outputs["Fac"], shader.inputs["Roughness"])
        tree.links.new(noise.outputs["Fac"], bump.inputs["Height"])
        tree.links.new(bump.outputs["Normal"], shader.inputs["Normal"])
        self.assertEqual({identifier for _, identifier in bake.cuts_of(made)}, {"Base Color", "Roughness", "Height"})
        self.add_plane(made)
        document, _ = self.export()
        out = document["materials"][0]
        names = {out["principled"]["base_color"]["texture"], out["roughness_map"]["texture"], out["bump_map"]["texture"]}
        self.assertEqual(len(names), 3)

    def test_modifiers_are_those_of_the_render(self):
        made, tree, shader = material()
        tree.links.new(tree.nodes.new("ShaderNodeTexNoise").outputs["Color"], shader.inputs["Color"])
        modifier = self.add_plane(made).modifiers.new("smooth", "SUBSURF")
        modifier.subdivision_type, modifier.levels, modifier.render_levels = "SIMPLE", 0, 2
        document, _ = self.export()
        self.assertEqual(len(list(self.corners(document))), 3 * 2 * 4 ** 2)

    def test_equal_objects_share_their_images_and_others_do_not(self):
        made, tree, shader = material()
        tree.links.new(tree.nodes.new("ShaderNodeTexNoise").outputs["Color"], shader.inputs["Color"])
        first = self.add_plane(made)
        second = bpy.data.objects.new("second", first.data)
        bpy.context.scene.collection.objects.link(second)
        document, _ = self.export()
        self.assertEqual((len(document["materials"]), len(document["textures"])), (1, 1))

    def test_objects_that_make_instances_keep_them(self):
        made, tree, shader = material()
        tree.links.new(tree.nodes.new("ShaderNodeTexNoise").outputs["Color"], shader.inputs["Color"])
        self.add_plane(made).modifiers.new("particles", "PARTICLE_SYSTEM")
        _, notices = self.export()
        self.assertTrue(any("uniform grey" in text for text in notices), notices)

    def test_most_shader_nodes_are_mapped_or_baked(self):
        mapped = {*COMPUTED, *SHADERS, "TEX_IMAGE", "TEX_ENVIRONMENT", "VERTEX_COLOR", "ATTRIBUTE", "MIX_SHADER", "ADD_SHADER",
                  "NORMAL_MAP", "BUMP", "DISPLACEMENT", "GROUP", "REROUTE", "OUTPUT_MATERIAL"}
        made, tree, shader = material()
        count, good, left = 0, 0, []
        for name in dir(bpy.types):
            kind = getattr(bpy.types, name)
            if not (isinstance(kind, type) and issubclass(kind, bpy.types.ShaderNode) and kind is not bpy.types.ShaderNode):
                continue
            try:
                node = tree.nodes.new(name)
            except RuntimeError:
                continue
            count += 1
            output = next((one for one in node.outputs if one.enabled and one.type in ("RGBA", "VALUE", "VECTOR")), None)
            if node.type in mapped:
                good += 1
            elif output is not None:
                tree.links.new(output, shader.inputs["Color"])
                good += bool(list(bake.cuts_of(made))) and node.type not in NOT_BAKED
                left += [] if list(bake.cuts_of(made)) else [node.type]
            tree.nodes.remove(node)
        self.assertGreaterEqual(good, 0.8 * count, left)


class Worlds(unittest.TestCase):
    def setUp(self):
        bpy.ops.wm.read_factory_settings(use_empty=True)
        self.world = bpy.context.scene.world = bpy.data.worlds.new("sky")
        self.world.use_nodes = True
        self.tree = self.world.node_tree
        self.color = self.tree.nodes["Background"].inputs["Color"]

    def test_a_panorama_is_what_an_environment_texture_shows(self):
        image = bpy.data.images.new("sky", 16, 8, float_buffer=True, is_data=True)
        values = np.random.default_rng(3).random((8, 16, 4)).astype(np.float32)
        image.pixels.foreach_set(values.ravel())
        image.pack()
        texture = self.tree.nodes.new("ShaderNodeTexEnvironment")
        texture.image, texture.interpolation = image, "Closest"
        self.tree.links.new(texture.outputs[0], self.color)
        baked = bake_world.panorama(self.world, 32)
        seen = np.empty(64 * 32 * 4, dtype=np.float32)
        baked.pixels.foreach_get(seen)
        centers = seen.reshape(8, 4, 16, 4, 4)[:, 1, :, 1]
        np.testing.assert_allclose(centers[..., :3], values[..., :3], atol=1e-3)

    def test_only_worlds_that_an_export_would_flatten_are_baked(self):
        self.assertFalse(bake_world.needs_image(self.world))
        texture = self.tree.nodes.new("ShaderNodeTexSky")
        self.tree.links.new(texture.outputs[0], self.color)
        self.assertTrue(bake_world.needs_image(self.world))
        # What the camera sees may differ from what lights the scene. No image can say that.
        path = self.tree.nodes.new("ShaderNodeLightPath")
        self.tree.links.new(path.outputs["Is Camera Ray"], self.tree.nodes["Background"].inputs["Strength"])
        self.assertFalse(bake_world.needs_image(self.world))

    def test_a_sky_texture_becomes_an_environment_with_a_notice(self):
        texture = self.tree.nodes.new("ShaderNodeTexSky")
        texture.sky_type, texture.sun_disc = "NISHITA", False
        self.tree.links.new(texture.outputs[0], self.color)
        bpy.ops.mesh.primitive_plane_add()
        export(FOLDER, SIZE)
        with open(os.path.join(FOLDER, "scene.json"), encoding="utf-8") as file:
            environment = json.load(file)["lights"][0]["environment"]
        with open(os.path.join(FOLDER, "report.json"), encoding="utf-8") as file:
            notices = json.load(file)["notices"]
        self.assertTrue(environment["file"].endswith(".exr"), environment)
        self.assertIn(f"world sky: it is baked into an image of {2 * SIZE} × {SIZE} texels", notices)
        self.assertFalse(any("grey" in text for text in notices), notices)


if __name__ == "__main__":
    unittest.main()
