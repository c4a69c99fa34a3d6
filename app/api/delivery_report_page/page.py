"""The delivery report as one HTML page without scripts or external resources, for printing and archiving."""

from __future__ import annotations

import base64
import json
from collections.abc import Iterable, Mapping
from datetime import UTC, datetime
from html import escape
from pathlib import Path
from typing import Any, Final

from app.api.delivery_report_page.picture import close_up, overview
from app.domain.delivery.delivery_report import DeliveryReport, Entry, ReportedAttachment
from app.domain.drop.consent import ConsentRecord, ConsentState
from app.domain.drop.record import Certainty, DropOutcome, DropRecord, OutputEvidence
from app.domain.events import EventKind
from app.domain.reasons import Reason, describe
from app.domain.run.run import LastPosition
from app.domain.targets import TargetEvidence
from app.domain.vehicle.link_security import LinkSecurity


def typed(text: str) -> str:
    """Escape untrusted text and isolate its writing direction, so that it cannot reorder the text around it."""
    return f"<bdi>{escape(text)}</bdi>"


def shown_time(seconds: float | None, *, clock_only: bool = False) -> str | None:
    if seconds is None:
        return None
    moment = datetime.fromtimestamp(seconds, UTC)
    return moment.strftime("%H:%M:%S" if clock_only else "%Y-%m-%d %H:%M:%S UTC")


def attached(attachments: Iterable[ReportedAttachment], plan_item_id: str, pictures: Mapping[str, bytes]) -> str:
    """Return the attachments of one drop as HTML, empty without any."""
    shown = [_one(one, pictures.get(one.sha256)) for one in attachments if one.plan_item_id == plan_item_id]
    return f"<h3>Attached</h3>{''.join(shown)}" if shown else ""


def _one(attachment: ReportedAttachment, picture: bytes | None) -> str:
    size = f"{attachment.size_bytes / 1000:.1f} kB"
    when = f"{shown_time(attachment.at)} by {typed(attachment.actor)}"
    if attachment.is_as_attached:
        warning = ""
    elif attachment.is_expired:
        warning = "<br>The file was deleted at the end of its retention period."
    else:
        warning = "<br><b>WARNING: the stored file differs from the file that was attached</b>"
    text = f"{typed(attachment.name)}, {typed(attachment.media_type)}, {size}, {when}"
    text += f"<br><code>SHA-256 {typed(attachment.sha256)}</code>"
    image = "" if picture is None else _image(attachment.media_type, picture)
    return f'<figure class="attached">{image}<figcaption>{text}{warning}</figcaption></figure>'


def _image(media_type: str, content: bytes) -> str:
    """As a data URL: a saved page needs no other file, and an image cannot run scripts."""
    return f'<img alt="" src="data:{media_type};base64,{base64.b64encode(content).decode("ascii")}">'


_POLICY_OF_A_COPY: Final = (
    "default-src 'none'; img-src data:; style-src 'unsafe-inline'; base-uri 'none'; form-action 'none'"
)
"""Also in the page itself, because a saved copy has no headers. <meta> does not support frame-ancestors and sandbox."""
POLICY: Final = f"{_POLICY_OF_A_COPY}; frame-ancestors 'none'; sandbox allow-downloads allow-modals"
"""No scripts. The style is inline, so that a saved copy looks the same."""

_OUTCOMES: Final = {
    DropOutcome.PENDING: "not made yet",
    DropOutcome.RELEASED: "released",
    DropOutcome.KEPT: "kept on board",
    DropOutcome.UNKNOWN: "unknown",
}
_CERTAINTIES: Final = {
    Certainty.SENSED: "sensed: a sensor detected the release",
    Certainty.ACKNOWLEDGED: "acknowledged by the vehicle, not confirmed by a sensor",
    Certainty.INFERRED: "inferred from telemetry",
    Certainty.NONE: "none",
}
_OUTPUTS: Final = {
    OutputEvidence.MOVED: "moved to the release position",
    OutputEvidence.NOT_MOVED: "did not move",
    OutputEvidence.NOT_SEEN: "was not observed",
    OutputEvidence.NOT_ASSIGNED: "none is assigned: no movement was observed",
    OutputEvidence.NOT_KNOWN: "unknown whether one is assigned: no movement was observed",
}
_LINKS: Final = {
    LinkSecurity.SIGNED: "signed: all messages were authenticated with the vehicle's key",
    LinkSecurity.PINNED: "pinned: messages were accepted from one address only, without authentication",
    LinkSecurity.OPEN: "open: messages were accepted from any address, without authentication",
}
_CONSENTS: Final = {
    ConsentState.PENDING: "required, not requested yet",
    ConsentState.ASKED: "requested, not answered yet",
    ConsentState.GRANTED: "granted",
    ConsentState.REFUSED: "refused",
    ConsentState.TIMED_OUT: "not given in time, which counts as a refusal",
    ConsentState.WITHDRAWN: "withdrawn",
}
_DROP_STEP: Final = (
    "plan_item_id",
    "phase",
    "attempts",
    "acknowledged_result",
    "output_us",
    "output_evidence",
    "outcome",
    "certainty",
)
"""Event data of a drop that the table of events shows. Measurements have a table of their own."""

