"""Materials: lists of closures as the document's materials."""
from dataclasses import dataclass

import numpy as np

from .anisotropy import Direction, follows, parameters
from .closures import ClosureReader
from .nodes import output_of
from .normals import read_displacement, read_normal
from .principled import OLD, OLD_DIFFUSE, SHEEN_COLOR, SHEEN_ROUGHNESS, diffuse_factor
from .textures import Textures
from .values import Value, ValueReader, constant, luminance

LEAST_GLOSS = 0.01  # roughness below which a glossy shader becomes a mirror
SCHLICK_MEAN = 1 / 21  # mean of (1 − cos)⁵ in uniform light


@dataclass
class Made:
    """A material of the document, and what its meshes need."""
    document: dict
    placement: object = None  # of the texture coordinates
    colors: str | None = None
    direction: object = None  # along which facets are rougher, if there are no texture coordinates

    def uses_generated(self):
        """Whether its meshes need generated coordinates."""
        return (self.placement or self.direction or Direction("", "")).kind in ("GENERATED", "RADIAL")


class Materials:
    """The document's materials, by the name of Blender's material."""

    def __init__(self, files, notices):
        self.textures = Textures(files, notices)
        self.notices = notices
        self.made = {}
        self.names = set()

    def of(self, material):
        """The document's material for one of Blender's. For None it is grey, as in Cycles."""
        key = material.name_full if material is not None else None
        if key not in self.made:
            self.notices.about = f"material {material.name}" if material is not None else "objects without a material"
            name = self.unique(material.name if material is not None else "no material")
            self.made[key] = MaterialMaker(name, self.textures, self.notices).make(material)
        return self.made[key]

    def unique(self, name):
        fitting = "".join("_" if c.isspace() and c != " " or c in "#\\" else c for c in name).strip() or "material"
        while fitting in self.names:
            fitting += "'"
        self.names.add(fitting)
        return fitting

    def documents(self):
        return [made.document for made in self.made.values()]


