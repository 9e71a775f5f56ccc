"""Runs in Blender. Nothing of a scene is left out in silence: each changed property changes the document, or is named in a notice.

The tests walk all kinds of objects, and the properties of lights, cameras, worlds and films that this Blender has. Properties
that do neither are in a list here, with the reason.
"""
import json
import os
import tempfile
import unittest

import bpy

from changes import change
from lightmill_export import camera, lights, world
from lightmill_export.images import ImageFiles
from lightmill_export.notices import Notices
from lightmill_export.render_engine import export

FOLDER = tempfile.mkdtemp(prefix="lightmill-walk-")
# Properties that are no part of a picture by Cycles.
EEVEE = "only Eevee has it"
EDITOR = "only the editor shows it"
ID_PROPERTIES = ("name", "use_fake_user", "use_extra_user", "tag")
LIGHT_PROPERTIES = {
    **{name: EEVEE for name in (
        "specular_factor", "diffuse_factor", "volume_factor", "use_custom_distance", "cutoff_distance", "use_shadow",
        "shadow_buffer_size", "shadow_buffer_clip_start", "shadow_buffer_bias", "shadow_buffer_samples", "shadow_color",
        "use_contact_shadow", "contact_shadow_distance", "contact_shadow_bias", "contact_shadow_thickness",
        "shadow_cascade_max_distance", "shadow_cascade_count", "shadow_cascade_exponent", "shadow_cascade_fade")},
    **{name: "of Blender's renderer before 2.8" for name in (
        "distance", "falloff_type", "linear_attenuation", "quadratic_attenuation", "constant_coefficient", "linear_coefficient",
        "quadratic_coefficient")},
    "show_cone": EDITOR, "use_square": EDITOR, **{name: EDITOR for name in ID_PROPERTIES}, "type": "walked",
    "use_nodes": "on, with the nodes that do nothing",
}
# What counts for other kinds of lights alone.
ONLY_OTHERS = {("SUN", "shadow_soft_size"), ("POINT", "is_portal"), ("SUN", "is_portal"), ("SPOT", "is_portal")}


class Lights(unittest.TestCase):
    def test_a_property_counts_or_is_named(self):
        for kind in ("POINT", "SUN", "SPOT", "AREA"):
            data = bpy.data.lights.new("the light", kind)
            if kind == "AREA":
                data.shape, data.size_y = "RECTANGLE", 0.7
            item = bpy.data.objects.new("the light", data)
            before = self.export(item)
            for holder, known in ((data, LIGHT_PROPERTIES), (data.cycles, {
                    "name": EDITOR, "use_multiple_importance_sampling": "only noise", "is_caustics_light": "only noise"})):
                for one in holder.bl_rna.properties:
                    if one.identifier in known or one.is_readonly or (
                            kind, one.identifier) in ONLY_OTHERS:
                        continue
                    for value in change(holder, one.identifier):
                        with self.subTest(f"{kind}.{one.identifier} = {value}"):
                            self.assertNotEqual(self.export(item), before)
            for name in [one for one in dir(item) if one.startswith("visible_") and one not in ("visible_get", "visible_shadow",
                                                                                              "visible_in_viewport_get")]:
                if name == "visible_camera" and kind in ("POINT", "SPOT", "SUN"):
                    continue  # without a size nothing is seen; below
                setattr(item, name, not getattr(item, name))
                self.assertNotEqual(self.export(item), before, name)
                setattr(item, name, not getattr(item, name))

    def export(self, item):
        notices = Notices()
        return str(lights.export(item, item.matrix_world, notices)), notices.texts


