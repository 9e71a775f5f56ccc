"""Runs in Blender. No shader node is left out in silence: each change of a material changes the document, or is named
in a notice.

The tests walk all shader nodes that this Blender has, their inputs and their properties. What neither changes nor is named
stands in a list here, with its reason.
"""
import tempfile
import unittest

import bpy

from changes import change, own_properties
from lightmill_export.closures import SHADERS
from lightmill_export.images import ImageFiles
from lightmill_export.materials import MaterialMaker
from lightmill_export.math_nodes import COMPUTED
from lightmill_export.notices import Notices
from lightmill_export.textures import Textures

FOLDER = tempfile.mkdtemp(prefix="lightmill-walk-")
# Nodes that are no part of a picture.
NO_PICTURE = {
    "OUTPUT_AOV": "only writes a pass", "OUTPUT_LINESTYLE": "only of Freestyle", "OUTPUT_MATERIAL": "the end itself",
    "OUTPUT_WORLD": "of worlds", "OUTPUT_LIGHT": "of lights", "GROUP": "its nodes count", "CUSTOM GROUP": "its nodes count",
}


class Scene:
    """A material with one diffuse shader."""

    def __init__(self):
        self.material = bpy.data.materials.new("the material")
        self.material.use_nodes = True
        self.tree = self.material.node_tree
        self.tree.nodes.clear()
        self.end = self.tree.nodes.new("ShaderNodeOutputMaterial")
        self.diffuse = self.tree.nodes.new("ShaderNodeBsdfDiffuse")
        self.tree.links.new(self.diffuse.outputs[0], self.end.inputs["Surface"])

    def add(self, kind, name="the node"):
        node = self.tree.nodes.new(kind)
        node.name = name
        return node

    def use(self, node, output):
        """Puts a node where its output has a meaning."""
        if output.type == "SHADER":
            place = "Volume" if node.type.startswith(("VOLUME", "PRINCIPLED_VOLUME")) else "Surface"
            target = self.end.inputs[place]
        elif node.type in ("DISPLACEMENT", "VECTOR_DISPLACEMENT"):
            target = self.end.inputs["Displacement"]
        elif node.type in ("NORMAL_MAP", "BUMP"):
            target = self.diffuse.inputs["Normal"]
        else:
            target = self.diffuse.inputs["Color"]
        self.tree.links.new(output, target)

    def export(self):
        """The document's material with its textures, and the notices."""
        notices = Notices()
        notices.about = "material the material"
        textures = Textures(ImageFiles(FOLDER), notices)
        made = MaterialMaker("the material", textures, notices).make(self.material)
        textures = [{key: value for key, value in one.items() if key != "file"} for one in textures.documents]
        return str((made.document, textures, made.placement, made.colors)), notices.texts

    def close(self):
        bpy.data.materials.remove(self.material)


def named(notices, name):
    return any(name in text and "the material" in text for text in notices)


def shader_nodes():
    for name in dir(bpy.types):
        kind = getattr(bpy.types, name)
        if isinstance(kind, type) and issubclass(kind, bpy.types.ShaderNode) and kind is not bpy.types.ShaderNode:
            yield name


MAPPED = {*COMPUTED, *SHADERS, "TEX_IMAGE", "TEX_ENVIRONMENT", "VERTEX_COLOR", "ATTRIBUTE", "MIX_SHADER", "ADD_SHADER", "NORMAL_MAP",
          "BUMP", "DISPLACEMENT"}


# Shaders that are named as a whole, so their numbers are not.
NAMED_AS_A_WHOLE = {"BSDF_TOON", "BSDF_HAIR", "BSDF_HAIR_PRINCIPLED", "BSDF_VELVET",
                    "EEVEE_SPECULAR", "BSDF_SHEEN"}
