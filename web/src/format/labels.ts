/**
 * Labels of the API's enumerations that several features show. A value that lacks a label fails the type check; one
 * that only a newer service knows is shown as it is. Pure.
 */

import type {
  Certainty,
  ConsentRecord,
  ConsentState,
  DropOutcome,
  DropPhase,
  DropRecord,
  FlightMode,
  LandedState,
  LinkSecurity,
  OutputEvidence,
  Role,
  RunState,
  VehicleType,
} from "../api/types";
import { formatReason } from "./reasons";
import { humanize } from "./text";

/**
 * What each colour means, everywhere on the page and on the map:
 *
 * - `neutral`: at rest, or of no consequence.
 * - `info`: chosen, in progress, or next.
 * - `ok`: done as wanted, healthy, allowed.
 * - `warn`: a person must pay attention: something deviates, or a person controls or interrupts a flight.
 * - `danger`: failed, lost, refused, forbidden.
 * - `drop`: where and when a parcel leaves the vehicle.
 */
export type Tone = "neutral" | "info" | "ok" | "warn" | "danger" | "drop";

const VEHICLE_TYPES: Readonly<Record<VehicleType, string>> = {
  multicopter: "Multicopter",
  fixed_wing: "Fixed wing",
  vtol: "VTOL",
  rover: "Rover",
  airship: "Airship",
};

/** Null: the type is unknown. A plan may name any text as its vehicle type. */
export function vehicleTypeLabel(type: VehicleType | string | null): string {
  return type === null ? "Unknown type" : (VEHICLE_TYPES[type as VehicleType] ?? humanize(type));
}

/** Within a sentence: "for any multicopter". */
export function vehicleTypeNoun(type: VehicleType | string | null): string {
  return type === "vtol" ? "VTOL" : vehicleTypeLabel(type).toLowerCase();
}

const FLIGHT_MODES: Readonly<Record<FlightMode, string>> = {
  mission: "Mission",
  hold: "Hold",
  return: "Return",
  land: "Land",
  takeoff: "Takeoff",
  offboard: "Offboard",
  position: "Position",
  altitude: "Altitude",
  manual: "Manual",
  stabilized: "Stabilized",
  descend: "Descend (failsafe)",
  orbit: "Orbit",
  other: "Other mode",
};

export function flightModeLabel(mode: FlightMode | null): string {
  return mode === null ? "Unknown mode" : (FLIGHT_MODES[mode] ?? humanize(mode));
}

/** A vehicle on the ground may be in Mission mode without flying one. */
export function flightModeTone(state: { mode: FlightMode | null; armed: boolean; landed: LandedState }): Tone {
  return state.mode === "mission" && state.armed && state.landed !== "on_ground" ? "info" : "neutral";
}

const LANDED_STATES: Readonly<Record<LandedState, string>> = {
  undefined: "Unknown",
  on_ground: "On ground",
  in_air: "In the air",
  taking_off: "Taking off",
  landing: "Landing",
};

export function landedLabel(landed: LandedState): string {
  return LANDED_STATES[landed] ?? humanize(landed);
}

/** Whose frames the service accepts as the vehicle's. */
const LINK_SECURITY: Readonly<Record<LinkSecurity, string>> = {
  open: "Any sender",
  pinned: "One sender",
  signed: "Signed only",
};

/** Null: the link is not up yet. */
export function linkSecurityLabel(security: LinkSecurity | null): string {
  return security === null ? "–" : (LINK_SECURITY[security] ?? humanize(security));
}

const ROLES: Readonly<Record<Role, string>> = {
  viewer: "viewer",
  dispatcher: "dispatcher",
  pilot: "pilot",
  admin: "admin",
};

export function roleLabel(role: Role): string {
  return ROLES[role] ?? role;
}

