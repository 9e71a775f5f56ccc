#!/usr/bin/env python3
"""Makes the tables of docs/reference from the programs' own tables, or checks that the pages have them.

  reference_pages.py ROOT PROGRAMS [--write]

A page has a made part between `<!-- NAME: made by … -->` and `<!-- end -->`:
  commands  the programs' options, and the topics of `lightmill help`
  metrics   /metrics of a coordinator
  calls     client/web/public/openapi.json, which tests compare with the coordinator's operations
  methods   the first table of `lightmill help methods`
  layers    the tables of `lightmill help layers`
"""
import argparse
import difflib
import json
import pathlib
import re
import subprocess
import sys
import tempfile
import urllib.request

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "deploy"))
from waiting import TIMEOUT_S, wait_until
from processes import BackgroundProgram

PAGES = {"command-line.md": "commands", "metrics.md": "metrics", "http-api.md": "calls", "methods.md": "methods", "exr.md": "layers"}
DESCRIBE = pathlib.Path(__file__).resolve().parents[2] / "deploy/describe"
PROGRAMS = ["lightmill", "lightmill-server", "lightmill-worker"]


def printed(*command):
    return subprocess.run(list(map(str, command)), capture_output=True, text=True, check=True, timeout=TIMEOUT_S).stdout.strip() + "\n"


def table(heads, rows):
    lines = [heads, ["---"] * len(heads), *rows]
    return "".join(f"| {' | '.join(line)} |\n" for line in lines)


def commands(_root, programs):
    parts = [printed(sys.executable, "-B", DESCRIBE, programs / name, "markdown") for name in PROGRAMS]
    parts.append("## Topics\n\n`lightmill help TOPIC` prints these.\n")
    for topic, about in re.findall(r"^  ([a-z-]+)  +(\S.*)$", printed(programs / "lightmill", "help", "--help").split("explains a topic:")[1], re.MULTILINE):
        text = re.sub(r" +$", "", printed(programs / "lightmill", "help", topic), flags=re.MULTILINE)
        parts.append(f"### Topic {topic}\n\n{about[0].upper()}{about[1:]}.\n\n```text\n{text}```\n")
    return "\n".join(parts)


def metrics_text(programs):
    """/metrics of a new coordinator."""
    with tempfile.TemporaryDirectory(prefix="lightmill-reference-") as folder:
        port = pathlib.Path(folder) / "port"
        coordinator = BackgroundProgram([programs / "lightmill-server", "--data", f"{folder}/data", "--listen", "127.0.0.1:0", "--http",
                                         "127.0.0.1:0", "--http-port-file", port, "--log-level", "error"], f"{folder}/log")
        try:
            wait_until("the page is served", lambda: coordinator.poll() is not None or port.exists() and port.read_text().strip())
            with urllib.request.urlopen(f"http://127.0.0.1:{port.read_text().strip()}/metrics", timeout=TIMEOUT_S) as answer:
                return answer.read().decode()
        finally:
            coordinator.end()


def metrics(_root, programs):
    text = metrics_text(programs)
    kinds, rows = dict(re.findall(r"^# TYPE (\S+) (\S+)$", text, re.MULTILINE)), []
    for name, about in re.findall(r"^# HELP (\S+) (.*)$", text, re.MULTILINE):
        labels = re.findall(rf'^{name}{{(\w+)="([^"]*)"}}', text, re.MULTILINE)
        values = ", ".join(f"`{value}`" for _, value in labels)
        shown = f"{{{labels[0][0]}}}" if labels else ""
        rows.append([f"`{name}{shown}`", kinds[name], about + (f" {labels[0][0].capitalize()}: {values}." if len(labels) > 1 else "")])
    return table(["metric", "type", "meaning"], rows)


def fields_of(schema):
    """"`samples`: the new total of samples per pixel"."""
    return [f"`{name}`" + (f": {field['description']}" if "description" in field else "") for name, field in schema.get("properties", {}).items()]


