"""Plastic as files older than the principled shader have it: a diffuse and a glossy shader, mixed by the Fresnel reflectance."""
from dataclasses import replace

import numpy as np

from .math_nodes import fresnel, mean_over_hemisphere
from .mixtures import Closure
from .nodes import Node
from .values import constant, equal

MOST_IOR = 10.0  # of the document


class Fresnel:
    """The Fresnel reflectance at an input: a node and its index of refraction."""

    def __init__(self, inside, ior):
        self.inside = inside
        self.ior = ior

    def plastic(self, notices, first, second):
        """The surface that is `second` with this reflectance, and else `first`. None if that is no plastic."""
        matt, shiny = first.reflection, second.reflection
        if not (is_plain(first, "diffuse") and is_plain(second, "glossy")):
            return None
        interior = matt.numbers.get("interior")  # of subsurface scattering
        if interior is None and not matt.transmittance.is_black():
            return None
        color = shiny.color
        if not color.is_constant() or np.ptp(color.rgb) > 0 or shiny.numbers["anisotropy"] is not None:
            return None
        gray = float(color.rgb[0])
        if not 0 < gray <= 1 or interior is not None and gray < 1:
            return None
        rough = matt.numbers["roughness"]
        if not rough.is_constant() or rough.rgb[0] > 0:
            notices.node(matt.node, "its roughness is treated as 0, because it is the base of plastic")
        numbers = {"metallic": constant(0.0), "roughness": shiny.numbers["roughness"], "transmission": 0.0,
                   "specular": 0.5 * gray, "ior": self.ior, "coat": 0.0, "coat_roughness": 0.0,
                   "multiple": shiny.numbers["multiple"], "lambert": True}
        if interior is not None:
            numbers.update(interior=interior, shown=constant(*interior["subsurface"]["color"]["rgb"]))
        # Lightmill's base also gets the light that a grey gloss absorbs. It is darker, so that the mean is the same.
        mean = mean_over_hemisphere(lambda cosine: fresnel(cosine, self.ior))
        base = matt.scaled((1 - mean) / (1 - gray * mean))
        return replace(first, reflection=replace(base, kind="principled", numbers=numbers))

    def normal(self):
        """The input for its normal."""
        normal = self.inside.input("Normal")
        return normal if normal.node() is not None else None


def is_plain(surface, kind):
    """Whether a surface is one shader of this kind."""
    return (equal(surface.opacity, constant(1.0)) and surface.radiance.is_black() and isinstance(surface.reflection, Closure)
            and surface.reflection.kind == kind)


def fresnel_of(reader, socket):
    """The Fresnel reflectance at an input. None if it is another value, or has an index that plastic cannot have."""
    node, output, groups = socket.source()
    if node is None or node.type not in ("FRESNEL", "LAYER_WEIGHT") or output.name == "Facing":
        return None
    inside = Node(node, groups)
    value = reader.scalar(inside.input("IOR", "Blend"))
    if not value.is_constant():
        return None
    number = float(value.rgb[0])
    ior = number if node.type == "FRESNEL" else 1 / max(1 - number, 1e-5)
    return Fresnel(inside, ior) if 1 < ior <= MOST_IOR else None
