/** The JSON Schema of plans as this service has it: the editor makes its fields from it. */

import { effect, signal } from "@preact/signals";
import { api } from "../api/client";
import type { Schema } from "../schema/control";
import { report } from "./notices";
import { live } from "./store";

/** Null until it is read: the JSON can be edited meanwhile. */
export const planSchema = signal<Schema | null>(null);

export function watchPlanSchema(): void {
  effect(() => {
    if (!live.value) return;
    api
      .planSchema()
      .then((schema) => (planSchema.value = schema))
      .catch((error: unknown) => report("Read the plan's schema", error));
  });
}
