"""Run by Blender: exports the open file. After `--`: the folder, and the texels along a side of a baked image."""
import os
import sys

sys.dont_write_bytecode = True
sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))

try:
    import numpy  # noqa: F401
except ImportError:
    sys.exit("Blender's Python has no numpy. Debian has it in the package python3-numpy")

from lightmill_export.render_engine import export  # noqa: E402  (the path is set above)

folder, texels = sys.argv[sys.argv.index("--") + 1:]
export(folder, int(texels))
