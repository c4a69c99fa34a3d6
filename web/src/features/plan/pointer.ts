/** JSON pointers (RFC 6901) into a plan: how findings, map handles and form fields name the same place. Pure. */

import type { PlanDocument } from "../../api/types";

/** What is there; undefined if nothing is. */
export function valueAt(plan: PlanDocument, pointer: string): unknown {
  let place: unknown = plan;
  for (const step of steps(pointer)) {
    if (Array.isArray(place)) place = place[Number(step)];
    else place = isRecord(place) ? place[step] : undefined;
  }
  return place;
}

/** The plan with `value` there; undefined takes the field, or the entry of an array, out. Missing objects are made. */
export function withValue(plan: PlanDocument, pointer: string, value: unknown): PlanDocument {
  const result = put(plan, steps(pointer), value);
  return isRecord(result) ? result : plan;
}

/** The plan with a new entry in the array there; made if there is none. */
export function withEntry(plan: PlanDocument, pointer: string, index: number, entry: unknown): PlanDocument {
  const list = valueAt(plan, pointer);
  return withValue(plan, pointer, Array.isArray(list) ? list.toSpliced(index, 0, entry) : [entry]);
}

function put(place: unknown, path: readonly string[], value: unknown): unknown {
  const [step, ...rest] = path;
  if (step === undefined) return value;
  if (Array.isArray(place)) {
    const index = Number(step);
    if (rest.length === 0 && value === undefined) return place.toSpliced(index, 1);
    return index < place.length ? place.with(index, put(place[index], rest, value)) : place;
  }
  const record = isRecord(place) ? place : {};
  const inner = put(record[step], rest, value);
  if (inner !== undefined) return { ...record, [step]: inner };
  const { [step]: _, ...others } = record;
  return others;
}

function steps(pointer: string): string[] {
  return pointer === ""
    ? []
    : pointer
        .slice(1)
        .split("/")
        .map((step) => step.replaceAll("~1", "/").replaceAll("~0", "~"));
}

export function isRecord(value: unknown): value is Record<string, unknown> {
  return typeof value === "object" && value !== null && !Array.isArray(value);
}
