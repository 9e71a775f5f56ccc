"""Runs in Blender. Makes small scenes with one feature each, saves them, and renders them with Cycles.

  blender --background --factory-startup --python cases.py -- FOLDER SAMPLES [CASE…]

FOLDER gets CASE.blend and CASE.cycles.exr of each case, or of all. Existing pictures are kept.
"""
import math
import os
import pathlib
import sys

import bpy

sys.dont_write_bytecode = True
sys.path.append(str(pathlib.Path(__file__).resolve().parents[3] / "scenes" / "blender"))

import kit  # noqa: E402  (the path is set above)
from kit import NODES, gray, image, insert, light, material, mixture, shader_of, sky, textured  # noqa: E402

CASES = {}
GAP = 0.05  # below glass: of coincident faces, a renderer may hit any one


def case(make):
    CASES[make.__name__.replace("_", "-")] = make
    return make


# Building blocks of the cases.

def floor(surface=None):
    bpy.ops.mesh.primitive_plane_add(size=12)
    bpy.context.object.data.materials.append(surface or material("floor", Color=gray(0.5)))
    return bpy.context.object


def ball(surface=None, x=-1.1, radius=0.8):
    bpy.ops.mesh.primitive_uv_sphere_add(segments=96, ring_count=48, radius=radius, location=(x, 0, radius))
    bpy.ops.object.shade_smooth()
    bpy.context.object.data.materials.append(surface or material("ball", Color=(0.7, 0.3, 0.2, 1)))
    return bpy.context.object


def block(surface=None, x=1.0):
    bpy.ops.mesh.primitive_cube_add(size=1.3, location=(x, 0.2, 0.65), rotation=(0, 0, 0.5))
    bpy.context.object.data.materials.append(surface or material("block", Color=(0.2, 0.4, 0.7, 1)))
    return bpy.context.object


def things(**surfaces):
    floor(surfaces.get("floor"))
    ball(surfaces.get("ball"))
    block(surfaces.get("block"))


def under_the_sky(lifted=0.0, **surfaces):
    things(**surfaces)
    for item in bpy.data.objects:
        if item.type == "MESH" and item.name != "Plane":
            item.location.z += lifted
    sky(0.6)
    light("SUN", 2, rotation=(0.7, 0.2, 0), angle=0.3)


# Lights.

@case
def point():
    things()
    light("POINT", 300, shadow_soft_size=0)


@case
def point_with_radius():
    things()
    light("POINT", 300, shadow_soft_size=0.3)


@case
def sun():
    things()
    light("SUN", 3, rotation=(0.7, 0.3, 0), angle=0)


@case
def sun_with_angle():
    things()
    light("SUN", 3, rotation=(0.7, 0.3, 0), angle=math.radians(40))


@case
def spot():
    things()
    light("SPOT", 600, (1, -2, 3.5), (0.5, 0.2, 0), spot_size=1.0, spot_blend=0.4, shadow_soft_size=0)


@case
def spot_with_radius():
    things()
    light("SPOT", 600, (1, -2, 3.5), (0.5, 0.2, 0), spot_size=1.0, spot_blend=0.4, shadow_soft_size=0.2)


@case
def area_square():
    things()
    light("AREA", 200, (1.5, -1.5, 3), (0.5, 0.4, 0), size=1.5)


@case
def area_rectangle_scaled():
    things()
    light("AREA", 200, (1.5, -1.5, 3), (0.5, 0.4, 0), shape="RECTANGLE", size=1.5, size_y=0.5).scale = (1.5, 0.7, 1)


@case
def area_disk():
    things()
    light("AREA", 200, (1.5, -1.5, 3), (0.5, 0.4, 0), shape="DISK", size=1.5)


@case
def area_ellipse():
    things()
    light("AREA", 200, (1.5, -1.5, 3), (0.5, 0.4, 0.3), shape="ELLIPSE", size=2.0, size_y=0.6)


@case
def area_spread():
    things()
    light("AREA", 200, (0, -0.5, 3), (0.1, 0, 0), size=1.0, spread=math.radians(70))


@case
def area_in_view():
    things()
    light("AREA", 150, (0, 1.5, 2), (-0.6, 0, 0), size=1.5).visible_camera = True
    light("AREA", 50, (-2, 1, 2.2), (-0.6, 0, 0.4), size=0.8)


@case
def light_nodes():
    things()
    data = light("POINT", 300, shadow_soft_size=0.1).data
    data.use_nodes = True
    emission = data.node_tree.nodes["Emission"]
    emission.inputs["Strength"].default_value = 0.5
    body = data.node_tree.nodes.new("ShaderNodeBlackbody")
    body.inputs[0].default_value = 3500
    data.node_tree.links.new(body.outputs[0], emission.inputs["Color"])