# Inputs and properties without an effect of their own.
BESIDE = {
    ("BSDF_PRINCIPLED", "Anisotropic Rotation"): "anisotropy is named", ("BSDF_PRINCIPLED", "Sheen Tint"): "sheen is named",
    ("BSDF_ANISOTROPIC", "Rotation"): "anisotropy is named", ("DISPLACEMENT", "Midlevel"): "it moves all heights alike",
    ("MIX_RGB", "use_alpha"): "Cycles has no such alpha", ("MIX", "factor_mode"): "of vectors alone",
    ("MIX", "clamp_factor"): "of linked factors alone",
    ("TEX_IMAGE", "projection_blend"): "of projections that are named",
}


def prepared(scene, kind, second=False):
    """A node with inputs that have an effect. Where some exclude each other, there is a second way."""
    node = scene.add(kind)
    values = {}
    if node.type == "BSDF_PRINCIPLED":
        values = {"Base Color": (0.2, 0.5, 0.7, 1), "Metallic": 0.3, "Clearcoat": 0.5, "Emission Strength": 1.0, "Emission": (0.2, 0.3, 0.4, 1),
                  **({"Subsurface": 0.2, "Subsurface Anisotropy": 0.3} if second else {"Transmission": 0.4, "Alpha": 0.9})}
    elif hasattr(node, "distribution") and "Roughness" in node.inputs:
        values = {"Roughness": 0.5}
    elif node.type in COMPUTED:
        if node.type == "MIX":
            node.data_type = "RGBA"
        numbers = iter((0.9, 2.0, 1.6, 0.1, 0.5) if second else (0.3, 0.2, 0.9, 0.4, 0.8))
        for socket in [one for one in node.inputs if one.enabled and hasattr(one, "default_value")]:
            number = next(numbers)
            count = getattr(socket.default_value, "__len__", lambda: 0)()
            socket.default_value = [number * (0.4 + 0.3 * i) for i in range(count)] if count else number
        if node.type == "BLACKBODY":
            values = {"Temperature": 3000}
        if node.type == "CLAMP" and second:  # the least is above the most
            values = {"Value": 0.3, "Min": 0.8, "Max": 0.2}
    for name, value in values.items():
        node.inputs[name].default_value = value
    if node.type in ("MIX_SHADER", "ADD_SHADER"):
        first = 1 if node.type == "MIX_SHADER" else 0
        for slot, color in ((first, (1, 0, 0, 1)), (first + 1, (0, 1, 0, 1))):
            part = scene.tree.nodes.new("ShaderNodeBsdfDiffuse")
            part.inputs["Color"].default_value = color
            scene.tree.links.new(part.outputs[0], node.inputs[slot])
    if node.type in ("TEX_IMAGE", "TEX_ENVIRONMENT"):
        node.image = picture()
    if node.type in ("NORMAL_MAP", "BUMP", "DISPLACEMENT"):
        image = scene.tree.nodes.new("ShaderNodeTexImage")
        image.image = picture()
        scene.tree.links.new(image.outputs[0], node.inputs["Color" if node.type == "NORMAL_MAP" else "Height"])
    return node


def picture():
    image = bpy.data.images.get("the picture")
    if image is None:
        image = bpy.data.images.new("the picture", 2, 2)
        image.pixels.foreach_set([0.1, 0.2, 0.3, 1, 0.4, 0.5, 0.6, 1, 0.7, 0.8, 0.9, 1, 0.2, 0.4, 0.6, 1])
        image.pack()
    return image


