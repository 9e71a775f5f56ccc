"""Surfaces of several shaders: their opacity, their emission, and a tree of what reflects light."""
from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from .values import Value, constant, equal

SHINING_OPACITY = 0.1  # of flames, which let light through. The lower, the more noise


@dataclass
class Closure:
    """What one shader reflects and transmits."""
    kind: str  # diffuse, glossy, glass, principled
    node: object
    color: Value
    numbers: dict  # by name: a Value, or a choice of the node
    transmittance: Value = field(default_factory=lambda: constant(0.0))  # of a sheet

    def is_black(self):
        return self.kind in ("diffuse", "glossy") and self.color.is_black() and self.transmittance.is_black()

    def is_linear(self):
        """Whether it reflects twice the light with twice the colour."""
        rough = self.numbers["roughness"]
        return "interior" not in self.numbers and self.kind in ("diffuse", "glossy") and (not self.numbers["multiple"] or rough.is_black())

    def transmits(self):
        metallic = self.numbers.get("metallic")
        is_metal = metallic is not None and metallic.is_constant() and metallic.rgb[0] == 1
        return self.kind == "glass" or self.numbers.get("transmission", 0) > 0 and not is_metal

    def most(self):
        """The largest share of light that it can reflect and transmit."""
        if not self.is_linear():
            return 1.0
        first, second = (value.rgb if value.image is None else value.rgb * value.image.texels()
                         for value in (self.color, self.transmittance))
        images = self.color.image, self.transmittance.image
        if None in images or images[0].same_place(images[1]):
            return float(np.max(first + second))
        return float(np.max(first) + np.max(second))

    def scaled(self, factor):
        color, transmittance = (replace(value, rgb=value.rgb * factor) for value in (self.color, self.transmittance))
        return self if factor == 1 else replace(self, color=color, transmittance=transmittance)

    def leaves(self):
        return [self]


@dataclass
class Mixture:
    node: object
    share: Value  # of the light that meets `second`
    first: Closure | Mixture
    second: Closure | Mixture

    def most(self):
        return max(self.first.most(), self.second.most())

    def scaled(self, factor):
        return replace(self, first=self.first.scaled(factor), second=self.second.scaled(factor))

    def leaves(self):
        return self.first.leaves() + self.second.leaves()


@dataclass
class Surface:
    """Light meets the opaque share of a surface. There it is reflected, and the surface shines."""
    node: object
    opacity: Value
    radiance: Value
    reflection: Closure | Mixture


def diffuse(color, node=None):
    return Closure("diffuse", node, color, {"roughness": constant(0.0), "multiple": False})


def black(node=None):
    return Surface(node, constant(1.0), constant(0.0), diffuse(constant(0.0), node))


def mix(reader, node, factor, a, b):
    """A surface that is `b` with the share `factor`, and else `a`."""
    if a.opacity.is_black() or b.opacity.is_black():
        share = constant(0.0 if b.opacity.is_black() else 1.0)
    elif equal(a.opacity, b.opacity):
        share = factor
    else:
        share = reader.combine(lambda f, x, y: f * y / ((1 - f) * x + f * y), [factor, a.opacity, b.opacity], node)
    return Surface(node, reader.blend(factor, a.opacity, b.opacity, node), reader.blend(share, a.radiance, b.radiance, node),
                   mixture(reader, node, share, a.reflection, b.reflection))


def mixture(reader, node, share, a, b):
    if not share.is_constant():
        return merged(reader, node, share, a, b) or Mixture(node, share, a, b)
    parts = []
    for other, weight in even_parts(b, float(share.rgb[0]), even_parts(a, 1 - float(share.rgb[0]), [])):
        for i, (known, amount) in enumerate(parts):
            one = merged(reader, node, constant(weight / (amount + weight)), known, other)
            if one is not None:
                parts[i] = one, amount + weight
                break
        else:
            parts.append((other, weight))
    out, total = parts[0]
    for part, weight in parts[1:]:
        total += weight
        out = Mixture(node, constant(weight / total), out, part)
    return out


def even_parts(tree, weight, before):
    """Adds the parts of a tree that have the same weight everywhere."""
    if isinstance(tree, Mixture) and tree.share.is_constant():
        share = float(tree.share.rgb[0])
        return even_parts(tree.second, weight * share, even_parts(tree.first, weight * (1 - share), before))
    return [*before, (tree, weight)] if weight > 0 else before


