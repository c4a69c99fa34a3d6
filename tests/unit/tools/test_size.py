"""The table of sizes counts each module once, in its layer, and each feature by its paths."""

from __future__ import annotations

from tests.support.paths import ROOT
from tools.size import FEATURES, by_feature, by_layer, sizes_at, table

BEFORE = {"domain/plan/parse.py": 100, "domain/plan/__init__.py": 5, "storage/events.py": 50}
AFTER = {"domain/plan/parse.py": 80, "storage/events.py": 60, "audit.py": 1, "services/audit.py": 70}


def test_each_module_counts_in_its_layer() -> None:
    assert by_layer(BEFORE) == {"domain": 105, "storage": 50}


def test_a_feature_counts_by_its_paths() -> None:
    assert by_feature(AFTER)["audit log"] == 70


def test_the_table_ends_with_what_is_left_without_features() -> None:
    rows = table(BEFORE, AFTER).splitlines()
    assert "| `domain` | 105 | 80 |" in rows
    assert rows[-2:] == ["| **all** | 155 | 211 |", "| **without these features** | 155 | 141 |"]


def test_each_feature_is_there() -> None:
    app = ROOT / "app"
    gone = [path for parts in FEATURES.values() for path in parts if not (app / path).exists()]
    assert gone == []


def test_a_commit_is_read_from_git() -> None:
    sizes = sizes_at("HEAD")
    assert sizes["__main__.py"] > 0
    assert not any("generated" in path for path in sizes)
