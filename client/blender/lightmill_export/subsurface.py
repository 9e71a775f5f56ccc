"""Subsurface scattering shaders as diffuse sheets around a medium.

Cycles' random walk enters a body and leaves it with cosine lobes, and has no refraction. So does Lightmill's.
"""
import math

import numpy as np

from .values import constant

FIXED = 0.25 / math.pi  # mean free path over a fixed radius
LEAST_SHARE = 1e-3  # of the largest radius
MOST_ANISOTROPY = 0.9


def read(self, inside):
    node, reader = inside.node, self.reader
    color = inside.input("Color")
    radius = np.maximum(reader.even(reader.color(inside.input("Radius")), node), 0) * max(reader.number(inside.input("Scale"), node), 0)
    anisotropy = min(max(reader.number(inside.input("Anisotropy"), node), 0.0), MOST_ANISOTROPY)
    ior = min(max(reader.number(inside.input("IOR"), node), 1.01), 3.8)
    if np.all(radius == 0):
        return self.one("diffuse", inside, {"roughness": constant(0.0), "multiple": False})
    albedo = np.clip(reader.even(reader.color(color), node), 0, 1)
    if node.falloff == "BURLEY":
        self.notices.node(node, "its Christensen-Burley scattering is replaced by a random walk with a fixed radius")
        anisotropy = 0.0
    if node.falloff == "RANDOM_WALK":
        radius = radius * [math.sqrt(3 * (1 - reduced_albedo(share, ior))) for share in albedo]
    else:
        radius = radius * FIXED
    if np.any(albedo > 0.8):
        self.notices.node(node, "bright colours of its subsurface scattering are up to 5 % darker than in Blender")
    radius = np.maximum(radius, LEAST_SHARE * radius.max())
    interior = {"subsurface": {"color": {"rgb": [float(c) for c in albedo]}, "radius": {"rgb": [float(r) for r in radius]}},
                "anisotropy": anisotropy}
    out = self.one("diffuse", inside, {"roughness": constant(0.0), "multiple": False, "interior": interior}, constant(0.0))
    out.reflection.transmittance = constant(1.0)
    return out


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
