"""Lights of Blender, with the strengths that Cycles gives them.

A point light of P watts has the intensity P/(4π), whatever its radius. An area light of P watts has the radiance P/(4 area), and
with a spread 1/(1 − h cot h) times that, where h is half of the spread. The strength of a small sun is its irradiance on a
surface that faces it.

Cycles before Blender 4.0 differs from later versions, and from Lightmill:
- A light with a radius is a disk that faces the point that it lights.
- A spot falls off with the cosine within its cone.
- At the angle θ from its middle, the radiance of a sun's disk is proportional to 1/cos³θ.
For the last two, the exported light has the same power.
"""
import math

import bpy

from . import space
from .values import ValueReader

OLD = bpy.app.version < (4, 0, 0)
LEAST_SPREAD = 1.0  # degrees: the limit of documents
CUTOFF_RANGE = (0.001, 180.0)


def export(light, world_matrix, notices):
    """A light object, as an entry of the document's list. None if it does not shine."""
    data = light.data
    notices.about = f"light {light.name}"
    if data.type == "AREA" and data.cycles.is_portal:
        return None  # it only guides Cycles' samples
    color = [data.energy * own * factor for own, factor in zip(data.color, emission_factor(data, notices))]
    if min(color) < 0:
        notices.here("its negative strength is treated as 0")
        color = [max(c, 0) for c in color]
    check(light, data, notices)
    kind, shape, has_size = KINDS[data.type](data, color, space.axes(world_matrix), notices)
    out = {"name": light.name, kind: shape}
    if has_size and not light.visible_camera:
        out["hidden_from_camera"] = True
    if light.lightgroup:
        out["group"] = group_name(light.lightgroup, notices)
    return out


def emission_factor(data, notices):
    """The factors by which the light's nodes multiply its colour."""
    if not data.use_nodes or data.node_tree is None:
        return [1, 1, 1]
    reader = ValueReader(notices)
    end = data.node_tree.get_output_node("CYCLES") or data.node_tree.get_output_node("ALL")
    if end is None:
        return [0, 0, 0]
    from .closures import ClosureReader
    return reader.even(*ClosureReader(reader).radiance(end.inputs["Surface"], "left out: lights have only emission shaders"))


def check(light, data, notices):
    """Adds notices on properties that the document's lights lack."""
    kinds = ("diffuse", "glossy", "transmission", "volume_scatter")
    unseen = [kind for kind in kinds if not getattr(light, f"visible_{kind}")]
    if unseen:
        notices.here(f"it is hidden from {', '.join(unseen)} rays in Blender, and visible in Lightmill")
    if not data.cycles.cast_shadow:
        notices.here("it casts no shadows in Blender. In Lightmill it does")
    if data.cycles.max_bounces < 1024:
        notices.here(f"left out: its limit of {data.cycles.max_bounces} bounces")
    if getattr(light, "light_linking", None) and light.light_linking.receiver_collection:
        notices.here("left out: its light linking. It lights all objects")


def group_name(name, notices):
    fitting = "".join(c if c.isascii() and (c.isalnum() or c in "-_") else "_" for c in name)[:64]
    if fitting != name:
        notices.here(f"its light group {name} is renamed to {fitting}")
    return fitting


def rgb(color, factor=1.0):
    return {"rgb": [c * factor for c in color]}


def say_disk(data, notices):
    if OLD and data.shadow_soft_size > 0:
        notices.add("Lights with a radius are spheres. In this version of Blender they are disks that face the lit point, and give "
                    "less light nearby")


def point(data, color, axes, notices):
    say_disk(data, notices)
    shape = {"position": space.vector(axes[3]), "intensity": rgb(color, 1 / (4 * math.pi)), "radius": data.shadow_soft_size}
    return "point", shape, data.shadow_soft_size > 0


def spot(data, color, axes, notices):
    lengths = [axis.length for axis in axes[:3]]
    if max(lengths) > 1.001 * min(lengths):
        notices.here("left out: the different scales of its axes. Its cone is round")
    half = min(max(math.degrees(data.spot_size) / 2, CUTOFF_RANGE[0]), CUTOFF_RANGE[1])
    cosine = math.cos(math.radians(half))
    # Blender's falloff is the same polynomial of the cosine, over the share `spot_blend` of the cosine's range.
    inner = math.degrees(math.acos(min(cosine + (1 - cosine) * data.spot_blend, 1.0)))
    blend = min(max(1 - inner / half, 0.0), 1.0)
    power = 1.0
    if OLD:
        power = cosine_share(cosine, data.spot_blend)
        notices.add("Spot lights are uniform within their cone. In this version of Blender they fall off with the cosine. Their "
                    "power is the same")
    say_disk(data, notices)
    shape = {"position": space.vector(axes[3]), "direction": space.vector(-axes[2]),
             "intensity": rgb(color, power / (4 * math.pi)), "cutoff_degrees": half, "blend": blend, "radius": data.shadow_soft_size}
    return "spot", shape, data.shadow_soft_size > 0


def cosine_share(cosine, blend):
    """The mean cosine of the light in a spot's cone."""
    weights = cosines = 0.0
    for i in range(1000):
        t = (i + 0.5) / 1000  # uniform in the cosine, from the rim
        s = min(t / blend, 1.0) if blend > 0 else 1.0
        weight = s * s * (3 - 2 * s)
        weights += weight
        cosines += weight * (cosine + (1 - cosine) * t)
    return cosines / weights


def sun(data, color, axes, notices):
    angle = min(math.degrees(data.angle), 180.0)
    cosine = math.cos(math.radians(angle) / 2)
    share = 2 * cosine / (1 + cosine) if OLD else 1.0  # the mean of cos θ
    if share < 0.99:
        notices.here("its disk is uniform. In this version of Blender the rim is brighter. Its power is the same")
    shape = {"direction": space.vector(-axes[2]), "irradiance": rgb(color, share), "angle_degrees": angle}
    return "directional", shape, angle > 0


def area(data, color, axes, notices):
    round_shape = data.shape in ("DISK", "ELLIPSE")
    width = data.size * axes[0].length
    height = (data.size_y if data.shape in ("RECTANGLE", "ELLIPSE") else data.size) * axes[1].length
    if width <= 0 or height <= 0:
        notices.here("left out: it has no area")
        return "point", {"position": space.vector(axes[3]), "intensity": rgb((0, 0, 0))}, False
    surface = width * height * (math.pi / 4 if round_shape else 1)
    spread = math.degrees(data.spread)
    if spread < LEAST_SPREAD:
        notices.here(f"its spread is raised to {LEAST_SPREAD:g}°, the minimum")
        spread = LEAST_SPREAD
    spread = min(spread, 180.0)
    half = math.radians(spread / 2)
    kept = 1.0 if spread >= 180 else 1 - half / math.tan(half)
    if abs(axes[0].normalized().dot(axes[1].normalized())) > 1e-3:
        notices.here("left out: its shear. Its sides are at a right angle")
    shape = {"position": space.vector(axes[3]), "direction": space.vector(-axes[2]), "up": space.vector(axes[1]),
             "radiance": rgb(color, 1 / (4 * surface * kept)), "spread_degrees": spread}
    if round_shape:
        return "disk", {**shape, "radius": height / 2, "second_radius": width / 2}, True
    return "rectangle", {**shape, "width": width, "height": height}, True


KINDS = {"POINT": point, "SPOT": spot, "SUN": sun, "AREA": area}
