"""Shader nodes as a weighted list of closures, as Cycles flattens them."""
from dataclasses import dataclass, field

import numpy as np

from . import anisotropy
from .nodes import Input, Node
from .values import Value, constant


@dataclass
class Closure:
    kind: str           # diffuse, glossy, glass, principled, transparent, emission
    node: object
    weight: Value
    color: Value
    numbers: dict = field(default_factory=dict)  # by name: a Value, or a choice of the node
    normal: Input | None = None                  # its Normal input

    def weight_color(self, reader):
        return reader.multiply(self.weight, self.color, self.node)


class ClosureReader:
    def __init__(self, reader):
        self.reader = reader
        self.notices = reader.notices

    def read(self, socket):
        """Closures of a shader input of an output node."""
        return self.walk(Input(socket), constant(1.0))

    def walk(self, socket, weight):
        node, output, groups = socket.source()
        if node is None:
            return []
        inside = Node(node, groups)
        if node.type == "MIX_SHADER":
            factor = self.factor(inside)
            rest = self.reader.combine(lambda f: 1 - f, [factor], node)
            return (self.walk(inside.input(1), self.reader.multiply(weight, rest, node))
                    + self.walk(inside.input(2), self.reader.multiply(weight, factor, node)))
        if node.type == "ADD_SHADER":
            return self.walk(inside.input(0), weight) + self.walk(inside.input(1), weight)
        if weight.is_constant() and np.all(weight.rgb == 0):
            return []
        if node.type in SHADERS:
            closures = SHADERS[node.type](self, inside, weight)
            inside.name_unread(self.notices)
            return closures
        self.notices.node(node, "left out: Lightmill has no such shader, and shows black")
        return []

    def factor(self, inside):
        factor = self.reader.scalar(inside.input(0))
        return Value(np.clip(factor.rgb, 0, 1)) if factor.is_constant() else factor

    def one(self, kind, inside, weight, numbers=None):
        socket = inside.input("Color", "Base Color")
        return [Closure(kind, inside.node, weight, self.reader.color(socket), numbers or {}, inside.input("Normal"))]

    def without(self, inside, *names):
        """Adds notices that these inputs are left out, if they are linked or not 0."""
        for name in names:
            socket = inside.input(name)
            if socket is None:
                continue
            node, output, _groups = socket.source()
            if node is not None:
                self.notices.node(node, f"{name} of {inside.node.name} is treated as 0")
            elif output is not None and hasattr(output, "default_value") and np.any(np.array(output.default_value) != 0):
                self.notices.node(inside.node, f"{name} {shown(output.default_value)} is treated as 0")


def shown(value):
    return f"{value:g}" if isinstance(value, (int, float)) else "(" + ", ".join(f"{v:g}" for v in value) + ")"


def diffuse(self, inside, weight):
    return self.one("diffuse", inside, weight, {"roughness": roughness(self, inside)})


def replaced_by_diffuse(text):
    """Reader of a shader that is replaced by a diffuse one."""
    def read(self, inside, weight):
        self.notices.node(inside.node, f"left out: Lightmill has no such shader, and uses a diffuse one. {text}")
        return self.one("diffuse", inside, weight)
    return read


def distribution(self, inside, exact):
    """Whether the shader has multiple scattering between microfacets."""
    kind = inside.node.distribution
    if kind not in exact:
        self.notices.node(inside.node, f"its distribution {kind} is replaced by GGX")
    return kind == "MULTI_GGX"


def roughness(self, inside):
    value = self.reader.scalar(inside.input("Roughness"))
    return Value(np.clip(value.rgb, 0, 1)) if value.is_constant() else value


def glossy(self, inside, weight):
    sharp = inside.node.distribution == "SHARP"
    rough = constant(0.0) if sharp else roughness(self, inside)
    smooth = rough.is_constant() and rough.rgb[0] == 0
    multiple = distribution(self, inside, ("SHARP", "GGX", "MULTI_GGX") + (("BECKMANN", "ASHIKHMIN_SHIRLEY") if smooth else ()))
    directed = anisotropy.of_glossy(self.reader, inside) if "Anisotropy" in inside.node.inputs else None
    return self.one("glossy", inside, weight, {"roughness": rough, "multiple": multiple, "anisotropy": directed})


def glass(self, inside, weight):
    sharp = inside.node.distribution == "SHARP"
    rough = constant(0.0) if sharp else roughness(self, inside)
    smooth = rough.is_constant() and rough.rgb[0] == 0
    multiple = distribution(self, inside, ("SHARP", "GGX", "MULTI_GGX") + (("BECKMANN",) if smooth else ()))
    if inside.node.type == "BSDF_REFRACTION":
        self.notices.node(inside.node, "it is replaced by glass, which also reflects")
    return self.one("glass", inside, weight, {"roughness": rough, "multiple": multiple,
                                              "ior": self.reader.number(inside.input("IOR"), inside.node)})


def transparent(self, inside, weight):
    return self.one("transparent", inside, weight)


def emission(self, inside, weight):
    """`color` is the radiance."""
    radiance = self.reader.multiply(self.reader.color(inside.input("Color")), self.reader.scalar(inside.input("Strength")),
                                    inside.node)
    return [Closure("emission", inside.node, weight, radiance)]


def hold_out(self, inside, _weight):
    self.notices.node(inside.node, "it is black, not a hole in the picture as in Blender")
    return []


def principled(self, inside, weight):
    from .principled import read
    return read(self, inside, weight)


SHADERS = {
    "BSDF_DIFFUSE": diffuse, "BSDF_GLOSSY": glossy, "BSDF_ANISOTROPIC": glossy, "BSDF_GLASS": glass,
    "BSDF_REFRACTION": glass, "BSDF_TRANSPARENT": transparent, "BSDF_PRINCIPLED": principled, "EMISSION": emission,
    "BACKGROUND": emission, "HOLDOUT": hold_out,
    "BSDF_TRANSLUCENT": replaced_by_diffuse("No light passes through it"),
    "SUBSURFACE_SCATTERING": replaced_by_diffuse("It has no subsurface scattering"),
    "BSDF_VELVET": replaced_by_diffuse("It has no sheen"), "BSDF_SHEEN": replaced_by_diffuse("It has no sheen"),
    "BSDF_TOON": replaced_by_diffuse("Its shading has no steps"),
    "BSDF_HAIR": replaced_by_diffuse("It has no highlight"), "BSDF_HAIR_PRINCIPLED": replaced_by_diffuse("It has no highlight"),
    "EEVEE_SPECULAR": replaced_by_diffuse("Cycles does not support it"),
}