# Worlds.

@case
def world_color():
    things()
    sky(1.5, (0.4, 0.6, 1, 1))


def world_picture():
    bright = image("sky", 64, lambda x, y: (0.2 + 6 * (abs(x - 0.3) < 0.08 and abs(y - 0.7) < 0.1), 0.3 + y / 2, 0.2 + x, 1),
                   float_buffer=True)
    tree = bpy.context.scene.world.node_tree
    node = tree.nodes.new("ShaderNodeTexEnvironment")
    node.image = bright
    tree.links.new(node.outputs[0], sky(0.8).inputs["Color"])
    return tree, node


@case
def world_image():
    things()
    world_picture()


@case
def world_image_turned():
    things()
    tree, node = world_picture()
    move, source = tree.nodes.new("ShaderNodeMapping"), tree.nodes.new("ShaderNodeTexCoord")
    move.inputs["Rotation"].default_value = (0, 0, 1.2)
    tree.links.new(source.outputs["Generated"], move.inputs["Vector"])
    tree.links.new(move.outputs[0], node.inputs["Vector"])


# Cameras.

@case
def world_image_tilted():
    things()
    tree, node = world_picture()
    move, source = tree.nodes.new("ShaderNodeMapping"), tree.nodes.new("ShaderNodeTexCoord")
    move.inputs["Rotation"].default_value = (0.7, -0.4, 1.2)
    tree.links.new(source.outputs["Generated"], move.inputs["Vector"])
    tree.links.new(move.outputs[0], node.inputs["Vector"])


@case
def sky_texture():
    things()
    tree = bpy.context.scene.world.node_tree
    node = tree.nodes.new("ShaderNodeTexSky")
    node.sky_type, node.sun_elevation, node.sun_rotation = "NISHITA", 0.5, 0.8
    tree.links.new(node.outputs[0], tree.nodes["Background"].inputs["Color"])
    tree.nodes["Background"].inputs["Strength"].default_value = 0.05


@case
def absorbing_glass():
    """A volume in glass."""
    glass = material("glass", "BSDF_GLASS", Color=gray(1), Roughness=0, IOR=1.45)
    insert(glass, "ShaderNodeVolumeAbsorption", glass.node_tree.nodes["Material Output"].inputs["Volume"], Color=(0.2, 0.6, 0.9, 1), Density=1)
    under_the_sky(GAP, ball=glass, block=glass)


@case
def fog():
    """A cube of fog around the objects."""
    under_the_sky()
    bpy.ops.mesh.primitive_cube_add(size=5, location=(0, 0, 2.4))
    air = bpy.data.materials.new("air")
    air.use_nodes = True
    air.node_tree.nodes.clear()
    end = air.node_tree.nodes.new("ShaderNodeOutputMaterial")
    insert(air, "ShaderNodeVolumeScatter", end.inputs["Volume"], Color=(0.9, 0.95, 1, 1), Density=0.25, Anisotropy=0.4)
    bpy.context.object.data.materials.append(air)


@case
def depth_of_field():
    under_the_sky()
    dof = bpy.context.scene.camera.data.dof
    dof.use_dof, dof.focus_distance, dof.aperture_fstop = True, 5.5, 0.08


@case
def vertical_sensor():
    under_the_sky()
    data = bpy.context.scene.camera.data
    data.sensor_fit, data.sensor_height, data.lens = "VERTICAL", 20, 30


# Materials.

@case
def rough_diffuse():
    under_the_sky(floor=material("clay", Color=(0.8, 0.8, 0.8, 1), Roughness=1.0),
                  ball=material("sand", Color=(0.8, 0.6, 0.4, 1), Roughness=1.0),
                  block=material("plaster", Color=(0.3, 0.5, 0.8, 1), Roughness=0.5))


@case
def principled_rough_floor():
    rough = material("rough", "BSDF_PRINCIPLED", Base_Color=gray(0.6), Roughness=1.0)
    under_the_sky(floor=rough, ball=rough, block=rough)


@case
def principled_matt():
    matt = material("matt", "BSDF_PRINCIPLED", Base_Color=(0.7, 0.5, 0.3, 1), Roughness=0.5, Specular=0.0)
    under_the_sky(floor=matt, ball=matt, block=matt)


@case
def principled_plastic():
    under_the_sky(floor=material("floor", "BSDF_PRINCIPLED", Base_Color=gray(0.5), Roughness=0.5),
                  ball=material("ball", "BSDF_PRINCIPLED", Base_Color=(0.7, 0.1, 0.05, 1), Roughness=0.2),
                  block=material("block", "BSDF_PRINCIPLED", Base_Color=(0.1, 0.2, 0.6, 1), Roughness=0.6, Specular=1.0))


