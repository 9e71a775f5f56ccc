"""The document's textures, and the texture coordinates of each material.

A mesh has one set of coordinates for each material. The material's textures may scale and translate them.
"""
from dataclasses import replace

import numpy as np


class Textures:
    def __init__(self, files, notices):
        self.files = files
        self.notices = notices
        self.known = {}
        self.documents = []

    def of_material(self):
        return MaterialTextures(self)

    def add(self, use, scale, offset):
        file, space = self.files.add(use)
        document = {"file": file, "filter": "NEAREST" if use.place.nearest else "BILINEAR", "wrap": use.place.wrap,
                    "color_space": space, "scale": scale, "offset": offset}
        key = str(document)
        if key not in self.known:
            self.known[key] = self.unique(use.name)
            self.documents.append({"name": self.known[key], **document})
        return self.known[key]

    def unique(self, name):
        taken = {document["name"] for document in self.documents}
        while name in taken:
            name += "'"
        return name


class MaterialTextures:
    def __init__(self, textures):
        self.textures = textures
        self.placement = None  # of the coordinates in the mesh files

    def add(self, use, node):
        """The name of the image's texture in the document."""
        place = use.place
        if place.kind == "DIRECTION":
            self.textures.notices.node(node, f"the directions of {use.name} are replaced by the UV map")
            place = replace(place, kind="UV")
        if self.placement is None:
            straight = is_straight(place.affine())
            self.placement = replace(place, matrix=tuple(np.eye(4).reshape(-1))) if straight else place
        return self.textures.add(replace(use, place=place), *self.scale_and_offset(use, place, node))

    def scale_and_offset(self, use, place, node):
        base = self.placement
        if (place.kind, place.name) == (base.kind, base.name):
            if place.matrix == base.matrix:
                return [1, 1], [0, 0]
            try:
                change = place.affine() @ np.linalg.inv(base.affine())
            except np.linalg.LinAlgError:
                change = None
            if change is not None and is_straight(change):
                return [float(change[0, 0]), float(change[1, 1])], [float(change[0, 3]), float(change[1, 3])]
        self.textures.notices.node(node, f"left out: the coordinates of the image {use.name}. It uses those of another image "
                                   "of the material")
        return [1, 1], [0, 0]


def is_straight(matrix):
    """Whether it only scales and translates u and v."""
    return np.allclose([matrix[0, 1], matrix[0, 2], matrix[1, 0], matrix[1, 2]], 0, atol=1e-9)
