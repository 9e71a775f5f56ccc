#!/usr/bin/env python3
"""Makes a small copy of a pbrt scene, for pbrt and for Lightmill.

  tests/bench/peers/pbrt_copy.py SCENE.pbrt FOLDER [--samples N] [--side PIXELS] [--integrator KIND] [--grey]

FOLDER gets links to the files beside the scene, and the scene with another Film, Sampler and Integrator: the same aspect with SIDE pixels
on the longer side, the colours of cie1931, N independent samples, and volpath or KIND as deep as the file's integrator.
Without KIND, bdpt stays. --grey replaces each colour of the main file by its mean. Only the main file may have these statements. Prints the copy, its size and its depth.
"""
import argparse
import os
import pathlib
import re

TOKEN = re.compile(r'#[^\n]*|"[^"\n]*"|\[|\]|[^\s"\[\]#]+')
COLOR = re.compile(r'("rgb [\w.]+")\s*\[\s*((?:[-+.\deE]+\s+){2}[-+.\deE]+)\s*\]')
DIRECTIVE = re.compile(r"[A-Z]\w*$")


def statements(text):
    """(directive, begin, end, words) of each statement. Comments are no words."""
    found = []
    for match in TOKEN.finditer(text):
        word = match.group()
        if word.startswith("#"):
            continue
        if DIRECTIVE.match(word):
            found.append([word, match.start(), match.end(), []])
        elif found:
            found[-1][2] = match.end()
            found[-1][3].append(word)
    return found


def parameters(words):
    """The parameters after the kind, as {"name": ("type name", [values])}."""
    known, name, inside = {}, None, False
    for word in words[1:]:
        if word in "[]":
            inside = word == "["
        elif word.startswith('"') and not inside and (name is None or known[name][1]):
            name = word.strip('"').split()[-1]
            known[name] = (word, [])
        else:
            known[name][1].append(word)
    return known


def number(known, name, default):
    return int(known[name][1][0]) if name in known else default


def changed(word, words, options, answer):
    """The statement of the copy."""
    known = parameters(words) if word in ("Film", "Integrator") else {}
    if word == "Film":
        width, height = number(known, "xresolution", 1280), number(known, "yresolution", 720)
        answer["size"] = [max(1, round(side * options.side / max(width, height))) for side in (width, height)]
        dropped = ("xresolution", "yresolution", "filename", "sensor", "cropwindow", "pixelbounds", "savefp16")
        kept = [f"{typed} [ {' '.join(values)} ]" for name, (typed, values) in known.items() if name not in dropped]
        size = [f'"integer {axis}resolution" [ {side} ]' for axis, side in zip("xy", answer["size"])]
        return " ".join(['Film "rgb" "string filename" "picture.exr" "bool savefp16" false', *size, *kept])
    if word == "Integrator":
        answer["depth"] = number(known, "maxdepth", 5)
        answer["kind"] = words[0].strip('"')
        return ""
    return f'Sampler "independent" "integer pixelsamples" {options.samples}' if word == "Sampler" else None


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n", maxsplit=1)[0])
    parser.add_argument("scene", type=pathlib.Path)
    parser.add_argument("folder", type=pathlib.Path)
    parser.add_argument("--samples", type=int, default=256)
    parser.add_argument("--side", type=int, default=128)
    parser.add_argument("--integrator", default="")
    parser.add_argument("--grey", action="store_true")
    options = parser.parse_args()

    options.folder.mkdir(parents=True, exist_ok=True)
    for other in options.scene.parent.iterdir():
        link = options.folder / other.name
        if other != options.scene and not link.is_symlink():
            link.symlink_to(other.resolve())

    text = options.scene.read_text(encoding="utf-8")
    if options.grey:
        text = COLOR.sub(lambda match: f"{match[1]} [ {' '.join([str(sum(map(float, match[2].split())) / 3)] * 3)} ]", text)
    head = text[:re.search(r"^\s*WorldBegin", text, re.MULTILINE).start()]
    answer = {"depth": 5}
    found = statements(head)
    if not any(word == "Film" for word, *_ in found):
        found.append(["Film", len(head), len(head), ['"rgb"']])
    copy, at = [], 0
    for word, begin, end, words in found:
        new = changed(word, words, options, answer)
        if new is not None:
            copy += [head[at:begin], new]
            at = end
    kind = options.integrator or ("bdpt" if answer.get("kind") == "bdpt" else "volpath")
    copy += [head[at:], f'\nIntegrator "{kind}" "integer maxdepth" {answer["depth"]}\n']
    if not any(word == "Sampler" for word, *_ in found):
        copy.append(f'Sampler "independent" "integer pixelsamples" {options.samples}\n')
    target = options.folder / options.scene.name
    target.unlink(missing_ok=True)
    target.write_text("".join(copy) + text[len(head):], encoding="utf-8")
    print(os.path.relpath(target), "x".join(map(str, answer["size"])), answer["depth"])


if __name__ == "__main__":
    main()
