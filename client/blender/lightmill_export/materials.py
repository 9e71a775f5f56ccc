"""Materials: surfaces (see mixtures.py) as the document's materials."""
import math
from dataclasses import dataclass, replace

import bpy
import numpy as np

from . import volumes
from .anisotropy import Direction, follows, parameters
from .closures import ClosureReader
from .mixtures import Closure, Mixture, diffuse, mean_weights
from .nodes import output_of
from .normals import read_displacement, read_normal
from .principled import OLD, SHEEN_COLOR, SHEEN_ROUGHNESS
from .textures import Textures
from .values import Value, ValueReader, constant, hue

MOST_PARTS = 16  # of a mixture
ENOUGH_BOUNCES = 16  # in volumes, for nearly all light
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


SHADOW_CATCHER = object()  # the key of a material that is none of Blender's


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

    def shadow_catcher(self):
        """The material of all shadow catchers. It is a property of objects in Blender."""
        if SHADOW_CATCHER not in self.made:
            self.made[SHADOW_CATCHER] = Made({"name": self.unique("shadow catcher"), "shadow_catcher": {}})
        return self.made[SHADOW_CATCHER]

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
        self.tinted = False  # whether colours of the vertices multiply all of its reflectances

    def make(self, material):
        if material is None:
            self.solid(diffuse(constant(0.8)))
        elif not material.use_nodes or material.node_tree is None:
            self.solid(diffuse(constant(*material.diffuse_color[:3])))
        else:
            self.from_nodes(material)
        if self.direction is not None and self.uses.placement is not None:
            if not follows(self.direction, self.uses.placement):
                self.notices.here("left out: the direction of its anisotropy. It is that of u of its images")
            self.direction = None
        return Made(self.document, self.uses.placement, self.colors, self.direction)

    def from_nodes(self, material):
        end = output_of(material.node_tree)
        if end is None:
            self.solid(diffuse(constant(0.0)))
            return
        medium = volumes.read(self.reader, end.inputs["Volume"])
        bounces = bpy.context.scene.cycles.volume_bounces
        if np.any(medium.scattering > 0) and bounces < ENOUGH_BOUNCES:
            self.notices.here(f"left out: the limit of {bounces} bounces in volumes. Fog is brighter than in Blender")
        if end.inputs["Volume"].is_linked and not end.inputs["Surface"].is_linked:
            self.document.update({"dielectric": {"ior": 1.0}, "interior": medium.document()})
            return
        reader = ClosureReader(self.reader)
        self.fit(reader.read(end.inputs["Surface"]))
        if not medium.is_empty():
            self.fill(medium, end.inputs["Volume"].links[0].from_node)
        normals = [one for one in reader.normals if one.node() is not None]
        if normals:
            read_normal(self, normals, len(normals) == len(reader.normals))
        if end.inputs["Displacement"].is_linked:
            read_displacement(self, material, end.inputs["Displacement"], bool(normals))

    def fill(self, medium, node):
        """Puts a medium into glass. Behind other surfaces it is left out."""
        if self.document.get("opacity", {}).get("value") == 0:
            self.document = {"name": self.name, "dielectric": {"ior": 1.0}, "interior": medium.document()}
        elif "interior" in self.document or not is_glass(self.document):
            self.notices.node(node, "left out: its surface is no glass")
        else:
            self.document["interior"] = medium.document()

    def fit(self, surface):
        opacity, radiance, node = surface.opacity, surface.radiance, surface.node
        if not (opacity.is_constant() and opacity.rgb[0] == 1):
            self.document["opacity"] = self.scalar(opacity, node, "value", "map")
        self.solid(surface.reflection)
        self.interior(surface.reflection)
        if np.any(radiance.rgb < 0):
            self.notices.node(node, "its negative emission is treated as 0")
            radiance = Value(np.maximum(radiance.rgb, 0), radiance.image, radiance.colors)
        if not radiance.is_black():
            self.document["emission"] = self.color(radiance, node, limit=None)
            self.document["two_sided_emission"] = True
            if any(closure.transmits() for closure in surface.reflection.leaves()):
                self.notices.node(node, "what it emits into the glass is darker than in Blender, by the square of the index of refraction")

    def solid(self, tree):
        closures = [closure for closure in tree.leaves() if not closure.is_black()]
        self.tinted = len({closure.color.colors for closure in closures if not closure.color.is_black()}) == 1
        obstacle = self.obstacle(tree, closures) if isinstance(tree, Mixture) else None
        self.document.update(self.part(tree) if obstacle is None else self.mean(tree, obstacle))

    def interior(self, tree):
        """The medium of the subsurface scattering. A material has one."""
        skins = [closure for closure in tree.leaves() if "interior" in closure.numbers]
        if not skins or not has_sheet(self.document):
            return
        self.document["interior"] = skins[0].numbers["interior"]
        for other in skins[1:]:
            if other.numbers["interior"] != self.document["interior"]:
                self.notices.node(other.node, f"its subsurface scattering is that of {skins[0].node.name}")
        if self.document.pop("opacity", None) is not None:
            self.notices.node(skins[0].node, "left out: its opacity. Materials that light enters have none")
        if len(tree.leaves()) > 1:
            self.notices.node(skins[0].node, "light from within meets the other shaders of the mixture, too, unlike in Blender")

    def obstacle(self, tree, closures):
        """Why a tree cannot be a mixture of the document. None if it can."""
        indices = {fitting_ior(closure.numbers["ior"]) for closure in closures if closure.transmits()}
        if len(indices) > 1:
            return "Glass of one mixture has one index of refraction"
        if indices and "opacity" in self.document:
            return "A mixture with glass has no opacity"
        return f"A mixture has at most {MOST_PARTS} shaders" if len(tree.leaves()) > MOST_PARTS else None

    def part(self, tree):
        """The document of a material, or of a part of a mixture."""
        if isinstance(tree, Closure):
            return self.one(tree)
        return {"mixture": {"first": self.part(tree.first), "second": self.part(tree.second),
                            **self.scalar(tree.share, tree.node, "factor")}}

    def mean(self, tree, reason):
        """One principled material instead of a mixture. Adds colours, and averages the other parameters."""
        parts = [(self.opaque(closure), share) for closure, share in mean_weights(self.reader, tree)
                 if share > 0 and not closure.is_black()]
        if not parts:
            return self.one(diffuse(constant(0.0)))
        total = sum(share for _, share in parts)
        if len(parts) == 1:
            closure = parts[0][0]
            self.notices.node(closure.node, f"its share {total:.3g} scales only its colour")
            return self.principled(closure.node, closure.scaled(total).color, self.as_principled(closure))
        names = ", ".join(sorted({closure.node.name for closure, _ in parts}))
        self.notices.here(f"the mixture of {names} is replaced by one principled material with their mean colour. {reason}")
        params = [(self.as_principled(closure), share / total, closure) for closure, share in parts]
        mean = {name: sum(p[name] * share for p, share, _ in params)
                for name in ("transmission", "specular", "ior", "coat", "coat_roughness")}
        shiny = [one for one in params if one[2].kind != "diffuse"] or params
        for name, chosen in (("metallic", params), ("roughness", shiny)):
            mean[name] = constant(sum(float(self.reader.even(p[name], c.node)[0]) * share for p, share, c in chosen)
                                  / sum(share for _, share, _ in chosen))
        mean["multiple"] = all(p["multiple"] for p, _, _ in params)
        mean["lambert"] = all(p.get("lambert", False) for p, _, _ in params)
        color = constant(0.0)
        for p, share, closure in params:
            color = self.reader.combine(lambda a, b, share=share: a + share * b, [color, closure.color], closure.node)
            if closure.kind == "diffuse" and is_rough(closure.numbers["roughness"]):
                self.notices.node(closure.node, "its roughness is left out of the mixture")
            for name in ("anisotropy", "sheen"):
                if p.get(name):
                    self.notices.node(closure.node, f"its {name} is left out of the mixture")
            for value in p.get("images", {}).values():
                self.reader.even(value, closure.node)
        return self.principled(parts[0][0].node, Value(color.rgb * min(total, 1.0), color.image), mean)

    def opaque(self, closure):
        """A closure that reflects what a sheet transmits."""
        if closure.transmittance.is_black():
            return closure
        self.notices.node(closure.node, "the light that it transmits is reflected")
        if closure.kind == "principled":
            numbers = {name: value for name, value in closure.numbers.items() if name not in ("interior", "shown")}
            return replace(closure, color=closure.numbers["shown"], numbers=numbers, transmittance=constant(0.0))
        if "interior" in closure.numbers:
            shown = constant(*closure.numbers["interior"]["subsurface"]["color"]["rgb"])
            return diffuse(shown, closure.node)
        color = self.reader.combine(lambda a, b: np.clip(a + b, 0, 1), [closure.color, closure.transmittance], closure.node)
        return replace(closure, color=color, transmittance=constant(0.0))

    # One closure.

    def one(self, closure):
        if closure.is_black():
            return {"diffuse": {"reflectance": {"rgb": [0.0, 0.0, 0.0]}}}
        if closure.kind == "diffuse":
            return self.diffuse(closure)
        if closure.kind == "glossy":
            return self.glossy(closure)
        if closure.kind == "glass":
            return self.glass(closure)
        return self.principled(closure.node, closure.color, closure.numbers, closure.transmittance)

    def diffuse(self, closure):
        fields, rough = {"reflectance": self.color(closure.color, closure.node, vertex=True)}, closure.numbers["roughness"]
        if not closure.transmittance.is_black():
            fields["transmittance"] = self.color(closure.transmittance, closure.node)
        if not is_rough(rough):
            return {"diffuse": fields}
        return surface("diffuse", {**fields, **self.scalar(rough, closure.node, "roughness")}, closure.numbers["multiple"])

    def glossy(self, closure):
        rough, color = closure.numbers["roughness"], closure.color
        if rough.is_constant() and rough.rgb[0] < LEAST_GLOSS:
            return {"mirror": {"reflectance": self.color(color, closure.node, vertex=True)}}
        if not np.all(color.rgb == 1) or color.image is not None:
            self.notices.node(closure.node, "it is brighter at grazing angles than in Blender, and darker elsewhere. The mean is "
                              "the same")
            # Blender's is the same at all angles.
            color = Value(np.maximum((color.rgb - SCHLICK_MEAN) / (1 - SCHLICK_MEAN), 0), color.image, color.colors)
        return self.principled(closure.node, color, self.as_principled(closure))

    def glass(self, closure):
        rough, color = closure.numbers["roughness"], closure.color
        if not (color.is_constant() and np.all(color.rgb == 1)):
            self.notices.node(closure.node, "left out: the colour of its reflections")
            return self.principled(closure.node, color, self.as_principled(closure))
        self.without_holes(closure.node)
        fields = {"ior": fitting_ior(closure.numbers["ior"])}
        if not is_rough(rough):
            return {"dielectric": fields}
        if OLD:
            self.notices.node(closure.node, "this rough glass loses less light than in this version of Blender")
        return surface("dielectric", {**fields, **self.scalar(rough, closure.node, "roughness")}, closure.numbers["multiple"])

    def without_holes(self, node):
        if self.document.pop("opacity", None) is not None:
            self.notices.node(node, "left out: its opacity. Glass materials have none")

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

    def principled(self, node, color, numbers, transmittance=constant(0.0)):
        metallic, ior, specular = numbers["metallic"], numbers["ior"], numbers["specular"]
        burley = OLD and not numbers.get("lambert")
        if burley:
            ior, specular = self.old_gloss(numbers)
        gloss_color = numbers.get("gloss_color")
        if gloss_color is not None and gloss_color.is_constant():
            most = max(float(np.max(gloss_color.rgb)), 1.0)
            gloss_color, specular = Value(gloss_color.rgb / most), specular * most
        if numbers["transmission"] == 0 and not numbers.get("lambert") and "specular" not in numbers.get("images", {}):
            ior, specular = index_of_gloss(ior, specular)
        specular = min(specular, 1.0)
        roughness, directed = self.anisotropic(node, numbers["roughness"], numbers.get("anisotropy"))
        means = {"specular": specular, "coat": numbers["coat"], "coat_roughness": numbers["coat_roughness"]}
        out = {"base_color": self.color(color, node, vertex=True),
               "transmission": numbers["transmission"], "ior": fitting_ior(ior), **means,
               **self.images_of_layers(node, numbers, means),
               **self.scalar(roughness, node, "roughness"), **self.scalar(metallic, node, "metallic"), **directed,
               **self.sheen(color, node, numbers)}
        if gloss_color is not None:
            out["specular_color"] = self.color(gloss_color, node)
        if burley and numbers["transmission"] < 1 and float(metallic.mean()[0]) < 1:
            out["burley_diffuse"] = True
        if not transmittance.is_black():
            out["transmittance"] = self.color(transmittance, node)
        if numbers["transmission"] > 0:
            self.without_holes(node)
        return surface("principled", out, numbers["multiple"])

    def images_of_layers(self, node, numbers, means):
        """The fields of the numbers that have images. `means` may be other multiples of them."""
        out = {}
        for name, value in numbers.get("images", {}).items():
            factor = means[name] / numbers[name] if numbers[name] > 0 else 0.0
            out.update(self.scalar(Value(value.rgb * factor, value.image), node, name))
        return out

    def anisotropic(self, node, roughness, anisotropy):
        """The roughness in the document, and the fields of the anisotropy."""
        if anisotropy is None or roughness.rgb[0] == 0:
            return roughness, {}
        across, fields = parameters(anisotropy, float(np.clip(roughness.rgb[0], 0, 1)))
        if fields:
            if self.direction not in (None, anisotropy.direction):
                self.notices.node(node, "left out: the direction of its anisotropy. It is that of another shader")
            self.direction = self.direction or anisotropy.direction
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
        if value.colors is not None and vertex and self.tinted:
            self.colors = value.colors
        elif value.colors is not None:
            self.notices.node(node, f"the colour attribute {value.colors} is replaced by white")
        if value.image is not None:
            use = value.image
            if use.channel != "COLOR":
                use = use.with_texels(use.texels())
            out["texture"] = self.uses.add(use, node)
        return out

    def scalar(self, value, node, name, map_name=None):
        """A number, and its map."""
        if value.image is not None and value.rgb[0] > 1:  # texels may have room for it
            value = self.reader.combine(lambda x: np.clip(x, 0, 1), [value], node)
        number = float(np.clip(value.rgb[0], 0, 1))
        if value.image is None or number == 0:
            return {name: number}
        use = value.image
        if use.channel == "A" and use.pixels is not None:  # their files have no alpha
            use = use.with_texels(use.texels())
        channel = use.channel if use.channel != "COLOR" else "LUMINANCE"
        return {name: number, map_name or f"{name}_map": {"texture": self.uses.add(use, node), "channel": channel}}


