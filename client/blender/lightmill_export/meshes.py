"""Evaluated meshes as OBJ files, with the triangles, normals and texture coordinates of Cycles."""
import os

import numpy as np

from mathutils import Vector

from .anisotropy import around
from .images import Placement


def read(mesh, name, shape):
    """A property of all elements, as an array."""
    flat = np.empty(len(mesh) * int(np.prod(shape, initial=1)), dtype=np.float32 if name != "use_smooth" else bool)
    if name in ("vertices", "loops", "material_index", "polygon_index", "vertex_index"):
        flat = np.empty(len(flat), dtype=np.int32)
    mesh.foreach_get(name, flat)
    return flat.reshape(len(mesh), *shape) if shape else flat


def corner_normals(mesh):
    if hasattr(mesh, "corner_normals"):  # Blender 4.1
        return read(mesh.corner_normals, "vector", (3,))
    mesh.calc_normals_split()
    return read(mesh.loops, "normal", (3,))


class MeshFiles:
    """OBJ files below a folder."""

    def __init__(self, folder, notices):
        self.folder = folder
        self.notices = notices
        self.count = 0
        os.makedirs(os.path.join(folder, "meshes"), exist_ok=True)

    def write(self, mesh, materials):
        """The file's name and the materials (see materials.Made) of its faces. None if the mesh has no area."""
        mesh.calc_loop_triangles()
        triangles = mesh.loop_triangles
        if len(triangles) == 0 or not np.any(read(triangles, "area", ()) > 0):
            return None
        corners = read(triangles, "loops", (3,))
        vertices = read(mesh.loops, "vertex_index", ())
        polygons = read(triangles, "polygon_index", ())
        smooth = read(mesh.polygons, "use_smooth", ())[polygons]
        slots = np.clip(read(mesh.polygons, "material_index", ())[polygons], 0, len(materials) - 1)
        positions = read(mesh.vertices, "co", (3,))
        coordinates = np.zeros((len(vertices), 2), dtype=np.float32)
        colors = np.ones((len(vertices), 3), dtype=np.float32)
        has_coordinates = np.zeros(len(materials), dtype=bool)
        for slot in np.unique(slots):
            own = corners[slots == slot].reshape(-1)
            placement, direction = materials[slot].placement, materials[slot].direction
            if direction is not None and direction.kind == "UV":
                placement = Placement("UV", direction.name, tuple(np.eye(4).reshape(-1)))
            if placement is not None:
                coordinates[own] = self.coordinates(mesh, placement, positions, vertices)[own]
            elif direction is not None:
                coordinates[own] = directed_coordinates(mesh, direction.name, positions, vertices)[own]
            has_coordinates[slot] = placement is not None or direction is not None
            if materials[slot].colors is not None:
                colors[own] = self.colors(mesh, materials[slot].colors, vertices)[own]
        text = Text()
        if np.all(colors == 1):
            place = vertices
            text.rows("v %.9g %.9g %.9g\n", positions)
        else:
            both, place = np.unique(np.hstack([positions[vertices], colors]), axis=0, return_inverse=True)
            text.rows("v %.9g %.9g %.9g %.9g %.9g %.9g\n", both)
        uv, uv_of = np.unique(coordinates, axis=0, return_inverse=True)
        text.rows("vt %.9g %.9g\n", uv)
        normals, normal_of = np.unique(corner_normals(mesh), axis=0, return_inverse=True)
        text.rows("vn %.9g %.9g %.9g\n", normals)
        place, uv_of, normal_of = (np.asarray(one).reshape(-1)[corners] + 1 for one in (place, uv_of, normal_of))
        used = np.unique(slots)
        for slot in used:
            if len(used) > 1:
                text.line(f"usemtl {materials[slot].document['name']}\n")
            for is_smooth in (False, True):
                chosen = (slots == slot) & (smooth == is_smooth)
                parts = [place] + [uv_of] * bool(has_coordinates[slot]) + [normal_of] * is_smooth
                corner = {(False, False): "%d", (True, False): "%d/%d", (False, True): "%d//%d", (True, True): "%d/%d/%d"}
                one = corner[bool(has_coordinates[slot]), is_smooth]
                text.rows(f"f {one} {one} {one}\n", np.stack([part[chosen] for part in parts], axis=-1))
        return self.save(text), [materials[slot] for slot in used]

    def save(self, text):
        name = f"meshes/{self.count}.obj"
        self.count += 1
        with open(os.path.join(self.folder, name), "w", encoding="utf-8") as file:
            file.writelines(text.parts)
        return name

    def coordinates(self, mesh, placement, positions, vertices):
        """Texture coordinates (u, v) of each corner."""
        if placement.kind == "UV":
            layers = mesh.uv_layers
            layer = layers.get(placement.name) if placement.name else next((one for one in layers if one.active_render), None)
            if layer is None:
                if placement.name:
                    self.notices.here(f"it has no UV map {placement.name}. Its texture coordinates are 0")
                return np.zeros((len(vertices), 2))
            source = np.hstack([read(layer.data, "uv", (2,)), np.zeros((len(vertices), 1))])
        elif placement.kind == "GENERATED":
            source = generated(mesh, positions, positions)[vertices]
        else:
            source = positions[vertices]
        matrix = placement.affine()
        return (source @ matrix[:3, :3].T + matrix[:3, 3])[:, :2]

    def colors(self, mesh, name, vertices):
        """Colours of each corner, sRGB-encoded as in OBJ files. Like in Cycles, a missing attribute is black."""
        attribute = mesh.color_attributes.get(name) if name else mesh.color_attributes.active_color
        if attribute is None:
            self.notices.here(f"it has no colour attribute {name}, and is black where the material uses it")
            return np.zeros((len(vertices), 3))
        linear = read(attribute.data, "color", (4,))[:, :3]
        if np.any(linear > 1):
            self.notices.here(f"colours of {name} above 1 are treated as 1")
        linear = np.clip(linear, 0, 1)
        encoded = np.where(linear <= 0.0031308, linear * 12.92, 1.055 * linear ** (1 / 2.4) - 0.055)
        return encoded if attribute.domain == "CORNER" else encoded[vertices]


