"""Volume shaders as homogeneous media.

A Volume Absorption absorbs what its colour leaves. A Volume Scatter scatters its colour, and absorbs nothing. Coefficients are per unit of
length in the world, whatever the scale of the object (Cycles' svm/closure.h).
"""
from dataclasses import dataclass

import numpy as np

from .nodes import Input, Node
from .values import luminance

MOST_ANISOTROPY = 0.99


@dataclass
class Medium:
    """Coefficients of red, green and blue per unit of length, and g of the Henyey-Greenstein phase function."""
    absorption: np.ndarray
    scattering: np.ndarray
    anisotropy: float = 0.0

    def is_empty(self):
        return not (np.any(self.absorption > 0) or np.any(self.scattering > 0))

    def document(self):
        out = {"absorption": {"rgb": [float(c) for c in self.absorption]}}
        if np.any(self.scattering > 0):
            out.update({"scattering": {"rgb": [float(c) for c in self.scattering]}, "anisotropy": float(self.anisotropy)})
        return out


def empty():
    return Medium(np.zeros(3), np.zeros(3))


def read(reader, socket):
    """The medium at a volume input."""
    return walk(reader, Input(socket))


def walk(reader, socket):
    node, _output, groups = socket.source()
    if node is None:
        return empty()
    inside = Node(node, groups)
    if node.type == "ADD_SHADER":
        return total(walk(reader, inside.input(0)), walk(reader, inside.input(1)))
    if node.type == "MIX_SHADER":
        share = min(max(reader.number(inside.input(0), node), 0.0), 1.0)
        return total(scaled(walk(reader, inside.input(1)), 1 - share), scaled(walk(reader, inside.input(2)), share))
    if node.type not in SHADERS:
        reader.notices.node(node, "left out: Lightmill has no such volume shader")
        return empty()
    medium = SHADERS[node.type](reader, inside)
    inside.name_unread(reader.notices)
    return medium


def scaled(medium, factor):
    return Medium(medium.absorption * factor, medium.scattering * factor, medium.anisotropy)


def total(a, b):
    """Both media in one place. Their anisotropy is the mean, weighted by how much they scatter."""
    weights = [float(np.sum(luminance(one.scattering))) for one in (a, b)]
    mean = 0.0 if sum(weights) == 0 else (a.anisotropy * weights[0] + b.anisotropy * weights[1]) / sum(weights)
    return Medium(a.absorption + b.absorption, a.scattering + b.scattering, mean)


def density(reader, inside):
    return max(reader.number(inside.input("Density"), inside.node), 0.0)


def color(reader, inside, name="Color"):
    return np.clip(reader.even(reader.color(inside.input(name)), inside.node), 0, 1) * np.ones(3)


def anisotropy(reader, inside):
    return min(max(reader.number(inside.input("Anisotropy"), inside.node), -MOST_ANISOTROPY), MOST_ANISOTROPY)


def absorption(reader, inside):
    return Medium(density(reader, inside) * (1 - color(reader, inside)), np.zeros(3))


def scatter(reader, inside):
    return Medium(np.zeros(3), density(reader, inside) * color(reader, inside), anisotropy(reader, inside))


def principled(reader, inside):
    tint, kept = color(reader, inside), np.sqrt(color(reader, inside, "Absorption Color"))
    if reader.number(inside.input("Emission Strength"), inside.node) > 0 or reader.number(inside.input("Blackbody Intensity"), inside.node) > 0:
        reader.notices.node(inside.node, "left out: the light of its volume")
    amount = density(reader, inside)
    return Medium(amount * (1 - tint) * (1 - kept), amount * tint, anisotropy(reader, inside))


SHADERS = {"VOLUME_ABSORPTION": absorption, "VOLUME_SCATTER": scatter, "PRINCIPLED_VOLUME": principled}