const RUN_STATES: Readonly<Record<RunState, readonly [string, Tone]>> = {
  created: ["Created", "neutral"],
  uploading: ["Uploading", "info"],
  uploaded: ["Ready to start", "info"],
  starting: ["Starting", "info"],
  flying: ["Flying", "info"],
  at_drop: ["At the drop", "drop"],
  paused: ["Paused", "warn"],
  returning: ["Returning", "warn"],
  landed: ["Landed", "ok"],
  completed: ["Completed", "ok"],
  aborted: ["Aborted", "warn"],
  failed: ["Failed", "danger"],
  lost: ["Lost", "danger"],
};

export function runStateLabel(state: RunState): string {
  return RUN_STATES[state]?.[0] ?? humanize(state);
}

export function runStateTone(state: RunState): Tone {
  return RUN_STATES[state]?.[1] ?? "neutral";
}

const DROP_PHASES: Readonly<Record<DropPhase, string>> = {
  waiting: "Pending",
  holding: "Holding",
  asking: "Waiting for consent",
  releasing: "Releasing",
  done: "Done",
};

export function dropPhaseLabel(phase: DropPhase): string {
  return DROP_PHASES[phase] ?? humanize(phase);
}

const DROP_OUTCOMES: Readonly<Record<DropOutcome, readonly [string, Tone]>> = {
  pending: ["Pending", "neutral"],
  released: ["Released", "ok"],
  kept: ["Kept on board", "warn"],
  unknown: ["Unknown", "danger"],
};

/** Only the vehicle's acknowledgement says that it released: PX4 sends the same one where nothing can move. */
export function isAcknowledgedOnly(drop: Pick<DropRecord, "outcome" | "certainty" | "output_evidence">): boolean {
  const hasMoved = (drop.output_evidence ?? "moved") === "moved";
  return drop.outcome === "released" && drop.certainty === "acknowledged" && !hasMoved;
}

/** What a drop is doing, and at its end what became of it. */
export function dropLabel(drop: DropRecord): string {
  if (drop.outcome === "pending")
    return drop.phase === "asking" && drop.consent?.state === "granted"
      ? CONSENT_STATES.granted
      : dropPhaseLabel(drop.phase);
  return isAcknowledgedOnly(drop) ? "Acknowledged only" : (DROP_OUTCOMES[drop.outcome]?.[0] ?? humanize(drop.outcome));
}

export function dropTone(drop: DropRecord): Tone {
  return isAcknowledgedOnly(drop) ? "warn" : (DROP_OUTCOMES[drop.outcome]?.[1] ?? "neutral");
}

const OUTPUT_EVIDENCE: Readonly<Record<OutputEvidence, string>> = {
  moved: "moved to release",
  not_moved: "did not move",
  not_seen: "not observed",
  not_assigned: "none assigned",
  not_known: "unknown",
};

/** What the gripper's output showed; "" while nothing is known. */
export function outputLabel(evidence: OutputEvidence | null): string {
  return evidence === null ? "" : (OUTPUT_EVIDENCE[evidence] ?? humanize(evidence));
}

const CERTAINTIES: Readonly<Record<Certainty, string>> = {
  sensed: "sensed",
  acknowledged: "acknowledged by the vehicle",
  inferred: "inferred from the flight",
  none: "",
};

export function certaintyLabel(certainty: Certainty): string {
  return CERTAINTIES[certainty] ?? humanize(certainty);
}

const CONSENT_STATES: Readonly<Record<ConsentState, string>> = {
  pending: "Consent required",
  asked: "Waiting for consent",
  granted: "Consent granted",
  refused: "Consent refused",
  timed_out: "Consent timed out",
  withdrawn: "Consent no longer needed",
};

/** "Consent granted by anna: gate is closed". */
export function formatConsent(consent: Pick<ConsentRecord, "state" | "answered_by" | "comment" | "reason">): string {
  const { state, answered_by, comment, reason } = consent;
  const said = comment || formatReason(reason);
  const by = answered_by === null ? "" : ` by ${answered_by}`;
  return (CONSENT_STATES[state] ?? humanize(state)) + by + (said === "" ? "" : `: ${said}`);
}
