"""Subsurface scattering shaders as sheets around a medium.

Cycles' random walk enters a body and leaves it with cosine lobes, and has no refraction. So does Lightmill's.
"""
import math

import bpy
import numpy as np

from .values import constant

FIXED = 0.25 / math.pi  # mean free path over a fixed radius
BY_COLOR = "RANDOM_WALK" if bpy.app.version < (4, 0, 0) else "RANDOM_WALK_SKIN"  # whose mean free path depends on the colour
LEAST_SHARE = 1e-3  # of the largest radius
MOST_ANISOTROPY = 0.9


def read(self, inside):
    node, reader = inside.node, self.reader
    color = reader.color(inside.input("Color"))
    radius = reader.even(reader.color(inside.input("Radius")), node) * max(reader.number(inside.input("Scale"), node), 0)
    skin = body(self, inside, node.falloff, color, radius, "Anisotropy", "IOR")
    if skin is None:
        return self.one("diffuse", inside, {"roughness": constant(0.0), "multiple": False}, color)
    interior, transmittance = skin
    out = self.one("diffuse", inside, {"roughness": constant(0.0), "multiple": False, "interior": interior}, constant(0.0))
    out.reflection.transmittance = transmittance
    return out


def body(self, inside, method, color, radius, anisotropy, ior):
    """The document's medium, and the transmittance of the sheet around it, which has the colour's image. None without a radius.

    `anisotropy`, `ior`: names of the inputs.
    """
    node, reader = inside.node, self.reader
    anisotropy, ior = number(reader, inside, anisotropy, 0.0, MOST_ANISOTROPY), number(reader, inside, ior, 1.01, 3.8, 1.4)
    radius = np.maximum(radius, 0)
    if np.all(radius == 0):
        return None
    albedo, transmittance = albedo_of(self, color, node)
    if method == "BURLEY":
        self.notices.node(node, "its Christensen-Burley scattering is replaced by a random walk with a fixed radius")
        anisotropy = 0.0
    if method == BY_COLOR:
        radius = radius * [math.sqrt(3 * (1 - reduced_albedo(share, ior))) for share in albedo]
    else:
        radius = radius * FIXED
    if np.any(albedo > 0.8):
        self.notices.node(node, "bright colours of its subsurface scattering are up to 5 % darker than in Blender")
    radius = np.maximum(radius, LEAST_SHARE * radius.max())
    return {"subsurface": {"color": {"rgb": [float(c) for c in albedo]}, "radius": {"rgb": [float(r) for r in radius]}},
            "anisotropy": anisotropy}, transmittance


def albedo_of(self, color, node):
    """The colour of the medium, and the transmittance t of its sheet. What they show, t² times the colour, has the colour's image."""
    if color.image is None or color.colors is not None:
        return np.clip(self.reader.even(color, node), 0, 1), constant(1.0)
    texels = np.clip(color.rgb * color.image.texels(), 0, 1)
    most = texels.reshape(-1, 3).max(axis=0)
    self.notices.node(node, "the image of its subsurface scattering is on its surface, so light that leaves is tinted, too")
    return most, self.reader.combine(lambda c: np.sqrt(np.clip(c, 0, most) / np.where(most > 0, most, 1)), [color], node)


def number(reader, inside, name, least, most, missing=0.0):
    socket = inside.input(name)
    return missing if socket is None else min(max(reader.number(socket, inside.node), least), most)


def reduced_albedo(reflectance, ior):
    """Single-scattering albedo of a half-space with this diffuse reflectance, by the dipole of Jensen and Buhler (2002)."""
    fresnel = -1.44 / ior ** 2 + 0.71 / ior + 0.668 + 0.0636 * ior
    factor = 4 / 3 * (1 + fresnel) / (1 - fresnel)
    low, high = 0.0, 1.0
    for _ in range(30):
        middle = (low + high) / 2
        root = math.sqrt(3 * (1 - middle))
        if middle / 2 * (1 + math.exp(-factor * root)) * math.exp(-root) < reflectance:
            low = middle
        else:
            high = middle
    return min(low, 0.999999)