@case
def principled_metal():
    under_the_sky(ball=material("ball", "BSDF_PRINCIPLED", Base_Color=(0.9, 0.7, 0.3, 1), Metallic=1.0, Roughness=0.3),
                  block=material("block", "BSDF_PRINCIPLED", Base_Color=(0.6, 0.6, 0.65, 1), Metallic=1.0, Roughness=0.6))


@case
def principled_glass():
    green = {"Base_Color": (0.8, 1, 0.9, 1), "Transmission": 1.0, "Roughness": 0.0, "IOR": 1.45}
    under_the_sky(GAP, ball=material("ball", "BSDF_PRINCIPLED", **green), block=material("block", "BSDF_PRINCIPLED", **green))


def floor_alone(degrees):
    """A principled floor under a uniform sky. It fills the picture, seen from this angle above the horizon."""
    floor(material("floor", "BSDF_PRINCIPLED", Base_Color=gray(0.6), Roughness=1.0)).scale = (100, 100, 1)
    from_height(degrees)


def from_height(degrees):
    sky(1.0)
    camera = bpy.context.scene.camera
    camera.location, camera.rotation_euler, camera.data.lens = (0, 0, 2), (math.radians(90 - degrees), 0, 0), 200


@case
def principled_floor_from_above():
    floor_alone(90)


@case
def principled_floor_from_30_degrees():
    floor_alone(30)


@case
def principled_floor_from_15_degrees():
    floor_alone(15)


@case
def principled_coat():
    under_the_sky(ball=material("ball", "BSDF_PRINCIPLED", Base_Color=(0.1, 0.3, 0.1, 1), Roughness=0.6, Clearcoat=1.0),
                  block=material("block", "BSDF_PRINCIPLED", Base_Color=(0.6, 0.1, 0.1, 1), Roughness=0.6, Clearcoat=1.0,
                                 Clearcoat_Roughness=0.3))


@case
def principled_anisotropic():
    under_the_sky(ball=material("ball", "BSDF_PRINCIPLED", Base_Color=(0.9, 0.7, 0.3, 1), Metallic=1.0, Roughness=0.35,
                                Anisotropic=0.9),
                  block=material("block", "BSDF_PRINCIPLED", Base_Color=(0.6, 0.6, 0.65, 1), Metallic=1.0, Roughness=0.35,
                                 Anisotropic=0.9, Anisotropic_Rotation=0.2))


@case
def anisotropic():
    along = material("ball", "BSDF_ANISOTROPIC", Color=gray(0.8), Roughness=0.4, Anisotropy=0.6)
    tangent = insert(along, "ShaderNodeTangent", shader_of(along).inputs["Tangent"])
    tangent.direction_type = "UV_MAP"
    under_the_sky(ball=along, block=material("block", "BSDF_ANISOTROPIC", Color=gray(0.8), Roughness=0.4, Anisotropy=-0.6))


@case
def principled_sheen():
    dark = {"Base_Color": (0.05, 0.01, 0.02, 1), "Roughness": 0.8, "Specular": 0.0, "Sheen": 1.0}
    under_the_sky(ball=material("ball", "BSDF_PRINCIPLED", **dark, Sheen_Tint=0.0),
                  block=material("block", "BSDF_PRINCIPLED", **dark, Sheen_Tint=1.0))


@case
def glossy():
    under_the_sky(ball=material("ball", "BSDF_GLOSSY", Color=(0.9, 0.7, 0.3, 1), Roughness=0.0),
                  block=material("block", "BSDF_GLOSSY", Color=(0.3, 0.5, 0.8, 1), Roughness=0.4))


@case
def glass():
    clear = {"Color": (1, 1, 1, 1), "Roughness": 0.0, "IOR": 1.5}
    under_the_sky(GAP, ball=material("ball", "BSDF_GLASS", **clear), block=material("block", "BSDF_GLASS", **clear))


@case
def rough_glass():
    rough = {"Color": (1, 1, 1, 1), "Roughness": 0.3, "IOR": 1.5, "distribution": "GGX"}
    under_the_sky(GAP, ball=material("ball", "BSDF_GLASS", **rough), block=material("block", "BSDF_GLASS", **rough))


@case
def emission():
    things(ball=material("ball", "EMISSION", Color=(1, 0.6, 0.3, 1), Strength=4.0))


@case
def transparent_mix():
    veil = mixture("veil", ("BSDF_TRANSPARENT", {}), ("BSDF_DIFFUSE", {"Color": (0.7, 0.2, 0.2, 1)}), 0.4)
    glow = mixture("glow", ("BSDF_TRANSPARENT", {}), ("EMISSION", {"Color": (0.2, 0.5, 1, 1), "Strength": 2}), 0.3)
    under_the_sky(ball=veil, block=glow)