def values_of(schema):
    if "enum" in schema:
        return f" ({', '.join(schema['enum'])})"
    if "minimum" in schema and "maximum" in schema:
        return f" ({schema['minimum']} to {schema['maximum']})"
    return ""


def roles_of(call):
    if "x-roles" not in call:
        return "everyone"
    own = call.get("x-own-roles", [])
    return ", ".join(call["x-roles"] + [f"{role} (own jobs)" for role in own])


def calls(root, _programs):
    description, rows = json.loads((root / "client/web/public/openapi.json").read_text()), []
    for path, methods in description["paths"].items():
        base = methods.get("servers", description["servers"])[0]["url"].rstrip("/")
        for method in ("get", "post"):
            if method not in methods:
                continue
            call = methods[method]
            query = [f"`?{each['name']}`" + values_of(each["schema"]) + (f": {each['description']}" if "description" in each else "")
                     for each in call.get("parameters", [])]
            content = call.get("requestBody", {}).get("content", {})
            body = [field for each in content.values() for field in fields_of(each["schema"])]
            rows.append([f"{method.upper()} `{base}{path}`", call["summary"], roles_of(call), "<br>".join(query + body)])
    return table(["call", "what it does", "roles", "query and body"], [[cell.replace("|", "\\|") for cell in row] for row in rows])


def topic_tables(programs, topic):
    """The tables of `lightmill help TOPIC`, each as its heads and rows. A table ends at an empty line."""
    tables = []
    for block in printed(programs / "lightmill", "help", topic).split("\n\n"):
        head, *lines = block.strip("\n").splitlines()
        if re.fullmatch(r"[A-Z]+(  +[A-Z]+)+", head):
            starts = [word.start() for word in re.finditer(r"[A-Z]+", head)]
            rows = [[line[begin:end].strip() for begin, end in zip(starts, starts[1:] + [None])] for line in lines]
            tables.append((head.lower().split(), rows))
    return tables


def as_code(cell):
    """"`a`, `b`" for "a, b"; "all but `a`" for "all but a"."""
    return re.sub(r"(?<![^\s,])(?!(?:all|but|others)\b)[^\s,]+", r"`\g<0>`", cell)


def methods(_root, programs):
    heads, rows = topic_tables(programs, "methods")[0]
    return table(heads, [[as_code(name), shows, as_code(parameters)] for name, shows, parameters in rows])


def layers(_root, programs):
    (heads, rows), (method_heads, method_rows) = topic_tables(programs, "layers")
    return (table(heads, [[as_code(name), as_code(channels), contents] for name, channels, contents in rows]) + "\n" +
            table(method_heads, [list(map(as_code, row)) for row in method_rows]))


def made_page(file, text, name, part):
    pattern = re.compile(rf"(<!-- {name}: made by [^\n]*-->\n).*?(<!-- end -->\n)", re.DOTALL)
    made, count = pattern.subn(lambda found: f"{found[1]}\n{part.strip()}\n\n{found[2]}", text)
    if count != 1:
        raise SystemExit(f"{file} has no part `{name}`")
    return made


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("root", type=pathlib.Path)
    parser.add_argument("programs", type=pathlib.Path)
    parser.add_argument("--write", action="store_true", help="write the pages")
    options = parser.parse_args()
    root, programs = options.root.resolve(), options.programs.resolve()
    stale = []
    for file, name in PAGES.items():
        path = root / "docs/reference" / file
        text = path.read_text()
        made = made_page(f"docs/reference/{file}", text, name, globals()[name](root, programs))
        if made == text:
            continue
        stale.append(f"docs/reference/{file}")
        if options.write:
            path.write_text(made)
        else:
            print("\n".join(list(difflib.unified_diff(text.splitlines(), made.splitlines(), "page", "programs", lineterm="", n=0))[:20]))
    if stale and not options.write:
        print(f"{', '.join(stale)}: not what the programs print. Run: tests/lint/reference_pages.py . build/release/bin --write")
        return 1
    print(f"{len(PAGES)} pages: {'written' if stale else 'as the programs print'}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
