"""Blender's principled shader as parameters of Lightmill's.

Before Blender 4.0 it is Burley's: its diffuse part is not Lambert's, and is not reduced by the light that the specular part
reflects. Documents have this variant too (burley_diffuse), but not in mixtures with other shaders. In a mixture, the base
colour is scaled until both parts reflect the same share of uniform light.
"""
from functools import lru_cache

import bpy
import numpy as np

from . import anisotropy
from .closures import Closure
from .values import Value, constant

OLD = bpy.app.version < (4, 0, 0)
OLD_DIFFUSE = bpy.app.version < (4, 3, 0)  # rough diffuse shaders have no multiple scattering between facets
OLD_COAT = 0.25  # factor of the clearcoat's weight
# The sheen of Lightmill whose albedo is within 0.007 of that of Burley's sheen, (1 − cos)⁵, at all angles.
SHEEN_ROUGHNESS = 0.4
SHEEN_COLOR = 0.11


def read(self, inside, weight):
    reader, node = self.reader, inside.node

    def scalar(*names):
        value = reader.scalar(inside.input(*names))
        return Value(np.clip(value.rgb, 0, 1)) if value.is_constant() else value

    def number(*names):
        return min(max(reader.number(inside.input(*names), node), 0.0), 1.0)
    self.without(inside, "Sheen Weight", "Thin Film Thickness", "Diffuse Roughness")
    if OLD:
        self.without(inside, "Specular Tint")
    base = subsurface(self, inside, reader.color(inside.input("Base Color")))
    numbers = {"metallic": scalar("Metallic"), "roughness": scalar("Roughness"),
               "transmission": number("Transmission Weight", "Transmission"),
               "specular": number("Specular IOR Level", "Specular"), "ior": reader.number(inside.input("IOR"), node),
               "coat": number("Coat Weight", "Clearcoat") * (OLD_COAT if OLD else 1),
               "coat_roughness": number("Coat Roughness", "Clearcoat Roughness"),
               "multiple": node.distribution == "MULTI_GGX", **sheen(reader, inside)}
    if numbers["transmission"] > 0:
        self.without(inside, "Anisotropic")
    else:
        numbers["anisotropy"] = anisotropy.of_principled(reader, inside)
    details(self, inside, numbers)
    alpha = scalar("Alpha")
    solid = reader.multiply(weight, alpha, node)
    out = [Closure("principled", node, solid, base, numbers, inside.input("Normal"))]
    if not (alpha.is_constant() and alpha.rgb[0] == 1):
        rest = reader.multiply(weight, reader.combine(lambda a: 1 - a, [alpha], node), node)
        out.append(Closure("transparent", node, rest, constant(1.0)))
    radiance = reader.multiply(reader.color(inside.input("Emission Color", "Emission")),
                               reader.scalar(inside.input("Emission Strength")), node)
    return out if np.all(radiance.rgb == 0) else [*out, Closure("emission", node, solid, radiance)]


def details(self, inside, numbers):
    """Adds notices on inputs that matter only together with others."""
    if numbers["coat"] > 0:
        normal = inside.input("Coat Normal", "Clearcoat Normal").node()
        if normal is not None:
            self.notices.node(normal, "left out: the coat has the normals of the surface below it")
        if OLD:
            self.notices.node(inside.node, "its clearcoat has a GGX highlight, whose tail is shorter than in Blender")
        else:
            self.without(inside, "Coat Tint")
    if numbers["transmission"] > 0 and OLD and not numbers["multiple"]:
        self.without(inside, "Transmission Roughness")


def sheen(reader, inside):
    """Amount and tint of the sheen of Blender before 4.0."""
    if not OLD:
        return {}
    amount, tint = (min(max(reader.number(inside.input(name), inside.node), 0.0), 1.0) for name in ("Sheen", "Sheen Tint"))
    return {"sheen": amount, "sheen_tint": tint} if amount > 0 else {}


def subsurface(self, inside, base):
    share = self.reader.number(inside.input("Subsurface Weight", "Subsurface"), inside.node)
    if share == 0:
        return base
    self.notices.node(inside.node, "its subsurface scattering is treated as diffuse reflection")
    socket = inside.input("Subsurface Color")
    if socket is None:
        return base
    return self.reader.combine(lambda a, b: (1 - share) * a + share * b, [base, self.reader.color(socket)], inside.node)


def diffuse_factor(roughness, specular):
    """The factor of the base colour in a mixture, for Burley's shader. Else 1."""
    return burley_albedo(round(roughness, 3)) / (1 - gloss_albedo(round(roughness, 3), round(specular, 3))) if OLD else 1.0


@lru_cache(maxsize=None)
def burley_albedo(roughness):
    """Albedo in uniform light of Burley's diffuse BRDF (2012), as in Cycles 3.4."""
    steps = (np.arange(32) + 0.5) / 32
    mu_o, mu_i, turn = np.meshgrid(steps, steps, np.pi * steps, indexing="ij")
    cosine = mu_o * mu_i + np.sqrt((1 - mu_o ** 2) * (1 - mu_i ** 2)) * np.cos(turn)
    fo, fi, retro = (1 - mu_o) ** 5, (1 - mu_i) ** 5, roughness * (cosine + 1)
    value = (1 - 0.5 * fo) * (1 - 0.5 * fi) + retro * (fo + fi + fo * fi * (retro - 1))
    return float((value * 4 * mu_o * mu_i).mean())


@lru_cache(maxsize=None)
def gloss_albedo(roughness, specular):
    """Albedo in uniform light of a GGX lobe with Schlick's Fresnel term, f0 = 0.08 specular. Samples visible normals."""
    if specular == 0:
        return 0.0
    f0, alpha = 0.08 * specular, max(roughness ** 2, 1e-4)
    steps = (np.arange(24) + 0.5) / 24
    mu, u, turn = np.meshgrid(steps, steps, 2 * np.pi * steps, indexing="ij")
    wo = np.stack([np.sqrt(1 - mu ** 2), np.zeros_like(mu), mu])
    stretched = wo * np.array([alpha, alpha, 1]).reshape(3, 1, 1, 1)
    stretched /= np.linalg.norm(stretched, axis=0)
    side = np.stack([np.zeros_like(mu), np.ones_like(mu), np.zeros_like(mu)])
    other = np.cross(stretched, side, axis=0)
    r, s = np.sqrt(u), 0.5 * (1 + stretched[2])
    x = r * np.cos(turn)
    y = (1 - s) * np.sqrt(np.maximum(1 - x * x, 0)) + s * r * np.sin(turn)
    z = np.sqrt(np.maximum(1 - x * x - y * y, 0))
    half = side * x + other * y + stretched * z
    half = half * np.array([alpha, alpha, 1]).reshape(3, 1, 1, 1)
    half /= np.linalg.norm(half, axis=0)
    dot = (wo * half).sum(axis=0)
    wi = 2 * dot * half - wo
    mu_i = wi[2]

    def lam(c):
        c2 = np.maximum(c * c, 1e-12)
        return 0.5 * (np.sqrt(1 + alpha ** 2 * (1 - c2) / c2) - 1)
    shadow = (1 + lam(mu)) / (1 + lam(mu) + lam(np.maximum(mu_i, 1e-6)))
    fresnel = f0 + (1 - f0) * (1 - np.clip(dot, 0, 1)) ** 5
    return float((np.where(mu_i > 0, fresnel * shadow, 0) * 2 * mu).mean())