@case
def diffuse_and_glossy_mix():
    same = {"Color": (0.6, 0.4, 0.2, 1)}
    under_the_sky(ball=mixture("ball", ("BSDF_DIFFUSE", same), ("BSDF_GLOSSY", {**same, "Roughness": 0.3}), 0.4),
                  block=mixture("block", ("BSDF_DIFFUSE", {"Color": (0.1, 0.3, 0.6, 1)}),
                                ("BSDF_GLOSSY", {"Color": (0.9, 0.9, 0.9, 1), "Roughness": 0.2}), 0.2))


@case
def diffuse_and_glossy_sum():
    under_the_sky(ball=mixture("ball", ("BSDF_DIFFUSE", {"Color": (0.1, 0.3, 0.6, 1)}),
                               ("BSDF_GLOSSY", {"Color": gray(0.3), "Roughness": 0.2})),
                  block=mixture("block", ("BSDF_DIFFUSE", {"Color": (0.5, 0.2, 0.1, 1)}), ("BSDF_DIFFUSE", {"Color": gray(0.2)})))


PAINT = "BSDF_PRINCIPLED", {"Base Color": (0.1, 0.3, 0.7, 1), "Roughness": 0.3}
IRON = "BSDF_PRINCIPLED", {"Base Color": (0.7, 0.65, 0.6, 1), "Metallic": 1.0, "Roughness": 0.2}
RUST = "BSDF_PRINCIPLED", {"Base Color": (0.4, 0.15, 0.05, 1), "Roughness": 0.9, "Specular": 0.2}


@case
def principled_mix_by_image():
    spots = image("spots", 64, lambda x, y: (min(max(2 * math.sin(19 * x) * math.sin(19 * y) + 0.5, 0), 1),) * 3 + (1,), data=True)
    under_the_sky(ball=mixture("ball", PAINT, RUST, spots), block=mixture("block", IRON, RUST, spots))


@case
def three_way_mix():
    spots = image("spots", 64, lambda x, y: (0.5 + 0.5 * math.sin(19 * x) * math.sin(19 * y),) * 3 + (1,), data=True)
    dust = "BSDF_DIFFUSE", {"Color": (0.6, 0.5, 0.4, 1), "Roughness": 0.8}
    under_the_sky(ball=mixture("ball", (PAINT, ("BSDF_GLOSSY", {"Color": gray(1), "Roughness": 0.1}), 0.2), dust, 0.3),
                  block=mixture("block", (PAINT, RUST, spots), dust, 0.4))


@case
def emission_mix():
    glow = "EMISSION", {"Color": (1, 0.5, 0.2, 1), "Strength": 2.0}
    spots = image("spots", 64, lambda x, y: (float(math.sin(19 * x) * math.sin(19 * y) > 0.5),) * 3 + (1,), data=True)
    under_the_sky(ball=mixture("ball", IRON, glow, 0.3), block=mixture("block", PAINT, glow, spots))


# Sheets, glass and plastic of mixtures.

def sheet(surface, x=0.0, turned=0.0):
    bpy.ops.mesh.primitive_plane_add(size=1.8, location=(x, 0, 1), rotation=(math.radians(90), 0, turned))
    bpy.context.object.data.materials.append(surface)


GREEN = "BSDF_DIFFUSE", {"Color": (0.1, 0.4, 0.05, 1)}
SHINING_THROUGH = "BSDF_TRANSLUCENT", {"Color": (0.6, 0.8, 0.2, 1)}


def sheets_in_the_sun(behind):
    floor()
    sky(0.1)
    light("SUN", 3, rotation=(-0.9 if behind else 0.9, 0.2, 0), angle=0.1)
    sheet(material("paper", "BSDF_TRANSLUCENT", Color=(0.8, 0.7, 0.5, 1)), x=-1.1)
    sheet(mixture("leaf", GREEN, SHINING_THROUGH, 0.6), x=1.1, turned=0.4)


@case
def translucent_from_the_front():
    sheets_in_the_sun(behind=False)


@case
def translucent_from_behind():
    sheets_in_the_sun(behind=True)


@case
def leaf():
    """Sheets that add and mix both sides, with textures, a rough side and an image as the factor."""
    veins = image("veins", 64, lambda x, y: (0.5 + 0.5 * math.sin(25 * x) * math.sin(25 * y),) * 3 + (1,), data=True)
    rough = "BSDF_DIFFUSE", {"Color": (0.1, 0.4, 0.05, 1), "Roughness": 0.8}
    floor()
    sky(0.3)
    light("SUN", 3, rotation=(-0.7, 0.3, 0), angle=0.1)
    sheet(mixture("leaf", GREEN, SHINING_THROUGH, veins), x=-1.8)
    sheet(mixture("rough leaf", rough, SHINING_THROUGH, 0.5), x=1.8)
    ball(mixture("lantern", GREEN, ("BSDF_TRANSLUCENT", {"Color": (0.5, 0.3, 0.2, 1)})), x=0.0)


