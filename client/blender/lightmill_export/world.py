"""The world as an environment."""
import math

import numpy as np

from .closures import ClosureReader
from .nodes import output_of
from .space import TO_DOCUMENT
from .values import Value, ValueReader, constant

LEFT_OUT = "The world has its mean colour in all directions"


def export(world, files, notices):
    """The document's light. None if the world is black."""
    if world is None:
        return None
    notices.about = f"world {world.name}"
    radiance, node = read_radiance(world, notices)
    check(world, notices)
    if np.any(radiance.rgb < 0):
        notices.here("its negative strength is treated as 0")
        radiance = Value(np.maximum(radiance.rgb, 0), radiance.image)
    if np.all(radiance.rgb == 0):
        return None
    environment = {"radiance": {"rgb": [float(c) for c in radiance.rgb]}}
    if radiance.image is not None:
        turn = orientation(radiance.image.place)
        if turn is None:
            notices.node(node, f"left out: a sky image can only be turned or mirrored, not moved or scaled along an axis. {LEFT_OUT}")
            environment["radiance"]["rgb"] = [float(c) for c in radiance.mean()]
        else:
            environment["file"] = files.add(radiance.image)[0]
            environment |= turn
    out = {"name": world.name, "environment": environment}
    if world.lightgroup:
        from .lights import group_name
        out["group"] = group_name(world.lightgroup, notices)
    return out


def read_radiance(world, notices):
    if not world.use_nodes or world.node_tree is None:
        return constant(*world.color), None
    end = output_of(world.node_tree)
    if end is None:
        return constant(0.0), None
    if end.inputs["Volume"].is_linked:
        notices.node(end.inputs["Volume"].links[0].from_node, "left out: an environment has no volume. A large box around the scene can have it")
    reader = ValueReader(notices)
    radiance, node = ClosureReader(reader).radiance(end.inputs["Surface"],
                                                    "left out: a world has only background and emission shaders")
    return (radiance if radiance.colors is None else constant(*reader.even(radiance, node))), node


def check(world, notices):
    seen = world.cycles_visibility
    unseen = [kind for kind in ("camera", "diffuse", "glossy", "transmission", "scatter") if not getattr(seen, kind)]
    if unseen:
        notices.here(f"it is hidden from {', '.join(unseen)} rays in Blender, and visible in Lightmill")
    if world.cycles.max_bounces < 1024:
        notices.here(f"left out: its limit of {world.cycles.max_bounces} bounces")


def orientation(place):
    """The document's fields for the turn of an equirectangular image. None if its transform is no turn and no reflection."""
    matrix = place.affine()
    turn = matrix[:3, :3]
    size = np.cbrt(abs(np.linalg.det(turn)))
    if place.kind != "DIRECTION" or not np.allclose(matrix[:3, 3], 0, atol=1e-6) or size == 0 or not np.allclose(
            turn @ turn.T, np.eye(3) * size * size, atol=1e-5 * size * size):
        return None
    turn = turn / size
    if np.allclose(turn[2], [0, 0, 1], atol=1e-6) and np.linalg.det(turn) > 0:
        return {"rotation_degrees": -math.degrees(math.atan2(turn[1, 0], turn[0, 0]))}
    to_document = np.array(TO_DOCUMENT)[:3, :3]
    return {"orientation": [float(x) for x in (to_document @ turn @ to_document.T).ravel()]}
