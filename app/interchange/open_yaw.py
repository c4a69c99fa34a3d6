"""A yaw of 0 in files that have no way to say "not given": read as north, it would turn the vehicle."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from app.domain.items import FORMS
from app.interchange.file_item import FileItem
from app.interchange.findings import Report


def without_zero_yaws(items: Sequence[FileItem], pointer: str, report: Report) -> list[FileItem]:
    """The items with each param4 of 0 that would be a yaw taken out; said once for the file."""
    if any(_is_zero_yaw(item) for item in items):
        message = "a 0 in the place of the yaw (param4) is read as not given: such files do not say it otherwise"
        report.assume("conversion.yaw", pointer, message)
    return [_without(item) if _is_zero_yaw(item) else item for item in items]


def _is_zero_yaw(item: FileItem) -> bool:
    form = FORMS.get(item.command)
    return form is not None and "yaw_deg" in form.params and item.param(4) == 0


def _without(item: FileItem) -> FileItem:
    return replace(item, params=(*item.params[:3], None, *item.params[4:]))
