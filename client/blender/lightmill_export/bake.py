"""Images of values that only Cycles can compute, such as procedural textures.

Runs before the export, which then finds images instead. Inputs of shaders are baked if reading them would need a notice. An object
with such inputs gets a copy of its evaluated mesh, with texture coordinates without overlaps and with materials of its own. Only the
open scene changes, not the file.
"""
import math

import bpy

from .nodes import Input, output_of
from .notices import Notices
from .values import ValueReader

COORDINATES = "lightmill"
SAMPLES = 4
MARGIN_TEXELS = 4
# Nodes whose values depend on the ray. An image cannot have these.
VIEW_NODES = {"FRESNEL", "LAYER_WEIGHT", "LIGHT_PATH", "CAMERA"}
VIEW_OUTPUTS = {"NEW_GEOMETRY": {"Incoming", "Backfacing"}, "TEX_COORD": {"Camera", "Window", "Reflection"}}
# Notices that an image would not make unnecessary, or about less than its resolution costs.
MINOR = ("interpolation", "colour space", "missing or too large", "all but one picture")
NORMAL_INPUTS = {"NORMAL_MAP": "Color", "BUMP": "Height", "DISPLACEMENT": "Height"}


def bake(size, notices):
    """Replaces inputs by images of size × size texels, in all objects of the active scene that are rendered."""
    depsgraph = bpy.context.evaluated_depsgraph_get()
    items = dict.fromkeys([*bpy.context.scene.objects, *(one.object.original for one in depsgraph.object_instances)])
    known = {}
    work = [one for one in (Work(item, known) for item in items if can_change(item)) if one.cuts]
    if not work:
        return
    for one in work:
        one.use_render_settings()
    depsgraph = bpy.context.evaluated_depsgraph_get()
    meshes = [one.evaluated(depsgraph) for one in work]
    shared = {}
    with BakeScene() as studio:
        for one, mesh in zip(work, meshes):
            key = one.key()
            if key is None or key not in shared:
                try:
                    shared[key] = one.finished(mesh, studio.bake(one, mesh, size))
                except RuntimeError as failure:  # of Cycles
                    notices.add(f"object {one.item.name}: Blender cannot bake its materials: {str(failure).strip()}")
                    continue
                one.tell(size, notices)
            one.replace(shared[key])


def can_change(item):
    """Whether the object is rendered with materials, and belongs to the file."""
    own = item.library is None and item.override_library is None
    return own and item.type in ("MESH", "CURVE", "SURFACE", "FONT") and not item.hide_render and not item.is_shadow_catcher