def skins(falloff, **inputs):
    """A ball and a block that light enters and leaves."""
    skin = material("skin", "SUBSURFACE_SCATTERING", Color=(0.7, 0.4, 0.25, 1), Radius=(1.0, 0.4, 0.2), Scale=0.3, **inputs)
    shader_of(skin).falloff = falloff
    under_the_sky(lifted=GAP, ball=skin, block=skin)


@case
def subsurface():
    skins("RANDOM_WALK_FIXED_RADIUS")


@case
def subsurface_by_index():
    skins("RANDOM_WALK", IOR=1.4)


@case
def subsurface_forwards():
    skins("RANDOM_WALK_FIXED_RADIUS", Anisotropy=0.7)


def glossy_skins(method, **inputs):
    """The same with a highlight."""
    skin = material("skin", "BSDF_PRINCIPLED", Subsurface_Color=(0.7, 0.4, 0.25, 1), Subsurface_Radius=(1.0, 0.4, 0.2), **inputs)
    shader_of(skin).subsurface_method = method
    under_the_sky(lifted=GAP, ball=skin, block=skin)


@case
def principled_subsurface():
    glossy_skins("RANDOM_WALK_FIXED_RADIUS", Base_Color=(0.7, 0.4, 0.25, 1), Subsurface=0.3, Roughness=0.3)


@case
def principled_subsurface_by_index():
    glossy_skins("RANDOM_WALK", Base_Color=(0.3, 0.5, 0.7, 1), Subsurface=0.4, Subsurface_IOR=1.4, Roughness=0.6, Clearcoat=1.0)


@case
def principled_subsurface_by_image():
    freckles = image("freckles", 64, lambda x, y: (0.7, *(0.4 if math.sin(40 * x) * math.sin(40 * y) > 0 else 0.2,) * 2, 1))
    skin = material("skin", "BSDF_PRINCIPLED", Subsurface=0.1, Subsurface_Radius=(1.0, 0.4, 0.2), Roughness=0.3)
    shader_of(skin).subsurface_method = "RANDOM_WALK_FIXED_RADIUS"
    for name in ("Base Color", "Subsurface Color"):
        textured(skin, freckles, shader_of(skin).inputs[name])
    under_the_sky(lifted=GAP, ball=skin, block=skin)


@case
def fresnel_subsurface():
    inner = "SUBSURFACE_SCATTERING", {"Color": (0.7, 0.4, 0.25, 1), "Radius": (1.0, 0.4, 0.2), "Scale": 0.3}
    shiny = "BSDF_GLOSSY", {"Color": gray(1), "Roughness": 0.2}
    skin = mixture("skin", inner, shiny, ("FRESNEL", {"IOR": 1.45}))
    under_the_sky(lifted=GAP, ball=skin, block=skin)


@case
def glass_mix_by_image():
    spots = image("spots", 64, lambda x, y: (min(max(2 * math.sin(19 * x) * math.sin(19 * y) + 0.5, 0), 1),) * 3 + (1,), data=True)
    clear, rough = ("BSDF_GLASS", {"Color": gray(1), "Roughness": 0.0, "IOR": 1.5}), ("BSDF_DIFFUSE", {"Color": (0.7, 0.3, 0.2, 1)})
    under_the_sky(GAP, ball=mixture("ball", clear, rough, spots), block=mixture("block", clear, rough, spots))


@case
def fresnel_plastic():
    matt, shiny = ("BSDF_DIFFUSE", {"Color": (0.6, 0.1, 0.1, 1)}), ("BSDF_GLOSSY", {"Color": gray(1), "Roughness": 0.2})
    under_the_sky(ball=mixture("ball", matt, shiny, ("FRESNEL", {"IOR": 1.45})),
                  block=mixture("block", matt, shiny, ("LAYER_WEIGHT", {"Blend": 0.4})))


@case
def fresnel_plastic_with_grey_gloss():
    matt, shiny = ("BSDF_DIFFUSE", {"Color": (0.1, 0.3, 0.6, 1)}), ("BSDF_GLOSSY", {"Color": gray(0.5), "Roughness": 0.0})
    under_the_sky(ball=mixture("ball", matt, shiny, ("FRESNEL", {"IOR": 1.5})),
                  block=mixture("block", matt, shiny, ("FRESNEL", {"IOR": 1.8})))


# Textures.

@case
def image_texture():
    tiles = material("tiles")
    textured(tiles, image("tiles"), shader_of(tiles).inputs["Color"], "UV",
             {"Scale": (3, 2, 1), "Rotation": (0, 0, 0.4), "Location": (0.2, 0.1, 0)})
    under_the_sky(floor=tiles, block=tiles)


