"""compose.yaml is what the Compose Specification allows, and gives the containers no more than they need."""

from __future__ import annotations

import copy
import json
from typing import Any

import jsonschema_rs
import pytest
import yaml

from app.config import Settings
from tests.support.paths import DATA, ROOT

COMPOSE: dict[str, Any] = yaml.safe_load((ROOT / "compose.yaml").read_text(encoding="utf-8"))
SCHEMA: dict[str, Any] = json.loads((DATA / "compose" / "compose-spec.json").read_text(encoding="utf-8"))
SERVICES: dict[str, Any] = COMPOSE["services"]


def problems_of(document: Any) -> list[str]:
    return [error.message for error in jsonschema_rs.Draft7Validator(SCHEMA).iter_errors(document)]


def test_it_is_a_compose_file() -> None:
    jsonschema_rs.meta.validate(SCHEMA)
    assert problems_of(COMPOSE) == []


def test_the_schema_rejects_a_misspelt_key() -> None:
    misspelt = copy.deepcopy(COMPOSE)
    misspelt["services"]["waydrop"]["readonly"] = misspelt["services"]["waydrop"].pop("read_only")
    assert len(problems_of(misspelt)) == 1


@pytest.mark.parametrize("name", SERVICES)
def test_every_container_drops_its_capabilities_and_has_limits(name: str) -> None:
    service = SERVICES[name]
    assert (service["cap_drop"], service["security_opt"]) == (["ALL"], ["no-new-privileges:true"])
    assert {"mem_limit", "cpus", "pids_limit"} <= set(service)
    assert not {"privileged", "cap_add", "pid", "ipc", "devices"} & set(service)


@pytest.mark.parametrize("name", ["waydrop", "simulator"])
def test_our_own_containers_have_a_read_only_root(name: str) -> None:
    assert SERVICES[name]["read_only"] is True


def test_the_profile_cluster_has_all_parts_and_its_key_is_a_file() -> None:
    parts = {name: service for name, service in SERVICES.items() if service.get("profiles") == ["cluster"]}
    commands = sorted(part["command"][0] for part in parts.values() if part.get("image") == "waydrop-cluster")
    assert commands == ["api", "api", "gateway", "gateway", "sim", "sim"]
    assert {"nats", "postgres"} < set(parts)
    for part in parts.values():
        if part.get("command", [""])[0] in ("api", "gateway"):
            assert part["read_only"]
            assert "waydrop_cluster_key" in part["secrets"]
            assert {name.removeprefix("WAYDROP_").lower() for name in part["environment"]} <= set(Settings.model_fields)
    assert list(COMPOSE["secrets"]["waydrop_cluster_key"]) == ["file"]


def test_nats_runs_as_the_user_that_owns_a_new_volume() -> None:
    # its image has no /data, so the engine makes the volume root's
    assert "user" not in SERVICES["nats"]
    assert SERVICES["nats"]["volumes"] == ["nats:/data"]


def test_the_token_is_a_file_that_the_settings_read() -> None:
    assert "WAYDROP_BOOTSTRAP_TOKEN" not in SERVICES["waydrop"]["environment"]
    for secret in SERVICES["waydrop"]["secrets"]:
        assert list(COMPOSE["secrets"][secret]) == ["file"]
        assert secret.removeprefix("waydrop_") in Settings.model_fields
    assert "WAYDROP_SECRETS_DIR=/run/secrets" in (ROOT / "Dockerfile").read_text(encoding="utf-8")


def test_it_is_published_on_this_machine_alone() -> None:
    assert all(port.startswith("127.0.0.1:") for service in SERVICES.values() for port in service.get("ports", ()))


def test_settings_of_the_env_file_reach_every_service_that_reads_settings() -> None:
    readers = [service for name, service in SERVICES.items() if name.startswith(("waydrop", "gateway", "api"))]
    assert len(readers) == 5
    for service in readers:
        assert service["env_file"] == [{"path": ".env", "required": False}]
        # the service's own entries go before the file: what a user may want to set must not be among them
        fixed = {"CONNECTIONS", "NATS_SERVERS", "GATEWAY_URL", "POSTGRES_URL", "SECRET_KEY_FILE"}
        assert {name.removeprefix("WAYDROP_") for name in service["environment"]} <= fixed


def test_nats_takes_large_plans() -> None:
    (config,) = SERVICES["nats"]["configs"]
    assert SERVICES["nats"]["command"][-2:] == ["-c", config["target"]]
    assert "max_payload: 8MB" in (ROOT / COMPOSE["configs"][config["source"]]["file"]).read_text(encoding="utf-8")


@pytest.mark.parametrize("kind", ["configs", "secrets"])
def test_what_a_read_only_container_gets_is_a_file(kind: str) -> None:
    """Compose refuses to start a container with a read-only root and a config or secret of inline content."""
    assert all(list(source) == ["file"] for source in COMPOSE[kind].values())
