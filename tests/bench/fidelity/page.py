"""Runs in Blender. Compares pairs of pictures, and writes a table and a page that shows them side by side.

  blender --background --factory-startup --python page.py -- FOLDER

FOLDER has CASE.cycles.exr and CASE.lightmill.exr, and CASE.json of `lightmill error --json`. It gets index.html and table.md.
"""
import glob
import html
import json
import os
import sys

import bpy
import numpy as np

def pixels(path):
    """RGB from the lowest row."""
    image = bpy.data.images.load(path)
    width, height = image.size
    flat = np.empty(width * height * 4, dtype=np.float32)
    image.pixels.foreach_get(flat)
    bpy.data.images.remove(image)
    return flat.reshape(height, width, 4)[..., :3]


def without_layers(path, size, copy):
    """Writes the picture of an EXR file with several layers alone, by the compositor. Blender's image has no pixels of it."""
    scene = bpy.context.scene
    scene.use_nodes = True
    nodes = scene.node_tree.nodes
    nodes.clear()
    source, output = nodes.new("CompositorNodeImage"), nodes.new("CompositorNodeComposite")
    source.image = bpy.data.images.load(path)
    scene.node_tree.links.new(source.outputs["Combined" if "Combined" in source.outputs else "Image"], output.inputs["Image"])
    render = scene.render
    render.resolution_x, render.resolution_y, render.resolution_percentage = *size, 100
    render.image_settings.file_format, render.image_settings.color_depth = "OPEN_EXR", "32"
    render.filepath = copy
    bpy.ops.render.render(write_still=True)
    bpy.data.images.remove(source.image)
    return copy


def save(path, rgb):
    """As PNG. `rgb` is linear."""
    encoded = np.where(rgb <= 0.0031308, rgb * 12.92, 1.055 * np.power(np.clip(rgb, 0.0031308, 1), 1 / 2.4) - 0.055)
    image = bpy.data.images.new("picture", rgb.shape[1], rgb.shape[0])
    flat = np.concatenate([np.clip(encoded, 0, 1), np.ones((*rgb.shape[:2], 1))], axis=-1)
    image.pixels.foreach_set(flat.astype(np.float32).reshape(-1))
    image.filepath_raw, image.file_format = path, "PNG"
    image.save()
    bpy.data.images.remove(image)


def main():
    folder = sys.argv[sys.argv.index("--") + 1]
    rows, figures = [], []
    for path in sorted(glob.glob(os.path.join(folder, "*.lightmill.exr"))):
        name = os.path.basename(path)[:-len(".lightmill.exr")]
        theirs = pixels(os.path.join(folder, f"{name}.cycles.exr"))
        ours = pixels(without_layers(path, theirs.shape[1::-1], os.path.join(folder, f"{name}.plain.exr")))
        save(os.path.join(folder, f"{name}.lightmill.png"), ours)
        save(os.path.join(folder, f"{name}.cycles.png"), theirs)
        save(os.path.join(folder, f"{name}.difference.png"), np.abs(ours - theirs))
        ratios = ours.mean(axis=(0, 1)) / theirs.mean(axis=(0, 1))
        with open(os.path.join(folder, f"{name}.json"), encoding="utf-8") as file:
            flip = json.load(file)["flip"]
        notices = open(os.path.join(folder, f"{name}.notices"), encoding="utf-8").read().strip()
        rows.append(f"| {name} | {ratios[0]:.4f} | {ratios[1]:.4f} | {ratios[2]:.4f} | {flip:.3f} |")
        shown = "".join(f'<img src="{name}.{kind}.png" width="288">' for kind in ("cycles", "lightmill", "difference"))
        figures.append(f"<h2>{name}</h2><p>energy {ratios[0]:.4f} {ratios[1]:.4f} {ratios[2]:.4f}, FLIP {flip:.3f}</p>{shown}"
                       f"<p>{html.escape(notices)}</p>")
    table = "\n".join(["| case | red | green | blue | FLIP |", "| --- | --- | --- | --- | --- |", *rows]) + "\n"
    with open(os.path.join(folder, "table.md"), "w", encoding="utf-8") as file:
        file.write(table)
    with open(os.path.join(folder, "index.html"), "w", encoding="utf-8") as file:
        file.write('<!doctype html><meta charset="utf-8"><title>Fidelity</title><h1>Cycles, Lightmill, difference</h1>'
                   + "\n".join(figures))
    print(table)


main()
