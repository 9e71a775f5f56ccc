"""Images of textures: their texels, their coordinates and their files.

Coordinates are an affine function of a UV map, or of generated or object coordinates. meshes.py computes them for each
corner, so a Mapping node is exact.
"""
import hashlib
import math
import os
import shutil
import tempfile
from dataclasses import dataclass, replace

import bpy
import numpy as np

CHANNELS = {"R": 0, "G": 1, "B": 2, "A": 3}
READABLE = {"PNG": "png", "JPEG": "jpg", "OPEN_EXR": "exr", "HDR": "hdr", "TIFF": "tif", "TARGA": "tga", "TARGA_RAW": "tga",
            "BMP": "bmp", "WEBP": "webp"}
WRAPS = {"REPEAT": "REPEAT", "EXTEND": "CLAMP", "CLIP": "CLAMP", "MIRROR": "MIRROR"}
DATA_SPACES = ("Non-Color", "Raw", "Linear", "Linear Rec.709", "Generic Data")
LUMINANCE = np.array((0.2126, 0.7152, 0.0722))
MOST_TEXELS = 1 << 27
MISSING = (1.0, 0.0, 1.0, 1.0)  # what Cycles shows


@dataclass(frozen=True)
class Placement:
    kind: str                  # UV, GENERATED, OBJECT or DIRECTION
    name: str                  # of a UV map; "" is the one that renders
    matrix: tuple              # 4×4, row by row
    wrap: str = "REPEAT"
    nearest: bool = False

    def affine(self):
        return np.array(self.matrix).reshape(4, 4)


@dataclass(frozen=True)
class ImageUse:
    name: str
    place: Placement
    source: object = None      # a Blender image whose file is used as it is
    pixels: np.ndarray | None = None  # RGBA, linear, from the lowest row; of a computed image
    channel: str = "COLOR"

    def texels(self):
        """(height, width, 3); a channel is repeated."""
        pixels = self.pixels if self.pixels is not None else load_pixels(self.source)
        if self.channel == "COLOR":
            return pixels[..., :3]
        one = pixels[..., :3] @ LUMINANCE if self.channel == "LUMINANCE" else pixels[..., CHANNELS[self.channel]]
        return np.repeat(one[..., None], 3, axis=-1)

    def as_channel(self, channel):
        return replace(self, channel=channel)

    def with_texels(self, texels):
        """An image with these texels at the same coordinates."""
        alpha = np.ones((*texels.shape[:2], 1), dtype=np.float32)
        texels = texels.astype(np.float32)
        return replace(self, source=None, pixels=np.concatenate([texels, alpha], axis=-1), channel="COLOR")

    def is_same(self, other):
        same = self.same_place(other) and self.source == other.source and self.channel == other.channel
        return same and (self.pixels is other.pixels or self.pixels is not None and np.array_equal(self.pixels, other.pixels))

    def same_place(self, other):
        return self.place == other.place and self.size() == other.size()

    def size(self):
        return tuple(self.source.size) if self.pixels is None else (self.pixels.shape[1], self.pixels.shape[0])


def is_data(image):
    return image.colorspace_settings.name in DATA_SPACES or image.colorspace_settings.is_data


def load_pixels(image):
    """RGBA as Cycles reads it: linear, before multiplication by alpha. Shape (height, width, 4)."""
    width, height = image.size
    channels = image.channels
    flat = np.empty(width * height * channels, dtype=np.float32)
    image.pixels.foreach_get(flat)
    pixels = flat.reshape(height, width, channels)
    rgba = np.ones((height, width, 4), dtype=np.float32)
    if channels < 3:
        rgba[..., :3] = pixels[..., :1]
    else:
        rgba[..., :3] = pixels[..., :3]
    if channels in (2, 4):
        rgba[..., 3] = pixels[..., -1]
    if not is_data(image) and not image.is_float:
        rgb = rgba[..., :3]
        rgba[..., :3] = np.where(rgb <= 0.04045, rgb / 12.92, ((rgb + 0.055) / 1.055) ** 2.4)
    return rgba


