"""Single WAYDROP_* variables: app.config has them all, and takes 0.2 s of CPU time to import."""

from __future__ import annotations

import os
from pathlib import Path


def variable(name: str) -> str | None:
    """What app.config finds: the variable, in any case, unless it is empty, else the secret file of this name."""
    for given, value in os.environ.items():
        if given.upper() == name and value:
            return value
    secrets = os.environ.get("WAYDROP_SECRETS_DIR")
    for path in Path(secrets).glob("*") if secrets else ():
        if path.name.upper() == name:
            return path.read_text(encoding="utf-8").strip()
    return None
