"""Base and head in turns: does a ratio fall by more than its noise?

Each side measures its own rows with its own code, in a worktree of its own, so that a renamed function breaks nothing;
what is compared is the ratio to the floor, which both measured on the same machine within the same second.
"""

from __future__ import annotations

import filecmp
import statistics
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from bench.machine import ROOT
from bench.measured import spread
from bench.process import RowFailedError, row_process
from bench.row import Goal, Pair
from bench.table import number

LEAST_NOISE: Final = 0.05
LOCKS: Final = ("requirements.txt", "requirements-dev.txt")
ROUNDS: Final = 9
PROCESSES: Final = 2
HEAD: Final = f"{'row':18} {'base':>8} {'head':>8} {'change':>8} {'noise':>8}"
PrintLine = Callable[[str], None]


@dataclass(frozen=True, slots=True)
class Comparison:
    """Of one row: ratios to the floor of base and head, each round's pair taken one right after the other."""

    name: str
    goal: Goal
    base: tuple[float, ...]
    head: tuple[float, ...]

    @property
    def change(self) -> float:
        """How much worse the head's median is, as a share of the base's; below 0: better."""
        base, head = statistics.median(self.base), statistics.median(self.head)
        return head / base - 1.0 if self.goal.sense == "at most" else base / head - 1.0

    @property
    def noise(self) -> float:
        """How far the rounds of one side lie apart."""
        return max(LEAST_NOISE, spread(self.base), spread(self.head))

    @property
    def is_worse(self) -> bool:
        """By more than its noise."""
        return self.change > self.noise

    def __str__(self) -> str:
        base, head = number(statistics.median(self.base)), number(statistics.median(self.head))
        worse = "  WORSE" if self.is_worse else ""
        return f"{self.name:18} {base:>8} {head:>8} {self.change:>+8.0%} {self.noise:>8.0%}{worse}"


async def against(commit: str, names: Sequence[str], print_line: PrintLine) -> int:
    """The exit status: 1 if a row became worse or could not be measured here."""
    failed = False
    with _checked_out(commit) as root:
        python = _python_of(root, print_line)
        print_line(HEAD)
        for name in names:
            try:
                failed = await _is_worse(name, root, python, print_line) or failed
            except RowFailedError as error:
                print_line(f"{name:18} NOT MEASURED: {error}")
                failed = True
    return 1 if failed else 0


async def _is_worse(name: str, root: Path, python: Path, print_line: PrintLine) -> bool:
    """
    Whether the row is worse in two processes of each side. One process can be slower than the next of the same code,
    by its memory layout and hash seeds, and its rounds do not show that noise.
    """
    for _ in range(PROCESSES):
        compared = await _compared(name, root, python)
        print_line(f"{name:18} new: the base does not measure it so" if compared is None else str(compared))
        if compared is None or not compared.is_worse:
            return False
    return True


async def _compared(name: str, root: Path, python: Path) -> Comparison | None:
    """None if the base has no such row, or measures something else under its name."""
    async with row_process(name, ROOT, Path(sys.executable), long=False) as head:
        try:
            async with row_process(name, root, python, long=False) as base:
                if base.row["version"] != head.row["version"]:
                    return None
                pairs = [(await base.measure(), await head.measure()) for _ in range(ROUNDS)]
        except RowFailedError:
            if _has(root, name):
                raise
            return None
    return Comparison(
        name, Goal(**head.row["goal"]), tuple(_ratio(one) for one, _ in pairs), tuple(_ratio(one) for _, one in pairs)
    )


def _ratio(pair: Pair) -> float:
    return pair.ours / pair.floor


def _has(root: Path, name: str) -> bool:
    registry = root / "bench" / "rows" / "__init__.py"
    return registry.exists() and f'"{name}":' in registry.read_text(encoding="utf-8")


@contextmanager
def _checked_out(commit: str) -> Iterator[Path]:
    """The commit's source in a folder of its own, until the block ends."""
    with tempfile.TemporaryDirectory() as folder:
        root = Path(folder) / "base"
        subprocess.run(("git", "worktree", "add", "--quiet", "--detach", root, commit), cwd=ROOT, check=True)
        try:
            yield root
        finally:
            subprocess.run(("git", "worktree", "remove", "--force", root), cwd=ROOT, check=True)


def _python_of(root: Path, print_line: PrintLine) -> Path:
    """The base's own environment; this one, if its packages are the same. The base's source comes first in it."""
    if all((root / lock).exists() and filecmp.cmp(root / lock, ROOT / lock, shallow=False) for lock in LOCKS):
        return Path(sys.executable)
    print_line("the base has other packages: making its environment")
    made = (".venv/.installed-dev", "app/simulator/dialect/generated/.built")
    subprocess.run(("make", "--silent", *made), cwd=root, check=True, stdout=subprocess.DEVNULL)
    return root / ".venv" / "bin" / "python"