class MaterialMaker:
    def __init__(self, name, textures, notices):
        self.name = name
        self.notices = notices
        self.reader = ValueReader(notices)
        self.uses = textures.of_material()
        self.document = {"name": name}
        self.colors = None
        self.direction = None

    def make(self, material):
        if material is None:
            self.diffuse(constant(0.8), None)
        elif not material.use_nodes or material.node_tree is None:
            self.diffuse(constant(*material.diffuse_color[:3]), None)
        else:
            self.from_nodes(material)
        if self.direction is not None and self.uses.placement is not None:
            if not follows(self.direction, self.uses.placement):
                self.notices.here("left out: the direction of its anisotropy. It is that of u of its images")
            self.direction = None
        return Made(self.document, self.uses.placement, self.colors, self.direction)

    def from_nodes(self, material):
        end = output_of(material.node_tree)
        surface = ClosureReader(self.reader).read(end.inputs["Surface"]) if end is not None else []
        if end is not None and end.inputs["Volume"].is_linked:
            volume = end.inputs["Volume"].links[0].from_node
            self.notices.node(volume, "left out: Lightmill has no volume shaders")
            if not end.inputs["Surface"].is_linked:
                self.document.update({"diffuse": {"reflectance": black()}, "opacity": {"value": 0}})
                return
        self.fit(surface)
        normals = [c.normal for c in surface if c.normal is not None and c.normal.node() is not None]
        if normals:
            read_normal(self, normals, len(normals) == len([c for c in surface if c.normal is not None]))
        if end is not None and end.inputs["Displacement"].is_linked:
            read_displacement(self, material, end.inputs["Displacement"], bool(normals))

    # Opacity, emission and reflection of a list of closures.

    def fit(self, closures):
        holes = [c for c in closures if c.kind == "transparent"]
        glow = [c for c in closures if c.kind == "emission"]
        solid = [c for c in closures if c.kind not in ("transparent", "emission")]
        opacity = self.opacity(holes, [*solid, *glow])
        share = max(float(opacity.mean().mean()), 1e-6)
        self.solid([(c, self.share(c, opacity, share)) for c in solid])
        if glow:
            self.glow(glow, opacity, share)

    def share(self, closure, opacity, mean_opacity):
        """A closure's share in the opaque part: 1 if its weight is the opacity itself."""
        if closure.weight is opacity:
            return 1.0
        return float(self.reader.even(closure.weight, closure.node).mean()) / mean_opacity

    def opacity(self, holes, others):
        """1 − the weight of the transparent closures."""
        if not holes:
            return constant(1.0)
        for hole in holes:
            if not (hole.color.is_constant() and np.all(hole.color.rgb == 1)):
                self.notices.node(hole.node, "its colour does not tint what is behind it. Its luminance is the "
                                  "transparency")
        clear = len(holes) == 1 and holes[0].color.is_constant() and np.all(holes[0].color.rgb == 1)
        if clear and len({id(c.weight) for c in others}) == 1:
            value = others[0].weight
        else:
            total = constant(0.0)
            for hole in holes:
                weight = self.reader.multiply(hole.weight, self.gray(hole.color, hole.node), hole.node)
                total = self.reader.combine(lambda a, b: a + b, [total, weight], hole.node)
            value = self.reader.combine(lambda a: np.clip(1 - a, 0, 1), [total], holes[0].node)
        self.document["opacity"] = self.scalar(value, holes[0].node, "value", "map")
        return value

    def gray(self, value, node):
        return value if np.ptp(value.rgb) == 0 and value.is_constant() else self.reader.combine(luminance, [value], node)

    def glow(self, closures, opacity, share):
        total, node = None, closures[0].node
        for closure in closures:
            color = closure.color if closure.weight is opacity else closure.weight_color(self.reader)
            if closure.weight is not opacity:
                color = Value(color.rgb / share, color.image, color.colors)
            total = color if total is None else self.reader.combine(lambda a, b: a + b, [total, color], closure.node)
        if total.colors is not None:
            total = constant(*self.reader.even(total, node))
        if np.any(total.rgb < 0):
            self.notices.node(node, "its negative emission is treated as 0")
            total = Value(np.maximum(total.rgb, 0), total.image)
        if np.all(total.rgb == 0):
            return
        self.document["emission"] = self.color(total, node, limit=None)
        self.document["two_sided_emission"] = True

    def solid(self, parts):
        parts = [(c, share) for c, share in parts if share > 0]
        total = sum(share for _, share in parts)
        if total > 1 + 1e-6:
            self.notices.node(parts[0][0].node, "the sum of shaders reflects more light than arrives. All of them are "
                              "scaled down")
            parts = [(c, share / total) for c, share in parts]
        if not parts:
            self.diffuse(constant(0.0), None)
        elif len(parts) == 1:
            self.single(*parts[0])
        elif all(c.kind == "diffuse" for c, _ in parts):
            self.diffuse(self.sum_of_colors(parts), parts[0][0].node, self.common_roughness(parts), mixed=True)
        else:
            self.mixture(parts)

    def sum_of_colors(self, parts):
        total = constant(0.0)
        for closure, share in parts:
            total = self.reader.combine(lambda a, b, share=share: a + share * b, [total, closure.color], closure.node)
        return total

    def common_roughness(self, parts):
        """The roughness that all diffuse closures have, or its mean, with a notice."""
        given = [closure.numbers.get("roughness", constant(0.0)) for closure, _ in parts]
        if all(value.rgb[0] == given[0].rgb[0] and value.image == given[0].image and value.colors == given[0].colors for value in given):
            return given[0]
        self.notices.here("its diffuse shaders get the mean of their roughnesses")
        total = sum(share for _, share in parts)
        return constant(sum(float(self.reader.even(value, closure.node)[0]) * share / total
                            for value, (closure, share) in zip(given, parts)))

    # One closure.

    def single(self, closure, share):
        color = Value(closure.color.rgb * share, closure.color.image, closure.color.colors)
        if closure.kind == "diffuse":
            self.diffuse(color, closure.node, closure.numbers.get("roughness"), mixed=share < 1 - 1e-6)
        elif closure.kind == "glossy":
            self.glossy(closure, color)
        elif closure.kind == "glass" and share > 1 - 1e-6:
            self.glass(closure, color)
        elif closure.kind == "principled" and share > 1 - 1e-6:
            self.principled(closure.node, color, closure.numbers)
        else:
            self.notices.node(closure.node, f"its share {share:.3g} scales only its colour")
            params = self.as_principled(closure)
            self.principled(closure.node, color, params)

    def diffuse(self, color, node, roughness=None, mixed=False):
        out = {"reflectance": self.color(color, node, vertex=True)}
        if roughness is not None and is_rough(roughness):
            out.update(self.scalar(roughness, node, "roughness"))
            self.rough(not OLD_DIFFUSE)
            if mixed and not OLD_DIFFUSE:  # light between facets is not linear in the colour
                self.notices.here("its rough diffuse shaders are replaced by one with their mean colour")
        self.document["diffuse"] = out

    def glossy(self, closure, color):
        rough = closure.numbers["roughness"]
        if rough.is_constant() and rough.rgb[0] < LEAST_GLOSS:
            self.document["mirror"] = {"reflectance": self.color(color, closure.node, vertex=True)}
            return
        self.principled(closure.node, *self.metal(closure, color))

    def metal(self, closure, color):
        """A metal with the mean reflectance of a glossy shader, whose own reflectance is the same at all angles."""
        if not np.all(color.rgb == 1) or color.image is not None:
            self.notices.node(closure.node, "it is brighter at grazing angles than in Blender, and darker elsewhere. The mean is "
                              "the same")
            color = Value(np.maximum((color.rgb - SCHLICK_MEAN) / (1 - SCHLICK_MEAN), 0), color.image, color.colors)
        return color, self.as_principled(closure)

    def glass(self, closure, color):
        rough = closure.numbers["roughness"]
        white = color.is_constant() and np.all(color.rgb == 1)
        if not white:
            self.notices.node(closure.node, "left out: the colour of its reflections")
            self.principled(closure.node, color, self.as_principled(closure))
            return
        self.without_holes(closure.node)
        out = {"ior": fitting_ior(closure.numbers["ior"])}
        if not (rough.is_constant() and rough.rgb[0] == 0):
            if OLD:
                self.notices.node(closure.node, "this rough glass loses less light than in this version of Blender")
            out.update(self.scalar(rough, closure.node, "roughness"))
            self.rough(closure.numbers["multiple"])
        self.document["dielectric"] = out

    def without_holes(self, node):
        if self.document.pop("opacity", None) is not None:
            self.notices.node(node, "left out: its opacity. Glass materials have none")

    def rough(self, multiple):
        if not multiple:
            self.document["single_scattering"] = True

    def as_principled(self, closure):
        """The parameters of the principled shader that is nearest to a closure."""
        zero = constant(0.0)
        plain = {"metallic": zero, "roughness": constant(1.0), "transmission": 0.0, "specular": 0.0, "ior": 1.5, "coat": 0.0,
                 "coat_roughness": 0.0, "multiple": False, "lambert": True}
        if closure.kind == "principled":
            return closure.numbers
        if closure.kind == "glossy":
            return {**plain, "metallic": constant(1.0), **closure.numbers}
        if closure.kind == "glass":
            return {**plain, "transmission": 1.0, "specular": 0.5, **closure.numbers}
        return plain

    def principled(self, node, color, numbers):
        metallic, ior, specular = numbers["metallic"], numbers["ior"], numbers["specular"]
        burley = OLD and not numbers.get("lambert")
        if burley:
            ior, specular = self.old_gloss(numbers)
        roughness, directed = self.anisotropic(node, numbers["roughness"], numbers.get("anisotropy"))
        out = {"base_color": self.color(color, node, vertex=True),
               "specular": specular, "transmission": numbers["transmission"], "ior": fitting_ior(ior),
               "coat": numbers["coat"], "coat_roughness": numbers["coat_roughness"],
               **self.scalar(roughness, node, "roughness"), **self.scalar(metallic, node, "metallic"), **directed,
               **self.sheen(color, node, numbers)}
        if burley and numbers["transmission"] < 1 and float(metallic.mean()[0]) < 1:
            out["burley_diffuse"] = True
        self.document["principled"] = out
        if numbers["transmission"] > 0:
            self.without_holes(node)
        self.rough(numbers["multiple"])

    def anisotropic(self, node, roughness, anisotropy):
        """The roughness in the document, and the fields of the anisotropy."""
        if anisotropy is None or roughness.rgb[0] == 0:
            return roughness, {}
        across, fields = parameters(anisotropy, float(np.clip(roughness.rgb[0], 0, 1)))
        if fields:
            self.direction = anisotropy.direction
            if roughness.image is not None:
                self.notices.node(node, "where its image makes it smoother, its highlights are longer than in Blender")
            if anisotropy.direction.kind == "UV" and 4 * anisotropy.rotation % 1 != 0:
                self.notices.node(node, "where the UV map is mirrored, its anisotropy is rotated the other way than in Blender")
        return Value(np.full(3, across), roughness.image, roughness.colors), fields

    def sheen(self, color, node, numbers):
        """The sheen that has the albedo of Burley's. His is of the diffuse part alone, and takes no light from it."""
        plastic = (1 - float(numbers["metallic"].mean()[0])) * (1 - numbers["transmission"])
        covered = 1 - numbers["transmission"] * (1 - float(numbers["metallic"].mean()[0]))
        if numbers.get("sheen", 0) == 0 or plastic == 0:
            return {}
        self.notices.node(node, "its sheen is that of glTF, which has nearly the same albedo at each angle")
        amount, tint = numbers["sheen"] * SHEEN_COLOR * plastic / covered, numbers["sheen_tint"]
        if tint == 0:
            return {"sheen_color": {"rgb": [amount] * 3}, "sheen_roughness": SHEEN_ROUGHNESS}
        tinted = self.reader.combine(lambda c: amount * (1 - tint + tint * hue(c)), [color], node)
        return {"sheen_color": self.color(tinted, node), "sheen_roughness": SHEEN_ROUGHNESS}

    def old_gloss(self, numbers):
        """The `ior` and `specular` for a shader of Blender before 4.0, whose specular part has its own index of refraction."""
        ior, specular, transmission = numbers["ior"], numbers["specular"], numbers["transmission"]
        if transmission == 0:
            ior = 1.5
        elif transmission < 1 and abs(ior - 1) > 1e-3:
            specular = min(specular * 0.04 / ((ior - 1) / (ior + 1)) ** 2, 1.0)
        return ior, specular

    def lambert_factor(self, color, numbers):
        """The factor of a principled shader's base colour in a mixture."""
        diffuse_share = (1 - float(numbers["metallic"].mean()[0])) * (1 - numbers["transmission"])
        rough = float(numbers["roughness"].mean()[0])
        factor = 1 + diffuse_share * (diffuse_factor(rough, numbers["specular"]) - 1)
        if abs(factor - 1) > 5e-3 and np.any(color.rgb > 0):
            self.notices.add("Principled shaders in mixtures have Lambert's diffuse part. In this version of Blender it is "
                             "Burley's. Their colours are scaled to reflect the same share of uniform light")
        if color.image is None and np.any(color.rgb * factor > 1):
            self.notices.here("its bright colour reflects more light than arrives in Blender, but not in Lightmill")
        return factor

    def mixture(self, parts):
        """Makes one principled material of several closures. Adds shares and colours, and averages the other parameters."""
        names = ", ".join(sorted({c.node.name for c, _ in parts}))
        self.notices.here(f"the mixture of {names} is replaced by one principled material with their mean colour")
        total = sum(share for _, share in parts)
        params = [(self.as_principled(c), share / total, c) for c, share in parts]
        mean = {}
        for name in ("transmission", "specular", "ior", "coat", "coat_roughness"):
            mean[name] = sum(p[name] * share for p, share, _ in params)
        for name in ("metallic", "roughness"):
            mean[name] = constant(sum(float(self.reader.even(p[name], c.node)[0]) * share for p, share, c in params))
        shiny = [(p, share, c) for p, share, c in params if c.kind != "diffuse"]
        if shiny:
            weight = sum(share for _, share, _ in shiny)
            mean["roughness"] = constant(sum(float(self.reader.even(p["roughness"], c.node)[0]) * share for p, share, c in shiny)
                                         / weight)
        mean["multiple"] = all(p["multiple"] for p, _, _ in params)
        mean["lambert"] = True
        color = constant(0.0)
        for p, share, closure in params:
            own = closure.color
            if not p.get("lambert"):
                factor = self.lambert_factor(own, p)
                own = Value(own.rgb * factor, own.image, own.colors)
            if closure.kind == "diffuse" and is_rough(closure.numbers.get("roughness", constant(0.0))):
                self.notices.node(closure.node, "its roughness is left out of the mixture")
            color = self.reader.combine(lambda a, b, share=share: a + share * b, [color, own], closure.node)
            for name in ("anisotropy", "sheen"):
                if p.get(name):
                    self.notices.node(closure.node, f"its {name} is left out of the mixture")
        scale = min(total, 1.0)
        self.principled(parts[0][0].node, Value(color.rgb * scale, color.image, color.colors), mean)

    # Values in the document's form.

    def color(self, value, node, vertex=False, limit=1.0):
        rgb = np.maximum(value.rgb, 0)
        if limit is not None and value.image is not None and np.any(rgb > limit):  # texels may have room for it
            value = self.reader.combine(lambda c: np.clip(c, 0, limit), [value], node)
            rgb = value.rgb
        if limit is not None and np.any(rgb > limit + 1e-6):
            self.notices.node(node, f"its colour is above {limit:g}, and is limited to that")
        rgb = rgb if limit is None else np.minimum(rgb, limit)
        out = {"rgb": [float(c) for c in rgb]}
        if value.colors is not None and vertex:
            self.colors = value.colors
        if value.image is not None:
            use = value.image
            if use.channel != "COLOR":
                use = use.with_texels(use.texels())
            out["texture"] = self.uses.add(use, node)
        return out

    def scalar(self, value, node, name, map_name=None):
        """A number, and its map."""
        number = float(np.clip(value.rgb[0], 0, 1))
        if value.image is None or number == 0:
            return {name: number}
        channel = value.image.channel if value.image.channel != "COLOR" else "LUMINANCE"
        mapped = {"texture": self.uses.add(value.image, node), "channel": channel}
        if map_name is not None:
            return {name: number, map_name: mapped}
        self.document[f"{name}_map"] = mapped
        return {name: number}


def is_rough(value):
    return not value.is_constant() or value.rgb[0] > 0


def hue(rgb):
    """Colours scaled to luminance 1. White for black."""
    gray = luminance(rgb)
    return np.where(gray > 0, rgb / np.where(gray > 0, gray, 1), 1)


def fitting_ior(ior):
    return min(max(ior, 1e-3), 10.0)


def black():
    return {"rgb": [0, 0, 0]}
