"""`waydrop token`: who may use the service. Works on the journal of this machine, whether Waydrop runs or not."""

from __future__ import annotations

import asyncio
import re
from collections.abc import Awaitable, Callable
from datetime import datetime
from pathlib import Path
from typing import Annotated, TypeVar

import typer
from rich.table import Table

from app.cli.serve import DataDirOption
from app.cli.terminal import OutputError, err, out
from app.config import load_settings
from app.domain.errors import InvalidInputError
from app.services.access import Access, Role

T = TypeVar("T")
token_app = typer.Typer(help="Manage the access tokens of Waydrop on this machine.", no_args_is_help=True)


@token_app.command()
def create(
    name: Annotated[str, typer.Argument(help="Who or what uses it, such as dispatch-desk.")],
    role: Annotated[Role, typer.Option(help="Role; each role includes those before it.")],
    expires_in: Annotated[
        str | None,
        typer.Option(metavar="TIME", help="Validity, such as 90d, 12h or 30m; default: until it is revoked."),
    ] = None,
    data_dir: DataDirOption = None,
) -> None:
    """Create a token. It is shown once; only its hash is stored."""
    lifetime_s = None if expires_in is None else _seconds(expires_in)
    stored, secret = _with_access(data_dir, lambda access: access.create_token(name, role, lifetime_s=lifetime_s))
    until = "" if stored.expires_at is None else f", valid until {_day(stored.expires_at)}"
    err().print(f"token {stored.id} for {name}, role {role.value}{until}; it is not shown again:", markup=False)
    try:
        out().out(secret, highlight=False)
    except OutputError as error:
        lost = f"{error.detail}: the secret of {stored.id} is lost"
        raise OutputError(lost, hint=f"`waydrop token revoke {stored.id}`, and create another") from error
    err().print(
        "From now on every client needs a token, including those on this machine, even after all tokens are revoked.",
        markup=False,
    )


@token_app.command("list")
def list_tokens(data_dir: DataDirOption = None) -> None:
    """List all tokens, expired and revoked ones too."""
    tokens = _with_access(data_dir, lambda access: access.list_tokens(), of_existing=True)
    table = Table()
    for column in ("id", "name", "role", "created", "last used", "expires", "revoked"):
        table.add_column(column)
    for token in tokens:
        times = (token.created_at, token.last_used_at, token.expires_at, token.revoked_at)
        table.add_row(token.id, token.name, token.role, *("" if at is None else _day(at) for at in times))
    out().print(table)


@token_app.command()
def revoke(
    token_id: Annotated[str, typer.Argument(metavar="ID", help="The token's id.")], data_dir: DataDirOption = None
) -> None:
    """Revoke a token. From now on requests with it are rejected."""
    _with_access(data_dir, lambda access: access.revoke(token_id), of_existing=True)
    err().print(f"token {token_id} is revoked", markup=False)


def _with_access(data_dir: Path | None, use: Callable[[Access], Awaitable[T]], *, of_existing: bool = False) -> T:
    """Raises StorageError: also if there is no journal, and it is to be `of_existing` one."""
    from app.application import open_access  # here: the other commands start without it

    async def used() -> T:
        async with open_access(load_settings(data_dir=data_dir), of_existing=of_existing) as access:
            return await use(access)

    return asyncio.run(used())


def _seconds(text: str) -> float:
    """Raises InvalidInputError."""
    match = re.fullmatch(r"(\d{1,6})([mhd])", text.strip())
    if match is None:
        raise InvalidInputError(f"--expires-in: {text!r} is not a valid duration", hint="use the form 90d, 12h or 30m")
    return int(match[1]) * {"m": 60.0, "h": 3600.0, "d": 86400.0}[match[2]]


def _day(seconds: float) -> str:
    return datetime.fromtimestamp(seconds).strftime("%Y-%m-%d %H:%M")
