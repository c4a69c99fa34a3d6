"""Who asks, as the service knows them."""

from __future__ import annotations

import pytest

from app.services.access import Role
from tests.support.service_in_process import Service

PRINCIPAL = "/api/v1/principal"


async def test_without_tokens_whoever_asks_from_this_machine_may_do_everything(service: Service) -> None:
    status, _, body = await service.call("GET", PRINCIPAL)
    assert (status, body) == (
        200,
        {"name": "local", "role": "admin", "roles": ["viewer", "dispatcher", "pilot", "admin"]},
    )


@pytest.mark.parametrize(
    ("role", "roles"),
    [
        (Role.VIEWER, ["viewer"]),
        (Role.DISPATCHER, ["viewer", "dispatcher"]),
        (Role.PILOT, ["viewer", "dispatcher", "pilot"]),
        (Role.ADMIN, ["viewer", "dispatcher", "pilot", "admin"]),
    ],
)
async def test_a_token_tells_its_name_and_each_role_that_it_includes(
    service: Service, role: Role, roles: list[str]
) -> None:
    headers = await service.token(role)
    status, _, body = await service.call("GET", PRINCIPAL, headers=headers)
    assert (status, body) == (200, {"name": f"a {role.value}", "role": role.value, "roles": roles})
