"""Settings: read once from WAYDROP_* variables and validated before anything starts."""

from __future__ import annotations

import ipaddress
import os
import re
from collections.abc import Mapping
from difflib import get_close_matches
from pathlib import Path
from typing import Annotated, Final, Literal, Self
from urllib.parse import urlsplit

from pydantic import Field, SecretStr, ValidationError, ValidationInfo, field_validator, model_validator
from pydantic_settings import BaseSettings, NoDecode, SettingsConfigDict
from pydantic_settings import SettingsError as UnreadableSettingError

from app.domain.autopilot.declared import require_known_keys
from app.domain.cluster.site import SITE
from app.domain.errors import InvalidInputError
from app.domain.offboard.limits import OffboardLimits
from app.domain.vehicle.performance import Performance

PREFIX: Final = "WAYDROP_"
DEFAULT_CONNECTIONS: Final = "udpin://127.0.0.1:14540..14543"
MAX_CONNECTIONS: Final = 15
"""mavsdk instances that one process carries well; each connection is one."""

MIN_TOKEN_CHARS: Final = 16
MIN_CLUSTER_KEY_CHARS: Final = 32
MISSPELT: Final = 0.85
"""How alike a variable and a setting are, if the one is probably meant to be the other; less names other tools' own."""
SECRETS_DIR: Final = f"{PREFIX}SECRETS_DIR"

_PORT_RANGE = re.compile(r"^(?P<head>[^?]*:)(?P<first>\d{1,5})\.\.(?P<last>\d{1,5})(?P<options>\?.*)?$")
_LOOPBACK_PORT = re.compile(r"127\.0\.0\.1:(?P<port>\d{1,5})")
_ORIGIN = r"https?://[A-Za-z0-9.\[\]:-]+"
_MAP_URL = re.compile(_ORIGIN + r"/[^\s'\";]*")
_URL_ORIGIN = re.compile(_ORIGIN)

_HOST_NAME = re.compile(r"[A-Za-z0-9._-]+|\[[0-9A-Fa-f:.]+\]")
_PAGE_ORIGIN = re.compile(r"[a-z][a-z0-9+.-]*://([a-z0-9._-]+|\[[0-9a-f:.]+\])(:\d{1,5})?")
_DEFAULT_PORT = re.compile(r"http://.*:80|https://.*:443")

OFF: Final = "off"
BASEMAP_STYLES: Final = ("https://tiles.openfreemap.org/styles/positron", "https://tiles.openfreemap.org/styles/dark")
"""For the light and the dark theme. OpenFreeMap serves styles, tiles and sprites from one host, without keys."""
_POSTGRES = re.compile(
    r"postgres(ql)?(\+asyncpg)?://([^:/@]*(:[^@]*)?@)?(\[[0-9A-Fa-f:.]+\]|[^][/:?#@]*)(:(?P<port>\d{1,5}))?(/[^/?#]*)?"
    r"(\?(&?((host|passfile|target_session_attrs|prepared_statement_cache_size)=[^&#]+"
    r"|ssl=(disable|allow|prefer|require|verify-ca|verify-full)))+)?"
)
_CONNECTION = re.compile(r"^(udpin|udpout|tcpin|tcpout|serial)://\S+$")


Network = ipaddress.IPv4Network | ipaddress.IPv6Network


class SettingsError(InvalidInputError, code="settings.invalid"):
    """A setting cannot be used. `detail` has one line for each wrong one."""


def default_data_dir() -> Path:
    """`var/` in a checkout, else the user's XDG state folder. Not created here."""
    root = Path(__file__).resolve().parent.parent
    if (root / "pyproject.toml").is_file() and (root / "app").is_dir():
        return root / "var"
    state = os.environ.get("XDG_STATE_HOME")
    base = Path(state) if state else Path.home() / ".local" / "state"
    return base / "waydrop"


