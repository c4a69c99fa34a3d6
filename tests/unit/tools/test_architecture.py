"""The map of packages is what the code imports, and the page shows the newest one."""

from __future__ import annotations

from pathlib import Path

from tests.support.paths import ROOT
from tools.architecture import (
    BEGIN,
    END,
    PICTURE,
    drawn,
    import_cycles,
    import_graph,
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


def test_the_graph_has_imports_of_other_packages(tmp_path: Path) -> None:
    write(
        tmp_path,
        domain__plan__parse="from app.domain.items import Land\nfrom app.domain.plan import walk",
        domain__plan__walk="",
        domain__items="",
        services__plans="import os\nfrom app.domain.plan.parse import parse",
        storage__events="from app.domain import errors",
        domain__errors="",
    )
    graph = import_graph(modules(tmp_path))
    assert graph["domain.plan"] == {"domain.items"}
    assert graph["services.plans"] == {"domain.plan"}
    assert graph["storage"] == {"domain.errors"}
    assert layers(graph) == {"domain": frozenset(), "services": {"domain"}, "storage": {"domain"}}


def test_packages_that_reach_each_other_are_one_cycle() -> None:
    graph = {name: frozenset(to) for name, to in {"a": "b", "b": "c", "c": "a", "d": "a"}.items()}
    assert import_cycles(graph) == [("a", "b", "c")]


def test_a_layer_is_drawn_below_all_that_import_it() -> None:
    graph = {"api": frozenset({"domain"}), "cli": frozenset({"api", "domain"}), "domain": frozenset[str]()}
    assert rows(graph) == [["cli"], ["api"], ["domain"]]
    assert picture(graph).count('<path d="M') == 3, "two arrows and their head: from cli to domain goes by api"


def test_only_what_stands_between_the_marks_is_drawn_anew() -> None:
    assert redrawn(f"before\n{BEGIN}\nold\n{END}\nafter\n", f"{BEGIN}\nnew\n{END}") == (
        f"before\n{BEGIN}\nnew\n{END}\nafter\n"
    )


def test_the_page_shows_the_map_of_this_code() -> None:
    files = modules(ROOT)
    page = (ROOT / "docs" / "architecture.md").read_text(encoding="utf-8")
    graph = import_graph(files)
    assert drawn(files, graph) in page, "run `make architecture`"
    assert PICTURE.read_text(encoding="utf-8") == picture(graph), "run `make architecture`"
