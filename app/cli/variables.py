"""Single WAYDROP_* variables: app.config has them all, and takes 0.2 s of CPU time to import."""

from __future__ import annotations

import os
from pathlib import Path

from app.domain.errors import InvalidInputError


def variable(name: str) -> str | None:
    """What app.config finds: the last variable of this name in any case that is not empty, else the secret file.

    Raises InvalidInputError.
    """
    given = [value for one, value in os.environ.items() if one.upper() == name and value]
    if given:
        return given[-1]
    secrets = os.environ.get("WAYDROP_SECRETS_DIR")
    return _secret(name, Path(secrets)) if secrets else None


def _secret(name: str, folder: Path) -> str | None:
    if not folder.is_dir():
        raise InvalidInputError(f"WAYDROP_SECRETS_DIR: {folder} is no folder")
    try:
        for path in folder.iterdir():
            if path.name.upper() == name and path.is_file() and folder.resolve() in path.resolve().parents:
                return path.read_text(encoding="utf-8").strip()
    except (OSError, UnicodeDecodeError) as error:
        raise InvalidInputError(f"{name}: its file in {folder} cannot be read: {error}") from error
    return None