def default_page_dir() -> Path | None:
    """The built page: `app/page` in an installed wheel, `web/dist` in a checkout; None before it is built."""
    package = Path(__file__).resolve().parent
    for folder in (package / "page", package.parent / "web" / "dist"):
        if (folder / "index.html").is_file():
            return folder
    return None


class Settings(BaseSettings):
    """All that can be configured. A list is written comma separated in the environment.

    `connections` are mavsdk URLs; a port may be a range (`udpin://0.0.0.0:14540..14543` is four connections). Options
    of the link guard stand behind a question mark: see docs/explanation/security.md.
    `system_id` is Waydrop's own MAVLink system id, as a ground station: each one that a vehicle hears needs its own.
    `allowed_hosts` are further Host names (without port) under which clients reach the service.
    `allowed_origins` are further web origins (`https://desk.example`) whose pages may send commands.
    `tls_cert` and `tls_key` are PEM files: with them the service speaks https.
    `trusted_proxies` are addresses or networks of proxies whose X-Forwarded-For names the client.
    `tile_url` (`https://tiles.example/{z}/{x}/{y}.png`) or `tile_file` (PMTiles) is a map under the page's own grid.
    `basemap_style` is the MapLibre style that the page offers to load over the internet, `off` for no offer;
    `basemap_style_dark` is another one for the dark theme, `basemap_origins` are further servers that they use.
    `satellite_url` is a template like `tile_url`: pictures that the page offers.
    `simulator_control` is the control socket of simulated vehicles on this machine; with it their faults can be set.
    `offboard_limits` is JSON and bounds what clients may ask in offboard control; see docs/reference/offboard.md.
    `vehicle_performance` is JSON: payload, power and reserve by uid, id or type of vehicle; see docs/how-to/deploy.md.
    `link_keys` is the file of the vehicles' signing keys, `link-keys.json` in the data folder without it.
    `offboard_gap_s`: standing still for so long ends every offboard lease; keep it below COM_OF_LOSS_T of all vehicles.
    `hang_exit_s`: a process that hangs so long ends itself, so that vehicles see the link lost; 0 turns that off.
    `retention_days` is how long events, ended runs and jobs, and unused plans are kept; for ever without it.
    `attachments_retention_days` is the same for attached files, `retention_days` without it.
    `max_connections_per_address` does not hold for trusted proxies.
    `max_sockets` are websockets that follow the events, as many as connections at most.
    `webhook_http_anywhere` lets webhooks use plain http to other machines too, where it can be read and altered.
    `secret_key_file` has the key that encrypts webhook secrets; without it `secret.key` in the data folder.
    `bootstrap_token` is an admin token for containers: the first real tokens are made with it.

    Of a cluster, see docs/how-to/cluster.md: `site` names a gateway's site, `gateway_url` is where its own page is.
    `standby`: another gateway of the site takes it over by itself; both have this setting.
    `nats_servers` are URLs; `nats_credentials` and `nats_ca` are files. `postgres_url` is the store of API nodes.
    `cluster_key` signs the calls of API nodes, and is the same everywhere.
    """

    model_config = SettingsConfigDict(env_prefix=PREFIX, frozen=True, extra="forbid", env_ignore_empty=True)

    host: str = "127.0.0.1"
    port: int = Field(default=8080, ge=0, le=65535)
    system_id: int = Field(default=245, ge=1, le=255)
    connections: Annotated[tuple[str, ...], NoDecode] = Field(default=(DEFAULT_CONNECTIONS,), validate_default=True)
    data_dir: Path = Field(default_factory=default_data_dir)
    secret_key_file: Path | None = None
    link_keys: Path | None = None
    tls_cert: Path | None = None
    tls_key: Path | None = None
    page_dir: Path | None = Field(default_factory=default_page_dir)
    tile_url: str | None = None
    tile_file: Path | None = None
    tile_attribution: str = Field(default="", max_length=200)
    basemap_style: str = BASEMAP_STYLES[0]
    basemap_style_dark: str | None = None
    basemap_origins: Annotated[tuple[str, ...], NoDecode] = ()
    satellite_url: str | None = None
    satellite_attribution: str = Field(default="", max_length=200)
    simulator_control: str | None = None
    bootstrap_token: SecretStr | None = None
    allowed_hosts: Annotated[tuple[str, ...], NoDecode] = ()
    allowed_origins: Annotated[tuple[str, ...], NoDecode] = ()
    trusted_proxies: Annotated[tuple[Network, ...], NoDecode] = ()
    log_format: Literal["auto", "console", "json"] = "auto"
    log_level: Literal["debug", "info", "warning", "error"] = "info"
    max_body_bytes: int = Field(default=1024 * 1024, ge=1024, le=64 * 1024 * 1024)
    offboard_rate_hz: float = Field(default=20.0, ge=20.0, le=50.0)
    vehicle_performance: dict[str, Performance] = Field(default_factory=dict)
    offboard_gap_s: float = Field(default=0.8, ge=0.2, le=10.0)
    offboard_limits: OffboardLimits = Field(default_factory=OffboardLimits)
    attachments_max_bytes: int = Field(default=10 * 1024**3, ge=1024 * 1024)
    retention_days: int | None = Field(default=None, ge=1, le=36_500)
    attachments_retention_days: int | None = Field(default=None, ge=1, le=36_500)
    max_connections: int = Field(default=1000, ge=16, le=20_000)
    max_connections_per_address: int = Field(default=500, ge=8, le=20_000)
    max_sockets: int = Field(default=256, ge=8, le=20_000)
    hang_exit_s: float = Field(default=15.0, ge=0.0, le=600.0)
    webhook_http_anywhere: bool = False
    telemetry_period_s: float = Field(default=0.2, ge=0.02, le=10.0)
    site: str | None = None
    standby: bool = False
    gateway_url: str = ""
    nats_servers: Annotated[tuple[str, ...], NoDecode] = ("nats://127.0.0.1:4222",)
    nats_credentials: Path | None = None
    nats_ca: Path | None = None
    postgres_url: SecretStr | None = None
    cluster_key: SecretStr | None = None

    @field_validator(
        "connections",
        "allowed_hosts",
        "allowed_origins",
        "trusted_proxies",
        "basemap_origins",
        "nats_servers",
        mode="before",
    )
    @classmethod
    def _split(cls, value: object) -> object:
        if isinstance(value, str):
            return tuple(part.strip() for part in value.split(",") if part.strip())
        return value

    @field_validator("port", mode="before")
    @classmethod
    def _port_ours(cls, value: object) -> object:
        if isinstance(value, str) and value.startswith("tcp://"):
            raise ValueError(
                "Kubernetes sets it for a Service that is named waydrop: "
                "set enableServiceLinks: false in the specification of the pod"
            )
        return value

    @field_validator("host")
    @classmethod
    def _host_named(cls, value: str) -> str:
        if not value.strip() or "://" in value or "/" in value:
            raise ValueError("specify an address or a host name to listen on, such as 127.0.0.1 or 0.0.0.0")
        return value.strip()

    @field_validator("trusted_proxies")
    @classmethod
    def _proxies_few(cls, value: tuple[Network, ...]) -> tuple[Network, ...]:
        if any(network.prefixlen == 0 for network in value):
            raise ValueError("a network of all addresses would let any client forge its address")
        return value

    @field_validator("tile_url", "satellite_url")
    @classmethod
    def _tiles_numbered(cls, value: str | None) -> str | None:
        numbered = value is None or all(part in value for part in ("{z}", "{x}", "{y}"))
        if value is not None and not (numbered and _MAP_URL.fullmatch(value)):
            raise ValueError("write it as https://tiles.example/{z}/{x}/{y}.png")
        return value

    @field_validator("basemap_style", "basemap_style_dark")
    @classmethod
    def _style_addressed(cls, value: str | None, info: ValidationInfo) -> str | None:
        is_off = value == OFF and info.field_name == "basemap_style"
        if value is not None and not is_off and not _MAP_URL.fullmatch(value):
            raise ValueError(f"write it as https://maps.example/style.json; {PREFIX}BASEMAP_STYLE={OFF} offers no map")
        return value

    @field_validator("basemap_origins")
    @classmethod
    def _origins_bare(cls, value: tuple[str, ...]) -> tuple[str, ...]:
        if not all(_URL_ORIGIN.fullmatch(origin) for origin in value):
            raise ValueError("write each as https://maps.example, without a path")
        return value

    @field_validator("simulator_control")
    @classmethod
    def _control_here(cls, value: str | None) -> str | None:
        match = None if value is None else _LOOPBACK_PORT.fullmatch(value)
        if value is not None and (match is None or not 0 < int(match["port"]) <= 65535):
            raise ValueError("the simulator's control socket is on this machine: use 127.0.0.1:PORT")
        return value

    @field_validator("bootstrap_token")
    @classmethod
    def _token_long(cls, value: SecretStr | None) -> SecretStr | None:
        if value is not None and len(value.get_secret_value()) < MIN_TOKEN_CHARS:
            raise ValueError(f"too short for a secret: use at least {MIN_TOKEN_CHARS} characters")
        return value

    @field_validator("site")
    @classmethod
    def _site_named(cls, value: str | None) -> str | None:
        if value is not None and not SITE.fullmatch(value):
            raise ValueError("a site has 1 to 31 lower-case letters and digits, a letter first")
        return value

    @field_validator("gateway_url")
    @classmethod
    def _gateway_reached(cls, value: str) -> str:
        if value and not _URL_ORIGIN.fullmatch(value):
            raise ValueError("write it as https://north.example, without a path")
        return value

    @field_validator("nats_servers")
    @classmethod
    def _servers_named(cls, value: tuple[str, ...]) -> tuple[str, ...]:
        if not value or not all(_is_server(url) for url in value):
            raise ValueError(
                "write them as nats://USER:PASSWORD@HOST:4222, or tls://HOST:4222 with TLS; "
                "a password with / ? # or a comma cannot be in a URL"
            )
        return value

    @field_validator("postgres_url")
    @classmethod
    def _database_addressed(cls, value: SecretStr | None) -> SecretStr | None:
        match = None if value is None else _POSTGRES.fullmatch(value.get_secret_value())
        if value is not None and (match is None or not 0 < int(match["port"] or 5432) <= 65535):
            raise ValueError(
                "write it as postgresql://USER:PASSWORD@HOST:PORT/DATABASE; "
                "for TLS, ?ssl=require or ?ssl=verify-full behind it, where libpq has sslmode"
            )
        return value

    @field_validator("cluster_key")
    @classmethod
    def _key_long(cls, value: SecretStr | None) -> SecretStr | None:
        if value is not None and len(value.get_secret_value()) < MIN_CLUSTER_KEY_CHARS:
            raise ValueError(f"too short to be a secret: at least {MIN_CLUSTER_KEY_CHARS} characters")
        return value

    @field_validator("vehicle_performance")
    @classmethod
    def _performance_of_vehicles(cls, value: dict[str, Performance]) -> dict[str, Performance]:
        require_known_keys(value)
        return value

    @field_validator("connections")
    @classmethod
    def _connections_usable(cls, value: tuple[str, ...]) -> tuple[str, ...]:
        expanded = [url for entry in value for url in expand_connection(entry)]
        if not expanded:
            raise ValueError("at least one connection is required")
        if len(expanded) > MAX_CONNECTIONS:
            raise ValueError(f"{len(expanded)} connections: one process takes at most {MAX_CONNECTIONS}")
        if len(set(expanded)) != len(expanded):
            raise ValueError("a connection is specified twice")
        return tuple(expanded)

    @field_validator("allowed_hosts")
    @classmethod
    def _hosts_bare(cls, value: tuple[str, ...]) -> tuple[str, ...]:
        if not all(_HOST_NAME.fullmatch(name) for name in value):
            raise ValueError("write each as desk.example, without scheme and port; an IPv6 address as [fd00::1]")
        return tuple(name.lower() for name in value)

    @field_validator("allowed_origins")
    @classmethod
    def _pages_bare(cls, value: tuple[str, ...]) -> tuple[str, ...]:
        origins = tuple(origin.lower().rstrip("/") for origin in value)
        if not all(_PAGE_ORIGIN.fullmatch(origin) and not _DEFAULT_PORT.fullmatch(origin) for origin in origins):
            raise ValueError("write each as https://desk.example or http://desk.example:8000, as browsers send it")
        return origins

    @model_validator(mode="after")
    def _tls_whole(self) -> Self:
        if (self.tls_cert is None) != (self.tls_key is None):
            raise ValueError(f"{PREFIX}TLS_CERT and {PREFIX}TLS_KEY: set both or neither")
        return self

    @model_validator(mode="after")
    def _files_go_with_events(self) -> Self:
        days, files_days = self.retention_days, self.attachments_retention_days
        if days is not None and files_days is not None and files_days > days:
            raise ValueError(
                f"{PREFIX}ATTACHMENTS_RETENTION_DAYS {files_days} is more than {PREFIX}RETENTION_DAYS {days}: "
                "files are deleted with their events at the latest"
            )
        return self

    @property
    def basemap_styles(self) -> tuple[str, str] | None:
        """The style for the light and for the dark theme, None if none is offered."""
        if self.basemap_style == OFF:
            return None
        default_dark = BASEMAP_STYLES[1] if self.basemap_style == BASEMAP_STYLES[0] else self.basemap_style
        return self.basemap_style, self.basemap_style_dark or default_dark

    @property
    def journal_path(self) -> Path:
        """The SQLite file of journal, plans, runs and tokens."""
        return self.data_dir / "waydrop.db"

    @property
    def link_key_path(self) -> Path:
        """The file of the vehicles' signing keys."""
        return self.link_keys or self.data_dir / "link-keys.json"

    @property
    def link_state_path(self) -> Path:
        """What the service remembers of signatures: their timestamps, and which keys are in use."""
        return self.data_dir / "link-state.json"

    @property
    def is_loopback(self) -> bool:
        """Whether only this machine can reach the service."""
        if self.host == "localhost":
            return True
        try:
            return ipaddress.ip_address(self.host).is_loopback
        except ValueError:
            return False


