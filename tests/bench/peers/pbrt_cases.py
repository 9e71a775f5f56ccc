#!/usr/bin/env python3
"""Writes small scenes of pbrt-v4 with one feature each, for tests/bench/pbrt.sh.

  tests/bench/peers/pbrt_cases.py FOLDER
"""
import array
import math
import pathlib
import struct
import sys
import zlib

FLOOR = """
AttributeBegin
  Material "diffuse" "rgb reflectance" [ 0.5 0.45 0.4 ]
  Shape "bilinearmesh" "point3 P" [ -9 0 9  9 0 9  -9 0 -9  9 0 -9 ] "point2 uv" [ 0 0  1 0  0 1  1 1 ]
AttributeEnd
"""
SKY = 'LightSource "infinite" "rgb L" [ 0.5 0.55 0.6 ]\n'
PANEL = """
AttributeBegin
  Translate 2 4 1
  Rotate 90 1 0 0
  AreaLightSource "diffuse" "rgb L" [ 9 8 7 ] {}
  Shape "bilinearmesh" "point3 P" [ -1 -1 0  1 -1 0  -1 1 0  1 1 0 ]
AttributeEnd
"""
BALL = """
AttributeBegin
  Translate {x} 1 0
  {material}
  Shape "sphere"
AttributeEnd
"""
GREY = 'Material "diffuse" "rgb reflectance" [ 0.4 0.5 0.6 ]'
LIGHT = SKY + PANEL.format("")


def scene(world, camera='Camera "perspective" "float fov" [ 40 ]', film="", look="LookAt 1 3 8  0 0.8 0  0 1 0", head=""):
    return f"""{look}
{camera}
Film "rgb" "integer xresolution" [ 96 ] "integer yresolution" [ 64 ] {film}
Integrator "volpath" "integer maxdepth" [ 16 ]
{head}
WorldBegin
{world}
"""


def balls(material, before=""):
    """A small panel and a sky over a ball of the material and a diffuse one."""
    return scene(LIGHT + before + FLOOR + BALL.format(x=-1.2, material=material) + BALL.format(x=1.4, material=GREY))


def lit(light):
    return scene(light + FLOOR + BALL.format(x=-1.2, material=GREY))


def quad(material, before=""):
    """An upright square of the material behind which a ball stands."""
    return scene(LIGHT + before + FLOOR + BALL.format(x=0.3, material=GREY) + f"""
AttributeBegin
  {material}
  Shape "trianglemesh" "integer indices" [ 0 1 2  0 2 3 ] "point3 P" [ -2 0.1 1.5  0.5 0.1 1.5  0.5 2.2 1.5  -2 2.2 1.5 ]
    "point2 uv" [ 0 0  1 0  1 1  0 1 ] "normal N" [ 0 0 1  0 0 1  0 0 1  0 0 1 ]
AttributeEnd
""")


def fog(medium, surface='Material "interface"'):
    return scene(LIGHT + FLOOR + f"""
MakeNamedMedium "fog" {medium}
AttributeBegin
  Translate 0 1.2 0
  {surface}
  MediumInterface "fog" ""
  Shape "sphere"
AttributeEnd
""")


