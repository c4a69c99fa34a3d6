"""`waydrop serve`: the service alone, for real vehicles or a simulator of one's own."""

from __future__ import annotations

import asyncio
import os
from pathlib import Path
from typing import Annotated

import typer

from app.cli.loading import end_at_sigterm, loaded_for_good
from app.config import load_settings
from app.data_folder import PRIVATE_UMASK
from app.logs import configure_logs

ConnectionOption = Annotated[
    list[str] | None,
    typer.Option(
        "--connection", metavar="URL", help="Connection to vehicles, such as udpin://0.0.0.0:14540; repeatable."
    ),
]
HostOption = Annotated[str | None, typer.Option("--host", help="Address to listen on; default: WAYDROP_HOST.")]
PortOption = Annotated[int | None, typer.Option("--port", help="Port to listen on; default: WAYDROP_PORT.")]
DataDirOption = Annotated[
    Path | None, typer.Option("--data-dir", help="Directory of the journal; default: WAYDROP_DATA_DIR.")
]


def serve(
    connection: ConnectionOption = None,
    host: HostOption = None,
    port: PortOption = None,
    data_dir: DataDirOption = None,
) -> None:
    """Start Waydrop, configured by options and WAYDROP_* variables. Ctrl-C stops it; vehicles fly on."""
    end_at_sigterm()
    settings = load_settings(
        connections=tuple(connection) if connection else None, host=host, port=port, data_dir=data_dir
    )
    configure_logs(settings)
    os.umask(PRIVATE_UMASK)
    with loaded_for_good():
        from app.application import serve as serve_application  # here: other commands do not wait for mavsdk

    asyncio.run(serve_application(settings))