def _is_server(url: str) -> bool:
    """Whether it names a server of NATS, and nothing else."""
    try:
        parts = urlsplit(url)
        is_named = bool(parts.hostname) and parts.port != 0
    except ValueError:  # of the port
        return False
    return parts.scheme in ("nats", "tls") and is_named and not (parts.path.strip("/") or parts.query or parts.fragment)


def expand_connection(entry: str) -> tuple[str, ...]:
    """One connection URL, or one for each port if its port is a range `first..last`. ValueError if unusable."""
    if not _CONNECTION.match(entry):
        raise ValueError(
            f"{entry!r} is not a valid connection: use udpin://ADDRESS:PORT, udpout://..., tcpin://..., tcpout://... "
            "or serial://DEVICE:BAUD (udp:// and tcp:// are deprecated in mavsdk)"
        )
    ports = _PORT_RANGE.match(entry)
    if ports is None:
        return (entry,)
    first, last = int(ports["first"]), int(ports["last"])
    if not 0 < first <= last <= 65535:
        raise ValueError(f"{entry!r}: a port range must be ascending and within 1..65535")
    if last - first >= MAX_CONNECTIONS:
        raise ValueError(f"{entry!r}: a process supports at most {MAX_CONNECTIONS} connections")
    return tuple(f"{ports['head']}{port}{ports['options'] or ''}" for port in range(first, last + 1))


