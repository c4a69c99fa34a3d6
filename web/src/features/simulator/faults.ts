/** Faults of simulated vehicles: which persist, their labels, and which value clears one. Pure. */

import type { FaultKind, SimulatedVehicle } from "../../api/types";
import { type Control, controlOf, labelAndUnit } from "../../ui/schema-control";

/** The fault's name for people, as `slow_gripper` -> "Slow gripper". */
export function faultLabel(fault: string): string {
  return labelAndUnit(fault).label;
}

/** The fault's unit: that of its name, else the one that its schema names. */
export function faultUnit(kind: FaultKind): string {
  const { unit } = labelAndUnit(kind.fault);
  return unit !== "" ? unit : String(kind.value_schema["unit"] ?? "");
}

/** A value in words: "on", "0.1", "3, -2.5". */
export function formatFaultValue(value: unknown): string {
  if (value === true) return "on";
  if (value === false) return "off";
  return Array.isArray(value) ? value.map(String).join(", ") : String(value);
}

/** The value with which the fault is no more; undefined if no value says so. */
export function clearingValue(kind: FaultKind): unknown {
  return clearingOf(controlOf(kind.value_schema), kind.value_schema);
}

function clearingOf(control: Control, schema: FaultKind["value_schema"]): unknown {
  if (control.kind === "switch") return false;
  if (control.kind === "number") return Number(schema["minimum"] ?? 0) <= 0 ? 0 : undefined;
  if (control.kind === "tuple" && control.parts.every((part) => part.kind === "number"))
    return control.parts.map(() => 0);
  return undefined;
}

/** What the target has now: one vehicle's faults, or those that all of them share. */
export function activeFaults(
  vehicles: readonly SimulatedVehicle[],
  target: string | null,
): Readonly<Record<string, unknown>> {
  if (target !== null) return vehicles.find((vehicle) => vehicle.vehicle_id === target)?.faults ?? {};
  const [first, ...others] = vehicles;
  const shared = Object.entries(first?.faults ?? {}).filter(([fault, value]) =>
    others.every((vehicle) => JSON.stringify(vehicle.faults[fault]) === JSON.stringify(value)),
  );
  return Object.fromEntries(shared);
}

type ParsedValue = { readonly value: unknown } | { readonly error: string };

/** What was typed into the control's inputs as the value to send; ranges are the service's to judge. */
export function parseFaultValue(control: Control, texts: readonly string[]): ParsedValue {
  switch (control.kind) {
    case "number":
      return typedNumber(texts[0] ?? "", control.integer);
    case "tuple": {
      const parts = control.parts.map((part, i) => parseFaultValue(part, [texts[i] ?? ""]));
      const wrong = parts.find((part) => "error" in part);
      return wrong ?? { value: parts.map((part) => ("value" in part ? part.value : null)) };
    }
    case "once":
      return { value: control.value };
    default:
      return texts[0] ? { value: texts[0] } : { error: "Select a value." };
  }
}

function typedNumber(text: string, integer: boolean): ParsedValue {
  const value = text.trim() === "" ? Number.NaN : Number(text.trim().replace(",", "."));
  if (!Number.isFinite(value)) return { error: "Enter a number." };
  return integer && !Number.isInteger(value) ? { error: "Enter a whole number." } : { value };
}
