"""The documents stand alone: every link leads somewhere, and no retired name or missing document is mentioned."""

from __future__ import annotations

import subprocess
import tomllib
from pathlib import Path

from tests.architecture import docs
from tests.architecture.sources import ROOT
from tests.support.violations import held

NAMES = tomllib.loads((ROOT / "tests" / "architecture" / "retired_names.toml").read_text(encoding="utf-8"))
TEXT = {".md", ".py", ".ts", ".tsx", ".css", ".toml", ".yml", ".yaml", ".sh", ""}
GENERATED = {"web/src/api/schema.d.ts", "web/openapi.json", "tests/architecture/retired_names.toml"}
OF_THE_LAWS = {"tests/architecture/test_docs.py"}
"""They hold names that must be rejected."""


def tracked() -> frozenset[str]:
    """All files of the repository, and their folders."""
    command = ["git", "ls-files", "--cached", "--others", "--exclude-standard"]
    listed = subprocess.run(command, cwd=ROOT, check=True, capture_output=True, text=True).stdout.splitlines()
    files = [path for path in listed if (ROOT / path).is_file()]
    return frozenset(files) | {str(folder) for path in files for folder in Path(path).parents}


EXISTING = tracked()
TEXTS = {
    path: (ROOT / path).read_text(encoding="utf-8")
    for path in sorted(EXISTING - GENERATED - OF_THE_LAWS)
    if Path(path).suffix in TEXT and (ROOT / path).is_file() and not path.startswith("tests/data/")
}
PAGES = {path: text for path, text in TEXTS.items() if path.endswith(".md")}


def test_links_lead_somewhere() -> None:
    held(docs.dead_links(PAGES, EXISTING))


def test_every_document_that_code_names_exists() -> None:
    held(docs.dead_citations(TEXTS, EXISTING))


def test_every_name_that_a_page_places_in_a_file_is_there() -> None:
    held(docs.dead_names(PAGES, TEXTS))


def test_a_name_that_is_not_in_its_file_is_found() -> None:
    pages = {"a.md": "add it to `ONE` in\n`app/a.py` and to `TWO` in `app/a.py`"}
    assert docs.dead_names(pages, {"app/a.py": "ONE = 1"}) == ["a.md: app/a.py has no TWO"]


def test_every_code_with_which_something_fails_exists() -> None:
    held(docs.dead_codes(PAGES, TEXTS))


def test_a_code_that_does_not_exist_is_found() -> None:
    pages = {"a.md": "it fails with `a.b`, is rejected\nwith `a.c`, or refused with 409 `a.d`"}
    found = docs.dead_codes(pages, {"app/a.py": 'code="a.b"'})
    assert found == ["a.md: a.c does not exist", "a.md: a.d does not exist"]


def test_a_decision_is_named_after_its_title() -> None:
    held(docs.misnamed_decisions(PAGES))


def test_a_decision_with_another_name_is_found() -> None:
    pages = {
        "docs/decisions/0001-loopback-only.md": "# 1. Loopback only, until a token exists\n## Context\n",
        "docs/decisions/0002-loopback-only.md": "# 1. Loopback only\n",
        "docs/decisions/0003-loop.md": "# 3. Loopback only\n",
    }
    assert docs.misnamed_decisions(pages) == [
        "docs/decisions/0002-loopback-only.md: its title is '1. Loopback only'",
        "docs/decisions/0003-loop.md: its title is '3. Loopback only'",
    ]


def test_retired_names_do_not_return() -> None:
    held(docs.retired(TEXTS, NAMES["anywhere"]))
    held(docs.retired({path: text for path, text in TEXTS.items() if path.endswith(".py")}, NAMES["python"]))


def test_nothing_refers_to_a_document_that_a_reader_does_not_have() -> None:
    held(docs.retired(TEXTS, NAMES["references"]))


def test_a_dead_link_is_found() -> None:
    page = "# One\n[a](b.md) [b](#two) [c](#one) [d](../e/f.md#x) [e](https://example.com/x)\n```\n[no](link.md)\n```\n"
    existing = frozenset({"docs/a.md", "e/f.md"})
    found = docs.dead_links({"docs/a.md": page, "e/f.md": "## Y\n"}, existing)
    assert found == [
        "docs/a.md:2: the link b.md leads nowhere",
        "docs/a.md:2: the link #two leads nowhere",
        "docs/a.md:2: the link ../e/f.md#x leads nowhere",
    ]


def test_a_retired_name_is_found() -> None:
    text = "one line\nthe pilot flies by hand\n"
    assert docs.retired({"a.py": text}, NAMES["anywhere"]) == [
        "a.py:2: 'flies by hand' was retired; use offboard control"
    ]


def test_a_document_that_does_not_exist_is_found() -> None:
    assert docs.dead_citations({"a.py": "# see docs/none.md"}, EXISTING) == ["a.py:1: docs/none.md does not exist"]
