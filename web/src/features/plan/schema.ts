/** The published JSON Schema of plans, as the editor asks it: which fields has what. Pure. */

import { effect, signal } from "@preact/signals";
import { api } from "../../api/client";
import type { JsonSchema } from "../../api/types";
import { reportProblem } from "../../store/notices";
import { live } from "../../store/store";
import { type Field, fieldsOf, isSchema, resolveSchema } from "../../ui/schema-control";
import { ITEM_TYPES } from "./edits";

/** The types of items that both the service and this page know, in the page's order. */
export function itemTypes(schema: JsonSchema): readonly string[] {
  return ITEM_TYPES.filter((type) => itemSchema(schema, type) !== null);
}

/** The fields of an item type; its `type` has a control of its own. */
export function itemFields(schema: JsonSchema, type: string): readonly Field[] {
  const found = itemSchema(schema, type);
  const fields = found === null ? [] : fieldsOf(found, schema).filter(({ name }) => name !== "type");
  return fields.toSorted((a, b) => rank(a) - rank(b));
}

/** What it is called, where it is, how high, then the rest as the schema has it. */
function rank({ name }: Field): number {
  const first = ["id", "latitude_deg", "longitude_deg", "relative_altitude_m", "absolute_altitude_m"].indexOf(name);
  return first === -1 ? 9 : first;
}

/** The plan's own fields, without its lists. */
export function planFields(schema: JsonSchema): readonly Field[] {
  const lists = new Set(["version", "items", "geofence", "rally_points"]);
  return fieldsOf(schema).filter(({ name }) => !lists.has(name));
}

export type Shape = "FencePolygon" | "FenceCircle" | "RallyPoint" | "Point";

export function shapeFields(schema: JsonSchema, shape: Shape): readonly Field[] {
  const definitions = schema["$defs"];
  const found = isSchema(definitions) ? definitions[shape] : undefined;
  return isSchema(found) ? fieldsOf(found, schema) : [];
}

function itemSchema(schema: JsonSchema, type: string): JsonSchema | null {
  const properties = schema["properties"];
  const items = isSchema(properties) ? properties["items"] : undefined;
  const entry = isSchema(items) ? items["items"] : undefined;
  const discriminator = isSchema(entry) ? entry["discriminator"] : undefined;
  const mapping = isSchema(discriminator) ? discriminator["mapping"] : undefined;
  const ref = isSchema(mapping) ? mapping[type] : undefined;
  return typeof ref === "string" ? resolveSchema({ $ref: ref }, schema) : null;
}

// The JSON Schema of plans as this service has it: the editor makes its fields from it.

/** Null until it is read: the JSON can be edited meanwhile. */
export const planSchema = signal<JsonSchema | null>(null);

export function watchPlanSchema(): void {
  effect(() => {
    if (!live.value) return;
    api
      .planSchema()
      .then((schema) => (planSchema.value = schema))
      .catch((error: unknown) => reportProblem("Load the schema of plans", error));
  });
}
