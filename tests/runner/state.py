"""What is remembered between calls: of the sources as they are, since a change starts anew."""
import hashlib
import json
import subprocess

from process import ROOT


def sources_id():
    """Names the sources as they are, changes that are not committed included."""
    def git(*arguments):
        return subprocess.run(["git", *arguments], cwd=ROOT, check=False, capture_output=True).stdout
    digest = hashlib.sha256(git("rev-parse", "HEAD^{tree}") + git("diff", "HEAD"))
    for name in git("ls-files", "--others", "--exclude-standard", "-z").split(b"\0"):
        if name and (ROOT / name.decode()).is_file():
            digest.update(name + (ROOT / name.decode()).read_bytes())
    return digest.hexdigest()


def load(path):
    """{"sources": the sources' name, "done": {what: result}}."""
    try:
        state = json.loads(path.read_text())
    except (OSError, ValueError):
        state = {}
    now = sources_id()
    return state if state.get("sources") == now else {"sources": now, "done": {}}


def save(path, state):
    path.parent.mkdir(parents=True, exist_ok=True)
    temporary = path.with_suffix(".new")
    temporary.write_text(json.dumps(state, indent=1))
    temporary.replace(path)