def has_sheet(part):
    """Whether a material of the document, or a part of it, transmits diffuse light."""
    if "mixture" in part:
        return has_sheet(part["mixture"]["first"]) or has_sheet(part["mixture"]["second"])
    return any("transmittance" in part.get(kind, {}) for kind in ("diffuse", "principled"))


def is_glass(part):
    """Whether light enters a material of the document, or a part of it, by refraction."""
    if "mixture" in part:
        return is_glass(part["mixture"]["first"]) or is_glass(part["mixture"]["second"])
    return "dielectric" in part or part.get("principled", {}).get("transmission", 0) > 0


def surface(kind, fields, multiple):
    """The document of a kind. Maps stand beside it."""
    maps = {name: fields.pop(name) for name in ("roughness_map", "metallic_map") if name in fields}
    return {kind: fields, **maps, **({} if multiple else {"single_scattering": True})}


def is_rough(value):
    return not value.is_constant() or value.rgb[0] > 0


def index_of_gloss(ior, specular):
    """The index with this reflectance at normal incidence, which is Blender's, and the `specular` that leaves it alone."""
    if specular == 0.5:
        return ior, specular
    root = abs(ior - 1) / (ior + 1) * math.sqrt(2 * specular)
    return (fitting_ior((1 + root) / (1 - root)), 0.5) if 0 < root < 1 else (ior, specular)


def fitting_ior(ior):
    return min(max(ior, 1e-3), 10.0)
