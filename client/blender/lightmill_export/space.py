"""Conversion from Blender's space (z up) to the document's (y up)."""
from mathutils import Matrix, Vector

TO_DOCUMENT = Matrix(((1, 0, 0, 0), (0, 0, 1, 0), (0, -1, 0, 0), (0, 0, 0, 1)))


def vector(v):
    """A point or direction as a document's list."""
    return [v[0], v[2], -v[1]]


def matrix(world):
    """A transform from an object's space, which keeps Blender's axes, to the document's."""
    return [x for row in TO_DOCUMENT @ world for x in row]


def axes(world):
    """Columns of a transform: x, y, z and the position."""
    return [Vector(world.col[i][:3]) for i in range(4)]
