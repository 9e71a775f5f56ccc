"""Blender's principled shader as parameters of Lightmill's.

Before Blender 4.0 it is Burley's: its diffuse part is not Lambert's, and is not reduced by the light that the specular part
reflects. Documents have this variant too (burley_diffuse).
"""
import bpy
import numpy as np

from . import anisotropy
from .values import Value

OLD = bpy.app.version < (4, 0, 0)
OLD_COAT = 0.25  # factor of the clearcoat's weight
# The sheen of Lightmill whose albedo is within 0.007 of that of Burley's sheen, (1 − cos)⁵, at all angles.
SHEEN_ROUGHNESS = 0.4
SHEEN_COLOR = 0.11


def read(self, inside):
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
    out = self.one("principled", inside, numbers, base)
    out.opacity = scalar("Alpha")
    out.radiance = reader.multiply(reader.color(inside.input("Emission Color", "Emission")),
                                   reader.scalar(inside.input("Emission Strength")), node)
    return out


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
