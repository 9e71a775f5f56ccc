"""A render engine that exports instead of rendering. Only engines get the scene as it is evaluated for a render: with the
modifiers, subdivisions and visibilities of renders, not of the viewport."""
import bpy

from .bake import bake
from .bake_world import bake_world
from .notices import Notices
from .scene import SceneExport


class ExportEngine(bpy.types.RenderEngine):
    bl_idname = "LIGHTMILL_EXPORT"
    bl_label = "Lightmill export"
    folder = None
    view = None  # name of the scene's own camera
    baked = ()  # notices about baked images
    failure = None
    done = False

    def render(self, depsgraph):
        kind = type(self)
        if kind.done:  # another view layer
            return
        kind.done = True
        try:
            SceneExport(depsgraph, kind.folder, kind.view, kind.baked).write()
        except Exception as failure:  # Blender would print it and continue
            kind.failure = failure


def export(folder, texels):
    """Exports the active scene of the open file. `texels`: side of baked images. The scene gets its settings back, but keeps what is
    baked."""
    notices = Notices()
    bake(texels, notices)
    bake_world(texels, notices)
    ExportEngine.baked = notices.texts
    scene = bpy.context.scene
    render = scene.render
    kept = {name: getattr(render, name) for name in ("engine", "use_compositing", "use_sequencer")}
    ExportEngine.folder, ExportEngine.failure, ExportEngine.done = folder, None, False
    ExportEngine.view = scene.camera.name if scene.camera is not None else ""
    stand_in = None
    if scene.camera is None:  # Blender renders nothing without one
        stand_in = bpy.data.objects.new("camera", bpy.data.cameras.new("camera"))
        scene.camera = stand_in
    bpy.utils.register_class(ExportEngine)
    try:
        render.engine, render.use_compositing, render.use_sequencer = ExportEngine.bl_idname, False, False
        bpy.ops.render.render()
    finally:
        for name, value in kept.items():
            setattr(render, name, value)
        if stand_in is not None:
            bpy.data.cameras.remove(stand_in.data)
        bpy.utils.unregister_class(ExportEngine)
    if ExportEngine.failure is not None:
        raise ExportEngine.failure
    if not ExportEngine.done:
        raise RuntimeError("Blender did not evaluate the scene")