class Work:
    """An object, and the inputs of its materials that are baked."""

    def __init__(self, item, known):
        """`known`: the inputs of materials so far."""
        self.item = item
        self.materials = [slot.material for slot in item.material_slots]
        # Other modifiers also make instances, which a mesh would not have.
        can = not any(one.type in ("PARTICLE_SYSTEM", "NODES") and one.show_render for one in item.modifiers)
        self.cuts = {}  # (node's name, input's identifier) by slot
        for slot, material in enumerate(self.materials if can else []):
            if material is not None and material.use_nodes:
                if material not in known:
                    known[material] = list(cuts_of(material))
                if known[material]:
                    self.cuts[slot] = known[material]

    def key(self):
        """Objects with the same key look the same. None for an object that looks like no other."""
        if self.item.modifiers or self.item.type != "MESH" or self.item.data.shape_keys:
            return None
        trees = [self.materials[slot].node_tree for slot in self.cuts]
        if any(node.type == "OBJECT_INFO" or node.type == "NEW_GEOMETRY" or getattr(node, "object", None) for node in nodes_of(trees)):
            return None
        return self.item.data.name_full, tuple(one and one.name_full for one in self.materials)

    def use_render_settings(self):
        """Shows the object in the viewport, with the modifiers' settings of renders."""
        self.item.hide_viewport = False
        for modifier in self.item.modifiers:
            modifier.show_viewport = modifier.show_render
            if modifier.type in ("SUBSURF", "MULTIRES"):
                modifier.levels = modifier.render_levels
        for name in ("u", "v") if self.item.type != "MESH" else ():
            if getattr(self.item.data, f"render_resolution_{name}", 0):
                setattr(self.item.data, f"resolution_{name}", getattr(self.item.data, f"render_resolution_{name}"))

    def evaluated(self, depsgraph):
        """A new mesh: the object's after modifiers, with its generated coordinates."""
        mesh = bpy.data.meshes.new_from_object(self.item.evaluated_get(depsgraph), preserve_all_data_layers=True, depsgraph=depsgraph)
        if self.item.type == "MESH":
            before = self.item.data
            mesh.use_auto_texspace = False
            mesh.texspace_location, mesh.texspace_size = before.texspace_location, before.texspace_size
        return mesh

    def finished(self, mesh, images):
        """The mesh with materials that show the images, which are by slot and input."""
        copies = [self.finished_material(slot, images) if slot in self.cuts else material for slot, material in enumerate(self.materials)]
        mesh.materials.clear()
        for material in copies:
            mesh.materials.append(material)
        return mesh

    def finished_material(self, slot, images):
        copy = self.materials[slot].copy()
        copy.name = f"{self.materials[slot].name} of {self.item.name}"
        for cut in self.cuts[slot]:
            add_image(copy.node_tree, input_of(copy.node_tree, cut), images[slot, cut])
        return copy

    def replace(self, mesh):
        """Gives the object the mesh. An object of another type is hidden behind a new one."""
        item = self.item
        if item.type == "MESH":
            item.modifiers.clear()
            item.data = mesh
            for slot in item.material_slots:
                slot.link = "DATA"
            return
        new = bpy.data.objects.new(item.name, mesh)
        new.matrix_world = item.matrix_world
        for collection in item.users_collection:
            collection.objects.link(new)
        item.hide_render = True
        item.name, new.name = f"{item.name} before", item.name

    def tell(self, size, notices):
        for slot, cuts in self.cuts.items():
            notices.about = f"material {self.materials[slot].name} of {self.item.name}"
            for name, identifier in cuts:
                node = self.materials[slot].node_tree.nodes[name]
                notices.node(node, f"its {input_of(node.id_data, (name, identifier)).name} is baked into an image of {size} × {size} texels")


class BakeScene:
    """A scene for one object at a time."""

    def __enter__(self):
        self.window = bpy.context.window
        self.before = self.window.scene
        self.scene = bpy.data.scenes.new("bake")
        self.scene.render.engine = "CYCLES"
        self.scene.cycles.samples = SAMPLES
        self.scene.cycles.use_denoising = False
        self.scene.render.bake.margin = MARGIN_TEXELS
        self.window.scene = self.scene
        return self

    def __exit__(self, *failure):
        self.window.scene = self.before
        bpy.data.scenes.remove(self.scene)

    def bake(self, work, mesh, size):
        """Adds texture coordinates to the mesh. Returns an image for each slot and input."""
        if not mesh.polygons:
            raise RuntimeError("it has no faces")
        item = bpy.data.objects.new("bake", mesh)
        item.matrix_world = work.item.matrix_world
        try:
            return self.bake_object(item, work, size)
        finally:
            bpy.data.objects.remove(item)

    def bake_object(self, item, work, size):
        self.scene.collection.objects.link(item)
        mesh = item.data
        view = bpy.context.view_layer
        view.objects.active = item
        item.select_set(True)
        unwrap(item)
        stages = [material.copy() if material is not None else bpy.data.materials.new("none") for material in work.materials]
        mesh.materials.clear()
        for stage in stages:
            stage.use_nodes = True
            mesh.materials.append(stage)
        images = {}
        for number in range(max(len(cuts) for cuts in work.cuts.values())):
            image = bpy.data.images.new(f"baked {work.item.name}", size, size, float_buffer=True, is_data=True)
            for slot, stage in enumerate(stages):
                cuts = work.cuts.get(slot, [])
                show(stage.node_tree, cuts[number] if number < len(cuts) else None, image)
                if number < len(cuts):
                    images[slot, cuts[number]] = image
            bpy.ops.object.bake(type="EMIT", margin=MARGIN_TEXELS, use_clear=True, uv_layer=COORDINATES)
        for stage in stages:
            bpy.data.materials.remove(stage)
        return images


