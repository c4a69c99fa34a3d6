"""Lays two sequences of values beside each other.

Values are sampled at the period of the message that shows them. One that a side showed only once may have been too
short to be seen at all on the other side, so it may be missing there.
"""

from __future__ import annotations

import bisect
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import TypeVar

from tools.compare.trace import Stand

# What a judge says about one aspect, and the tolerances that all judges share.


TOLERANCE = 0.2
"""A time may differ by this share, or by one period of the message that shows it, whichever is more."""


@dataclass(frozen=True, slots=True)
class Verdict:
    """`compared` counts what was looked at; `differences` says in words what was not alike."""

    aspect: str
    compared: int
    differences: tuple[str, ...] = ()


def times_agree(recorded_s: float, simulated_s: float, period_s: float) -> bool:
    """Within TOLERANCE of the recorded time, or one period."""
    return abs(recorded_s - simulated_s) <= max(TOLERANCE * abs(recorded_s), period_s) + 1e-6


# Which of two sides' things belong together, when one side may have more of them.


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


LONG_STAND = 1000


@dataclass(frozen=True, slots=True)
class Alignment:
    """`pairs` are the stands that both sides have; `differences` what only one has and was not too short."""

    pairs: tuple[tuple[Stand, Stand], ...]
    differences: tuple[str, ...]


def joined(alignments: Iterable[Alignment]) -> Alignment:
    """Of several sequences, one after the other."""
    every = tuple(alignments)
    pairs = tuple(pair for one in every for pair in one.pairs)
    return Alignment(pairs, tuple(said for one in every for said in one.differences))


def align(recorded: Sequence[Stand], simulated: Sequence[Stand], short: int = 1) -> Alignment:
    """`short`: a stand of at most so many messages may be missing on the other side; 0 for none."""
    pairs: list[tuple[Stand, Stand]] = []
    differences: list[str] = []
    i = j = 0
    for i_next, j_next in (*_common(recorded, simulated, short), (len(recorded), len(simulated))):
        missing = [one for one in recorded[i:i_next] if one.count > short]
        extra = [one for one in simulated[j:j_next] if one.count > short]
        if missing or extra:
            differences.append(_said(missing, extra))
        if i_next < len(recorded):
            pairs.append((recorded[i_next], simulated[j_next]))
        i, j = i_next + 1, j_next + 1
    return Alignment(tuple(pairs), tuple(differences))


def _common(recorded: Sequence[Stand], simulated: Sequence[Stand], short: int) -> list[tuple[int, int]]:
    """Index pairs of equal values that leave the fewest stands over, long ones counting most."""
    first = 0
    while first < min(len(recorded), len(simulated)) and recorded[first].value == simulated[first].value:
        first += 1
    rows, columns = len(recorded) - first, len(simulated) - first
    best = [[0] * (columns + 1) for _ in range(rows + 1)]
    for row in range(rows - 1, -1, -1):
        for column in range(columns - 1, -1, -1):
            skipped = max(best[row + 1][column], best[row][column + 1])
            met = best[row + 1][column + 1] + _worth(recorded[first + row], simulated[first + column], short)
            best[row][column] = max(skipped, met)
    found = [(index, index) for index in range(first)]
    row = column = 0
    while row < rows and column < columns:
        worth = _worth(recorded[first + row], simulated[first + column], short)
        if worth and best[row][column] == best[row + 1][column + 1] + worth:
            found.append((first + row, first + column))
            row, column = row + 1, column + 1
        elif best[row][column] == best[row + 1][column]:
            row += 1
        else:
            column += 1
    return found


def _worth(a: Stand, b: Stand, short: int) -> int:
    """Of a pair; 0 for different values."""
    if a.value != b.value:
        return 0
    return 1 + LONG_STAND * ((a.count > short) + (b.count > short))


def _said(missing: list[Stand], extra: list[Stand]) -> str:
    if not extra:
        return f"missing: {_listed(missing)}"
    if not missing:
        return f"extra: {_listed(extra)}"
    return f"recorded {_listed(missing)}; simulated {_listed(extra)}"


def _listed(values: list[Stand]) -> str:
    return ", ".join(f"{one.value} at {one.t_s:.1f} s" for one in values)


def late(alignment: Alignment, period_s: float, acts: tuple[Sequence[float], Sequence[float]]) -> list[str]:
    """Stands that began too early or too late, counted from the ground's last act or, if that is later, from the
    stand before. `acts` are the times of the ground's acts, the same acts on both sides.

    A sampled moment is seen up to a period late.
    """
    found = []
    for before, pair in zip(alignment.pairs, alignment.pairs[1:], strict=False):
        act = bisect.bisect_right(acts[0], pair[0].t_s) - 1
        from_act = act >= 0 and acts[0][act] > before[0].t_s
        starts = (acts[0][act], acts[1][act]) if from_act else (before[0].t_s, before[1].t_s)
        recorded_s, simulated_s = pair[0].t_s - starts[0], pair[1].t_s - starts[1]
        if not times_agree(recorded_s, simulated_s, period_s):
            since = "the ground's act" if from_act else before[0].value
            found.append(f"{pair[0].value} after {since}: {recorded_s:.2f} s, simulated {simulated_s:.2f} s")
    return found
