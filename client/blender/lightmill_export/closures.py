"""Shader nodes as surfaces (see mixtures.py)."""
import bpy
import numpy as np

from . import anisotropy, subsurface
from .fresnel import fresnel_of
from .mixtures import Closure, Surface, add, black, diffuse as matt, mix
from .nodes import Input, Node
from .values import Value, constant, luminance

OLD_DIFFUSE = bpy.app.version < (4, 3, 0)  # rough diffuse shaders have no multiple scattering between facets


class ClosureReader:
    def __init__(self, reader):
        self.reader = reader
        self.notices = reader.notices
        self.normals = []  # inputs for them

    def read(self, socket):
        """The surface at a shader input of an output node."""
        return self.walk(Input(socket))

    def walk(self, socket):
        node, _output, groups = socket.source()
        if node is None:
            return black()
        inside = Node(node, groups)
        if node.type == "MIX_SHADER":
            return self.mixed(inside)
        if node.type == "ADD_SHADER":
            return add(self.reader, node, self.walk(inside.input(0)), self.walk(inside.input(1)))
        if node.type in SHADERS:
            surface = SHADERS[node.type](self, inside)
            inside.name_unread(self.notices)
            return surface
        self.notices.node(node, "left out: Lightmill has no such shader, and shows black")
        return black(node)

    def mixed(self, inside):
        fresnel = fresnel_of(self.reader, inside.input(0))
        if fresnel is not None:
            first, second = self.walk(inside.input(1)), self.walk(inside.input(2))
            plastic = fresnel.plastic(self.notices, first, second)
            if plastic is None:
                return mix(self.reader, inside.node, self.factor(inside), first, second)
            self.normals += [normal for normal in [fresnel.normal()] if normal is not None]
            return plastic
        factor = self.factor(inside)
        if factor.is_constant() and factor.rgb[0] in (0, 1):
            return self.walk(inside.input(1 if factor.rgb[0] == 0 else 2))
        return mix(self.reader, inside.node, factor, self.walk(inside.input(1)), self.walk(inside.input(2)))

    def factor(self, inside):
        factor = self.reader.scalar(inside.input(0))
        if factor.image is None or factor.image.pixels is not None or factor.rgb[0] > 1:
            return self.reader.combine(lambda f: np.clip(f, 0, 1), [factor], inside.node)
        return factor

    def one(self, kind, inside, numbers, color=None):
        normal = inside.input("Normal")
        if normal is not None:
            self.normals.append(normal)
        closure = Closure(kind, inside.node, color or self.reader.color(inside.input("Color", "Base Color")), numbers)
        return Surface(inside.node, constant(1.0), constant(0.0), closure)

    def radiance(self, socket, text):
        """The light that leaves a surface of a world or light. Adds this text as a notice on shaders that only reflect light."""
        surface = self.read(socket)
        for closure in surface.reflection.leaves():
            if not closure.is_black():
                self.notices.node(closure.node, text)
        return self.reader.multiply(surface.opacity, surface.radiance, surface.node), surface.node

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


def diffuse(self, inside):
    return self.one("diffuse", inside, {"roughness": roughness(self, inside), "multiple": not OLD_DIFFUSE})


def replaced_by_diffuse(text):
    """Reader of a shader that is replaced by a diffuse one."""
    def read(self, inside):
        self.notices.node(inside.node, f"left out: Lightmill has no such shader, and uses a diffuse one. {text}")
        return self.one("diffuse", inside, matt(None).numbers)
    return read


def translucent(self, inside):
    out = self.one("diffuse", inside, {"roughness": constant(0.0), "multiple": not OLD_DIFFUSE}, constant(0.0))
    out.reflection.transmittance = self.reader.color(inside.input("Color"))
    return out


def distribution(self, inside, exact):
    """Whether the shader has multiple scattering between microfacets."""
    kind = inside.node.distribution
    if kind not in exact:
        self.notices.node(inside.node, f"its distribution {kind} is replaced by GGX")
    return kind == "MULTI_GGX"


def roughness(self, inside):
    value = self.reader.scalar(inside.input("Roughness"))
    return Value(np.clip(value.rgb, 0, 1)) if value.is_constant() else value


def glossy(self, inside):
    sharp = inside.node.distribution == "SHARP"
    rough = constant(0.0) if sharp else roughness(self, inside)
    smooth = rough.is_constant() and rough.rgb[0] == 0
    multiple = distribution(self, inside, ("SHARP", "GGX", "MULTI_GGX") + (("BECKMANN", "ASHIKHMIN_SHIRLEY") if smooth else ()))
    directed = anisotropy.of_glossy(self.reader, inside) if "Anisotropy" in inside.node.inputs else None
    return self.one("glossy", inside, {"roughness": rough, "multiple": multiple, "anisotropy": directed})


def glass(self, inside):
    sharp = inside.node.distribution == "SHARP"
    rough = constant(0.0) if sharp else roughness(self, inside)
    smooth = rough.is_constant() and rough.rgb[0] == 0
    multiple = distribution(self, inside, ("SHARP", "GGX", "MULTI_GGX") + (("BECKMANN",) if smooth else ()))
    if inside.node.type == "BSDF_REFRACTION":
        self.notices.node(inside.node, "it is replaced by glass, which also reflects")
    return self.one("glass", inside, {"roughness": rough, "multiple": multiple,
                                      "ior": self.reader.number(inside.input("IOR"), inside.node)})


def transparent(self, inside):
    color, out = self.reader.color(inside.input("Color")), black(inside.node)
    if not (color.is_constant() and np.all(color.rgb == 1)):
        self.notices.node(inside.node, "its colour does not tint what is behind it. Its luminance is the transparency")
    out.opacity = self.reader.combine(lambda c: np.clip(1 - luminance(c), 0, 1), [color], inside.node)
    return out


def emission(self, inside):
    out = black(inside.node)
    out.radiance = self.reader.multiply(self.reader.color(inside.input("Color")), self.reader.scalar(inside.input("Strength")),
                                        inside.node)
    return out


def hold_out(self, inside):
    self.notices.node(inside.node, "it is black, not a hole in the picture as in Blender")
    return black(inside.node)


def principled(self, inside):
    from .principled import read
    return read(self, inside)


SHADERS = {
    "BSDF_DIFFUSE": diffuse, "BSDF_GLOSSY": glossy, "BSDF_ANISOTROPIC": glossy, "BSDF_GLASS": glass,
    "BSDF_REFRACTION": glass, "BSDF_TRANSPARENT": transparent, "BSDF_PRINCIPLED": principled, "EMISSION": emission,
    "BACKGROUND": emission, "HOLDOUT": hold_out, "BSDF_TRANSLUCENT": translucent,
    "SUBSURFACE_SCATTERING": subsurface.read,
    "BSDF_VELVET": replaced_by_diffuse("It has no sheen"), "BSDF_SHEEN": replaced_by_diffuse("It has no sheen"),
    "BSDF_TOON": replaced_by_diffuse("Its shading has no steps"),
    "BSDF_HAIR": replaced_by_diffuse("It has no highlight"), "BSDF_HAIR_PRINCIPLED": replaced_by_diffuse("It has no highlight"),
    "EEVEE_SPECULAR": replaced_by_diffuse("Cycles does not support it"),
}
