"""Which of two sides' things belong together, when one side may have more of them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TypeVar

T = TypeVar("T")


def pair_up(ours: Sequence[T], theirs: Sequence[T], unlikeness: Callable[[T, T], float]) -> list[tuple[T, T]]:
    """As many pairs as the shorter side has, in order, and of all such the likest."""
    rows, columns = len(ours), len(theirs)
    table: dict[tuple[int, int], tuple[float, list[tuple[T, T]]]] = {}
    for row in range(rows, -1, -1):
        for column in range(columns, -1, -1):
            ways: list[tuple[float, list[tuple[T, T]]]] = []
            if row < rows and column < columns:
                cost, pairs = table[row + 1, column + 1]
                first = (ours[row], theirs[column])
                ways.append((cost + unlikeness(*first), [first, *pairs]))
            if row < rows:
                ways.append(table[row + 1, column])
            if column < columns:
                ways.append(table[row, column + 1])
            table[row, column] = min(ways, key=lambda way: (-len(way[1]), way[0]), default=(0.0, []))
    return table[0, 0][1]
