"""The table of sizes counts each module once, in its layer, and each feature by its paths."""

from __future__ import annotations

from tests.support.paths import ROOT
from tools.size import (
    FEATURES,
    Shape,
    added_elsewhere,
    by_feature,
    by_layer,
    shape_of,
    shape_table,
    sizes_of,
    sources_at,
    table,
)

BEFORE = {"domain/plan/parse.py": 100, "domain/plan/__init__.py": 5, "storage/events.py": 50}
AFTER = {"domain/plan/parse.py": 80, "storage/events.py": 60, "audit.py": 1, "services/audit.py": 70}


def test_each_module_counts_in_its_layer() -> None:
    assert by_layer(BEFORE) == {"domain": 105, "storage": 50}


def test_a_feature_counts_by_its_paths() -> None:
    assert by_feature(AFTER)["audit log"] == 70


def test_the_table_ends_with_what_is_left_without_features() -> None:
    rows = table(BEFORE, AFTER, {"retention": 10}).splitlines()
    assert "| `domain` | 105 | 80 |" in rows
    assert "| in files of others: retention | 0 | 10 |" in rows
    assert rows[-2:] == ["| **all** | 155 | 211 |", "| **without these features** | 155 | 131 |"]


def test_a_commit_of_a_feature_counts_as_what_it_added_to_files_of_others() -> None:
    numstat = "20\t5\tapp/vehicles/link.py\n300\t0\tapp/vehicles/link_guard/signing.py\n0\t3\tapp/config.py\n"
    assert added_elsewhere(numstat) == 12


def test_each_feature_is_there() -> None:
    app = ROOT / "app"
    gone = [path for parts in FEATURES.values() for path in parts if not (app / path).exists()]
    assert gone == []


def test_a_commit_is_read_from_git() -> None:
    sizes = sizes_of(sources_at("HEAD"))
    assert sizes["__main__.py"] > 0
    assert not any("generated" in path for path in sizes)


def test_a_shape_has_the_measures_of_decision_29() -> None:
    branches = "".join(f"    if a == {number}:\n        return {number}\n" for number in range(13))
    sources = {
        "domain/__init__.py": "",
        "domain/a.py": "class Plan: ...\n",
        "domain/b.py": "from app.domain.a import Plan as P\nclass Plan: ...\nclass _Plan: ...\n",
        "domain/c.py": "from app.domain import a, b\n",
        "services/d.py": f"class Plan:\n    def __init__(self, a, b, c, d, e, f, g, h, i): ...\ndef f(a):\n{branches}",
    }
    assert shape_of(sources) == Shape(
        files=4,
        lines=34,
        median_lines=2,
        single_importers=1,
        double_class_names=1,
        complex_functions=1,
        wide_constructors=1,
    )


def test_shapes_are_shown_side_by_side() -> None:
    rows = shape_table(Shape(1, 2000, 3, 4, 5, 6, 7), Shape(8, 9, 10, 11, 12, 13, 14)).splitlines()
    assert rows[:4] == ["| | before | after |", "|---|---|---|", "| files | 1 | 8 |", "| lines | 2,000 | 9 |"]
