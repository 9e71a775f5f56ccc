"""Normal maps and bump maps."""
import numpy as np

from .nodes import Input, Node


def read_bend(maker, inputs, are_all):
    """The linked Normal inputs of the shaders of a material. `are_all`: of each that has such an input."""
    sources = [one.source() for one in inputs]
    if len({source[0] for source in sources}) > 1 or not are_all:
        maker.notices.here("left out: its shaders have several normals, and the first counts for all")
    bend(maker, Node(sources[0][0], sources[0][2]))


def bend(maker, inside):
    node = inside.node
    if node.type not in ("NORMAL_MAP", "BUMP"):
        maker.notices.node(node, "left out: only normal maps and bumps change normals here")
        return
    maker.notices.add("Normal maps and bumps lose no light here. In Blender, diffuse surfaces that they bend are darker")
    (normal_map if node.type == "NORMAL_MAP" else bump)(maker, inside)
    inside.name_unread(maker.notices)


def normal_map(maker, inside):
    node, reader = inside.node, maker.reader
    if node.space != "TANGENT":
        maker.notices.node(node, f"left out: its space is {node.space}, and not TANGENT")
        return
    strength = reader.number(inside.input("Strength"), node)
    value = reader.color(inside.input("Color"))
    if value.image is None:
        maker.notices.node(node, "left out: its colour is no image")
        return
    if not np.all(value.rgb == 1):
        value = reader.combine(lambda c: c, [value], node)
    if strength != 1:
        maker.notices.node(node, f"its strength {strength:g} scales the slopes here, and not the normals")
    if node.uv_map and (value.image.place.kind, value.image.place.name) != ("UV", node.uv_map):
        maker.notices.node(node, f"left out: its tangents are those of the image's coordinates, and not of {node.uv_map}")
    if not np.allclose(value.image.place.affine()[:2, :2], np.diag(np.diag(value.image.place.affine()[:2, :2]))):
        maker.notices.node(node, "its tangents turn with the Mapping node here")
    maker.document["normal_map"] = {"texture": maker.uses.add(value.image, node), "scale": strength}


def bump(maker, inside):
    node, reader = inside.node, maker.reader
    strength = reader.number(inside.input("Strength"), node)
    height = reader.number(inside.input("Distance"), node) * (-1 if node.invert else 1)
    value = reader.scalar(inside.input("Height"))
    if value.image is None:
        if inside.input("Height").node() is not None:
            maker.notices.node(node, "left out: its height is no image")
        return
    if strength != 1:
        maker.notices.node(node, f"its strength {strength:g} scales the height here, and not the normals")
    bump_map(maker, value, height * strength, node)


def bump_map(maker, value, height, node):
    if not np.allclose(value.rgb, value.rgb[0]):
        value = maker.reader.combine(lambda c: c, [value], node)
    channel = value.image.channel if value.image.channel != "COLOR" else "LUMINANCE"
    maker.document["bump_map"] = {"texture": maker.uses.add(value.image, node), "channel": channel,
                                  "height": float(height * value.rgb[0])}


def read_displacement(maker, material, socket, bent):
    node, _output, groups = Input(socket).source()
    if node is None:
        return
    holder = material.cycles if hasattr(material.cycles, "displacement_method") else material  # Blender 4.1
    method = holder.displacement_method
    if method != "BUMP":
        maker.notices.node(node, "left out: surfaces are not displaced here"
                           + (", and have no bumps" if method == "DISPLACEMENT" else ""))
        if method == "DISPLACEMENT":
            return
    if node.type != "DISPLACEMENT":
        maker.notices.node(node, "left out: only a Displacement node with an image bends normals here")
        return
    inside = Node(node, groups)
    if bent:
        maker.notices.node(node, "left out: the material has another normal map or bump, and one counts")
        return
    scale = maker.reader.number(inside.input("Scale"), node)
    value = maker.reader.scalar(inside.input("Height"))
    inside.name_unread(maker.notices)
    if value.image is None:
        if inside.input("Height").node() is not None:
            maker.notices.node(node, "left out: its height is no image")
        return
    if node.space != "OBJECT":
        maker.notices.node(node, "its heights are in the scene's units here")
    bump_map(maker, value, scale, node)
