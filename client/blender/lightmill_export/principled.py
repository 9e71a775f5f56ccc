"""Blender's principled shader as parameters of Lightmill's.

Before Blender 4.0 it is Burley's: its diffuse part is not Lambert's, and is not reduced by the light that the specular part
reflects. Documents have this variant too (burley_diffuse).
"""
from dataclasses import dataclass, field

import bpy
import numpy as np

from . import anisotropy
from .subsurface import body
from .values import Value, constant, equal, hue

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

    images = {}

    def layer(name, *sockets, factor=1.0):
        """The mean of a number. If it has an image, that is in `images`, too."""
        value = scalar(*sockets)
        if value.image is None or value.colors is not None:
            return min(max(float(reader.even(value, node)[0]), 0.0), 1.0) * factor
        images[name] = Value(value.rgb * factor, value.image)
        return min(max(float(value.mean()[0]), 0.0), 1.0) * factor
    self.without(inside, "Sheen Weight", "Thin Film Thickness", "Diffuse Roughness")
    metallic, transmission, opacity = scalar("Metallic"), number("Transmission Weight", "Transmission"), scalar("Alpha")
    skin = Skin(reader.color(inside.input("Base Color")))
    if transmission < 1 and not equal(metallic, constant(1.0)):
        skin = subsurface(self, inside, skin.base, metallic, equal(opacity, constant(1.0)))
    numbers = {"metallic": metallic, "roughness": scalar("Roughness"), "transmission": transmission,
               "specular": layer("specular", "Specular IOR Level", "Specular"), "ior": reader.number(inside.input("IOR"), node),
               "coat": layer("coat", "Coat Weight", "Clearcoat", factor=OLD_COAT if OLD else 1.0),
               "coat_roughness": layer("coat_roughness", "Coat Roughness", "Clearcoat Roughness"), "images": images,
               "multiple": node.distribution == "MULTI_GGX", **gloss_color(reader, inside, skin.base),
               **sheen(reader, inside), **skin.numbers}
    if numbers["transmission"] > 0:
        self.without(inside, "Anisotropic")
    else:
        numbers["anisotropy"] = anisotropy.of_principled(reader, inside)
    details(self, inside, numbers)
    out = self.one("principled", inside, numbers, skin.base)
    out.reflection.transmittance = skin.transmittance
    out.opacity = opacity
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


def gloss_color(reader, inside, base):
    """The colour of the gloss at normal incidence. Before Blender 4.0 it is mixed from white and the hue of the base."""
    socket = inside.input("Specular Tint")
    if not OLD:
        value = reader.color(socket)
        return {} if equal(value, constant(1.0)) else {"gloss_color": value}
    tint = min(max(reader.number(socket, inside.node), 0.0), 1.0)
    return {"gloss_color": reader.combine(lambda c: 1 - tint + tint * hue(c), [base], inside.node)} if tint > 0 else {}


def sheen(reader, inside):
    """Amount and tint of the sheen of Blender before 4.0."""
    if not OLD:
        return {}
    amount, tint = (min(max(reader.number(inside.input(name), inside.node), 0.0), 1.0) for name in ("Sheen", "Sheen Tint"))
    return {"sheen": amount, "sheen_tint": tint} if amount > 0 else {}


@dataclass
class Skin:
    """What subsurface scattering changes: the base colour, the transmittance, and further parameters."""
    base: Value
    transmittance: Value = field(default_factory=lambda: constant(0.0))
    numbers: dict = field(default_factory=dict)


def subsurface(self, inside, base, metallic, is_opaque):
    """Before Blender 4.0, the amount scales the radius and mixes two colours. Since then, it is a share of the diffuse part."""
    reader, node = self.reader, inside.node
    amount = min(max(reader.number(inside.input("Subsurface Weight", "Subsurface"), node), 0.0), 1.0)
    if amount == 0:
        return Skin(base)
    color, scale, share = base, 1.0, amount
    if OLD:
        other = reader.color(inside.input("Subsurface Color"))
        color, scale, share = reader.combine(lambda a, b: (1 - amount) * a + amount * b, [base, other], node), amount, 1.0
    if not is_opaque:
        self.notices.node(node, "its subsurface scattering is treated as diffuse reflection, because it has an opacity")
        return Skin(color)
    socket = inside.input("Subsurface Scale")
    radius = reader.even(reader.color(inside.input("Subsurface Radius")), node) * (
        scale if socket is None else max(reader.number(socket, node), 0.0))
    if share < 1 or not metallic.is_black():  # the image is that of the base
        inner = constant(*reader.even(color, node))
    else:
        inner = color
    skin = body(self, inside, node.subsurface_method, inner, radius, "Subsurface Anisotropy", "Subsurface IOR")
    if skin is None:
        return Skin(color)
    interior, transmittance = skin
    base = color if transmittance.is_constant() else constant(0.0)
    if share < 1:
        base, transmittance = partly(reader, node, color, share)
    return Skin(base, transmittance, {"interior": interior, "shown": color})


def partly(reader, node, color, share):
    """The base colour and transmittance of a body whose diffuse part is this share of subsurface scattering.

    With the colour c and the transmittance t, the surface reflects r = (1 - share) c to both sides. The body shows
    r + t² c / (1 - c r), which is c with this t. Then r + t is at most 1.
    """
    c = np.clip(color.mean(), 0, 1)
    through = np.sqrt(share * (1 - (1 - share) * c * c))
    kept = np.where(through < 1, (1 - share) / np.where(through < 1, 1 - through, 1), 0)
    return reader.combine(lambda texels: np.clip(kept * texels, 0, 1), [color], node), constant(*through)