@case
def image_tiles():
    """Four images, one for each square of u and v (UDIM). One is larger, and one square has none."""
    folder = sys.argv[sys.argv.index("--") + 1]
    for number, size, color in ((1001, 64, (0.8, 0.2, 0.1)), (1002, 32, (0.1, 0.6, 0.2)), (1011, 32, (0.2, 0.3, 0.8))):
        picture = image(f"wall.{number}", size, lambda x, y, c=color: (c[0] * x, c[1] * y, c[2], 1))
        picture.filepath_raw, picture.file_format = os.path.join(folder, f"wall.{number}.png"), "PNG"
        picture.save()
    wall = bpy.data.images.load(os.path.join(folder, "wall.1001.png"))
    wall.source, wall.filepath = "TILED", os.path.join(folder, "wall.<UDIM>.png")
    for number in (1002, 1011):
        wall.tiles.new(number)
    painted = material("painted")
    textured(painted, wall, shader_of(painted).inputs["Color"], "UV", {"Scale": (1.9, 1.9, 1), "Location": (0.05, 0.05, 0)})
    under_the_sky(floor=painted, block=painted)


@case
def generated_coordinates():
    tiles = material("tiles")
    textured(tiles, image("tiles"), shader_of(tiles).inputs["Color"], "Generated",
             {"Scale": (0.9, 0.9, 1), "Location": (0.05, 0.05, 0)})  # without the seam
    under_the_sky(floor=tiles, ball=tiles, block=tiles)


@case
def alpha_cutout():
    leaf = material("leaf", "BSDF_PRINCIPLED", Roughness=1.0, Specular=0.0)
    picture = image("leaf", 64, lambda x, y: (0.3, 0.6, 0.2, 1.0 if (x - 0.5) ** 2 + (y - 0.5) ** 2 < 0.12 else 0.0))
    node = textured(leaf, picture, shader_of(leaf).inputs["Base Color"], "UV", {"Scale": (3, 3, 1)})
    leaf.node_tree.links.new(node.outputs["Alpha"], shader_of(leaf).inputs["Alpha"])
    under_the_sky(ball=leaf, block=leaf)


@case
def color_ramp():
    banded = material("banded")
    ramp = insert(banded, "ShaderNodeValToRGB", shader_of(banded).inputs["Color"])
    ramp.color_ramp.elements[0].color, ramp.color_ramp.elements[1].color = (0.8, 0.1, 0.1, 1), (0.1, 0.2, 0.8, 1)
    ramp.color_ramp.elements[0].position, ramp.color_ramp.elements[1].position = 0.3, 0.6
    textured(banded, image("slope", 64, lambda x, y: (x, x, x, 1)), ramp.inputs[0], "UV")
    under_the_sky(floor=banded, ball=banded)


@case
def vertex_colors():
    painted = material("painted")
    node = insert(painted, "ShaderNodeVertexColor", shader_of(painted).inputs["Color"])
    node.layer_name = "paint"
    under_the_sky(floor=painted, block=painted)
    for item in bpy.data.objects:
        if item.type == "MESH" and item.data.materials[0] == painted:
            colors = item.data.color_attributes.new("paint", "FLOAT_COLOR", "CORNER").data
            for i, one in enumerate(colors):
                one.color = ((0.9, 0.1, 0.1, 1), (0.1, 0.9, 0.1, 1), (0.1, 0.1, 0.9, 1), (0.8, 0.8, 0.2, 1))[i % 4]


@case
def normal_map():
    bumpy = material("bumpy")
    node = insert(bumpy, "ShaderNodeNormalMap", shader_of(bumpy).inputs["Normal"])
    picture = image("normals", 64, lambda x, y: (0.5 + 0.2 * math.sin(12.57 * x), 0.5 + 0.2 * math.cos(12.57 * y),
                                                 0.5 + 0.5 * math.sqrt(1 - 0.16 * (math.sin(12.57 * x) ** 2 + math.cos(12.57 * y) ** 2)), 1),
                    data=True)
    textured(bumpy, picture, node.inputs["Color"])
    under_the_sky(floor=bumpy, block=bumpy)


@case
def normals_alone():
    """A floor under a uniform sky. It fills the picture, and its normals lean by 40°."""
    leaning = material("leaning", Color=gray(0.6))
    lean = math.radians(40)
    node = insert(leaning, "ShaderNodeNormalMap", shader_of(leaning).inputs["Normal"])
    textured(leaning, image("normal", 2, lambda x, y: (0.5 + 0.5 * math.sin(lean), 0.5, 0.5 + 0.5 * math.cos(lean), 1), data=True,
                            float_buffer=True), node.inputs["Color"])
    floor(leaning)
    from_height(90)