_STYLE: Final = Path(__file__).with_name("sheet.css").read_text(encoding="utf-8")


def delivery_report_page(report: DeliveryReport, plan: dict[str, Any], pictures: Mapping[str, bytes]) -> str:
    """Render the report. `plan` is the document that was flown, `pictures` has small attachments by SHA-256."""
    name = report.plan.name or report.plan.id
    parts = [
        "<!doctype html>",
        '<html lang="en"><head><meta charset="utf-8">',
        f'<meta http-equiv="Content-Security-Policy" content="{_POLICY_OF_A_COPY}">',
        f"<title>Delivery report: {escape(name)}</title>",
        f'<meta name="viewport" content="width=device-width"><style>{_STYLE}</style></head><body><main>',
        f"<h1>Delivery report</h1><p>{typed(name)}, run {escape(report.run_id)}</p>",
        ""
        if report.is_final
        else '<p class="draft">The run is in progress. This report shows what is known so far.</p>',
        ""
        if report.is_whole
        else '<p class="draft">The first entries of this run were deleted at the end of their retention period.</p>',
        _head(report),
        overview(plan, report.drops) or "",
        *(_drop(drop, attached(report.attachments, drop.plan_item_id, pictures)) for drop in report.drops),
        "" if report.drops else "<p>The plan has no drops.</p>",
        _entries(report),
        "</main></body></html>",
    ]
    return "\n".join(part for part in parts if part)


def _head(report: DeliveryReport) -> str:
    order = report.plan.order
    ended = shown_time(report.ended_at)
    return _list(
        [
            ("Order", order and order.id),
            ("Recipient", order and order.recipient),
            ("Notes", order and order.notes),
            ("Flight", f"{report.state.value}{': ' + describe(report.reason) if report.reason else ''}"),
            ("Requested by", report.requested_by or None),
            ("Took off, ended", f"{shown_time(report.started_at) or 'not'}, {ended or 'not yet'}"),
            ("Last position", _position(report.last_position)),
            (
                "Vehicle",
                f"{report.vehicle.id}, {_words(report.vehicle.vehicle_type)},"
                f" PX4 {report.vehicle.firmware or 'unknown'}",
            ),
            ("Unique ID of the vehicle", report.vehicle.uid),
            ("Vehicle link", None if report.link_security is None else _LINKS[report.link_security]),
            ("Plan", f"{report.plan.id}, SHA-256 {report.plan.hash}"),
            (
                "WARNING",
                None
                if report.plan.is_as_flown
                else "the stored plan differs from the plan that was flown: run waydrop verify-journal",
            ),
            (
                "Mission",
                report.mission.hash and f"SHA-256 {report.mission.hash}, PX4's id {report.mission.id or 'not given'}",
            ),
            *(
                (f"Earlier plan {number}", f"{was.id}, SHA-256 {was.hash}, until {shown_time(was.until)}")
                for number, was in enumerate(report.earlier_plans, start=1)
            ),
            (
                "Continues",
                report.continues and f"run {report.continues}: this flight flew the remaining items of that run",
            ),
            (
                "Continued by",
                report.continued_by and f"run {report.continued_by}, which flew the remaining items of this run",
            ),
            ("Issued", f"{shown_time(report.issued_at)} by gateway {report.gateway}"),
        ]
    )


def _drop(drop: DropRecord, attachments: str) -> str:
    how = "supervised: Waydrop sent the command" if drop.supervised else "embedded in the mission"
    rows = _list(
        [
            ("Certainty", _CERTAINTIES[drop.certainty]),
            ("Reason", describe(drop.reason) or None),
            ("How", how),
            ("Consent", _consent(drop.consent)),
            ("Commanded", drop.commanded_at and f"{shown_time(drop.commanded_at)}, attempts: {drop.attempts}"),
            (
                "Acknowledged",
                drop.acknowledged_at and f"{shown_time(drop.acknowledged_at)}: {_result(drop)}",
            ),
            ("Gripper output", _output(drop)),
            ("Pictures", _pictures(drop)),
            ("Sensed", shown_time(drop.sensed_at) or "nothing sensed"),
            ("Planned at", _place(drop.planned_latitude_deg, drop.planned_longitude_deg)),
            ("Measured at", _place(drop.latitude_deg, drop.longitude_deg)),
            ("Distance from the planned point", _number(drop.offset_m, "m")),
            ("Altitude above home, above mean sea level", _pair(drop.relative_altitude_m, drop.absolute_altitude_m)),
            ("Moving target", _target(drop.target)),
            ("Ground speed", _number(drop.ground_speed_m_s, "m/s")),
            ("Landed state", drop.landed and _words(drop.landed)),
            ("GNSS", _gnss(drop)),
            ("Battery", _number(drop.battery_percent, "%")),
        ]
    )
    title = f"Drop: {typed(drop.plan_item_id)}"
    unseen = ", by acknowledgement only: no movement of the output was observed" if drop.rests_on_an_ack_alone else ""
    outcome = f'<p class="outcome">{_OUTCOMES[drop.outcome]}{unseen}</p>'
    return f'<section class="drop"><h2>{title}</h2>{outcome}{rows}{close_up(drop) or ""}{attachments}</section>'


