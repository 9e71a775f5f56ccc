#!/usr/bin/env python3
"""Tests that check_documents.py finds planted faults, and nothing else."""
import pathlib
import subprocess
import sys
import tempfile
import unittest

sys.path.insert(0, str(pathlib.Path(__file__).parent))
import check_documents


class Documents(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.root = pathlib.Path(folder.name).resolve()
        subprocess.run(["git", "init", "-q", self.root], check=True)

    def write(self, **texts):
        for name, text in texts.items():
            (self.root / f"{name}.md").write_text(text)
        return self.root, check_documents.documents(self.root)

    def broken(self, **texts):
        return list(check_documents.broken_links(*self.write(**texts)))

    def test_links_with_a_target_pass(self):
        self.assertEqual(self.broken(a="# A title, `code` & more\n[b](b.md#two-words) [c](#a-title-code--more) [d](https://x.example/)\n",
                                     b="## Two words\n```\n[no link](here.md)\n```\n![picture with [brackets]](a.md)\n"), [])

    def test_a_missing_file_is_found(self):
        self.assertEqual(self.broken(a="[b](b.md)"), ["a.md: there is no b.md"])

    def test_a_missing_heading_is_found(self):
        self.assertEqual(self.broken(a="[b](b.md#one)", b="# Two\n```\n# One\n```\n"), ["a.md: there is no heading for b.md#one"])

    def test_a_block_without_a_language_is_found(self):
        blocks = self.write(a="```sh\nls\n```\n\n```\nls\n```\n\n```text\na\n```\n")
        self.assertEqual([fault.split(": ")[0] for fault in check_documents.unmarked_blocks(*blocks)], ["a.md:5"])

    def test_a_missing_source_file_is_found(self):
        (self.root / "common").mkdir()
        (self.root / "common/film.h").touch()
        documents = self.write(a="`film.h`, `common/film.h`, `server/film.h`, `ilm.h`, `picture.png`\n```text\n`tile.h`\n```\n")
        self.assertEqual(list(check_documents.missing_files(*documents)), ["a.md: there is no file server/film.h", "a.md: there is no file ilm.h"])

    def test_missing_tests_are_found(self):
        (self.root / "tests").mkdir()
        (self.root / "tests/a_test.cpp").write_text("TEST(Film, Merges) {\nTEST_F(Film, HasTiles) {\n")
        root, files = self.write(**{"exact-answers": "`Film.Merges`, `Film.Has…`, `Film.Has`, `Tile.Has…`\n", "a": "`Film.Has`\n"})
        self.assertEqual(list(check_documents.missing_tests(root, files)),
                         ["exact-answers.md: there is no test Film.Has", "exact-answers.md: there is no test Tile.Has…"])

    def test_long_sentences_are_found(self):
        documents = self.write(a="A short sentence.\n", b=f"A{' long' * 14} sentence.\n", c=f"Short ones.{' Four words each here.' * 7}{' A' + ' b' * 24 + '.'}\n")
        self.assertEqual([fault.split(":")[0] for fault in check_documents.long_sentences(*documents)], ["b.md", "c.md"])

    def test_words_of_sentences_are_counted(self):
        text = "# A heading counts as no sentence\n\nOne two three. Four five\nsix [seven eight](a.md) `nine ten`.\n\n- a bullet\n" \
               "- a bullet with five words\n\n| a | table |\n\n```\ncode is no sentence\n```\n"
        self.assertEqual(list(check_documents.sentences(text)), [3, 6, 5])


if __name__ == "__main__":
    unittest.main()
