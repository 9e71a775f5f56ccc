"""Models the scenes of scenes/blender, and reads each: nothing of it may be left out. Needs Blender.

  scenes.py SOURCE-FOLDER PROGRAM-FOLDER
"""
import json
import os
import pathlib
import shutil
import subprocess
import sys
import tempfile

# Differences between renderers that the scenes accept.
KNOWN = ("brighter than in Blender, which loses light there", "Lights with a radius are spheres", "Spot lights are uniform within their cone")


def main():
    source, programs = map(pathlib.Path, sys.argv[1:])
    blender = shutil.which(os.environ.get("LIGHTMILL_BLENDER", "blender"))
    if blender is None:
        print("Blender is not installed (deploy/setup --blender)")
        sys.exit(77)
    wrong = []
    with tempfile.TemporaryDirectory() as folder:
        subprocess.run(["/usr/bin/env", f"PATH={os.defpath}", blender, "--background", "--factory-startup", "--disable-autoexec",
                        "--python-exit-code", "3", "--python", source / "scenes/blender/make.py", "--", folder],
                       check=True, stdout=subprocess.DEVNULL)
        scenes = sorted(pathlib.Path(folder).glob("*.blend"))
        for scene in scenes:
            said = json.loads(subprocess.run([programs / "lightmill", "check", "--json", scene], check=True, stdout=subprocess.PIPE).stdout)
            wrong += [f"{scene.stem}: {text}" for text in said["notices"] if not any(part in text for part in KNOWN)]
            scene.unlink()
    print(f"{len(scenes)} scenes", *wrong, sep="\n")
    sys.exit(1 if wrong or not scenes else 0)


main()
