/** The API's words in plain English. Unknown ones are shown as they are, never hidden. Pure. */

import type { ConsentRecord, DropRecord, LandedState, RunState, VehicleType } from "../api/types";
import { reasonWords } from "./reasons";

export type Tone = "neutral" | "info" | "ok" | "warn" | "danger" | "drop";

const VEHICLE_TYPES: Readonly<Record<VehicleType, string>> = {
  multicopter: "Multicopter",
  fixed_wing: "Fixed wing",
  vtol: "VTOL",
  rover: "Rover",
  airship: "Airship",
};

export function vehicleTypeName(type: VehicleType | string | null): string {
  return type === null ? "Unknown type" : (VEHICLE_TYPES[type as VehicleType] ?? plain(type));
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

export function runStateName(state: RunState): string {
  return RUN_STATES[state]?.[0] ?? plain(state);
}

export function runStateTone(state: RunState): Tone {
  return RUN_STATES[state]?.[1] ?? "neutral";
}

const OUTCOMES: Readonly<Record<DropRecord["outcome"], readonly [string, Tone]>> = {
  pending: ["Not yet", "neutral"],
  released: ["Released", "ok"],
  kept: ["Kept on board", "warn"],
  unknown: ["Not known", "danger"],
};

export function outcomeName(outcome: DropRecord["outcome"]): string {
  return OUTCOMES[outcome]?.[0] ?? plain(outcome);
}

export function outcomeTone(outcome: DropRecord["outcome"]): Tone {
  return OUTCOMES[outcome]?.[1] ?? "neutral";
}

/** Released by the vehicle's word alone: PX4 says the same where nothing can move. */
export function restsOnAckAlone(drop: Pick<DropRecord, "outcome" | "certainty" | "output_evidence">): boolean {
  return (
    drop.outcome === "released" && drop.certainty === "acknowledged" && (drop.output_evidence ?? "moved") !== "moved"
  );
}

/** The tone of a drop: an acknowledgement alone is no plain delivery. */
export function dropTone(drop: DropRecord): Tone {
  return restsOnAckAlone(drop) ? "warn" : outcomeTone(drop.outcome);
}

/** The same in words. */
export function dropName(drop: DropRecord): string {
  return restsOnAckAlone(drop) ? "Acknowledged, not seen" : outcomeName(drop.outcome);
}

const OUTPUTS: Readonly<Record<NonNullable<DropRecord["output_evidence"]>, string>> = {
  moved: "went to release",
  not_moved: "did not move",
  not_seen: "not seen",
  not_assigned: "none assigned",
  not_known: "not known",
};

/** What the gripper's output showed; "" while nothing can be said. */
export function outputWords(evidence: DropRecord["output_evidence"]): string {
  return evidence ? (OUTPUTS[evidence] ?? plain(evidence)) : "";
}

const CERTAINTIES: Readonly<Record<DropRecord["certainty"], string>> = {
  sensed: "sensed",
  acknowledged: "acknowledged by the vehicle",
  inferred: "inferred from the flight",
  none: "",
};

export function certaintyName(certainty: DropRecord["certainty"]): string {
  return CERTAINTIES[certainty] ?? plain(certainty);
}

const CONSENTS: Readonly<Record<ConsentRecord["state"], string>> = {
  pending: "Needs an operator's consent",
  asked: "Asks for consent",
  granted: "Consent granted",
  refused: "Consent refused",
  timed_out: "No consent in time",
  withdrawn: "Question withdrawn",
};

/** "Consent granted by anna: gate is closed". */
export function consentWords({
  state,
  answered_by: by,
  comment,
  reason,
}: Pick<ConsentRecord, "state" | "answered_by" | "comment" | "reason">): string {
  const said = comment || reasonWords(reason);
  return (CONSENTS[state] ?? plain(state)) + (by === null ? "" : ` by ${by}`) + (said === "" ? "" : `: ${said}`);
}

const LANDED: Readonly<Record<LandedState, string>> = {
  undefined: "Not known",
  on_ground: "On ground",
  in_air: "In the air",
  taking_off: "Taking off",
  landing: "Landing",
};

export function landedName(landed: LandedState): string {
  return LANDED[landed] ?? plain(landed);
}

/** A vehicle on the ground may be in Mission mode, and flies none. */
export function modeTone({ mode, armed, landed }: { mode: string | null; armed: boolean; landed: string }): Tone {
  return mode === "mission" && armed && landed !== "on_ground" ? "info" : "neutral";
}

/** The service's clauses as sentences: a capital first letter, unless the first word is a name such as hold_s. */
export function asSentence(text: string): string {
  return /^[a-z]+(?![\w./])/.test(text) ? text.charAt(0).toUpperCase() + text.slice(1) : text;
}

/** The same, closed as a sentence is. */
export function fullSentence(text: string): string {
  const words = asSentence(text);
  return /[.!?]$/.test(words) ? words : `${words}.`;
}

/** "in_failsafe" -> "In failsafe". */
export function plain(word: string): string {
  const spaced = word.replaceAll("_", " ");
  return spaced.charAt(0).toUpperCase() + spaced.slice(1);
}
