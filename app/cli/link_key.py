"""`waydrop link-key`: signing keys of the vehicle links. Works on this machine's files, also without a service."""

from __future__ import annotations

import re
import sys
from pathlib import Path
from typing import Annotated, Final

import typer
from rich.table import Table

from app.cli.serve import DataDirOption
from app.cli.service_client import ServerOption, TokenOption, with_client
from app.cli.terminal import err, out
from app.config import load_settings
from app.domain.errors import InvalidInputError
from app.domain.ports.link_keys import LinkKeys

link_key_app = typer.Typer(help="Manage the signing keys of vehicle links on this machine.", no_args_is_help=True)

KEY_BYTES: Final = 32
_VEHICLE: Final = re.compile(r"v?(\d{1,3})(-\d+)?")
VehicleArgument = Annotated[str, typer.Argument(metavar="VEHICLE", help="The vehicle: v1, or its system ID.")]


@link_key_app.command()
def create(
    vehicles: Annotated[list[str], typer.Argument(metavar="VEHICLE...", help="Vehicles: v1, or system IDs.")],
    given: Annotated[
        Path | None,
        typer.Option(
            "--from",
            metavar="FILE",
            help="Import a key that the vehicle already has: 32 bytes or 64 hex digits; - is standard input.",
        ),
    ] = None,
    data_dir: DataDirOption = None,
) -> None:
    """Make a key for each vehicle. It counts as soon as the vehicle signs with it; see `setup`."""
    keys, numbers = _keys(data_dir), [_system_id(vehicle) for vehicle in vehicles]
    if given is not None and len(numbers) != 1:
        raise InvalidInputError("--from requires exactly one vehicle", hint="name one vehicle")
    secret = None if given is None else _read_secret(given)
    for number in numbers:
        made = keys.create(number, secret)
        out().out(f"{number} {made.fingerprint}", highlight=False)
    if given is None:
        err().print(
            "Send it to the vehicle over a link that nobody else can read: `waydrop link-key setup`.", markup=False
        )


@link_key_app.command("list")
def list_keys(data_dir: DataDirOption = None) -> None:
    """List the keys by their fingerprints, and whether the vehicle uses them."""
    table = Table()
    for column in ("system", "fingerprint", "created", "state"):
        table.add_column(column)
    for key in _keys(data_dir).list_keys():
        table.add_row(str(key.system_id), key.fingerprint, key.created, "in use" if key.in_use else "new")
    out().print(table)


@link_key_app.command()
def remove(
    vehicle: VehicleArgument,
    fingerprint: Annotated[str, typer.Argument(help="Fingerprint of the key, as shown by `list`.")],
    data_dir: DataDirOption = None,
) -> None:
    """Forget a key. A vehicle that still signs with it cannot be commanded any more."""
    _keys(data_dir).remove(_system_id(vehicle), fingerprint)
    err().print(f"key {fingerprint} is removed", markup=False)


@link_key_app.command()
def setup(
    vehicle: Annotated[
        str, typer.Argument(metavar="VEHICLE", help="ID of the vehicle, as shown by `waydrop vehicles`.")
    ],
    server: ServerOption,
    token: TokenOption = None,
    trust_link: Annotated[
        bool,
        typer.Option("--trust-link", help="Confirm that nobody else can read this link: the key is sent unencrypted."),
    ] = False,
) -> None:
    """Send a vehicle its newest key (SETUP_SIGNING) through the running Waydrop, and wait until it signs with it."""
    if not trust_link:
        raise InvalidInputError(
            "the key is sent unencrypted: anybody who reads it can control the vehicle",
            hint="use a cable or a VPN, and confirm it with --trust-link",
        )
    path, order = f"/vehicles/{vehicle}/link-key", {"trust_link": True}
    found = with_client(server, token, lambda client: client.post(path, order))
    err().print(f"{found['vehicle_id']} signs with key {found['fingerprint']}", markup=False)


def _keys(data_dir: Path | None) -> LinkKeys:
    from app.application import link_keys

    return link_keys(load_settings(data_dir=data_dir))


def _system_id(vehicle: str) -> int:
    match = _VEHICLE.fullmatch(vehicle)
    if match is None or not 1 <= int(match[1]) <= 255:
        raise InvalidInputError(f"{vehicle!r} is not a vehicle: use v1 or its system ID, 1 to 255")
    return int(match[1])


def _read_secret(path: Path) -> bytes:
    try:
        data = sys.stdin.buffer.read() if str(path) == "-" else path.read_bytes()
    except OSError as error:
        raise InvalidInputError(f"cannot read {path}: {error.strerror}") from error
    if len(data) == KEY_BYTES and any(data):
        return data
    text = data.strip()
    if re.fullmatch(rb"[0-9a-fA-F]{64}", text) and any(bytes.fromhex(text.decode())):
        return bytes.fromhex(text.decode())
    raise InvalidInputError(f"{path} is not a key: expected {KEY_BYTES} bytes or {2 * KEY_BYTES} hex digits")
