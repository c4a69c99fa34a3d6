"""Writes the newest result into docs/reference/performance.md, between its marks, with the picture beside it."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Final

from bench.machine import ROOT
from bench.measured import Measured
from bench.picture import picture
from bench.table import limits, markdown

PAGE: Final = ROOT / "docs" / "reference" / "performance.md"
BEGIN: Final = "<!-- made by `make bench PUBLISH=1`: begin -->"
END: Final = "<!-- made by `make bench PUBLISH=1`: end -->"


def publish(whole: dict[str, Any], rows: Sequence[Measured]) -> None:
    """The table, the picture, and what limits each row."""
    before, _, rest = PAGE.read_text(encoding="utf-8").partition(BEGIN)
    _, _, after = rest.partition(END)
    on = whole["machine"]
    text = (
        f"\n\nCommit {whole['commit']}, {whole['date']}; {on['cores']} cores ({on['cpu']}), Python {on['python']}; "
        f"load of the machine as it began {whole['load']:.1f}, and others took "
        f"{min(found.others for found in rows):.0%} to {max(found.others for found in rows):.0%} of its CPU time.\n\n"
        f"![each row's ratio against its goal](performance.svg)\n\n{markdown(rows)}\n"
        f"What limits each row:\n\n{limits(rows)}\n"
    )
    PAGE.write_text(before + BEGIN + text + END + after, encoding="utf-8")
    PAGE.with_suffix(".svg").write_text(picture(rows, caption(whole)), encoding="utf-8")


def caption(whole: dict[str, Any]) -> str:
    """Of the picture."""
    return f"Waydrop {whole['commit']}, {whole['date']}: ratio to its goal"