IMAGE = 'Texture "image" "spectrum" "imagemap" "string filename" "image.png" {}\n'
USE_IMAGE = 'Material "diffuse" "texture reflectance" "image"'
NUMBERS = 'Texture "numbers" "float" "imagemap" "string filename" "image.png" {}\n'
CASES = {
    "light-panel": lit(PANEL.format('"float scale" 2')),
    "light-panel-power": lit(PANEL.format('"float power" 60')),
    "light-panel-two-sided": lit(PANEL.format('"bool twosided" true')),
    "light-sphere-blackbody": lit('AttributeBegin Translate 2 3 2 AreaLightSource "diffuse" "blackbody L" 3200 "float scale" 20 '
                                  'Shape "sphere" "float radius" 0.4 AttributeEnd\n'),
    "light-disk": lit('AttributeBegin Translate 2 3 2 Rotate 90 1 0 0 AreaLightSource "diffuse" "rgb L" [ 9 9 9 ] '
                      'Shape "disk" "float radius" 0.7 AttributeEnd\n'),
    "light-point": lit('LightSource "point" "rgb I" [ 20 15 10 ] "point3 from" [ 2 4 3 ] "float scale" 2\n'),
    "light-point-power": lit('LightSource "point" "rgb I" [ 20 15 10 ] "point3 from" [ 2 4 3 ] "float power" 300\n'),
    "light-spot": lit('LightSource "spot" "rgb I" [ 40 40 30 ] "point3 from" [ 2 4 3 ] "point3 to" [ -1 1 0 ] "float coneangle" 25\n'),
    "light-spot-soft": lit('LightSource "spot" "blackbody I" [ 5000 ] "float scale" 60 "point3 from" [ 2 4 3 ] "point3 to" [ -1 0 0 ] '
                           '"float coneangle" 35 "float conedeltaangle" 30\n'),
    "light-spot-power": lit('LightSource "spot" "float power" 200 "point3 from" [ 2 4 3 ] "point3 to" [ -1 0 0 ]\n'),
    "light-distant": lit('LightSource "distant" "rgb L" [ 2 1.8 1.5 ] "point3 from" [ 2 4 3 ]\n'),
    "light-distant-illuminance": lit('LightSource "distant" "rgb L" [ 2 1.8 1.5 ] "point3 from" [ 2 4 3 ] "float illuminance" 3\n'),
    "light-infinite-illuminance": lit('LightSource "infinite" "rgb L" [ 0.5 0.6 0.9 ] "float illuminance" 2\n'),
    "light-infinite-image": lit('AttributeBegin Rotate -90 1 0 0 Rotate 40 0 0 1 '
                                'LightSource "infinite" "string filename" "sky.pfm" "float scale" 1.5 AttributeEnd\n'),
    "light-illuminant": lit('LightSource "point" "spectrum I" "stdillum-A" "float scale" 40 "point3 from" [ 2 4 3 ]\n'),
    "diffuse": balls('Material "diffuse" "rgb reflectance" [ 0.7 0.2 0.1 ]'),
    "diffuse-transmission": quad('Material "diffusetransmission" "rgb reflectance" [ 0.3 0.2 0.1 ] "rgb transmittance" [ 0.2 0.4 0.3 ]'),
    "conductor": balls('Material "conductor" "float roughness" 0'),
    "conductor-gold-rough": balls('Material "conductor" "spectrum eta" "metal-Au-eta" "spectrum k" "metal-Au-k" "float roughness" 0.1'),
    "conductor-aluminium-brushed": balls('Material "conductor" "spectrum eta" "metal-Al-eta" "spectrum k" "metal-Al-k" '
                                         '"float uroughness" 0.02 "float vroughness" 0.2'),
    "conductor-reflectance": balls('Material "conductor" "rgb reflectance" [ 0.8 0.6 0.3 ] "float roughness" 0.3 '
                                   '"bool remaproughness" false'),
    "conductor-silver": balls('Material "conductor" "spectrum eta" "metal-Ag-eta" "spectrum k" "metal-Ag-k"'),
    "dielectric": balls('Material "dielectric"'),
    "dielectric-rough": balls('Material "dielectric" "float roughness" 0.1 "float eta" 1.4'),
    "dielectric-bk7": balls('Material "dielectric" "spectrum eta" "glass-BK7"'),
    "thin-dielectric": quad('Material "thindielectric" "float eta" 1.5'),
    "coated-diffuse": balls('Material "coateddiffuse" "rgb reflectance" [ 0.6 0.3 0.2 ] "float roughness" 0'),
    "coated-diffuse-rough": balls('Material "coateddiffuse" "rgb reflectance" [ 0.6 0.3 0.2 ] "float roughness" 0.1'),
    "coated-diffuse-very-rough": balls('Material "coateddiffuse" "rgb reflectance" [ 0.6 0.3 0.2 ] "float roughness" 0.5'),
    "coated-diffuse-white": balls('Material "coateddiffuse" "rgb reflectance" [ 0.9 0.9 0.9 ] "float roughness" 0'),
    "coated-conductor": balls('Material "coatedconductor"'),
    "coated-conductor-gold": balls('Material "coatedconductor" "spectrum conductor.eta" "metal-Au-eta" '
                                   '"spectrum conductor.k" "metal-Au-k" "float interface.roughness" 0'),
    "subsurface": balls('Material "subsurface" "rgb reflectance" [ 0.6 0.4 0.3 ] "rgb mfp" [ 0.2 0.1 0.05 ]'),
    "mix": balls('Material "mix" "string materials" [ "red" "metal" ] "float amount" 0.3', """
MakeNamedMaterial "red" "string type" "diffuse" "rgb reflectance" [ 0.7 0.2 0.1 ]
MakeNamedMaterial "metal" "string type" "conductor" "float roughness" 0.1
"""),
    "mix-by-image": quad('Material "mix" "string materials" [ "red" "blue" ] "texture amount" "numbers"', NUMBERS.format("") + """
MakeNamedMaterial "red" "string type" "diffuse" "rgb reflectance" [ 0.7 0.2 0.1 ]
MakeNamedMaterial "blue" "string type" "diffuse" "rgb reflectance" [ 0.1 0.2 0.7 ]
"""),
    "texture": quad(USE_IMAGE, IMAGE.format("")),
    "texture-linear": quad(USE_IMAGE, IMAGE.format('"string encoding" "linear"')),
    "texture-scaled": quad(USE_IMAGE, IMAGE.format('"float uscale" 3 "float vscale" 2 "float udelta" 0.25 "string filter" "trilinear"')),
    "texture-clamped": quad(USE_IMAGE, IMAGE.format('"float uscale" 2 "string wrap" "clamp"')),
    "texture-inverted": quad(USE_IMAGE, IMAGE.format('"bool invert" true "float scale" 0.8')),
    "texture-checkerboard": quad('Material "diffuse" "texture reflectance" "checks"',
                                 'Texture "checks" "spectrum" "checkerboard" "float uscale" 4 "float vscale" 4 '
                                 '"rgb tex1" [ 0.8 0.7 0.2 ] "rgb tex2" [ 0.1 0.1 0.4 ]\n'),
    "texture-product": quad('Material "diffuse" "texture reflectance" "product"', IMAGE.format("") +
                            'Texture "product" "spectrum" "scale" "texture tex" "image" "float scale" 0.5\n'),
    "texture-of-coat": quad('Material "coateddiffuse" "texture reflectance" "image" "float roughness" 0.01', IMAGE.format("")),
    "bump": quad('Material "diffuse" "texture displacement" "numbers"', NUMBERS.format('"float scale" 0.05')),
    "alpha": scene(LIGHT + FLOOR + BALL.format(x=0.3, material=GREY) + NUMBERS.format("") + f"""
AttributeBegin
  {GREY}
  Shape "trianglemesh" "texture alpha" "numbers" "integer indices" [ 0 1 2  0 2 3 ]
    "point3 P" [ -2 0.1 1.5  0.5 0.1 1.5  0.5 2.2 1.5  -2 2.2 1.5 ] "point2 uv" [ 0 0  1 0  1 1  0 1 ]
AttributeEnd
"""),
    "fog": fog('"string type" "homogeneous" "rgb sigma_a" [ 0.1 0.2 0.3 ] "rgb sigma_s" [ 0.8 0.6 0.4 ]'),
    "fog-forward": fog('"string type" "homogeneous" "rgb sigma_a" [ 0.1 0.2 0.3 ] "rgb sigma_s" [ 2 2 2 ] "float g" 0.7'),
    "fog-in-glass": fog('"string type" "homogeneous" "rgb sigma_a" [ 0.5 1 2 ] "rgb sigma_s" [ 0.2 0.2 0.2 ]', 'Material "dielectric"'),
    "fog-preset": fog('"string type" "homogeneous" "string preset" "Apple" "float scale" 3'),
    "instances": scene(LIGHT + FLOOR + f"""
ObjectBegin "ball"
  {GREY}
  Shape "sphere" "float radius" 0.5
  Translate 0 0.7 0
  Shape "trianglemesh" "integer indices" [ 0 1 2 ] "point3 P" [ -0.5 0 0  0.5 0 0  0 1 0 ]
ObjectEnd
AttributeBegin Translate -1.5 0.5 0 ObjectInstance "ball" AttributeEnd
AttributeBegin Translate 0 0.5 1 Scale 0.6 1 0.6 Rotate 30 0 1 0 ObjectInstance "ball" AttributeEnd
AttributeBegin Translate 1.8 0.5 0 Scale -1 1 1 ObjectInstance "ball" AttributeEnd
"""),
    "shapes": scene(LIGHT + FLOOR + f"""
AttributeBegin Translate -1.8 0.8 0 Rotate -90 1 0 0 {GREY} Shape "cylinder" "float radius" 0.6 "float zmin" -0.8 "float zmax" 0.6 AttributeEnd
AttributeBegin Translate 0 0.8 0 Rotate 20 0 1 0 {GREY} Shape "disk" "float radius" 0.8 "float innerradius" 0.3 AttributeEnd
AttributeBegin Translate 1.8 0.8 0 Rotate -90 1 0 0 {GREY} Shape "sphere" "float radius" 0.8 "float zmax" 0.4 "float phimax" 270 AttributeEnd
AttributeBegin Translate 0.9 0.9 2 {GREY}
  Shape "bilinearmesh" "point3 P" [ -0.3 -0.3 0  0.3 -0.3 0.2  -0.3 0.3 0.2  0.3 0.3 0 ] AttributeEnd
"""),
    "lens": scene(LIGHT + FLOOR + BALL.format(x=-1.2, material=GREY) + BALL.format(x=1.4, material=GREY),
                  'Camera "perspective" "float fov" 40 "float lensradius" 0.3 "float focaldistance" 5'),
    "screen-window": scene(LIGHT + FLOOR + BALL.format(x=-1.2, material=GREY) + BALL.format(x=1.4, material=GREY),
                           'Camera "perspective" "float fov" 40 "float screenwindow" [ -1 2 -1.2 0.8 ]'),
    "mirrored": scene(LIGHT + FLOOR + BALL.format(x=-1.2, material=GREY), look="Scale -1 1 1\nLookAt 1 3 8  0 0.8 0  0 1 0"),
    "exposure": scene(LIGHT + FLOOR + BALL.format(x=-1.2, material=GREY),
                      'Camera "perspective" "float fov" 40 "float shutteropen" 0 "float shutterclose" 0.5', '"float iso" 150'),
    "filter-box": scene(LIGHT + FLOOR + BALL.format(x=-1.2, material=GREY), head='PixelFilter "box"'),
    "filter-gaussian": scene(LIGHT + FLOOR + BALL.format(x=-1.2, material=GREY),
                             head='PixelFilter "gaussian" "float xradius" 2 "float yradius" 2'),
    "filter-mitchell": scene(LIGHT + FLOOR + BALL.format(x=-1.2, material=GREY), head='PixelFilter "mitchell"'),
    "filter-triangle": scene(LIGHT + FLOOR + BALL.format(x=-1.2, material=GREY), head='PixelFilter "triangle"'),
}