def mean_weights(reader, tree, weight=1.0):
    """The closures of a tree, each with its weight."""
    if isinstance(tree, Closure):
        return [(tree, weight)]
    share = float(reader.even(tree.share, tree.node)[0])
    return mean_weights(reader, tree.first, weight * (1 - share)) + mean_weights(reader, tree.second, weight * share)


def merged(reader, node, share, a, b):
    """A closure that scatters the same light as a mixture of two. None if there is none."""
    if isinstance(a, Mixture) or isinstance(b, Mixture):
        return None
    if is_same(a, b):
        return a
    if not is_sum(share, a, b):
        return None
    return replace(b if a.is_black() else a, color=reader.blend(share, a.color, b.color, node),
                   transmittance=reader.blend(share, a.transmittance, b.transmittance, node))


def is_same(a, b):
    return (a.kind == b.kind and equal(a.color, b.color) and equal(a.transmittance, b.transmittance) and a.numbers.keys() == b.numbers.keys()
            and all(equal(value, b.numbers[name]) for name, value in a.numbers.items()))


def is_sum(share, a, b):
    """Whether a closure with the sums of their colours scatters the sum of both."""
    dark = a.is_black() and b.kind == "diffuse" or b.is_black() and a.kind == "diffuse"
    alike = dark or is_same(a, replace(b, color=a.color, transmittance=a.transmittance))
    if not (a.is_linear() and b.is_linear() and alike):
        return False
    sides = [pair for pair in ((a.color, b.color), (a.transmittance, b.transmittance)) if not all(one.is_black() for one in pair)]
    return all(is_exact(share, *pair) for pair in sides) and (share.is_constant() or dark or len(sides) < 2)


def is_exact(share, a, b):
    """Whether the blend of two values has no means of images."""
    uses = [value.image for value in (a, b) if value.image is not None]
    return (all(use.same_place(uses[0]) for use in uses) and (share.is_constant() or not uses)
            and (a.is_black() or b.is_black() or a.colors is None and b.colors is None))


def add(reader, node, a, b):
    """A surface with the light of both."""
    one = constant(1.0)
    if equal(a.opacity, one) or equal(b.opacity, one):
        opacity = b.opacity if equal(a.opacity, one) else a.opacity
    else:
        opacity = reader.combine(lambda x, y: np.clip(x + y - 1, 0, 1), [a.opacity, b.opacity], node)
    if opacity.is_constant() and opacity.is_black():
        opacity = added_opacity(reader, node, a, b)
    factors = [relative(side.opacity, opacity) for side in (a, b)]
    lights = [replace(side.radiance, rgb=side.radiance.rgb * factor) for side, factor in zip((a, b), factors)]
    if lights[0].is_black() or lights[1].is_black():
        radiance = lights[1] if lights[0].is_black() else lights[0]
    else:
        radiance = reader.combine(lambda x, y: x + y, lights, node)
    return Surface(node, opacity, radiance, total(reader, node, a.reflection, b.reflection, factors))


def added_opacity(reader, node, a, b):
    """The opacity of a sum that lets all light through. What shines or reflects must have some."""
    if not all(closure.is_black() for closure in a.reflection.leaves() + b.reflection.leaves()):
        reader.notices.node(node, "it lets half of the light through, and all of it in Blender")
        return constant(0.5)
    if a.radiance.is_black() and b.radiance.is_black():
        return constant(0.0)
    reader.notices.node(node, f"it blocks {SHINING_OPACITY:.0%} of the light from behind, and none in Blender")
    return constant(SHINING_OPACITY)


def relative(opacity, whole):
    return 1.0 if equal(opacity, whole) else float(opacity.mean().mean()) / max(float(whole.mean().mean()), 1e-6)


def total(reader, node, a, b, factors):
    """A tree that scatters the light of both, times their factors. It is scaled down if that exceeds the light that arrives."""
    half = constant(0.5)
    if isinstance(a, Closure) and isinstance(b, Closure) and is_sum(half, a, b):
        out = merged(reader, node, half, a.scaled(factors[0]), b.scaled(factors[1])).scaled(2)
        most = out.most()
        out = out.scaled(1 / max(most, 1.0))
    else:
        parts = [side.most() * factor for side, factor in zip((a, b), factors)]
        most = max(sum(parts), 1e-12)
        scales = [factor * min(most, 1.0) / part if part > 0 else 0.0 for factor, part in zip(factors, parts)]
        out = mixture(reader, node, constant(parts[1] / most), a.scaled(scales[0]), b.scaled(scales[1]))
    if most > 1 + 1e-6:
        reader.notices.node(node, "the sum of shaders scatters more light than arrives. All of them are scaled down")
    return out
