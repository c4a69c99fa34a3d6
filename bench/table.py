"""The table that people read, and the same in Markdown."""

from __future__ import annotations

import sys
from collections.abc import Sequence

from bench.measured import Measured
from bench.row import Goal

HEAD = (
    f"{'row':18} {'Waydrop':>12} {'floor':>12} {'unit':15} {'ratio':>7}  {'(min to max)':18} {'goal':12} {'others':>6}"
)


def line(found: Measured) -> str:
    """One row."""
    between = f"({number(found.ratios[0])} to {number(found.ratios[-1])})"
    return (
        f"{found.row['name']:18} {number(found.ours):>12} {number(found.floor):>12} {found.row['unit']:15} "
        f"{number(found.ratio):>7}  {between:18} {goal(found.goal):12} {found.others:>6.0%}"
        f"  {'' if found.is_met else 'MISSED'}"
    )


def markdown(rows: Sequence[Measured]) -> str:
    """As docs/reference/performance.md has it."""
    head = "| work | floor | Waydrop | floor's | ratio | goal | |\n|---|---|---:|---:|---:|---|---|\n"
    return head + "".join(_markdown_line(found) for found in rows)


def _markdown_line(found: Measured) -> str:
    ratios = f"**{number(found.ratio)}** ({number(found.ratios[0])} to {number(found.ratios[-1])})"
    cells = (
        found.row["title"],
        found.row["floor"],
        f"{number(found.ours)} {found.row['unit']}",
        number(found.floor),
        ratios,
        goal(found.goal),
        "met" if found.is_met else "missed",
    )
    return f"| {' | '.join(cells)} |\n"


def limits(rows: Sequence[Measured]) -> str:
    """What limits each row, in Markdown."""
    return "".join(f"- {found.row['title']}: {found.row['limited_by']}.\n" for found in rows)


def goal(wanted: Goal) -> str:
    """In signs."""
    return f"{'<=' if wanted.sense == 'at most' else '>='} {number(wanted.bound)}{' x' if wanted.of == 'ratio' else ''}"


def number(value: float) -> str:
    """Three digits that count."""
    if abs(value) >= 100:
        return f"{value:,.0f}"
    return f"{value:.3g}" if abs(value) >= 1 else f"{value:.2f}"


def print_line(text: str) -> None:
    """One line, at once."""
    sys.stdout.write(text + "\n")
    sys.stdout.flush()