def unwrap(item):
    mesh = item.data
    layer = mesh.uv_layers.new(name=COORDINATES, do_init=False)
    rendered = next((one for one in mesh.uv_layers if one.active_render), None)
    mesh.uv_layers.active = layer
    bpy.ops.object.mode_set(mode="EDIT")
    bpy.ops.mesh.reveal()
    bpy.ops.mesh.select_all(action="SELECT")
    bpy.ops.uv.smart_project(angle_limit=math.radians(66), island_margin=0.005)
    bpy.ops.object.mode_set(mode="OBJECT")
    if rendered is not None:
        rendered.active_render = True


def show(tree, cut, image):
    """Lets the material emit what arrives at the input, and bakes it into the image."""
    for kind in ("baked value", "baked image"):
        if kind in tree.nodes:
            tree.nodes.remove(tree.nodes[kind])
    end = output_of(tree) or tree.nodes.new("ShaderNodeOutputMaterial")
    for name in ("Volume", "Displacement"):
        for link in list(end.inputs[name].links):
            tree.links.remove(link)
    emission = tree.nodes.new("ShaderNodeEmission")
    emission.name = "baked value"
    emission.inputs["Color"].default_value = 0, 0, 0, 1
    if cut is not None:
        tree.links.new(input_of(tree, cut).links[0].from_socket, emission.inputs["Color"])
    tree.links.new(emission.outputs[0], end.inputs["Surface"])
    target = tree.nodes.new("ShaderNodeTexImage")
    target.name, target.image = "baked image", image
    tree.nodes.active = target


def add_image(tree, socket, image):
    texture, place = tree.nodes.new("ShaderNodeTexImage"), tree.nodes.new("ShaderNodeUVMap")
    texture.name, texture.image, texture.extension, place.uv_map = f"baked {socket.name}", image, "EXTEND", COORDINATES
    tree.links.new(place.outputs[0], texture.inputs["Vector"])
    tree.links.new(texture.outputs["Color"], socket)


# Inputs that are baked.

def cuts_of(material):
    """(node's name, input's identifier) of each baked input of the material. Nodes inside of groups are left as they are."""
    end = output_of(material.node_tree)
    seen = set()
    waiting = [end.inputs[name] for name in ("Surface", "Displacement")] if end is not None else []
    while waiting:
        node, _output, groups = Input(waiting.pop()).source()
        if node is None or groups or node.name in seen:
            continue
        seen.add(node.name)
        for socket in node.inputs:
            if socket.type == "SHADER" or socket.name in ("Normal", "Clearcoat Normal", "Coat Normal"):
                waiting.append(socket)
            elif is_value(node, socket) and needs_image(socket):
                yield node.name, socket.identifier


def is_value(node, socket):
    if node.type in NORMAL_INPUTS:
        return socket.name == NORMAL_INPUTS[node.type]
    return socket.enabled and socket.name not in ("Tangent", "Subsurface Radius") and any(
        one.type == "SHADER" for one in node.outputs)


def needs_image(socket):
    """Whether the export would replace the input's value, and an image can have it."""
    if not socket.links:
        return False
    notices = Notices()
    ValueReader(notices).color(Input(socket))
    if all(any(minor in text for minor in MINOR) for text in notices.texts):
        return False
    return not any(depends_on_ray(node, output) for node, output in sources_of(socket))


def depends_on_ray(node, output):
    return node.type in VIEW_NODES or output in VIEW_OUTPUTS.get(node.type, ())


def sources_of(socket, seen=None):
    """(node, name of the output) of all that the input depends on. Of groups all nodes count."""
    seen = set() if seen is None else seen
    for link in socket.links:
        node = link.from_node
        if (node, link.from_socket.name) in seen:
            continue
        seen.add((node, link.from_socket.name))
        yield node, link.from_socket.name
        if node.type == "GROUP" and node.node_tree is not None:
            for inner in nodes_of([node.node_tree]):
                yield from ((inner, one.name) for one in inner.outputs if one.is_linked)
        for one in node.inputs:
            yield from sources_of(one, seen)


def nodes_of(trees):
    for tree in trees:
        for node in tree.nodes:
            yield node
            if node.type == "GROUP" and node.node_tree is not None:
                yield from nodes_of([node.node_tree])


def input_of(tree, cut):
    return next(one for one in tree.nodes[cut[0]].inputs if one.identifier == cut[1])
