"""The waydrop command, also as `python -m app`."""

from __future__ import annotations

from app.cli.loading import loaded_for_good

with loaded_for_good():
    from app.cli.main import main

if __name__ == "__main__":
    main()
