#!/usr/bin/env python3
"""Checks the links, blocks, names of files and tests, and sentences of documents. --sentences prints the lengths of the documents' sentences.

  check_documents.py ROOT [--sentences]
"""
import argparse
import pathlib
import re
import statistics
import subprocess
import sys

LINK = re.compile(r"!?\[(?:[^\]\[]|\[[^\]]*\])*\]\(([^)\s]+)\)")
CODE = re.compile(r"^```.*?^```$", re.MULTILINE | re.DOTALL)
SOURCE_FILE = re.compile(r"`([\w./-]+\.(?:h|cpp|py|mjs|tsx?|proto))`")
TEST = re.compile(r"^TEST(?:_[FP])?\((\w+), (\w+)\)", re.MULTILINE)
TEST_NAME = re.compile(r"`([A-Z]\w+\.[A-Z]\w+…?)`")
LEAST_WORDS = 5  # a bullet with this many words counts as a sentence
MOST_MEDIAN, MOST_90_PERCENT = 14, 24  # words a sentence


def names_of_files(root, *patterns):
    listed = subprocess.run(["git", "-C", root, "ls-files", "-co", "--exclude-standard", *patterns], capture_output=True, text=True, check=True)
    return [name for name in listed.stdout.splitlines() if (root / name).exists()]


def documents(root):
    return [root / name for name in names_of_files(root, "*.md")]


def anchors(text):
    """GitHub's anchor of a heading: letters, digits, hyphens and underscores, with hyphens for spaces."""
    names, seen = set(), {}
    for title in re.findall(r"^#+ +(.+?) *$", CODE.sub("", text), re.MULTILINE):
        name = re.sub(r"[^\w\- ]", "", title.lower()).replace(" ", "-")
        count = seen.get(name, 0)
        seen[name] = count + 1
        names.add(f"{name}-{count}" if count else name)
    return names


def broken_links(root, files):
    texts = {file.resolve(): file.read_text() for file in files}
    for file, text in texts.items():
        for target in LINK.findall(CODE.sub("", text)):
            if re.match(r"[a-z]+:", target):
                continue
            path, _, anchor = target.partition("#")
            there = (file.parent / path).resolve() if path else file
            if not there.exists():
                yield f"{file.relative_to(root)}: there is no {target}"
            elif anchor and there in texts and anchor not in anchors(texts[there]):
                yield f"{file.relative_to(root)}: there is no heading for {target}"


def unmarked_blocks(root, files):
    """Blocks without a language. The test of the documents' commands runs those of the language `sh`."""
    for file in files:
        fences = [(number, line) for number, line in enumerate(file.read_text().split("\n"), 1) if line.startswith("```")]
        for number, line in fences[::2]:
            if line == "```":
                yield f"{file.relative_to(root)}:{number}: a block without a language: sh for commands, text for what they print"


def missing_files(root, files):
    """Source files that a document names, and that are gone. A document may leave out their folders."""
    ends = {name[at:] for name in names_of_files(root) for at in [0, *(slash.end() for slash in re.finditer("/", name))]}
    for file in files:
        for name in SOURCE_FILE.findall(CODE.sub("", file.read_text())):
            if name.removeprefix("./") not in ends:
                yield f"{file.relative_to(root)}: there is no file {name}"


def missing_tests(root, files):
    """GoogleTest names in tables of exact answers, and that no test has. `Suite.Prefix…` stands for tests that begin like this."""
    tests = {".".join(pair) for name in names_of_files(root, "tests/*.cpp", "tests/**/*.cpp") for pair in TEST.findall((root / name).read_text())}
    for file in files:
        for name in TEST_NAME.findall(CODE.sub("", file.read_text())) if file.name == "exact-answers.md" else ():
            if not any(test.startswith(name[:-1]) if name.endswith("…") else test == name for test in tests):
                yield f"{file.relative_to(root)}: there is no test {name}"


def sentences(text):
    """Word counts of sentences, without code, headings and tables. A bullet of a few words is none."""
    text = CODE.sub("\n\n", text)
    for block in re.split(r"\n\s*\n|\n(?= *(?:[-*]|\d+\.) )", text):
        if not block.strip() or block.lstrip().startswith(("#", "|", "!")):
            continue
        is_bullet = re.match(r" *(?:[-*]|\d+\.) ", block)
        plain = re.sub(r"`[^`]*`", "Code", LINK.sub(lambda link: link.group(0)[1:].split("]")[0], block))
        for sentence in re.split(r"(?<=[.!?:])\s+(?=[A-Z(])", re.sub(r"^ *(?:[-*]|\d+\.) ", "", plain)):
            words = len(re.findall(r"[\w'’-]+", sentence))
            if words > 1 and not (is_bullet and words < LEAST_WORDS):
                yield words


def sentence_lengths(root, files):
    """(document, its words, its sentences, the median of words a sentence, and what 90 % of its sentences have at most)."""
    for file in files:
        text = file.read_text()
        lengths = sorted(sentences(text))
        if lengths:
            most = lengths[min(len(lengths) - 1, int(0.9 * len(lengths)))]
            yield str(file.relative_to(root)), len(text.split()), len(lengths), statistics.median(lengths), most


def long_sentences(root, files):
    for name, _, _, median, most in sentence_lengths(root, files):
        if median > MOST_MEDIAN or most > MOST_90_PERCENT:
            yield f"{name}: the median is {median:.0f} words a sentence (at most {MOST_MEDIAN}), and 90 % have up to {most} (at most {MOST_90_PERCENT})"


def show_sentences(root, files):
    print(f"{'document':<28} {'words':>6} {'sentences':>9} {'median':>6} {'90 %':>5}")
    for name, words, count, median, most in sentence_lengths(root, files):
        print(f"{name:<28} {words:>6} {count:>9} {median:>6.0f} {most:>5}")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("root", type=pathlib.Path)
    parser.add_argument("--sentences", action="store_true", help="print words a sentence: the median, and what 90 %% have at most")
    options = parser.parse_args()
    root = options.root.resolve()
    files = documents(root)
    if options.sentences:
        show_sentences(root, files)
        return 0
    faults = [fault for check in (broken_links, unmarked_blocks, missing_files, missing_tests, long_sentences) for fault in check(root, files)]
    print("\n".join(faults) if faults else f"{len(files)} documents: all links and names lead somewhere, all blocks have a language, sentences are short")
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())