class ShaderNodes(unittest.TestCase):
    def test_each_is_mapped_or_named(self):
        for kind in shader_nodes():
            scene = Scene()
            try:
                node = scene.add(kind)
            except RuntimeError:
                continue  # a base class
            if node.type not in NO_PICTURE and node.type not in MAPPED:
                for output in [one for one in node.outputs if one.enabled]:
                    scene.use(node, output)
                    _, notices = scene.export()
                    with self.subTest(f"{kind}, {output.name}: {notices}"):
                        self.assertTrue(named(notices, "the node"))
            scene.close()

    def test_what_is_linked_to_an_input_counts_or_is_named(self):
        for kind in shader_nodes():
            for index in self.inputs_of(kind):
                scene = Scene()
                node = prepared(scene, kind)
                scene.use(node, node.outputs[0])
                noise = scene.add("ShaderNodeTexNoise", "the noise")
                socket = node.inputs[index]
                if socket.type == "SHADER":
                    noise = scene.add("ShaderNodeBsdfToon", "the noise")
                scene.tree.links.new(noise.outputs[0], socket)
                _, notices = scene.export()
                with self.subTest(f"{kind}, {socket.name}: {notices}"):
                    self.assertTrue(named(notices, "the noise"))
                scene.close()

    def test_the_value_of_an_input_counts_or_is_named(self):
        for kind in shader_nodes():
            for index in self.inputs_of(kind):
                self.check_changes(kind, lambda node, index=index: (node.inputs[index], "default_value", node.inputs[index].name))

    def test_a_property_counts_or_is_named(self):
        for kind in shader_nodes():
            for name in self.properties_of(kind):
                self.check_changes(kind, lambda node, name=name: (node, name, name))

    def check_changes(self, kind, find):
        """That each other value of a property counts or is named, in one of the two ways to prepare the node."""
        seen = {}
        for second in (False, True):
            scene = Scene()
            node = prepared(scene, kind, second)
            scene.use(node, node.outputs[0])
            holder, name, label = find(node)
            if (node.type, label) in BESIDE or node.type in NAMED_AS_A_WHOLE and label != "Color" or not hasattr(holder, name) or (
                    name == "default_value" and (holder.hide_value or holder.is_linked)):
                scene.close()
                return
            before = scene.export()
            for i, value in enumerate(change(holder, name)):
                seen[i] = (value, seen.get(i, (value, False))[1] or scene.export() != before)
            scene.close()
        for value, differs in seen.values():
            with self.subTest(f"{kind}.{label} = {value}"):
                self.assertTrue(differs)

    def properties_of(self, kind):
        scene = Scene()
        try:
            node = prepared(scene, kind)
            return own_properties(node, bpy.types.ShaderNode) if node.type in MAPPED else []
        except RuntimeError:
            return []
        finally:
            scene.close()

    def inputs_of(self, kind):
        scene = Scene()
        try:
            node = prepared(scene, kind)
            return [i for i, socket in enumerate(node.inputs) if socket.enabled and not socket.is_unavailable] if node.type in MAPPED else []
        except RuntimeError:
            return []
        finally:
            scene.close()

class RoughDiffuse(unittest.TestCase):
    def mixture(self, *roughnesses):
        """The document and the notices of a mixture of diffuse shaders."""
        scene = Scene()
        mix = scene.add("ShaderNodeMixShader")
        for slot, roughness in enumerate(roughnesses, 1):
            part = scene.tree.nodes.new("ShaderNodeBsdfDiffuse")
            part.inputs["Roughness"].default_value = roughness
            scene.tree.links.new(part.outputs[0], mix.inputs[slot])
        scene.use(mix, mix.outputs[0])
        exported = scene.export()
        scene.close()
        return exported

    def test_the_roughness_is_kept(self):
        scene = Scene()
        scene.diffuse.inputs["Roughness"].default_value = 0.5
        document, notices = scene.export()
        scene.close()
        self.assertIn("'roughness': 0.5", document)
        self.assertEqual("'single_scattering': True" in document, bpy.app.version < (4, 3, 0))
        self.assertEqual(notices, [])

    def test_a_mixture_has_the_common_roughness(self):
        document, notices = self.mixture(0.25, 0.25)
        self.assertIn("'roughness': 0.25", document)
        self.assertEqual(notices, [])

    def test_an_image_is_a_map(self):
        scene = Scene()
        image = scene.add("ShaderNodeTexImage")
        image.image = picture()
        scene.tree.links.new(image.outputs[0], scene.diffuse.inputs["Roughness"])
        document, _ = scene.export()
        scene.close()
        self.assertIn("'roughness_map': {'texture'", document)
        self.assertIn("'roughness': 1.0", document)

    def test_different_roughnesses_make_a_mixture(self):
        document, notices = self.mixture(0.25, 0.75)
        self.assertIn("'roughness': 0.25", document)
        self.assertIn("'roughness': 0.75", document)
        self.assertEqual(notices, [])
