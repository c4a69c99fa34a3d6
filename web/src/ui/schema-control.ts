/** From a JSON Schema to the control that edits its value: one way for plan items and simulated faults alike. Pure. */

import type { JsonSchema } from "../api/types";

export type Control =
  | { readonly kind: "switch" }
  /** One value only: a button. */
  | { readonly kind: "once"; readonly value: unknown }
  | { readonly kind: "number"; readonly integer: boolean; readonly range: string }
  | { readonly kind: "choice"; readonly options: readonly string[] }
  | { readonly kind: "text" }
  | { readonly kind: "tuple"; readonly parts: readonly Control[]; readonly names: readonly string[] }
  | { readonly kind: "object"; readonly fields: readonly Field[] }
  /** What no control is made for: the JSON tab has it. */
  | { readonly kind: "none" };

export interface Field {
  readonly name: string;
  readonly label: string;
  readonly unit: string;
  readonly help: string;
  readonly required: boolean;
  /** What holds when it is not given; undefined if nothing does. */
  readonly fallback: unknown;
  readonly control: Control;
}

/** Longest first, so that m_s is not taken for s. */
const UNITS: readonly (readonly [string, string])[] = [
  ["_m_s", "m/s"],
  ["_percent", "%"],
  ["_deg", "°"],
  ["_kg", "kg"],
  ["_m", "m"],
  ["_s", "s"],
];

/** Words that people write in capitals. */
const ACRONYMS = /\b(gps|gcs)\b/g;

/** `root` holds the $defs that the schema refers to. */
export function controlOf(schema: JsonSchema, root: JsonSchema = schema): Control {
  const s = resolveSchema(schema, root);
  if ("const" in s) return { kind: "once", value: s["const"] };
  if (Array.isArray(s["enum"]))
    return { kind: "choice", options: s["enum"].filter((option) => typeof option === "string") };
  switch (s["type"]) {
    case "boolean":
      return { kind: "switch" };
    case "number":
    case "integer":
      return { kind: "number", integer: s["type"] === "integer", range: rangeOf(s) };
    case "string":
      return { kind: "text" };
    case "array":
      return tupleOf(s, root);
    case "object":
      return { kind: "object", fields: fieldsOf(s, root) };
    default:
      return { kind: "none" };
  }
}

/** The fields of an object's schema, in its order. */
export function fieldsOf(schema: JsonSchema, root: JsonSchema = schema): Field[] {
  const s = resolveSchema(schema, root);
  const required = Array.isArray(s["required"]) ? s["required"] : [];
  return Object.entries(isSchema(s["properties"]) ? s["properties"] : {})
    .filter((entry): entry is [string, JsonSchema] => isSchema(entry[1]))
    .map(([name, part]) => ({
      name,
      ...labelAndUnit(name),
      help: textOf(resolveSchema(part, root)["description"]),
      required: required.includes(name),
      fallback: part["default"] ?? undefined,
      control: controlOf(part, root),
    }));
}

/** "max_offset_m" -> "Max offset" in "m": the names of the API carry their units. */
export function labelAndUnit(name: string): { label: string; unit: string } {
  const found = UNITS.find(([suffix]) => name.endsWith(suffix) && name.length > suffix.length);
  const bare = (found ? name.slice(0, -found[0].length) : name)
    .replaceAll("_", " ")
    .replace(ACRONYMS, (word) => word.toUpperCase());
  return { label: bare.charAt(0).toUpperCase() + bare.slice(1), unit: found?.[1] ?? "" };
}

/** The schema behind $ref and "or null". */
export function resolveSchema(schema: JsonSchema, root: JsonSchema): JsonSchema {
  if (typeof schema["$ref"] === "string") return resolveSchema(at(root, schema["$ref"]), root);
  const options = Array.isArray(schema["anyOf"])
    ? schema["anyOf"].filter(isSchema).filter((option) => option["type"] !== "null")
    : [];
  const [only] = options;
  return options.length === 1 && only ? { ...schema, ...resolveSchema(only, root) } : schema;
}

function tupleOf(s: JsonSchema, root: JsonSchema): Control {
  const parts = Array.isArray(s["prefixItems"]) ? s["prefixItems"].filter(isSchema) : [];
  if (parts.length === 0) return { kind: "none" };
  return {
    kind: "tuple",
    parts: parts.map((part) => controlOf(part, root)),
    names: parts.map((part, i) => textOf(part["title"]) || String(i + 1)),
  };
}

function rangeOf(s: JsonSchema): string {
  const low = s["minimum"] ?? s["exclusiveMinimum"];
  const high = s["maximum"] ?? s["exclusiveMaximum"];
  const from = "exclusiveMinimum" in s ? `above ${String(low)}` : `${String(low)}`;
  if (low !== undefined && high !== undefined) return `${from} to ${String(high)}`;
  if (low !== undefined) return "exclusiveMinimum" in s ? from : `${from} or more`;
  return high === undefined ? "" : `up to ${String(high)}`;
}

/** What "#/$defs/Home" points to. */
function at(root: JsonSchema, pointer: string): JsonSchema {
  let place: unknown = root;
  for (const step of pointer.replace(/^#\//, "").split("/")) place = isSchema(place) ? place[step] : undefined;
  return isSchema(place) ? place : {};
}

function textOf(value: unknown): string {
  return typeof value === "string" ? value : "";
}

export function isSchema(value: unknown): value is JsonSchema {
  return typeof value === "object" && value !== null && !Array.isArray(value);
}