def _entries(report: DeliveryReport) -> str:
    rows = "".join(_row(entry) for entry in report.entries)
    note = "Each line is an event of the journal. Its hash covers all events before it. To verify an event:"
    return (
        f"<h2>Events of the journal</h2><p>{note} <code>waydrop verify-journal --anchor SEQ:HASH</code></p>"
        f"<table><thead><tr><th>UTC</th><th>event, and below it SEQ:HASH</th></tr></thead><tbody>{rows}</tbody></table>"
    )


def _row(entry: Entry) -> str:
    named = entry.data if entry.kind is not EventKind.RUN_DROP else {name: entry.data.get(name) for name in _DROP_STEP}
    shown = {name: value for name, value in named.items() if value not in (None, "")}
    if isinstance(reason := shown.get("reason"), dict):
        shown["reason"] = describe(Reason.model_validate(reason))
    data = typed(json.dumps(shown, ensure_ascii=False, separators=(", ", ": "))[1:-1])
    return (
        f"<tr><td>{shown_time(entry.time, clock_only=True)}</td>"
        f"<td><b>{entry.kind.value}</b> {data}<br><code>{entry.seq}:{entry.hash}</code></td></tr>"
    )


def _list(rows: Iterable[tuple[str, object]]) -> str:
    entries = "".join(
        f"<dt>{escape(name)}</dt><dd>{typed(str(value))}</dd>" for name, value in rows if value is not None
    )
    return f"<dl>{entries}</dl>"


def _place(latitude_deg: float | None, longitude_deg: float | None) -> str | None:
    return None if latitude_deg is None or longitude_deg is None else f"{latitude_deg:.7f}, {longitude_deg:.7f}"


def _result(drop: DropRecord) -> str:
    return "a result that MAVLink does not name" if drop.acknowledged_result is None else drop.acknowledged_result.name


def _output(drop: DropRecord) -> str | None:
    pulse = drop.output_at and f"{drop.output_us} µs at {shown_time(drop.output_at)}"
    output = drop.output_evidence and _OUTPUTS[drop.output_evidence]
    return ": ".join(part for part in (output, pulse) if part) or None


def _pictures(drop: DropRecord) -> str | None:
    """Photos reported by the cameras. The images are on the vehicle unless somebody attached them."""
    parts = (
        f"number {one.index} at {one.latitude_deg:.7f}, {one.longitude_deg:.7f}"
        f"{f' ({one.url})' if one.url else ''}{'' if one.captured else ', failed'}"
        for one in drop.pictures
    )
    return "; ".join(parts) or None


def _number(value: float | None, unit: str) -> str | None:
    return None if value is None else f"{value:.1f} {unit}"


def _pair(relative_m: float | None, absolute_m: float | None) -> str | None:
    parts = [f"{value:.1f} m" for value in (relative_m, absolute_m) if value is not None]
    return ", ".join(parts) or None


def _gnss(drop: DropRecord) -> str | None:
    if drop.gnss_fix is None:
        return None
    satellites = "" if drop.gnss_satellites is None else f", {drop.gnss_satellites} satellites"
    hdop = "" if drop.gnss_hdop is None else f", HDOP {drop.gnss_hdop:g}"
    return f"{_words(drop.gnss_fix)} fix{satellites}{hdop}"


def _target(target: TargetEvidence | None) -> str | None:
    """The target's position, its distance from the vehicle, and the age of the report."""
    if target is None:
        return None
    away = "" if target.distance_m is None else f", {target.distance_m:.1f} m from the vehicle"
    place = _place(target.latitude_deg, target.longitude_deg)
    return f"{target.feed}: {place}{away}, reported {target.age_s:.1f} s before"


def _consent(consent: ConsentRecord | None) -> str | None:
    """The answer to each consent request, who gave it, and the comment."""
    if consent is None:
        return None
    actor = f" by {consent.answered_by}" if consent.answered_by else ""
    at = f" at {shown_time(consent.answered_at)}" if consent.answered_at is not None else ""
    asked = f"; asked at {shown_time(consent.asked_at)}" if consent.asked_at is not None else ""
    said = consent.comment or describe(consent.reason)
    why = f": {said}" if said else ""
    return f"{_CONSENTS[consent.state]}{actor}{at}{why}{asked}"


def _position(last: LastPosition | None) -> str | None:
    if last is None:
        return None
    estimated = " (estimated, without a GNSS fix)" if last.is_estimated else ""
    return f"{_place(last.latitude_deg, last.longitude_deg)}{estimated}, at {shown_time(last.at)}"


def _words(value: str | None) -> str:
    return "type unknown" if value is None else value.replace("_", " ")
