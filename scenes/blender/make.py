"""Runs in Blender. Models scenes, and saves FOLDER/SCENE.blend of each, or of all:

  blender --background --factory-startup --python-exit-code 3 --python scenes/blender/make.py -- FOLDER [SCENE…]
"""
import importlib
import os
import pathlib
import sys

import bpy

sys.dont_write_bytecode = True
here = pathlib.Path(__file__).resolve().parent
sys.path.insert(0, str(here))

import kit  # noqa: E402  (the path is set above)

folder, *wanted = sys.argv[sys.argv.index("--") + 1:]
names = sorted(path.stem.replace("_", "-") for path in here.glob("*.py") if path.stem not in ("kit", "make"))
unknown = [name for name in wanted if name not in names]
if unknown:
    sys.exit(f"no scene {unknown[0]}: there are {', '.join(names)}")
os.makedirs(folder, exist_ok=True)
for name in wanted or names:
    kit.begin()
    importlib.import_module(name.replace("-", "_")).build()
    bpy.ops.wm.save_as_mainfile(filepath=os.path.join(folder, f"{name}.blend"), compress=True)