@case
def bump():
    bumpy = material("bumpy")
    node = insert(bumpy, "ShaderNodeBump", shader_of(bumpy).inputs["Normal"])
    node.inputs["Distance"].default_value = 0.15
    textured(bumpy, image("hills", 128, lambda x, y: (0.5 + 0.5 * math.sin(25.13 * x) * math.sin(25.13 * y),) * 3 + (1,), data=True),
             node.inputs["Height"], "UV")
    under_the_sky(floor=bumpy, block=bumpy)


@case
def roughness_map():
    worn = material("worn", "BSDF_PRINCIPLED", Base_Color=(0.8, 0.8, 0.8, 1), Metallic=1.0)
    textured(worn, image("wear", 64, lambda x, y: (0.2 + 0.6 * x, 0.2 + 0.6 * x, 0.2 + 0.6 * x, 1), data=True),
             shader_of(worn).inputs["Roughness"], "UV")
    under_the_sky(ball=worn, block=worn)


@case
def principled_gloss_by_images():
    worn = material("worn", "BSDF_PRINCIPLED", Base_Color=(0.5, 0.1, 0.1, 1), Roughness=0.5)
    for socket, frequency, least in (("Specular", 19, 0.0), ("Clearcoat", 12.57, 0.0), ("Clearcoat Roughness", 25.13, 0.1)):
        picture = image(socket, 64, lambda x, y, f=frequency, low=least: (low + (0.5 + 0.5 * math.sin(f * x)) * (1 - low),) * 3 + (1,),
                        data=True)
        textured(worn, picture, shader_of(worn).inputs[socket], "UV")
    under_the_sky(ball=worn, block=worn)


# Objects.

@case
def instances_and_modifiers():
    floor()
    sky(0.6)
    light("SUN", 2, rotation=(0.7, 0.2, 0), angle=0.3)
    group = bpy.data.collections.new("group")
    bpy.ops.mesh.primitive_monkey_add(size=0.9)
    monkey = bpy.context.object
    monkey.data.materials.append(material("monkey", Color=(0.7, 0.5, 0.3, 1)))
    bpy.ops.object.shade_smooth()
    monkey.modifiers.new("subdivision", "SUBSURF").render_levels = 2
    bpy.context.scene.collection.objects.unlink(monkey)
    group.objects.link(monkey)
    for i in range(4):
        empty = bpy.data.objects.new(f"copy {i}", None)
        empty.instance_type, empty.instance_collection = "COLLECTION", group
        empty.location, empty.rotation_euler = (i - 1.5, 0.3 * i, 0.6), (0, 0, i)
        empty.scale = (-1 if i == 1 else 1, 1, 1 + 0.2 * i)
        bpy.context.scene.collection.objects.link(empty)
    bpy.ops.object.text_add(location=(-1.5, -1.5, 0.01))
    bpy.context.object.data.body = "text"
    bpy.ops.object.metaball_add(radius=0.5, location=(1.6, -1, 0.3))


@case
def mixed():
    """Plastic, metal, coat and matt paint under three lights and a sky."""
    floor(material("floor", "BSDF_PRINCIPLED", Base_Color=gray(0.6), Roughness=0.9))
    block(material("plastic", "BSDF_PRINCIPLED", Base_Color=(0.7, 0.1, 0.05, 1), Roughness=0.3), x=-1.6)
    ball(material("metal", "BSDF_PRINCIPLED", Base_Color=(0.9, 0.7, 0.3, 1), Metallic=1.0, Roughness=0.25), x=0.1)
    ball(material("matt", "BSDF_PRINCIPLED", Base_Color=(0.1, 0.3, 0.7, 1), Roughness=1.0, Specular=0.0), x=1.6, radius=0.5)
    bpy.ops.mesh.primitive_monkey_add(size=1.2, location=(1.6, 1.5, 0.8))
    bpy.ops.object.shade_smooth()
    bpy.context.object.data.materials.append(material("coated", "BSDF_PRINCIPLED", Base_Color=(0.2, 0.5, 0.2, 1), Roughness=0.6,
                                                      Clearcoat=1.0, Clearcoat_Roughness=0.1))
    bpy.context.object.modifiers.new("subdivision", "SUBSURF").render_levels = 2
    light("POINT", 300, (-3, -3, 4), shadow_soft_size=0)
    light("AREA", 200, (3, -2, 4), (0.6, 0.4, 0), size=1.5)
    light("SUN", 1, rotation=(0.9, 0, 1), angle=0)
    sky(0.5, (0.4, 0.6, 1, 1))


@case
def shadow_catcher():
    under_the_sky()
    bpy.data.objects["Plane"].is_shadow_catcher = True


