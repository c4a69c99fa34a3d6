"""Uploads of attachments over REST."""

from __future__ import annotations

from typing import Any

from tests.support.runs_api import create
from tests.support.service_in_process import Service

JPEG = b"\xff\xd8\xff\xe0" + b"a photo" * 100


async def a_run(service: Service, plan: dict[str, Any]) -> str:
    _, _, made = await service.call("POST", "/api/v1/plans", json=plan)
    return str((await create(service, made["id"]))["id"])


def path_of(run_id: str, item_id: str = "drop") -> str:
    return f"/api/v1/runs/{run_id}/drops/{item_id}/attachments"


async def attach(
    service: Service, run_id: str, content: bytes, media: str, name: str = "door", **headers: str
) -> tuple[int, Any, Any]:
    path = f"{path_of(run_id)}?name={name}"
    return await service.call("POST", path, data=content, headers={"Content-Type": media, **headers})