def png(path, rows):
    """Writes 8-bit RGB rows."""
    def chunk(kind, data):
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))
    lines = b"".join(b"\0" + bytes(channel for pixel in row for channel in pixel) for row in rows)
    header = struct.pack(">IIBBBBB", len(rows[0]), len(rows), 8, 2, 0, 0, 0)
    path.write_bytes(b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", zlib.compress(lines)) + chunk(b"IEND", b""))


def sky(path, side=64):
    """A dim gradient with a bright spot off the middle, in 32-bit floats."""
    pixels = array.array("f")
    for y in range(side):
        for x in range(side):
            spot = 30 * math.exp(-((x / side - 0.6) ** 2 + (y / side - 0.62) ** 2) * 200)
            pixels.extend((0.2 + 0.3 * x / side + spot, 0.3 + spot, 0.6 - 0.3 * y / side + 0.8 * spot))
    path.write_bytes(f"PF\n{side} {side}\n-1.0\n".encode() + pixels.tobytes())


def main():
    folder = pathlib.Path(sys.argv[1])
    folder.mkdir(parents=True, exist_ok=True)
    png(folder / "image.png", [[(30 * (x % 8) + 20, 255 - 16 * y, 200 if (x // 4 + y // 4) % 2 else 40) for x in range(16)]
                               for y in range(16)])
    sky(folder / "sky.pfm")
    for name, text in CASES.items():
        (folder / f"{name}.pbrt").write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()
