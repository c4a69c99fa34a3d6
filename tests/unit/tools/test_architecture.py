"""The map of rooms is what the code imports, and the page shows the newest one."""

from __future__ import annotations

from pathlib import Path

from tests.support.paths import ROOT
from tools.architecture import (
    BEGIN,
    END,
    PICTURE,
    arrows_between,
    circles,
    drawn,
    layers,
    modules,
    picture,
    redrawn,
    rows,
)


def write(folder: Path, **texts: str) -> None:
    for name, text in texts.items():
        path = folder / "app" / f"{name.replace('__', '/')}.py"
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)


def test_an_arrow_is_an_import_of_another_room(tmp_path: Path) -> None:
    write(
        tmp_path,
        domain__plan__parse="from app.domain.items import Land\nfrom app.domain.plan import walk",
        domain__plan__walk="",
        domain__items="",
        services__plans="import os\nfrom app.domain.plan.parse import parse",
        storage__events="from app.domain import errors",
        domain__errors="",
    )
    arrows = arrows_between(modules(tmp_path))
    assert arrows["domain.plan"] == {"domain.items"}
    assert arrows["services.plans"] == {"domain.plan"}
    assert arrows["storage"] == {"domain.errors"}
    assert layers(arrows) == {"domain": frozenset(), "services": {"domain"}, "storage": {"domain"}}


def test_rooms_that_reach_each_other_are_one_circle() -> None:
    arrows = {name: frozenset(to) for name, to in {"a": "b", "b": "c", "c": "a", "d": "a"}.items()}
    assert circles(arrows) == [("a", "b", "c")]


def test_a_layer_is_drawn_below_all_that_import_it() -> None:
    arrows = {"api": frozenset({"domain"}), "cli": frozenset({"api", "domain"}), "domain": frozenset[str]()}
    assert rows(arrows) == [["cli"], ["api"], ["domain"]]
    assert picture(arrows).count('<path d="M') == 3, "two arrows and their head: from cli to domain goes by api"


def test_only_what_stands_between_the_marks_is_drawn_anew() -> None:
    assert redrawn(f"before\n{BEGIN}\nold\n{END}\nafter\n", f"{BEGIN}\nnew\n{END}") == (
        f"before\n{BEGIN}\nnew\n{END}\nafter\n"
    )


def test_the_page_shows_the_map_of_this_code() -> None:
    files = modules(ROOT)
    page = (ROOT / "docs" / "architecture.md").read_text(encoding="utf-8")
    arrows = arrows_between(files)
    assert drawn(files, arrows) in page, "run `make architecture`"
    assert PICTURE.read_text(encoding="utf-8") == picture(arrows), "run `make architecture`"
