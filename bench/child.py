"""Measures the rounds of one row, one for each line on its standard input; ends with it.

Usage: python -m bench.child ROW [--long]

Writes a JSON object a line: first what the row is, then `ours` and `floor` of each round.
"""

from __future__ import annotations

import argparse
import asyncio
import json
import sys
from dataclasses import asdict
from typing import Any

from bench.row import Row, Scale
from bench.rows import MODULES, row_of


def described(row: Row, scale: Scale) -> dict[str, Any]:
    """What the parent must know of a row."""
    fields = ("name", "title", "floor", "unit", "limited_by", "version")
    return {name: getattr(row, name) for name in fields} | {"goal": asdict(row.goal), "rounds": row.rounds_of(scale)}


def print_json(line: dict[str, Any]) -> None:
    """One line."""
    sys.stdout.write(json.dumps(line) + "\n")
    sys.stdout.flush()


async def main(row: Row, scale: Scale) -> None:
    """A round for each line."""
    async with row.prepare(scale) as measure:
        print_json(described(row, scale))
        while await asyncio.to_thread(sys.stdin.readline):
            pair = await measure()
            print_json({"ours": pair.ours, "floor": pair.floor})


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("row", choices=list(MODULES))
    parser.add_argument("--long", action="store_true")
    given = parser.parse_args()
    asyncio.run(main(row_of(given.row), Scale(long=given.long)))
