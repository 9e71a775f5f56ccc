"""A material whose shader nodes a test adds one by one."""
import bpy

from lightmill_export.images import ImageFiles
from lightmill_export.materials import MaterialMaker
from lightmill_export.notices import Notices
from lightmill_export.textures import Textures


class MaterialNodes:
    def __init__(self):
        bpy.ops.wm.read_factory_settings(use_empty=True)
        self.material = bpy.data.materials.new("the material")
        self.material.use_nodes = True
        self.tree = self.material.node_tree
        self.tree.nodes.clear()
        self.end = self.tree.nodes.new("ShaderNodeOutputMaterial")

    def add(self, kind, *linked, **inputs):
        """The output of a node with the inputs by name. `linked` are outputs for its first inputs that are shaders."""
        node = self.tree.nodes.new(f"ShaderNode{kind}")
        sockets = iter([one for one in node.inputs if one.type == "SHADER"])
        for output in linked:
            self.tree.links.new(output, next(sockets))
        for name, value in inputs.items():
            socket = node.inputs[name.replace("_", " ")]
            if isinstance(value, bpy.types.NodeSocket):
                self.tree.links.new(value, socket)
            else:
                socket.default_value = (*value, 1) if isinstance(value, tuple) else value
        return node.outputs[0]

    def document(self, folder):
        """The exported material. `made`, `notices` and the files of its `textures` are those of the last call."""
        self.notices = Notices()
        self.notices.about = "material the material"
        textures = Textures(ImageFiles(folder), self.notices)
        self.made = MaterialMaker("the material", textures, self.notices).make(self.material)
        self.textures = {one["name"]: one["file"] for one in textures.documents}
        return self.made.document
