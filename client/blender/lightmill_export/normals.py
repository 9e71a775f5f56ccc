"""Normal maps and bump maps."""
import numpy as np

from .nodes import Input, Node


def read_normal(maker, inputs, are_all):
    """Reads the linked Normal inputs of a material's shaders. `are_all`: every Normal input is linked."""
    sources = [one.source() for one in inputs]
    if len({source[0] for source in sources}) > 1 or not are_all:
        maker.notices.here("left out: its shaders have different normals. All of them use the first")
    make_normal(maker, Node(sources[0][0], sources[0][2]))


def make_normal(maker, inside):
    node = inside.node
    if node.type not in ("NORMAL_MAP", "BUMP"):
        maker.notices.node(node, "left out: Lightmill changes normals only by normal maps and bump maps")
        return
    maker.notices.add("Diffuse surfaces with normal maps or bump maps are brighter than in Blender, which loses light there")
    (normal_map if node.type == "NORMAL_MAP" else bump)(maker, inside)
    inside.name_unread(maker.notices)


def normal_map(maker, inside):
    node, reader = inside.node, maker.reader
    if node.space != "TANGENT":
        maker.notices.node(node, f"left out: its space is {node.space}. Lightmill supports only TANGENT")
        return
    strength = reader.number(inside.input("Strength"), node)
    value = reader.color(inside.input("Color"))
    if value.image is None:
        maker.notices.node(node, "left out: its colour is not an image")
        return
    if not np.all(value.rgb == 1):
        value = reader.combine(lambda c: c, [value], node)
    if strength != 1:
        maker.notices.node(node, f"its strength {strength:g} scales the slopes, not the normals as in Blender")
    if node.uv_map and (value.image.place.kind, value.image.place.name) != ("UV", node.uv_map):
        maker.notices.node(node, f"left out: its UV map {node.uv_map}. The tangents follow the image's coordinates")
    if not np.allclose(value.image.place.affine()[:2, :2], np.diag(np.diag(value.image.place.affine()[:2, :2]))):
        maker.notices.node(node, "the Mapping node also rotates its tangents, unlike in Blender")
    maker.document["normal_map"] = {"texture": maker.uses.add(value.image, node), "scale": strength}


def bump(maker, inside):
    node, reader = inside.node, maker.reader
    strength = reader.number(inside.input("Strength"), node)
    height = reader.number(inside.input("Distance"), node) * (-1 if node.invert else 1)
    value = reader.scalar(inside.input("Height"))
    if value.image is None:
        if inside.input("Height").node() is not None:
            maker.notices.node(node, "left out: its height is not an image")
        return
    if strength != 1:
        maker.notices.node(node, f"its strength {strength:g} scales the height, not the normals as in Blender")
    bump_map(maker, value, height * strength, node)


def bump_map(maker, value, height, node):
    if not np.allclose(value.rgb, value.rgb[0]):
        value = maker.reader.combine(lambda c: c, [value], node)
    channel = value.image.channel if value.image.channel != "COLOR" else "LUMINANCE"
    maker.document["bump_map"] = {"texture": maker.uses.add(value.image, node), "channel": channel,
                                  "height": float(height * value.rgb[0])}


def read_displacement(maker, material, socket, has_map):
    node, _output, groups = Input(socket).source()
    if node is None:
        return
    holder = material.cycles if hasattr(material.cycles, "displacement_method") else material  # Blender 4.1
    method = holder.displacement_method
    if method != "BUMP":
        maker.notices.node(node, "left out: Lightmill does not displace surfaces"
                           + (". It adds no bump map either" if method == "DISPLACEMENT" else ""))
        if method == "DISPLACEMENT":
            return
    if node.type != "DISPLACEMENT":
        maker.notices.node(node, "left out: only a Displacement node with an image changes normals")
        return
    inside = Node(node, groups)
    if has_map:
        maker.notices.node(node, "left out: the material already has a normal map or bump map")
        return
    scale = maker.reader.number(inside.input("Scale"), node)
    value = maker.reader.scalar(inside.input("Height"))
    inside.name_unread(maker.notices)
    if value.image is None:
        if inside.input("Height").node() is not None:
            maker.notices.node(node, "left out: its height is not an image")
        return
    if node.space != "OBJECT":
        maker.notices.node(node, "its heights are in scene units, unlike in Blender")
    bump_map(maker, value, scale, node)