@case
def shadow_catcher_dark():
    """Beside a dark wall that scatters little light onto it."""
    dark = material("dark", Color=gray(0.05))
    under_the_sky(ball=dark, block=dark)
    bpy.data.objects["Plane"].is_shadow_catcher = True


def procedural(surface, kind, socket, output="Color", coordinates="Generated", **properties):
    """Links a procedural texture to an input of the surface's shader."""
    tree = surface.node_tree
    texture, place = tree.nodes.new(kind), tree.nodes.new("ShaderNodeTexCoord")
    for key, value in properties.items():
        if key in texture.inputs:
            texture.inputs[key].default_value = value
        else:
            setattr(texture, key, value)
    tree.links.new(place.outputs[coordinates], texture.inputs["Vector"])
    tree.links.new(texture.outputs[output], shader_of(surface).inputs[socket])
    return texture


@case
def procedural_colors():
    noise, checker, wood = material("noise"), material("checker"), material("wood")
    procedural(noise, "ShaderNodeTexNoise", "Color", Scale=4.0)
    procedural(checker, "ShaderNodeTexChecker", "Color", coordinates="Object", Scale=1.5, Color1=(0.8, 0.2, 0.1, 1))
    procedural(wood, "ShaderNodeTexWave", "Color", Scale=1.5, Distortion=4.0)
    under_the_sky(floor=checker, ball=noise, block=wood)


@case
def procedural_plastic():
    """Roughness by a texture, colours by a ramp."""
    spots = material("spots", "BSDF_PRINCIPLED", Roughness=0.3)
    tree = spots.node_tree
    cells = procedural(spots, "ShaderNodeTexVoronoi", "Roughness", output="Distance", Scale=5.0)
    ramp = tree.nodes.new("ShaderNodeValToRGB")
    ramp.color_ramp.elements[0].color, ramp.color_ramp.elements[1].color = (0.1, 0.3, 0.7, 1), (0.8, 0.7, 0.2, 1)
    tree.links.new(cells.outputs["Distance"], ramp.inputs["Fac"])
    tree.links.new(ramp.outputs["Color"], shader_of(spots).inputs["Base Color"])
    under_the_sky(ball=spots)


@case
def procedural_mix():
    """Two shaders, mixed by noise."""
    mixed = material("mixed", Color=(0.7, 0.2, 0.1, 1))
    tree = mixed.node_tree
    first, end = shader_of(mixed), tree.nodes["Material Output"]
    second, mix = tree.nodes.new(NODES["BSDF_GLOSSY"]), tree.nodes.new("ShaderNodeMixShader")
    second.inputs["Roughness"].default_value = 0.3
    noise = tree.nodes.new("ShaderNodeTexNoise")
    noise.inputs["Scale"].default_value = 3
    tree.links.new(noise.outputs["Fac"], mix.inputs["Fac"])
    tree.links.new(first.outputs[0], mix.inputs[1])
    tree.links.new(second.outputs[0], mix.inputs[2])
    tree.links.new(mix.outputs[0], end.inputs["Surface"])
    under_the_sky(ball=mixed, block=mixed)


def begin():
    """An empty scene that has a camera and a black world."""
    scene = kit.begin()
    scene.camera = kit.place(bpy.data.objects.new("camera", bpy.data.cameras.new("camera")))
    scene.camera.location, scene.camera.rotation_euler, scene.camera.data.lens = (0, -6, 2.6), (math.radians(69), 0, 0), 42
    scene.render.resolution_x, scene.render.resolution_y, scene.render.resolution_percentage = 96, 64, 100
    return scene


def render(scene, path, samples):
    """Renders without any setting that changes the expected value, such as clamping."""
    scene.render.engine = "CYCLES"
    cycles = scene.cycles
    cycles.samples, cycles.use_adaptive_sampling, cycles.use_denoising = samples, False, False
    cycles.sample_clamp_direct = cycles.sample_clamp_indirect = cycles.blur_glossy = 0
    cycles.max_bounces = cycles.diffuse_bounces = cycles.glossy_bounces = cycles.transmission_bounces = cycles.volume_bounces = 64
    cycles.transparent_max_bounces = 64
    scene.render.image_settings.file_format, scene.render.image_settings.color_depth = "OPEN_EXR", "32"
    scene.render.filepath = path
    bpy.ops.render.render(write_still=True)


def main():
    folder, samples, *wanted = sys.argv[sys.argv.index("--") + 1:]
    for name, make in CASES.items():
        if wanted and name not in wanted:
            continue
        scene = begin()
        make()
        bpy.ops.wm.save_as_mainfile(filepath=os.path.join(folder, f"{name}.blend"))
        picture = os.path.join(folder, f"{name}.cycles.exr")
        if not os.path.exists(picture):
            render(scene, picture, int(samples))


main()
