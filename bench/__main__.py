"""Measures Waydrop against the floor, or against another commit: `make bench`.

Usage: python -m bench [--long] [--rows plan,help] [--folder build/bench] [--publish]
       python -m bench --base COMMIT [--rows plan,help]

Prints a table, and writes it as bench.json and bench.svg. Each row is a process of its own, one after the other.
Exit status 1 if a row could not be measured, with --base also if a ratio fell; a missed goal is told and no failure.
"""

from __future__ import annotations

import argparse
import asyncio
import datetime
import json
import os
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from bench import machine
from bench.against import against
from bench.machine import ROOT, Others
from bench.measured import Measured
from bench.picture import picture
from bench.process import RowFailedError, row_process
from bench.publish import caption, publish
from bench.rows import CHEAPEST, MODULES
from bench.table import HEAD, line, print_line


async def measured(name: str, *, long: bool) -> Measured:
    """All rounds of a row. Raises RowFailedError."""
    others = Others()
    async with row_process(name, ROOT, Path(sys.executable), long=long) as process:
        pairs = tuple([await process.measure() for _ in range(process.row["rounds"])])
    return Measured(process.row, pairs, others.share())


async def all_measured(names: Sequence[str], *, long: bool) -> list[Measured]:
    """What could be measured, each told as it is."""
    print_line(
        f"load of the machine {os.getloadavg()[0]:.1f}; others: the share of its CPU time that other processes took\n"
    )
    print_line(HEAD)
    found = []
    for name in names:
        try:
            found.append(await measured(name, long=long))
            print_line(line(found[-1]))
        except RowFailedError as error:
            print_line(f"{name:18} NOT MEASURED: {error}")
    return found


def record(rows: Sequence[Measured], load: float) -> dict[str, Any]:
    """The whole run."""
    commit = subprocess.run(
        ("git", "describe", "--always", "--dirty", "--abbrev=8"), cwd=ROOT, check=False, capture_output=True, text=True
    )
    return {
        "commit": commit.stdout.strip(),
        "date": datetime.datetime.now(datetime.UTC).date().isoformat(),
        "machine": machine.described(),
        "load": load,
        "rows": [found.as_json() for found in rows],
    }


def main() -> int:
    """The exit status."""
    parser = argparse.ArgumentParser(prog="python -m bench", description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--long", action="store_true", help="more rounds, for a machine that has nothing else to do")
    parser.add_argument("--rows", default=",".join(MODULES), help="only these, comma separated")
    parser.add_argument("--cheapest", action="store_true", help="only the three that take the shortest")
    parser.add_argument("--base", metavar="COMMIT", help="compare with this commit instead")
    parser.add_argument("--folder", type=Path, default=ROOT / "build" / "bench")
    parser.add_argument("--publish", action="store_true", help="write the result into docs/reference/performance.md")
    given = parser.parse_args()
    names = list(CHEAPEST) if given.cheapest else given.rows.split(",")
    if unknown := sorted(set(names) - MODULES.keys()):
        parser.error(f"no row {', '.join(unknown)}; there are {', '.join(MODULES)}")
    if given.base:
        return asyncio.run(against(given.base, names, print_line))
    load = os.getloadavg()[0]
    rows = asyncio.run(all_measured(names, long=given.long))
    whole = record(rows, load)
    given.folder.mkdir(parents=True, exist_ok=True)
    (given.folder / "bench.json").write_text(json.dumps(whole, indent=1) + "\n")
    (given.folder / "bench.svg").write_text(picture(rows, caption(whole)))
    print_line(f"\n{given.folder}: bench.json, bench.svg")
    if given.publish:
        publish(whole, rows)
    return 0 if len(rows) == len(names) else 1


if __name__ == "__main__":
    sys.exit(main())