def read_image_node(reader, node, output):
    n = node.node
    place = replace(placement(reader, node.input("Vector"), n, "UV"), wrap=WRAPS[n.extension],
                    nearest=n.interpolation == "Closest")
    if n.projection != "FLAT":
        reader.notices.node(n, f"its projection {n.projection.lower()} is treated as flat")
    if n.extension == "CLIP":
        reader.notices.node(n, "beyond the image, its border continues. In Blender it is black there")
    if n.interpolation in ("Cubic", "Smart"):
        reader.notices.node(n, f"its interpolation {n.interpolation.lower()} is replaced by bilinear")
    use = checked(reader, n, place)
    alpha_used = any(socket.is_linked for socket in n.outputs if socket.name == "Alpha")
    use = with_blender_alpha(use, n.image, alpha_used)
    return use.as_channel("A") if output.name == "Alpha" else use


def read_environment_node(reader, node):
    n = node.node
    place = placement(reader, node.input("Vector"), n, "DIRECTION")
    if n.projection != "EQUIRECTANGULAR":
        reader.notices.node(n, "its projection mirror ball is treated as equirectangular")
    if n.interpolation != "Linear":
        reader.notices.node(n, f"its interpolation {n.interpolation.lower()} is replaced by bilinear")
    return checked(reader, n, place)


def checked(reader, n, place):
    """The node's image. Like in Cycles, a missing one is magenta."""
    image = n.image.original if n.image is not None else None
    if image is None:
        return ImageUse("none", place, pixels=np.array([[[0.0, 0.0, 0.0, 1.0]]]))
    if image.source == "TILED":
        return tiled(reader, n, image, place)
    if image.source not in ("FILE", "GENERATED"):
        reader.notices.node(n, f"left out: all but one picture of the {image.source.lower()} image {image.name}")
    if image.size[0] == 0 or image.size[0] * image.size[1] > MOST_TEXELS:
        reader.notices.node(n, f"the image {image.name} is missing or too large, and is shown in magenta")
        return ImageUse(image.name, place, pixels=np.array([[MISSING]]))
    name = image.colorspace_settings.name
    if not is_data(image) and name != "sRGB":
        reader.notices.node(n, f"the colour space {name} of {image.name} is treated as sRGB")
    return ImageUse(image.name, place, source=image)