_CORRECT: Final = "correct the variable or the option, then restart"
_FIELD: Final = re.compile(r'field "(\w+)"')


def load_settings(**given: object) -> Settings:
    """Settings from `given` (None means not given), else the environment, else secret files, else the defaults.

    Secret files are in the folder that WAYDROP_SECRETS_DIR names, each with its variable's name in lower case.

    Raises:
        SettingsError: one or more cannot be used; `detail` has a line for each, by its variable's name.
    """
    secrets = os.environ.get(SECRETS_DIR) or None
    if secrets is not None and not os.path.isdir(secrets):  # without its files the service would be open to everybody
        raise SettingsError(f"{SECRETS_DIR}: {secrets} is no folder", hint=_CORRECT)
    try:
        return Settings(
            _secrets_dir=secrets,
            **{name: value for name, value in given.items() if value is not None},  # type: ignore[arg-type]
        )
    except ValidationError as error:
        lines = []
        for problem in error.errors(include_url=False, include_input=False):
            name = PREFIX + str(problem["loc"][0]).upper() if problem["loc"] else PREFIX + "*"
            said = problem["msg"].removeprefix("Value error, ").replace("Input should", "must")
            lines.append(f"{name}: {said}")
        raise SettingsError("\n".join(lines), hint=_CORRECT) from error
    except UnreadableSettingError as error:  # it names the field in a sentence alone, and repeats no value
        field = _FIELD.search(str(error))
        name = PREFIX + (field[1].upper() if field else "*")
        cause = error.__cause__
        if isinstance(cause, OSError):
            raise SettingsError(
                f"{name}: {cause.filename} cannot be read: {cause.strerror}",
                hint="let the user that runs Waydrop (10001 in the image) read the file: "
                "restrict the folder that it is in, not the file",
            ) from error
        raise SettingsError(f"{name}: must be valid JSON: {cause}", hint=_CORRECT) from error


