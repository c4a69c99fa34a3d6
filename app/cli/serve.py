"""`waydrop serve`: the service alone, for real vehicles or a simulator of one's own."""

from __future__ import annotations

import asyncio
import gc
import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Annotated

import typer

from app.config import load_settings
from app.data_folder import PRIVATE_UMASK
from app.logs import configure_logs

# What a process loads at its start stays until its end: the garbage collector need not look at it.


@contextmanager
def loaded_for_good() -> Iterator[None]:
    """Import in this block what is large.

    Else the collector looks through all of it again and again while it grows, now and then while the process runs,
    and once more at its end: together as long as a third of the start.
    """
    gc.disable()
    try:
        yield
    finally:
        gc.freeze()
        gc.enable()


ConnectionOption = Annotated[
    list[str] | None,
    typer.Option("--connection", metavar="URL", help="Where vehicles are: udpin://0.0.0.0:14540; may be repeated."),
]
HostOption = Annotated[str | None, typer.Option("--host", help="Address to listen on; else WAYDROP_HOST.")]
PortOption = Annotated[int | None, typer.Option("--port", help="Port to listen on; else WAYDROP_PORT.")]
DataDirOption = Annotated[Path | None, typer.Option("--data-dir", help="Folder of the journal; else WAYDROP_DATA_DIR.")]


def serve(
    connection: ConnectionOption = None,
    host: HostOption = None,
    port: PortOption = None,
    data_dir: DataDirOption = None,
) -> None:
    """Start Waydrop. What is not given here comes from WAYDROP_* variables. Ctrl-C ends it; vehicles fly on."""
    settings = load_settings(
        connections=tuple(connection) if connection else None, host=host, port=port, data_dir=data_dir
    )
    configure_logs(settings)
    os.umask(PRIVATE_UMASK)
    with loaded_for_good():
        from app.application import serve as serve_application  # here: other commands do not wait for mavsdk

    asyncio.run(serve_application(settings))
