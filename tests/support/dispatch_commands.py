"""`waydrop runs list` and `waydrop webhook` against a real service."""

from __future__ import annotations

import asyncio

from typer.testing import CliRunner, Result

from app.cli.main import app
from tests.support.service_in_process import Service


async def waydrop(service: Service, *arguments: str) -> Result:
    """Run a command beside the service."""
    environment = {"WAYDROP_SERVER": service.url, "COLUMNS": "250", "NO_COLOR": "1"}
    return await asyncio.to_thread(CliRunner().invoke, app, list(arguments), env=environment)
