"""The rows as a picture: each one's ratio against its goal, on a logarithmic scale, the goal in the middle."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Final
from xml.sax.saxutils import escape

from bench.measured import Measured
from bench.table import goal, number

WIDTH, LINE, TOP, BOTTOM = 960, 30, 44, 34
LEFT, RIGHT = 470, 150
"""Of the plot: titles before it, figures behind."""
DECADES: Final = 1.0
"""Each way from the goal."""
MET, MISSED = "#2b7a3f", "#b3261e"


def picture(rows: Sequence[Measured], caption: str) -> str:
    """An SVG."""
    height = TOP + LINE * len(rows) + BOTTOM
    lines = "".join(_row(found, TOP + LINE * number_ + LINE / 2) for number_, found in enumerate(rows))
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} {height}" width="{WIDTH}" height="{height}" '
        f'font-family="system-ui, sans-serif" font-size="12" role="img" aria-label="{escape(caption)}">'
        f'<rect width="{WIDTH}" height="{height}" fill="white"/>'
        f'<text x="12" y="20" font-size="13" fill="#222">{escape(caption)}</text>'
        f"{_scale(height)}{lines}</svg>\n"
    )


def _scale(height: float) -> str:
    drawn = ""
    for times, label in ((0.1, "10 x better"), (0.5, ""), (1.0, "goal"), (2.0, ""), (10.0, "10 x worse")):
        x, is_goal = _x(times), times == 1.0
        drawn += (
            f'<line x1="{x:.1f}" x2="{x:.1f}" y1="{TOP - 6}" y2="{height - BOTTOM + 6}" '
            f'stroke="{"#444" if is_goal else "#ddd"}" stroke-width="{1.5 if is_goal else 1}"/>'
            f'<text x="{x:.1f}" y="{height - 10}" text-anchor="middle" fill="#555">{label}</text>'
        )
    return drawn


def _row(found: Measured, y: float) -> str:
    colour = MET if found.is_met else MISSED
    middle, *ends = (_x(_worse(found, value)) for value in _shown(found))
    low, high = sorted(ends)
    value = f"{number(found.ratio)} x" if found.goal.of == "ratio" else f"{number(found.ours)} {found.row['unit']}"
    told = escape(f"{value}, {goal(found.goal)}")
    return (
        f'<text x="{LEFT - 12}" y="{y + 4:.1f}" text-anchor="end" fill="#222">{escape(found.row["title"])}</text>'
        f'<line x1="{low:.1f}" x2="{high:.1f}" y1="{y:.1f}" y2="{y:.1f}" stroke="{colour}" stroke-width="3"/>'
        f'<circle cx="{middle:.1f}" cy="{y:.1f}" r="5" fill="{colour}"/>'
        f'<text x="{WIDTH - RIGHT + 12}" y="{y + 4:.1f}" fill="{colour}">{told}</text>'
    )


def _shown(found: Measured) -> tuple[float, float, float]:
    """The median and the ends of what the goal is about."""
    if found.goal.of == "ratio":
        return found.ratio, found.ratios[0], found.ratios[-1]
    values = sorted(pair.ours for pair in found.pairs)
    return found.ours, values[0], values[-1]


def _worse(found: Measured, value: float) -> float:
    """How many times worse than the goal."""
    bound = found.goal.bound
    return value / bound if found.goal.sense == "at most" else bound / max(value, 1e-9)


def _x(worse: float) -> float:
    share = max(-DECADES, min(DECADES, math.log10(max(worse, 1e-9)))) / DECADES
    return LEFT + (WIDTH - RIGHT - LEFT) * (1.0 + share) / 2.0
