"""`waydrop gateway` and `waydrop api`: the parts of a cluster."""

from __future__ import annotations

import asyncio
import os
from typing import Annotated, Literal

import typer

from app.cli.loading import end_at_sigterm, loaded_for_good
from app.cli.serve import ConnectionOption, DataDirOption, HostOption, PortOption
from app.config import Settings, SettingsError, load_settings
from app.data_folder import PRIVATE_UMASK
from app.logs import configure_logs

SiteOption = Annotated[str | None, typer.Option("--site", help="Name of the site, such as north; else WAYDROP_SITE.")]


def gateway(
    site: SiteOption = None,
    connection: ConnectionOption = None,
    host: HostOption = None,
    port: PortOption = None,
    data_dir: DataDirOption = None,
) -> None:
    """Start a gateway of a cluster: the vehicles of one site. It flies them without the others, too."""
    connections = tuple(connection) if connection else None
    _serve(load_settings(site=site, connections=connections, host=host, port=port, data_dir=data_dir), "gateway")


def api(host: HostOption = None, port: PortOption = None, data_dir: DataDirOption = None) -> None:
    """Start an API node of a cluster: the vehicles of all its sites."""
    _serve(load_settings(host=host, port=port, data_dir=data_dir), "api")


def _serve(settings: Settings, part: Literal["gateway", "api"]) -> None:
    end_at_sigterm()
    configure_logs(settings)
    os.umask(PRIVATE_UMASK)
    try:
        with loaded_for_good():
            from app.cluster_application import serve_api, serve_gateway  # here: only a cluster has its libraries
    except ModuleNotFoundError as error:
        raise SettingsError(
            f"the library {error.name} is not installed", hint="install waydrop[cluster] instead of waydrop"
        ) from error
    asyncio.run(serve_gateway(settings) if part == "gateway" else serve_api(settings))