def generated(mesh, positions, points):
    """Generated coordinates of points: in the box of the mesh, from 0 to 1."""
    low, high = positions.min(axis=0), positions.max(axis=0)
    if not mesh.use_auto_texspace:
        middle, half = np.array(mesh.texspace_location), np.array(mesh.texspace_size)
        low, high = middle - half, middle + half
    return (points - low) / np.where(high > low, high - low, 1)


def directed_coordinates(mesh, axis, positions, vertices):
    """Texture coordinates of each corner that map each polygon without distortion. u goes around the axis."""
    centers, normals = (read(mesh.polygons, name, (3,)) for name in ("center", "normal"))
    along = around(axis, generated(mesh, positions, centers))
    along -= normals * (normals * along).sum(axis=1, keepdims=True)
    length = np.linalg.norm(along, axis=1, keepdims=True)
    along /= np.where(length > 0, length, 1)
    triangles = mesh.loop_triangles
    polygon = np.zeros(len(vertices), dtype=int)
    polygon[read(triangles, "loops", (3,))] = read(triangles, "polygon_index", ())[:, None]
    offset = positions[vertices] - centers[polygon]
    return np.stack([(offset * axes[polygon]).sum(axis=1) for axes in (along, np.cross(normals, along))], axis=-1)


class Text:
    """Lines of a file, formatted in blocks."""

    def __init__(self):
        self.parts = []

    def line(self, text):
        self.parts.append(text)

    def rows(self, form, array):
        rows = array.reshape(len(array), -1) if len(array) else array
        for begin in range(0, len(rows), 65536):
            block = rows[begin:begin + 65536]
            self.parts.append((form * len(block)) % tuple(block.reshape(-1).tolist()))


def bounds_depth(corners, camera_inverse):
    """Least and largest distance along the view of the corners of a box."""
    depths = [-(camera_inverse @ Vector(corner)).z for corner in corners]
    return min(depths), max(depths)
