"""The directory in which mavsdk keeps files: it is there before mavsdk looks for it."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Final

_CACHE: Final = Path(".cache", "mavsdk", "component_metadata")


def provide_cache_directory(data_dir: Path) -> None:
    """Make it in the user's home; where that cannot be written, in `data_dir`, which is HOME for this process then.

    mavsdk makes it when it finds a vehicle. The threads of two connections that do so at once get in each other's way
    ("Failed to create cache directory: Success"), and a service's user often has no home.
    """
    try:
        (Path.home() / _CACHE).mkdir(parents=True, exist_ok=True)
    except (OSError, RuntimeError):
        (data_dir / _CACHE).mkdir(parents=True, exist_ok=True)
        os.environ["HOME"] = str(data_dir.resolve())