def misspelt_settings() -> Mapping[str, str]:
    """Variables and secret files that are probably misspelt, and the setting that each resembles."""
    names = [name.upper() for name in Settings.model_fields]
    given = {name: name.removeprefix(PREFIX) for name in os.environ if name.startswith(PREFIX) and name != SECRETS_DIR}
    folder = os.environ.get(SECRETS_DIR)
    for path in Path(folder).glob(f"{PREFIX.lower()}*") if folder else ():
        given[str(path)] = path.name.upper().removeprefix(PREFIX)
    near = {one: get_close_matches(name, names, n=1, cutoff=MISSPELT) for one, name in given.items()}
    return {one: PREFIX + meant for one, found in sorted(near.items()) for meant in found if meant != given[one]}


def require_access_control(settings: Settings, *, has_tokens: bool) -> None:
    """Refuse to listen on an address that others can reach without authentication.

    Raises:
        SettingsError: the host is not loopback and there is neither a stored token nor a bootstrap token.
    """
    if settings.is_loopback or has_tokens or settings.bootstrap_token is not None:
        return
    raise SettingsError(
        f"{PREFIX}HOST: {settings.host} can be reached from other machines, and no access token exists: "
        "anybody there could fly the vehicles",
        hint=f"create a token with `waydrop token create NAME --role admin`, or set {PREFIX}BOOTSTRAP_TOKEN "
        f"(at least {MIN_TOKEN_CHARS} characters), or listen on 127.0.0.1",
    )


def require_part_of_cluster(settings: Settings, *names: str) -> None:
    """Raises SettingsError unless each of these is set: `site`, `cluster_key`, `postgres_url`."""
    missing = [PREFIX + name.upper() for name in names if getattr(settings, name) is None]
    if missing:
        raise SettingsError(
            f"{', '.join(missing)}: needed for a part of a cluster", hint="see docs/how-to/cluster.md for each"
        )