class Objects(unittest.TestCase):
    def setUp(self):
        bpy.ops.wm.read_factory_settings(use_empty=True)
        bpy.context.scene.camera = bpy.data.objects.new("view", bpy.data.cameras.new("view"))

    def export(self):
        """The document and the report."""
        export(FOLDER, 64)
        for name in ("scene.json", "report.json"):
            with open(os.path.join(FOLDER, name), encoding="utf-8") as file:
                yield json.load(file)

    def test_each_kind_is_exported_or_named_or_never_rendered(self):
        never = {"ARMATURE", "LATTICE", "EMPTY", "LIGHT_PROBE", "SPEAKER"}
        not_made = {"POINTCLOUD"}  # only modifiers and files have them
        makers = {
            "MESH": bpy.ops.mesh.primitive_cube_add, "CURVE": bpy.ops.curve.primitive_bezier_circle_add,
            "SURFACE": bpy.ops.surface.primitive_nurbs_surface_sphere_add, "META": bpy.ops.object.metaball_add,
            "FONT": bpy.ops.object.text_add, "VOLUME": bpy.ops.object.volume_add,
            "GPENCIL": lambda: bpy.ops.object.gpencil_add(type="MONKEY"), "LIGHT": lambda: bpy.ops.object.light_add(type="POINT"),
            "CAMERA": bpy.ops.object.camera_add, "CURVES": bpy.ops.object.curves_random_add,
        }
        kinds = {item.identifier for item in bpy.types.Object.bl_rna.properties["type"].enum_items}
        self.assertEqual(kinds - never - not_made, set(makers))
        for kind, make in makers.items():
            make()
            bpy.context.object.name = f"the {kind}"
            if kind == "CURVE":
                bpy.context.object.data.bevel_depth = 0.1
        document, report = self.export()
        names = [one["name"] for one in document["objects"] + document["lights"] + report["cameras"]]
        for kind in makers:
            with self.subTest(kind):
                self.assertTrue(f"the {kind}" in names or any(f"the {kind}" in text for text in report["notices"]))
        self.assertEqual(names.count("the FONT"), 1)

    def test_what_hides_an_object_is_named(self):
        changes = {one.identifier: False for one in bpy.types.Object.bl_rna.properties if one.identifier.startswith("visible_")}
        changes.update({"is_holdout": True, "is_shadow_catcher": True, "lightgroup": "group"})
        for name, value in changes.items():
            bpy.ops.mesh.primitive_cube_add()
            bpy.context.object.name = f"without {name}"
            setattr(bpy.context.object, name, value)
        _, report = self.export()
        for name in changes:
            with self.subTest(name):
                self.assertTrue(any(f"without {name}:" in text for text in report["notices"]))

    def test_a_shadow_catcher_has_one_material(self):
        for _ in range(2):
            bpy.ops.mesh.primitive_cube_add()
        caught = bpy.context.object
        caught.name, caught.is_shadow_catcher = "caught", True
        caught.data.materials.append(bpy.data.materials.new("red"))
        document, _ = self.export()
        name = {one["name"]: one["material"] for one in document["objects"]}["caught"]
        made = {one["name"]: one for one in document["materials"]}
        self.assertEqual(made[name], {"name": name, "shadow_catcher": {}})
        self.assertEqual(len(made), 2)
        # Lights with a spread have no formula for light without shadows.
        lamp = bpy.data.lights.new("lamp", "AREA")
        lamp.spread = 1
        bpy.context.scene.collection.objects.link(bpy.data.objects.new("lamp", lamp))
        document, report = self.export()
        made = {one["name"]: one for one in document["materials"]}
        self.assertIn("diffuse", made[name])
        self.assertTrue(any(text.startswith("shadow catchers are grey surfaces") for text in report["notices"]))

    def test_a_scene_without_a_camera_is_exported(self):
        bpy.context.scene.camera = None
        bpy.ops.mesh.primitive_cube_add()
        document, report = self.export()
        self.assertEqual((report["camera"], report["cameras"], len(document["objects"])), ("", [], 1))
        self.assertTrue(any("no active camera" in text for text in report["notices"]))
        self.assertIsNone(bpy.context.scene.camera)


class Films(unittest.TestCase):
    def test_a_property_counts_or_is_named(self):
        bpy.ops.wm.read_factory_settings(use_empty=True)
        scene = bpy.context.scene
        before = self.export(scene)
        for holder, names in ((scene.render, ("resolution_x", "resolution_y", "resolution_percentage", "pixel_aspect_x",
                                              "pixel_aspect_y", "use_border", "film_transparent", "use_motion_blur")),
                              (scene.cycles, ("film_exposure", "pixel_filter_type", "filter_width"))):
            for name in names:
                for value in change(holder, name):
                    with self.subTest(f"{name} = {value}"):
                        self.assertNotEqual(self.export(scene), before)

    def export(self, scene):
        notices = Notices()
        return str(camera.film(scene, notices)), notices.texts


class Worlds(unittest.TestCase):
    def test_a_property_counts_or_is_named(self):
        made = bpy.data.worlds.new("the world")
        made.color = (0.2, 0.3, 0.4)
        before = self.export(made)
        for holder in (made, made.cycles, made.cycles_visibility):
            for one in holder.bl_rna.properties:
                if one.identifier in {*ID_PROPERTIES, "use_nodes", "is_caustics_light", "sampling_method", "shadow",
                                      "sample_map_resolution", "homogeneous_volume", "volume_sampling", "volume_interpolation",
                                      "volume_step_size"} or one.is_readonly or one.type in ("STRING", "POINTER"):
                    continue  # the editor's, noise, or of volumes, which are named
                for value in change(holder, one.identifier):
                    with self.subTest(f"{one.identifier} = {value}"):
                        self.assertNotEqual(self.export(made), before)

    def export(self, made):
        notices = Notices()
        return str(world.export(made, ImageFiles(FOLDER), notices)), notices.texts


class Cameras(unittest.TestCase):
    def test_a_property_counts_or_is_named(self):
        bpy.ops.wm.read_factory_settings(use_empty=True)
        scene = bpy.context.scene
        item = bpy.data.objects.new("the camera", bpy.data.cameras.new("the camera"))
        data = item.data
        data.dof.use_dof = True
        before = self.export(item, scene)
        editor = {one.identifier for one in data.bl_rna.properties if one.identifier.startswith("show_")}
        known = editor | {*ID_PROPERTIES, "display_size", "passepartout_alpha", "lens_unit", "clip_start", "clip_end",
                          "ortho_scale", "sensor_height", "angle", "angle_x", "angle_y", "use_dof"}
        for holder in (data, data.dof):
            for one in holder.bl_rna.properties:
                if one.identifier in known or one.is_readonly or one.type in ("STRING", "POINTER"):
                    continue
                if one.identifier == "aperture_rotation":
                    continue  # of blades, which are named
                for value in change(holder, one.identifier):
                    if value == "HORIZONTAL":
                        continue  # AUTO of a wide film
                    if one.identifier == "aperture_blades":
                        data.dof.aperture_blades = 5
                    with self.subTest(f"{one.identifier} = {value}"):
                        self.assertNotEqual(self.export(item, scene), before)

    def export(self, item, scene):
        notices = Notices()
        return str(camera.export(item, item.matrix_world, scene, notices)), notices.texts
