"""Materials: lists of closures as the document's materials."""
from dataclasses import dataclass

import numpy as np

from .bends import read_bend, read_displacement
from .closures import ClosureReader
from .nodes import output_of
from .principled import OLD, diffuse_factor
from .textures import Textures
from .values import Value, ValueReader, constant

LEAST_GLOSS = 0.01  # roughness below which ours is smooth
SCHLICK_MEAN = 1 / 21  # of (1 − cos)⁵ in even light


@dataclass
class Made:
    """A material of the document, and what its meshes need."""
    document: dict
    placement: object = None  # of the texture coordinates
    colors: str | None = None


class Materials:
    """All materials of a scene, by Blender's."""

    def __init__(self, files, notices):
        self.textures = Textures(files, notices)
        self.notices = notices
        self.made = {}
        self.names = set()

    def of(self, material):
        """The material's entry. None is Cycles' own: a grey one."""
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

    def make(self, material):
        if material is None:
            self.diffuse(constant(0.8), None)
        elif not material.use_nodes or material.node_tree is None:
            self.diffuse(constant(*material.diffuse_color[:3]), None)
        else:
            self.from_nodes(material)
        return Made(self.document, self.uses.placement, self.colors)

    def from_nodes(self, material):
        end = output_of(material.node_tree)
        surface = ClosureReader(self.reader).read(end.inputs["Surface"]) if end is not None else []
        if end is not None and end.inputs["Volume"].is_linked:
            volume = end.inputs["Volume"].links[0].from_node
            self.notices.node(volume, "left out: surfaces have no volume here")
            if not end.inputs["Surface"].is_linked:
                self.document.update({"diffuse": {"reflectance": black()}, "opacity": {"value": 0}})
                return
        self.fit(surface)
        bends = [c.bend for c in surface if c.bend is not None and c.bend.node() is not None]
        if bends:
            read_bend(self, bends, len(bends) == len([c for c in surface if c.bend is not None]))
        if end is not None and end.inputs["Displacement"].is_linked:
            read_displacement(self, material, end.inputs["Displacement"], bool(bends))

    # The parts of the list.

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
        """A closure's share in what is opaque: 1 if the opacity is its weight."""
        if closure.weight is opacity:
            return 1.0
        return float(self.reader.even(closure.weight, closure.node).mean()) / mean_opacity

    def opacity(self, holes, others):
        """1 − the weight of the holes."""
        if not holes:
            return constant(1.0)
        for hole in holes:
            if not (hole.color.is_constant() and np.all(hole.color.rgb == 1)):
                self.notices.node(hole.node, "left out: its colour. What is behind is seen through a hole here, whose share "
                                  "is the colour's luminance")
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
        from .values import luminance
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
            self.notices.node(node, "left out: its negative emission counts as 0")
            total = Value(np.maximum(total.rgb, 0), total.image)
        if np.all(total.rgb == 0):
            return
        self.document["emission"] = self.color(total, node, limit=None)
        self.document["two_sided_emission"] = True

    def solid(self, parts):
        parts = [(c, share) for c, share in parts if share > 0]
        total = sum(share for _, share in parts)
        if total > 1 + 1e-6:
            self.notices.node(parts[0][0].node, "left out: it gives more light than arrives. All shaders of the sum are weaker "
                              "here")
            parts = [(c, share / total) for c, share in parts]
        if not parts:
            self.diffuse(constant(0.0), None)
        elif len(parts) == 1:
            self.single(*parts[0])
        elif all(c.kind == "diffuse" for c, _ in parts):
            self.diffuse(self.sum_of_colors(parts), parts[0][0].node)
        else:
            self.mixture(parts)

    def sum_of_colors(self, parts):
        total = constant(0.0)
        for closure, share in parts:
            total = self.reader.combine(lambda a, b, share=share: a + share * b, [total, closure.color], closure.node)
        return total

    # One closure.

    def single(self, closure, share):
        color = Value(closure.color.rgb * share, closure.color.image, closure.color.colors)
        if closure.kind == "diffuse":
            self.diffuse(color, closure.node)
        elif closure.kind == "glossy":
            self.glossy(closure, color)
        elif closure.kind == "glass" and share > 1 - 1e-6:
            self.glass(closure, color)
        elif closure.kind == "principled" and share > 1 - 1e-6:
            self.principled(closure.node, color, closure.numbers)
        else:
            self.notices.node(closure.node, f"only its colour is scaled with its share, {share:.3g}")
            params = self.as_principled(closure)
            self.principled(closure.node, color, params)

    def diffuse(self, color, node):
        self.document["diffuse"] = {"reflectance": self.color(color, node, vertex=True)}

    def glossy(self, closure, color):
        rough = closure.numbers["roughness"]
        if rough.is_constant() and rough.rgb[0] < LEAST_GLOSS:
            self.document["mirror"] = {"reflectance": self.color(color, closure.node, vertex=True)}
            return
        self.principled(closure.node, *self.metal(closure, color))

    def metal(self, closure, color):
        """A metal with the mean reflectance of the glossy shader, which has the same at all angles."""
        if not np.all(color.rgb == 1) or color.image is not None:
            self.notices.node(closure.node, "it is brighter at grazing angles here, and darker elsewhere: the mean is the same")
            color = Value(np.maximum((color.rgb - SCHLICK_MEAN) / (1 - SCHLICK_MEAN), 0), color.image, color.colors)
        return color, self.as_principled(closure)

    def glass(self, closure, color):
        rough = closure.numbers["roughness"]
        white = color.is_constant() and np.all(color.rgb == 1)
        if not white:
            self.notices.node(closure.node, "its reflections have no colour here")
            self.principled(closure.node, color, self.as_principled(closure))
            return
        self.without_holes(closure.node)
        out = {"ior": fitting_ior(closure.numbers["ior"])}
        if not (rough.is_constant() and rough.rgb[0] == 0):
            if OLD:
                self.notices.node(closure.node, "rough glass loses less light here than in this version of Blender")
            out.update(self.scalar(rough, closure.node, "roughness"))
            self.rough(closure.numbers["multiple"])
        self.document["dielectric"] = out

    def without_holes(self, node):
        if self.document.pop("opacity", None) is not None:
            self.notices.node(node, "left out: its holes. Glass has none")

    def rough(self, multiple):
        if not multiple:
            self.document["single_scattering"] = True

    def as_principled(self, closure):
        """The numbers of a principled shader that is nearest to a closure."""
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
        out = {"base_color": self.color(color, node, vertex=True),
               "specular": specular, "transmission": numbers["transmission"], "ior": fitting_ior(ior),
               "coat": numbers["coat"], "coat_roughness": numbers["coat_roughness"],
               **self.scalar(numbers["roughness"], node, "roughness"), **self.scalar(metallic, node, "metallic")}
        if burley and numbers["transmission"] < 1 and float(metallic.mean()[0]) < 1:
            out["burley_diffuse"] = True
        self.document["principled"] = out
        if numbers["transmission"] > 0:
            self.without_holes(node)
        self.rough(numbers["multiple"])

    def old_gloss(self, numbers):
        """The index and specular of a principled shader of Blender before 4.0, whose gloss has an index of its own."""
        ior, specular, transmission = numbers["ior"], numbers["specular"], numbers["transmission"]
        if transmission == 0:
            ior = 1.5
        elif transmission < 1 and abs(ior - 1) > 1e-3:
            specular = min(specular * 0.04 / ((ior - 1) / (ior + 1)) ** 2, 1.0)
        return ior, specular

    def lambert_factor(self, color, numbers):
        """What the base colour of a principled shader is scaled with in a mixture."""
        diffuse_share = (1 - float(numbers["metallic"].mean()[0])) * (1 - numbers["transmission"])
        rough = float(numbers["roughness"].mean()[0])
        factor = 1 + diffuse_share * (diffuse_factor(rough, numbers["specular"]) - 1)
        if abs(factor - 1) > 5e-3 and np.any(color.rgb > 0):
            self.notices.add("Principled shaders in mixtures have Lambert's diffuse part here, and not Burley's as in this version "
                             "of Blender. Their colours are scaled so that they reflect as much even light")
        if color.image is None and np.any(color.rgb * factor > 1):
            self.notices.here("its colour is so bright that it reflects more light in Blender than arrives. Here it does not")
        return factor

    def mixture(self, parts):
        """One principled material for several closures: shares and colours are added, and the rest is averaged."""
        names = ", ".join(sorted({c.node.name for c, _ in parts}))
        self.notices.here(f"the mixture of {names} is one principled material here, with their mean colour")
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
            color = self.reader.combine(lambda a, b, share=share: a + share * b, [color, own], closure.node)
        scale = min(total, 1.0)
        self.principled(parts[0][0].node, Value(color.rgb * scale, color.image, color.colors), mean)

    # Values as the document has them.

    def color(self, value, node, vertex=False, limit=1.0):
        rgb = np.maximum(value.rgb, 0)
        if limit is not None and value.image is not None and np.any(rgb > limit):  # texels may have room for it
            value = self.reader.combine(lambda c: np.clip(c, 0, limit), [value], node)
            rgb = value.rgb
        if limit is not None and np.any(rgb > limit + 1e-6):
            self.notices.node(node, f"its colour is more than {limit:g}, which is the most here")
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


def fitting_ior(ior):
    return min(max(ior, 1e-3), 10.0)


def black():
    return {"rgb": [0, 0, 0]}
