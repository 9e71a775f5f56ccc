"""The document of a scene, as Blender evaluates it for a render."""
import json
import os

from . import camera, lights, meshes, space, world
from .images import ImageFiles
from .materials import SHADOW_CATCHER, Materials
from .notices import Notices

# Blender gives the surfaces of curves, texts and metaballs as meshes of their own.
NOT_RENDERED = ("CURVE", "SURFACE", "META", "FONT", "ARMATURE", "LATTICE", "EMPTY", "LIGHT_PROBE", "CAMERA", "SPEAKER")
LEAST_VOLUME = 1e-12  # least determinant of a transform that a document may have


class SceneExport:
    """Writes the document, its meshes and images, and the report, into a folder."""

    def __init__(self, depsgraph, folder, view, notices=()):
        """`view`: name of the active camera, or empty. `notices`: those so far."""
        self.depsgraph = depsgraph
        self.scene = depsgraph.scene_eval
        self.folder = folder
        self.view = view
        self.notices = Notices()
        self.notices.texts += notices
        self.images = ImageFiles(folder)
        self.materials = Materials(self.images, self.notices)
        self.mesh_files = meshes.MeshFiles(folder, self.notices)
        self.shared = {}  # mesh files by mesh and materials
        self.objects, self.lights = [], []

    def write(self):
        document = {"film": camera.film(self.scene, self.notices)}
        cameras = [{"name": one.name, "camera": camera.export(one, one.matrix_world, self.scene, self.notices)}
                   for one in self.cameras()]
        document["camera"] = next((one["camera"] for one in cameras if one["name"] == self.view),
                                  {"eye": [0, 0, 1], "look_at": [0, 0, 0], "vertical_fov_degrees": 40})
        for instance in self.depsgraph.object_instances:
            self.add(instance)
        sky = world.export(self.scene.world, self.images, self.notices)
        self.check_shadow_catchers()
        document.update({"materials": self.materials.documents(), "textures": self.materials.textures.documents,
                         "objects": self.objects, "lights": self.lights + ([sky] if sky is not None else [])})
        self.check_scene()
        self.save("scene.json", document)
        self.save("report.json", {"camera": self.view, "cameras": cameras, "notices": self.notices.texts})

    def save(self, name, content):
        with open(os.path.join(self.folder, name), "w", encoding="utf-8") as file:
            json.dump(content, file, indent=1, allow_nan=False)

    def cameras(self):
        """The active camera first. Notices about the others are left out."""
        all_of_them = [one for one in self.depsgraph.objects if one.type == "CAMERA"]
        if self.view:
            yield self.scene.camera
        known = list(self.notices.texts)
        yield from (one for one in all_of_them if one.name not in (self.view, self.scene.camera.name))
        self.notices.texts = known

    def add(self, instance):
        item, matrix = instance.object, instance.matrix_world.copy()
        if item.type == "LIGHT":
            light = lights.export(item, matrix, self.notices)
            if light is not None:
                self.lights.append(light)
        elif item.type == "MESH":
            if instance.show_self:
                self.add_mesh(item, matrix)
        elif item.type not in NOT_RENDERED:
            self.notices.about = f"object {item.name}"
            self.notices.here(f"left out: Lightmill has no objects of the type {item.type.lower()}")
        self.check_particles(item)

    def add_mesh(self, item, matrix):
        if item.is_shadow_catcher:
            materials = [self.materials.shadow_catcher()]
        else:
            materials = [self.materials.of(self.override() or slot.material) for slot in item.material_slots]
            materials = materials or [self.materials.of(self.override())]
        self.notices.about = f"object {item.name}"
        if abs(matrix.to_3x3().determinant()) < LEAST_VOLUME:
            self.notices.here("left out: its transform makes it flat")
            return
        key = (item.data.as_pointer(), tuple(id(made) for made in materials))
        if key not in self.shared:
            if item.modifiers and any(made.uses_generated() for made in materials):
                self.notices.here("its generated coordinates are those of the mesh after its modifiers, unlike in Blender")
            mesh = item.to_mesh()
            self.shared[key] = self.mesh_files.write(mesh, materials) if mesh is not None else None
            item.to_mesh_clear()
        written = self.shared[key]
        if written is None:
            return
        file, used = written
        self.check_object(item, matrix, used)
        out = {"name": item.name, "mesh": {"file": file}, "transform": {"matrix": space.matrix(matrix)}}
        if len(used) == 1:
            out["material"] = used[0].document["name"]
        self.objects.append(out)

    def override(self):
        return self.depsgraph.view_layer.material_override

    # Notices on properties that a document cannot express.

    def check_object(self, item, matrix, used):
        kinds = ("camera", "diffuse", "glossy", "transmission", "volume_scatter", "shadow")
        unseen = [kind for kind in kinds if not getattr(item, f"visible_{kind}")]
        if unseen:
            self.notices.here(f"it is hidden from {', '.join(unseen)} rays in Blender, and visible in Lightmill")
        scales = [axis.length for axis in space.axes(matrix)[:3]]
        if max(scales) > 1.01 * min(scales) and any("normal_map" in made.document for made in used):
            self.notices.here("its normal map acts as if the object had the same scale along all axes")
        if item.is_shadow_catcher:
            self.notices.here("as a shadow catcher it does not show light that other objects scatter onto it")
        if item.is_holdout:
            self.notices.here("it is a holdout in Blender, and an ordinary surface in Lightmill")
        if item.lightgroup:
            self.notices.here(f"left out: its light group {item.lightgroup}")
        if item.cycles.use_camera_cull or item.cycles.use_distance_cull:
            self.notices.here("left out: its culling. It is always rendered")
        if self.view:
            self.check_clip(item, matrix)

    def check_shadow_catchers(self):
        """Shadow catchers compare their light with that without shadows, which Lightmill knows only for some lights."""
        catcher = self.materials.made.get(SHADOW_CATCHER)
        if catcher is None:
            return
        textured = any("texture" in one.get("emission", {}) for one in self.materials.documents())
        kinds = [kind for light in self.lights for kind in light.values() if isinstance(kind, dict)]
        if textured or any(kind.get("spread_degrees", 180) != 180 for kind in kinds):
            catcher.document.pop("shadow_catcher")
            catcher.document["diffuse"] = {"reflectance": {"rgb": [0.8, 0.8, 0.8]}}
            self.notices.add("shadow catchers are grey surfaces, because the scene has an emission with a texture or a light with a spread")

    def check_clip(self, item, matrix):
        view = self.scene.camera
        data = view.data
        near, far = meshes.bounds_depth(item.bound_box, view.matrix_world.normalized().inverted() @ matrix)
        if far > data.clip_end:
            self.notices.here(f"left out: the camera's clip end ({data.clip_end:g}). The object beyond it is rendered")
        if near < data.clip_start < far and data.clip_start > 0.1001:
            self.notices.here(f"left out: the camera's clip start ({data.clip_start:g}). The object before it is rendered")

    def check_particles(self, item):
        for system in getattr(item, "particle_systems", ()):
            settings = system.settings
            self.notices.about = f"object {item.name}"
            if settings.render_type in ("PATH", "HALO", "LINE"):
                self.notices.here(f"left out: its particles {system.name} ({settings.render_type.lower()})")

    def check_scene(self):
        scene, view = self.scene, self.scene.view_settings
        self.notices.about = "scene"
        if not self.view:
            self.notices.here("it has no active camera. The picture shows all of it")
        plain = view.view_transform in ("Standard", "Raw") and view.exposure == 0 and view.gamma == 1
        if not plain or view.look != "None" or view.use_curve_mapping:
            self.notices.here(f"left out: its view transform ({view.view_transform}, look {view.look}, exposure "
                              f"{view.exposure:g}, gamma {view.gamma:g}). PNG pictures are plain sRGB")
        if scene.use_nodes:
            self.notices.here("left out: compositing")
        if scene.render.use_freestyle:
            self.notices.here("left out: Freestyle's lines")
        layers = [layer.name for layer in scene.view_layers if layer.use]
        if len(layers) > 1:
            self.notices.here(f"left out: the view layers {', '.join(layers[1:])}. Only {layers[0]} is rendered")
        self.check_collections(self.depsgraph.view_layer_eval.layer_collection)

    def check_collections(self, layer):
        for one in (layer, *layer.children):
            if one.holdout or one.indirect_only:
                kind = "a holdout" if one.holdout else "only for indirect light"
                self.notices.add(f"collection {one.name}: it is {kind} in Blender, and ordinary in Lightmill")
        for one in layer.children:
            self.check_collections(one)
