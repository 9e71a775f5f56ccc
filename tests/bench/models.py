#!/usr/bin/env python3
"""Renders all models of a folder, and makes a page of the pictures with what each model lacks:

    tests/bench/models.py FOLDER OUT [--size 320x240] [--spp 64] [--formats gltf,glb,obj,ply,stl]
    tests/bench/models.py FOLDER OUT --formats blend --cycles

OUT gets index.html, the pictures, and models.json. The exit code is 0 although models are refused: the page says why. With --cycles,
the pictures of Blender's Cycles are beside those of .blend files, with the energy ratio and FLIP.
"""
import argparse
import collections
import html
import json
import os
import pathlib
import subprocess
import sys
import tempfile
import time

from measured_farm import PROGRAMS, farm

STYLE = """body{font:14px/1.4 sans-serif;margin:24px}main{display:grid;grid-template-columns:repeat(auto-fill,minmax(320px,1fr));gap:16px}
figure{margin:0;border:1px solid #bbb;border-radius:6px;overflow:hidden}img{width:100%;display:block;background:#444}
figcaption{padding:8px}ul{margin:4px 0;padding-left:18px;color:#555}.refused{background:#fee}"""


def run(*words):
    return subprocess.run([str(PROGRAMS / "lightmill"), *map(str, words)], capture_output=True, text=True, check=False)


def size_for(model, options):
    """The size of a .blend file's pictures. It keeps the file's aspect, on which Blender's field of view depends."""
    checked = run("check", model, "--json") if model.suffix.lower() == ".blend" else None
    if checked is None or checked.returncode != 0:
        return options.size
    film, most = json.loads(checked.stdout), max(map(int, options.size.split("x")))
    return "x".join(str(max(1, round(film[side] * most / max(film["width"], film["height"])))) for side in ("width", "height"))


def render(server, model, picture, size, options):
    """What happened to one model, as a dict."""
    begin = time.monotonic()
    made = run("render", model, *server, "--size", size, "--spp", options.spp, "-o", picture, "-o", picture.with_suffix(".exr"))
    lines = made.stderr.splitlines()
    row = {"notes": [line.removeprefix("note: ") for line in lines if line.startswith("note: ")],
           "seconds": round(time.monotonic() - begin, 2)}
    if made.returncode != 0:
        wrong = [line for line in lines if line.startswith("lightmill: ")]
        row["refused"] = wrong[-1].removeprefix("lightmill: ") if wrong else made.stderr[-500:]
    return row


def beside(model, name, size, options):
    """The same file by Cycles, and the difference. Empty if Cycles cannot render it."""
    stem = options.out / f"{name}.cycles"
    script = pathlib.Path(__file__).with_name("cycles_beside.py")
    for ending in (".cycles.exr", ".cycles.png"):
        (options.out / f"{name}{ending}").unlink(missing_ok=True)
    subprocess.run([os.environ.get("LIGHTMILL_BLENDER", "blender"), "--background", "--factory-startup", "--disable-autoexec", model,
                    "--python-exit-code", "3", "--python", script, "--", stem, size, str(options.spp)],
                   capture_output=True, check=False)
    if not stem.with_suffix(".cycles.exr").exists():
        return {}
    error = run("error", "--json", options.out / f"{name}.exr", stem.with_suffix(".cycles.exr"))
    known = json.loads(error.stdout) if error.returncode == 0 else {}
    return {"cycles": f"{name}.cycles.png", "energy": known.get("energy_ratio"), "flip": known.get("flip")}


def page(rows, folder):
    figures = []
    for name, row in rows.items():
        notes = "".join(f"<li>{html.escape(note.replace(str(folder) + '/', ''))}</li>" for note in row["notes"])
        picture = "".join(f'<img src="{row[each]}" alt="">' for each in ("picture", "cycles") if each in row and "refused" not in row)
        if row.get("energy") is not None:
            notes = f"<li>energy {row['energy']:.3f}, FLIP {row['flip']:.3f}, beside Cycles below</li>{notes}"
        refused = f"<p>{html.escape(row['refused'].replace(str(folder) + '/', ''))}</p>" if "refused" in row else ""
        figures.append(f'<figure class="{"refused" if refused else ""}">{picture}<figcaption><b>{html.escape(name)}</b> '
                       f'{row["seconds"]} s{refused}<ul>{notes}</ul></figcaption></figure>')
    return f'<!doctype html><meta charset="utf-8"><title>Models</title><style>{STYLE}</style><main>{"".join(figures)}</main>'


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=pathlib.Path)
    parser.add_argument("out", type=pathlib.Path)
    parser.add_argument("--size", default="320x240")
    parser.add_argument("--spp", type=int, default=64)
    parser.add_argument("--formats", default="gltf,glb,obj,ply,stl")
    parser.add_argument("--cycles", action="store_true")
    options = parser.parse_args()
    formats = {f".{each}" for each in options.formats.split(",")}
    models = sorted(path for path in options.folder.rglob("*") if path.suffix.lower() in formats and path.is_file())
    options.out.mkdir(parents=True, exist_ok=True)
    rows, reasons = {}, collections.Counter()
    with tempfile.TemporaryDirectory() as private, farm(pathlib.Path(private), 2) as here:
        for number, model in enumerate(models):
            name = str(model.relative_to(options.folder))
            picture = f"{number:03}.png"
            size = size_for(model, options)
            rows[name] = {"picture": picture, **render(here.server, model, options.out / picture, size, options)}
            if options.cycles and "refused" not in rows[name]:
                rows[name] |= beside(model.resolve(), f"{number:03}", size, options)
            state = f"refused: {rows[name]['refused']}" if "refused" in rows[name] else f"{len(rows[name]['notes'])} notes"
            print(f"{number + 1}/{len(models)}  {name}  {rows[name]['seconds']} s  {state}", file=sys.stderr, flush=True)
            reasons["refused" if "refused" in rows[name] else "rendered"] += 1
    (options.out / "models.json").write_text(json.dumps(rows, indent=1))
    (options.out / "index.html").write_text(page(rows, options.folder))
    print(f"{reasons['rendered']} rendered, {reasons['refused']} refused: {options.out / 'index.html'}")


if __name__ == "__main__":
    main()
