"""Shell commands of documents, as a reader types them."""
import re

BLOCK = re.compile(r"^```(\S*)\n(.*?)^```$", re.MULTILINE | re.DOTALL)


def commands(text):
    """Commands of all blocks ```sh. Lines that end with a backslash are one command with the next. Comments stay."""
    found = []
    for language, block in BLOCK.findall(text):
        if language == "sh":
            found += [line.strip() for line in block.replace("\\\n", " ").splitlines() if line.strip()]
    return found
