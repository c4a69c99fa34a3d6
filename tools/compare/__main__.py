"""`python -m tools.compare FOLDER`: replays every recording of a folder and prints what agrees and differs."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path

from tools.compare.judge import Judgement, compare
from tools.compare.report import lines
from tools.compare.trace import TraceError, read_trace, trace_files


def main(arguments: Sequence[str] | None = None) -> int:
    """Exit status: 0 when all agree but for known differences, 1 when not, 2 for a wrong command line or folder."""
    parser = argparse.ArgumentParser(
        prog="python -m tools.compare",
        description="How faithful the simulated vehicles are to recordings of a real PX4.",
    )
    parser.add_argument("folder", type=Path, help="of the recordings, *.jsonl and *.jsonl.gz")
    parser.add_argument("--only", default="", metavar="TEXT", help="scenarios whose name begins so")
    parser.add_argument("--verbose", action="store_true", help="also name the aspects that agree")
    found = parser.parse_args(arguments)
    judgements: list[Judgement] = []
    try:
        for path in trace_files(found.folder):
            if path.name.startswith(found.only):
                judgements.append(compare(read_trace(path)))
    except (OSError, TraceError) as error:
        sys.stderr.write(f"{error}\n")
        return 2
    if not judgements:
        sys.stderr.write(f"no recordings to replay in {found.folder}\n")
        return 2
    for line in lines(judgements, found.verbose):
        sys.stdout.write(line + "\n")
    return 0 if all(judgement.agrees for judgement in judgements) else 1


if __name__ == "__main__":
    sys.exit(main())
