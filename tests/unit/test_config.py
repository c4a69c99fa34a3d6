"""Settings come from the environment, are checked before anything starts, and are refused in words."""

from __future__ import annotations

from pathlib import Path

import pytest

from app.config import (
    SettingsError,
    default_data_dir,
    expand_connection,
    load_settings,
    misspelt_settings,
    require_access_control,
)
from tests.support.paths import ROOT


@pytest.fixture(autouse=True)
def _no_settings_of_this_machine(monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("HOST", "PORT", "CONNECTIONS", "DATA_DIR", "BOOTSTRAP_TOKEN", "ALLOWED_HOSTS", "SIMULATOR_CONTROL"):
        monkeypatch.delenv(f"WAYDROP_{name}", raising=False)


def test_the_defaults_listen_on_loopback_for_the_four_usual_ports() -> None:
    settings = load_settings()
    assert settings.is_loopback
    assert settings.port == 8080
    assert settings.connections == tuple(f"udpin://127.0.0.1:{port}" for port in range(14540, 14544))


def test_a_list_in_the_environment_is_comma_separated(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("WAYDROP_CONNECTIONS", "udpin://0.0.0.0:14540..14541?peer=any, serial:///dev/ttyACM0:57600")
    monkeypatch.setenv("WAYDROP_ALLOWED_HOSTS", "Desk.example")
    settings = load_settings()
    ports = ("udpin://0.0.0.0:14540?peer=any", "udpin://0.0.0.0:14541?peer=any")
    assert settings.connections == (*ports, "serial:///dev/ttyACM0:57600")
    assert settings.allowed_hosts == ("desk.example",)


def test_what_is_given_goes_before_the_environment(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("WAYDROP_PORT", "1234")
    assert load_settings(port=18301).port == 18301
    assert load_settings(port=None).port == 1234


def test_a_secret_can_be_a_file_and_the_environment_goes_before_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "waydrop_bootstrap_token").write_text("a secret of the file\n")
    assert load_settings().bootstrap_token is None
    monkeypatch.setenv("WAYDROP_SECRETS_DIR", str(tmp_path))
    token = load_settings().bootstrap_token
    assert token is not None
    assert token.get_secret_value() == "a secret of the file"
    monkeypatch.setenv("WAYDROP_BOOTSTRAP_TOKEN", "a secret of the environment")
    token = load_settings().bootstrap_token
    assert token is not None
    assert token.get_secret_value() == "a secret of the environment"


def test_a_missing_folder_of_secrets_does_not_open_the_service_without_them(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("WAYDROP_SECRETS_DIR", str(tmp_path / "nothing"))
    with pytest.raises(SettingsError, match=r"^WAYDROP_SECRETS_DIR: .*/nothing is no folder"):
        load_settings()
    monkeypatch.setenv("WAYDROP_SECRETS_DIR", "")
    assert load_settings().bootstrap_token is None


def test_a_secret_that_is_probably_misspelt_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("WAYDROP_SECRETS_DIR", str(tmp_path))
    for name in ("waydrop_bootstrap_tokn", "waydrop_cluster_key", "postgres_password", "waydrop_server"):
        (tmp_path / name).write_text("a secret of the file\n")
    path = tmp_path / "waydrop_bootstrap_tokn"
    assert misspelt_settings() == {str(path): "WAYDROP_BOOTSTRAP_TOKEN"}


def test_every_wrong_setting_is_named_with_its_variable(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("WAYDROP_PORT", "99999")
    monkeypatch.setenv("WAYDROP_CONNECTIONS", "udp://:14540")
    monkeypatch.setenv("WAYDROP_BOOTSTRAP_TOKEN", "short")
    with pytest.raises(SettingsError) as refused:
        load_settings()
    lines = refused.value.detail.splitlines()
    assert [line.split(":")[0] for line in lines] == [
        "WAYDROP_PORT",
        "WAYDROP_CONNECTIONS",
        "WAYDROP_BOOTSTRAP_TOKEN",
    ]
    assert "at least 16 characters" in lines[2]


@pytest.mark.parametrize("name", ["WAYDROP_OFFBOARD_LIMITS", "WAYDROP_VEHICLE_PERFORMANCE"])
def test_a_setting_that_is_no_json_is_named_without_its_value(monkeypatch: pytest.MonkeyPatch, name: str) -> None:
    monkeypatch.setenv(name, "{secret")
    with pytest.raises(SettingsError, match=f"^{name}: must be valid JSON: .* column 2") as refused:
        load_settings()
    assert "secret" not in refused.value.detail


@pytest.mark.parametrize("address", ["14600", "localhost:14600", "10.0.0.1:14600", "127.0.0.1:0", "127.0.0.1:70000"])
def test_a_simulator_is_controlled_on_this_machine_only(address: str) -> None:
    with pytest.raises(SettingsError, match=r"WAYDROP_SIMULATOR_CONTROL: .*127\.0\.0\.1:PORT"):
        load_settings(simulator_control=address)
    assert load_settings(simulator_control="127.0.0.1:14600").simulator_control == "127.0.0.1:14600"


def test_a_secret_is_not_shown() -> None:
    settings = load_settings(bootstrap_token="a-very-secret-token")
    assert "a-very-secret-token" not in repr(settings)


@pytest.mark.parametrize(
    "entry",
    ["14540", "udpin://0.0.0.0:9..5", "udpin://0.0.0.0:1..100", "udpin://0.0.0.0:0..3", "http://x:1", "udpin://", ""],
)
def test_an_unusable_connection_is_refused(entry: str) -> None:
    with pytest.raises(ValueError, match=r"connection|port"):
        expand_connection(entry)


def test_more_connections_than_one_process_carries_are_refused() -> None:
    urls = tuple(f"udpin://127.0.0.1:{port}" for port in range(14540, 14556))
    with pytest.raises(SettingsError, match="at most 15"):
        load_settings(connections=urls)


def test_a_connection_given_twice_is_refused() -> None:
    with pytest.raises(SettingsError, match="twice"):
        load_settings(connections=("udpin://127.0.0.1:14540..14542", "udpin://127.0.0.1:14541"))


@pytest.mark.parametrize("host", ["127.0.0.1", "127.8.8.8", "::1", "localhost"])
def test_loopback_needs_no_token(host: str) -> None:
    require_access_control(load_settings(host=host), has_tokens=False)


@pytest.mark.parametrize("host", ["0.0.0.0", "::", "192.168.1.4", "desk.example"])
def test_any_other_address_needs_a_token_and_says_how_to_get_one(host: str) -> None:
    settings = load_settings(host=host)
    with pytest.raises(SettingsError) as refused:
        require_access_control(settings, has_tokens=False)
    assert "waydrop token create" in refused.value.hint
    assert "WAYDROP_BOOTSTRAP_TOKEN" in refused.value.hint
    require_access_control(settings, has_tokens=True)
    require_access_control(load_settings(host=host, bootstrap_token="0123456789abcdef"), has_tokens=False)


def test_a_checkout_keeps_its_data_in_var() -> None:
    assert default_data_dir() == ROOT / "var"


def test_an_installed_waydrop_keeps_its_data_in_the_state_folder(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setattr("app.config.__file__", str(tmp_path / "site-packages" / "app" / "config.py"))
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))
    assert default_data_dir() == tmp_path / "state" / "waydrop"


def test_a_variable_that_resembles_a_setting_is_named_and_other_tools_variables_are_not(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    for name in ("RETENTION_DAY", "TRUSTED_PROXY", "SERVER", "TOKEN", "LEASES", "LOG_FILES", "CHROMIUM"):
        monkeypatch.setenv(f"WAYDROP_{name}", "x")
    monkeypatch.delenv("WAYDROP_SECRETS_DIR", raising=False)
    assert misspelt_settings() == {
        "WAYDROP_RETENTION_DAY": "WAYDROP_RETENTION_DAYS",
        "WAYDROP_TRUSTED_PROXY": "WAYDROP_TRUSTED_PROXIES",
    }


def test_files_cannot_be_kept_longer_than_their_events() -> None:
    assert load_settings(retention_days=30, attachments_retention_days=30).retention_days == 30
    with pytest.raises(SettingsError, match="31 is more than WAYDROP_RETENTION_DAYS 30"):
        load_settings(retention_days=30, attachments_retention_days=31)


def test_a_value_of_another_type_is_refused_in_words_about_the_variable(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("WAYDROP_PORT", "http")
    with pytest.raises(SettingsError, match=r"^WAYDROP_PORT: must be a valid integer"):
        load_settings()


@pytest.mark.parametrize(
    "url", ["nats://h:42x2", "nats://u:a#b@h", "nats://u:a?b@h", "nats://u:a/b@h", "nats://", "h:1"]
)
def test_a_nats_server_that_nothing_could_connect_to_is_refused(url: str) -> None:
    with pytest.raises(SettingsError, match=r"^WAYDROP_NATS_SERVERS: write them as nats://"):
        load_settings(nats_servers=("nats://north:4222", url))


def test_nats_servers_may_have_users_and_no_port() -> None:
    urls = ("nats://north", "tls://north:secret@[::1]:4222", "nats://token@10.0.0.1:4222/")
    assert load_settings(nats_servers=urls).nats_servers == urls


@pytest.mark.parametrize("name", ["offboard_limits", "nats_servers", "bootstrap_token"])
def test_a_secret_file_that_cannot_be_read_is_called_that(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str
) -> None:
    (tmp_path / f"waydrop_{name}").write_text("{}")
    monkeypatch.setenv("WAYDROP_SECRETS_DIR", str(tmp_path))

    def denied(path: Path, *_: object, **__: object) -> str:  # root, as in some test environments, may read any file
        raise PermissionError(13, "Permission denied", str(path))

    monkeypatch.setattr(Path, "read_text", denied)
    expected = f"^WAYDROP_{name.upper()}: .*/waydrop_{name} cannot be read: Permission denied$"
    with pytest.raises(SettingsError, match=expected) as refused:
        load_settings()
    assert "user that runs Waydrop" in refused.value.hint


@pytest.mark.parametrize(
    "rest",
    ["u:secret@h:abc/d", "u:secret@h:70000/d", "u:secret@h/d?sslmode=require", "u:secret@h/d?ssl=on", "h/d?timeout=5"],
)
def test_an_address_of_postgresql_that_cannot_be_used_is_refused_without_its_password(rest: str) -> None:
    with pytest.raises(SettingsError, match=r"^WAYDROP_POSTGRES_URL: write it as .*\?ssl=require") as refused:
        load_settings(postgres_url=f"postgresql://{rest}")
    assert "secret" not in refused.value.detail


@pytest.mark.parametrize(
    "rest", ["u@h/d", "u:p#/?@h:5432/d?ssl=verify-full", "u@[::1]:5432/d", "/d?host=/run/postgresql&ssl=disable", "h"]
)
def test_an_address_of_postgresql_may_have_these_forms(rest: str) -> None:
    assert load_settings(postgres_url=f"postgresql://{rest}").postgres_url is not None


@pytest.mark.parametrize("name", ["desk.example:8443", "https://desk.example", "desk.example/", "fd00::1", "*"])
def test_a_host_that_no_request_can_name_is_refused(name: str) -> None:
    with pytest.raises(SettingsError, match=r"^WAYDROP_ALLOWED_HOSTS: write each as desk\.example, without"):
        load_settings(allowed_hosts=("waydrop", name))
    assert load_settings(allowed_hosts=("Desk_2.example", "[fd00::1]")).allowed_hosts == ("desk_2.example", "[fd00::1]")


@pytest.mark.parametrize(
    "origin", ["desk.example", "https://desk.example/app", "https://desk.example:443", "http://desk.example:80", "*"]
)
def test_an_origin_that_no_browser_sends_is_refused(origin: str) -> None:
    with pytest.raises(SettingsError, match=r"^WAYDROP_ALLOWED_ORIGINS: write each as https://desk\.example"):
        load_settings(allowed_origins=("https://desk.example", origin))
    origins = ("https://Desk.example/", "http://10.0.0.1:443", "http://[fd00::1]:8000")
    assert load_settings(allowed_origins=origins).allowed_origins[0] == "https://desk.example"


def test_a_port_that_kubernetes_has_set_is_told_as_that(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("WAYDROP_PORT", "tcp://10.43.0.7:8080")
    with pytest.raises(SettingsError, match=r"^WAYDROP_PORT: .*enableServiceLinks: false"):
        load_settings()
