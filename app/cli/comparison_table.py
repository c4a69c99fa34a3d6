"""Predicted against flown as a table for the terminal."""

from __future__ import annotations

from rich.console import Console
from rich.markup import escape
from rich.table import Table

from app.domain.comparison import Comparison, DropComparison, ItemComparison
from app.domain.reason import in_words


def show_comparison(console: Console, comparison: Comparison) -> None:
    """A row for each visit of an item, a line for each drop. Nothing if there is nothing to show."""
    if not comparison.items:
        return
    table = Table(title="predicted against flown", title_justify="left")
    table.add_column("item")
    for name in ("predicted", "flown", "difference"):
        table.add_column(name, justify="right")
    table.add_column("")
    for item in comparison.items:
        table.add_row(*_cells(item))
    whole = _percent(comparison.predicted_s, comparison.flown_s)
    totals = _s(comparison.predicted_s), _s(comparison.flown_s)
    table.add_row("compared items", *totals, whole, _paused(comparison.paused_s), style="bold")
    console.print(table)
    for drop in comparison.drops:
        console.print(_drop_line(drop), markup=False)


def _cells(item: ItemComparison) -> tuple[str, str, str, str, str]:
    name = item.item_id if item.visit == 1 else f"{item.item_id} (visit {item.visit})"
    difference = "" if item.difference_percent is None else f"{item.difference_percent:+.0f} %"
    notes = [
        in_words(item.reason) or (f"unsure by {item.unsure_s:.0f} s" if item.unsure_s else ""),
        _paused(item.paused_s),
    ]
    return escape(name), _s(item.predicted_s), _s(item.flown_s), difference, escape("; ".join(filter(None, notes)))


def _paused(seconds: float) -> str:
    return f"paused for {seconds:.0f} s, not counted" if seconds >= 0.5 else ""


def _drop_line(drop: DropComparison) -> str:
    line = f"drop {drop.item_id}: "
    line += (
        f"released {drop.apart_m:.1f} m from the predicted place" if drop.apart_m is not None else in_words(drop.reason)
    )
    for word, predicted, flown, unit in (
        ("offset", drop.predicted_offset_m, drop.flown_offset_m, "m"),
        ("speed", drop.predicted_ground_speed_m_s, drop.flown_ground_speed_m_s, "m/s"),
    ):
        if predicted is not None and flown is not None:
            line += f", {word} {predicted:.1f} predicted and {flown:.1f} {unit} flown"
    return line


def _s(seconds: float | None) -> str:
    return "-" if seconds is None else f"{seconds:.1f} s"


def _percent(predicted_s: float | None, flown_s: float | None) -> str:
    return "" if not predicted_s or flown_s is None else f"{100.0 * (flown_s - predicted_s) / predicted_s:+.0f} %"