def tiled(reader, n, image, place):
    """The tiles of an image (UDIM) as one image. Tile 1001 + i + 10 j begins at u = i and v = j. Squares between them without
    a tile are magenta."""
    extent = [max(divmod(tile.number - 1001, 10)[axis] for tile in image.tiles) + 1 for axis in (0, 1)]
    if extent[0] * extent[1] * image.size[0] * image.size[1] > MOST_TEXELS:
        reader.notices.node(n, f"the tiles of {image.name} are too large together, and are shown in magenta")
        return ImageUse(image.name, place, pixels=np.array([[MISSING]]))
    squares = {divmod(tile.number - 1001, 10)[::-1]: tile_pixels(reader, n, image, tile.number) for tile in image.tiles}
    columns, rows = (max(square[axis] for square in squares) + 1 for axis in (0, 1))
    width, height = (max(pixels.shape[axis] for pixels in squares.values()) for axis in (1, 0))
    name = image.colorspace_settings.name
    if not is_data(image) and name != "sRGB":
        reader.notices.node(n, f"the colour space {name} of {image.name} is treated as sRGB")
    whole = np.tile(np.array(MISSING, dtype=np.float32), (rows * height, columns * width, 1))
    for (column, row), pixels in squares.items():
        down, across = (np.arange(size) * pixels.shape[axis] // size for axis, size in enumerate((height, width)))
        whole[row * height:(row + 1) * height, column * width:(column + 1) * width] = pixels[down][:, across]
    matrix = np.diag((1 / columns, 1 / rows, 1, 1)) @ place.affine()
    return ImageUse(image.name, replace(place, matrix=tuple(matrix.reshape(-1)), wrap="CLAMP"), pixels=whole)


def tile_pixels(reader, n, image, number):
    """The texels of a tile."""
    with tempfile.TemporaryDirectory() as folder:
        row, column = divmod(number - 1001, 10)
        path = bpy.path.abspath(image.filepath_raw, library=image.library)
        path = path.replace("<UDIM>", str(number)).replace("<UVTILE>", f"u{column + 1}_v{row + 1}")
        for packed in image.packed_files:
            if os.path.basename(packed.filepath) == os.path.basename(path):
                path = os.path.join(folder, os.path.basename(packed.filepath))
                with open(path, "wb") as file:
                    file.write(packed.packed_file.data)
        if not os.path.isfile(path):
            reader.notices.node(n, f"tile {number} of {image.name} is missing, and is shown in magenta")
            return np.array([[MISSING]], dtype=np.float32)
        tile = bpy.data.images.load(path)
        tile.colorspace_settings.name, tile.alpha_mode = image.colorspace_settings.name, image.alpha_mode
        pixels = load_pixels(tile)
        bpy.data.images.remove(tile)
        return pixels


def with_blender_alpha(use, image, alpha_used):
    """Cycles multiplies colours with a straight alpha unless the alpha output is used."""
    if image is None or use.source is None and image.source != "TILED":
        return use
    if image.channels != 4 or is_data(image) or image.alpha_mode in ("NONE", "CHANNEL_PACKED"):
        return use
    premultiplied = image.alpha_mode == "PREMUL"
    if premultiplied != alpha_used:
        return use
    pixels = load_pixels(use.source) if use.pixels is None else use.pixels
    alpha = pixels[..., 3:]
    if np.all(alpha == 1):
        return use
    pixels[..., :3] = pixels[..., :3] / np.where(alpha == 0, 1, alpha) if premultiplied else pixels[..., :3] * alpha
    return replace(use, source=None, pixels=pixels)


def placement(reader, socket, owner, default):
    """The coordinates at the input of an image node, as a Placement."""
    node, _output, groups = socket.source()
    if node is None:
        return Placement(default, "", identity())
    found = coordinates(reader, socket)
    if found is None:
        reader.notices.node(node, "coordinates other than UV, Generated and Object are replaced by "
                            + ("directions" if default == "DIRECTION" else "the UV map"))
        return Placement(default, "", identity())
    kind, name, matrix = found
    if default == "DIRECTION" and kind == "GENERATED":
        kind = "DIRECTION"
    return Placement(kind, name, tuple(matrix.reshape(-1)))


def identity():
    return tuple(np.eye(4).reshape(-1))


def coordinates(reader, socket):
    """(kind, name, matrix) if the input is an affine function of coordinates."""
    node, output, groups = socket.source()
    if node is None:
        return None
    from .nodes import Node
    inside = Node(node, groups)
    if node.type == "TEX_COORD":
        if output.name == "UV":
            return "UV", "", np.eye(4)
        if output.name == "Generated":
            return "GENERATED", "", np.eye(4)
        return ("OBJECT", "", np.eye(4)) if output.name == "Object" and node.object is None else None
    if node.type == "UVMAP":
        return "UV", node.uv_map, np.eye(4)
    if node.type == "ATTRIBUTE" and node.attribute_type == "GEOMETRY" and output.name == "Vector":
        return "UV", node.attribute_name, np.eye(4)
    if node.type == "MAPPING" and node.vector_type != "NORMAL":
        inner = coordinates(reader, inside.input("Vector"))
        return None if inner is None else (*inner[:2], mapping_matrix(reader, inside) @ inner[2])
    if node.type == "VECT_MATH" and node.operation in ("ADD", "SUBTRACT", "MULTIPLY", "SCALE"):
        return vector_math(reader, inside)
    return None


def vector_math(reader, inside):
    n = inside.node
    first = coordinates(reader, inside.input(0))
    other = inside.input("Scale") if n.operation == "SCALE" else inside.input(1)
    if first is None:
        return None
    numbers = reader.even(reader.color(other), n)
    change = np.eye(4)
    if n.operation in ("MULTIPLY", "SCALE"):
        change[:3, :3] = np.diag(numbers)
    else:
        change[:3, 3] = numbers if n.operation == "ADD" else -numbers
    return (*first[:2], change @ first[2])


def mapping_matrix(reader, node):
    kind = node.node.vector_type

    def numbers(name, default):
        socket = node.input(name)
        return np.full(3, default) if socket is None else reader.even(reader.color(socket), node.node)
    scale, angles = numbers("Scale", 1.0), numbers("Rotation", 0.0)
    location = numbers("Location", 0.0) if kind in ("POINT", "TEXTURE") else np.zeros(3)
    turn = np.eye(3)
    for axis, angle in enumerate(angles):  # about x, then y, then z
        c, s = math.cos(angle), math.sin(angle)
        one = np.eye(3)
        i, j = (axis + 1) % 3, (axis + 2) % 3
        one[i, i], one[i, j], one[j, i], one[j, j] = c, -s, s, c
        turn = one @ turn
    out = np.eye(4)
    out[:3, 3] = location
    if kind != "TEXTURE":
        out[:3, :3] = turn @ np.diag(scale)
        return out
    out[:3, :3] = turn
    shrink = np.eye(4)
    shrink[:3, :3] = np.diag([1 / s if s else 0.0 for s in scale])
    return shrink @ np.linalg.inv(out)


class ImageFiles:
    """Files of the images, below a folder."""

    def __init__(self, folder):
        self.folder = folder
        self.files = {}
        os.makedirs(os.path.join(folder, "images"), exist_ok=True)

    def add(self, use):
        """(file, linear or sRGB) of an image, relative to the document."""
        if use.pixels is not None:
            texels = np.ascontiguousarray(use.pixels[..., :3], dtype="<f4")
            key = texels.shape, hashlib.sha256(texels).digest()
            if key not in self.files:
                self.files[key] = self.write_texels(texels)
            return self.files[key], "LINEAR"
        image = use.source
        if image.name_full not in self.files:
            self.files[image.name_full] = self.copy(image)
        return self.files[image.name_full]

    def new_name(self, ending):
        return f"images/{len(os.listdir(os.path.join(self.folder, 'images')))}.{ending}"

    def copy(self, image):
        path = bpy.path.abspath(image.filepath, library=image.library)
        packed = image.packed_file is not None
        usable = image.source == "FILE" and not image.is_dirty and image.file_format in READABLE
        if not (usable and (packed or os.path.isfile(path))) or (image.is_float and not is_data(image)):
            pixels = load_pixels(image)
            has_alpha = bool(np.any(pixels[..., 3] != 1))
            return (self.write_png(image), "LINEAR" if is_data(image) else "SRGB") if has_alpha else (
                self.write_texels(pixels[..., :3]), "LINEAR")
        name = self.new_name(READABLE[image.file_format])
        target = os.path.join(self.folder, name)
        if packed:
            with open(target, "wb") as file:
                file.write(image.packed_file.data)
        else:
            shutil.copyfile(path, target)
        return name, "LINEAR" if is_data(image) else "SRGB"

    def write_png(self, image):
        name = self.new_name("png")
        copy = image.copy()
        copy.filepath_raw, copy.file_format = os.path.join(self.folder, name), "PNG"
        copy.save()
        bpy.data.images.remove(copy)
        return name

    def write_texels(self, texels):
        """Writes a portable float map. Returns its file."""
        name = self.new_name("pfm")
        height, width = texels.shape[:2]
        with open(os.path.join(self.folder, name), "wb") as file:
            file.write(f"PF\n{width} {height}\n-1.0\n".encode())
            file.write(np.ascontiguousarray(texels, dtype="<f4").tobytes())
        return name
