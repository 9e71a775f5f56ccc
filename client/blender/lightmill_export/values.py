"""Values of sockets: a constant, times the texels of an image, times a colour of the vertices.

Nodes that compute act on constants and on texels (math_nodes.py), so a computed image is exact. Everything else that varies
over a surface is replaced by a uniform grey, with a notice.
"""
from dataclasses import dataclass, replace

import numpy as np

from .images import ImageUse, read_environment_node, read_image_node
from .nodes import Input, Node

LUMINANCE = np.array((0.2126, 0.7152, 0.0722))
GREY = 0.5  # replaces values that cannot be exported


@dataclass(frozen=True)
class Value:
    rgb: np.ndarray                 # a factor; a number has equal channels
    image: ImageUse | None = None
    colors: str | None = None       # a colour attribute

    def is_constant(self):
        return self.image is None and self.colors is None

    def is_black(self):
        return bool(np.all(self.rgb == 0))

    def mean(self):
        return self.rgb if self.image is None else self.rgb * self.image.texels().reshape(-1, 3).mean(axis=0)


def constant(*numbers):
    return Value(np.array(numbers * 3 if len(numbers) == 1 else numbers[:3], dtype=float))


def equal(a, b):
    """Whether two values, two numbers, or two dictionaries of these, are the same everywhere."""
    if isinstance(a, dict) and isinstance(b, dict):
        return a.keys() == b.keys() and all(equal(a[name], b[name]) for name in a)
    if not isinstance(a, Value):
        return a == b
    if (a.image is None) != (b.image is None) or a.colors != b.colors or not np.array_equal(a.rgb, b.rgb):
        return False
    return a.image is None or a.image.is_same(b.image)


def luminance(rgb):
    return np.broadcast_to((rgb @ LUMINANCE)[..., None], rgb.shape)


def hue(rgb):
    """Colours scaled to luminance 1. White for black."""
    gray = luminance(rgb)
    return np.where(gray > 0, rgb / np.where(gray > 0, gray, 1), 1)


class ValueReader:
    """Reads inputs of the nodes of one material, world or light."""

    def __init__(self, notices):
        self.notices = notices
        self.used_alpha = set()  # images whose alpha output is used

    def color(self, socket):
        node, output, groups = socket.source()
        if node is None:
            return default_of(output)
        from .math_nodes import COMPUTED
        if node.type in COMPUTED:
            inside = Node(node, groups)
            value = COMPUTED[node.type](self, inside, output)
            inside.name_unread(self.notices)
            return value
        if node.type == "TEX_IMAGE":
            return Value(np.ones(3), image=read_image_node(self, Node(node, groups), output))
        if node.type == "TEX_ENVIRONMENT":
            return Value(np.ones(3), image=read_environment_node(self, Node(node, groups)))
        if node.type == "VERTEX_COLOR" or (node.type == "ATTRIBUTE" and node.attribute_type == "GEOMETRY"):
            return self.vertex_colors(node, output)
        self.notices.node(node, f"it is replaced by a uniform grey, {GREY}")
        return constant(GREY)

    def vertex_colors(self, node, output):
        if output.name != "Color":
            self.notices.node(node, f"its output {output.name} is treated as 1")
            return constant(1.0)
        return Value(np.ones(3), colors=node.layer_name if node.type == "VERTEX_COLOR" else node.attribute_name)

    def scalar(self, socket):
        """The number at an input. A colour gives its luminance."""
        value = self.color(socket)
        if np.ptp(value.rgb) == 0 and value.image is not None and value.image.channel == "COLOR" and value.colors is None:
            return replace(value, image=value.image.as_channel("LUMINANCE"))
        if np.ptp(value.rgb) == 0 and value.colors is None:
            return value
        node = socket.node()
        if node is None:  # a colour without a link
            return Value(luminance(value.rgb))
        return self.combine(luminance, [value], node)

    def number(self, socket, owner):
        """A number that has to be the same everywhere."""
        return float(self.even(self.scalar(socket), owner)[0])

    def even(self, value, owner):
        """The colour of a value that has to be the same everywhere."""
        if value.colors is not None:
            self.notices.node(owner, f"the colour attribute {value.colors} is replaced by white")
        if value.image is not None:
            self.notices.node(owner, f"the image {value.image.name} is replaced by its mean colour")
        return value.mean()

    def multiply(self, a, b, node):
        if (a.image is None or b.image is None) and (a.colors is None or b.colors is None):
            return Value(a.rgb * b.rgb, a.image or b.image, a.colors or b.colors)
        return self.combine(lambda x, y: x * y, [a, b], node)

    def blend(self, share, a, b, node):
        """From `a` where the share is 0 to `b` where it is 1."""
        if equal(a, b):
            return a
        if a.is_black():
            return self.multiply(share, b, node)
        if b.is_black():
            return self.multiply(self.combine(lambda s: 1 - s, [share], node), a, node)
        return self.combine(lambda s, x, y: (1 - s) * x + s * y, [share, a, b], node)

    def combine(self, function, values, node):
        """Applies `function` to the values. The last axis of its arguments has the three channels."""
        for value in values:
            if value.colors is not None:
                self.notices.node(node, f"the colour attribute {value.colors} is replaced by white")
        kept = next((value.image for value in values if value.image is not None), None)
        arrays = []
        for value in values:
            if value.image is None:
                arrays.append(value.rgb)
            elif value.image.same_place(kept):
                arrays.append(value.rgb * value.image.texels())
            else:
                self.notices.node(node, f"the image {value.image.name} is replaced by its mean colour, because its "
                                        f"texels do not match those of {kept.name}")
                arrays.append(value.mean())
        with np.errstate(all="ignore"):
            out = np.nan_to_num(np.asarray(function(*arrays)), posinf=0.0, neginf=0.0)
        return Value(out) if kept is None else Value(np.ones(3), kept.with_texels(out))


def default_of(socket):
    """The value of an input without a link. `socket` None: an output of a muted node, which gives 0."""
    if socket is None or not hasattr(socket, "default_value"):
        return constant(0.0)
    value = socket.default_value
    return constant(float(value)) if isinstance(value, (int, float)) else constant(*[float(v) for v in value][:3])


def input_of(node, *names):
    """An input of a node that is in no group."""
    return Node(node, ()).input(*names)


__all__ = ["GREY", "Input", "Value", "ValueReader", "constant", "input_of", "luminance"]
