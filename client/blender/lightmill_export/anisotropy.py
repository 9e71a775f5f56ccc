"""Anisotropic highlights. The facets of a surface are rougher along one direction than across it.

A document has the roughness across the direction, a strength, and a rotation. The direction is that of u of the texture
coordinates. Meshes without textures get coordinates whose u is the direction in Blender.
"""
from dataclasses import dataclass

import numpy as np

LEAST_ALPHA = 1e-4  # across the direction


@dataclass(frozen=True)
class Direction:
    kind: str  # RADIAL: around an axis of the object; UV: along u
    name: str  # the axis, or the UV map; "" is the one that renders


@dataclass(frozen=True)
class Anisotropy:
    along: float     # alpha along the direction over the square of the roughness
    across: float    # the same across it
    rotation: float  # in turns, counter-clockwise about the normal
    direction: Direction


def of_principled(reader, inside):
    """Of the metal and gloss of a principled shader. None if they are isotropic."""
    strength = float(np.clip(reader.number(inside.input("Anisotropic"), inside.node), 0, 1))
    aspect = (1 - 0.9 * strength) ** 0.5
    return make(reader, inside, 1 / aspect, aspect, "Anisotropic Rotation")


def of_glossy(reader, inside):
    strength = float(np.clip(reader.number(inside.input("Anisotropy"), inside.node), -0.99, 0.99))
    rougher, smoother = 1 / (1 - abs(strength)), 1 - abs(strength)
    return make(reader, inside, *((rougher, smoother) if strength < 0 else (smoother, rougher)), "Rotation")


def make(reader, inside, along, across, rotation):
    turns = reader.number(inside.input(rotation), inside.node)
    direction = direction_of(reader, inside)
    return None if along == across else Anisotropy(along, across, turns, direction)


def direction_of(reader, inside):
    socket = inside.input("Tangent")
    node = socket.node() if socket is not None else None
    if node is not None and node.type == "TANGENT":
        return Direction("UV", node.uv_map) if node.direction_type == "UV_MAP" else Direction("RADIAL", node.axis)
    if node is not None:
        reader.notices.node(node, "left out: the direction of the anisotropy is the one without a Tangent")
    return Direction("RADIAL", "Z")


def parameters(anisotropy, roughness):
    """The document's roughness, and its other fields. `roughness`: Blender's."""
    along, across = (min(max(factor * roughness ** 2, 0.0), 1.0) for factor in (anisotropy.along, anisotropy.across))
    if along == across:
        return roughness, {}
    most = max(along, across)
    least = max(min(along, across), min(LEAST_ALPHA, most))
    strength = ((most - least) / (1 - least)) ** 0.5 if least < 1 else 0.0
    degrees = 360 * anisotropy.rotation + (90 if along < across else 0)
    return least ** 0.5, {"anisotropy": strength, "anisotropy_rotation_degrees": degrees % 360}


def follows(direction, placement):
    """Whether u of these texture coordinates has the direction."""
    matrix = placement.affine()[:2, :3]
    straight = matrix[0, 0] > 0 and np.allclose(matrix[[0, 0, 1, 1], [1, 2, 0, 2]], 0)
    return (direction.kind, direction.name) == (placement.kind, placement.name) and straight


def around(axis, generated):
    """Directions around an axis of an object's box, at generated coordinates, as in Cycles. They are no unit vectors."""
    x, y, z = (generated[:, i] - 0.5 for i in range(3))
    zero = np.zeros_like(x)
    return np.stack({"X": (zero, -z, y), "Y": (-z, zero, x), "Z": (-y, x, zero)}[axis], axis=-1)
