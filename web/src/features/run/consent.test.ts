import { describe, expect, it } from "vitest";
import type { ConsentRecord } from "../../api/types";
import { sampleConsent, sampleDrop, sampleRun } from "../../testing/samples";
import { allConsentRequests, consentRequests, secondsLeft } from "./consent";

const asking = (id: string, fields: Partial<ConsentRecord> = {}) =>
  sampleRun({
    id,
    state: "at_drop",
    drops: [sampleDrop(), sampleDrop({ plan_item_id: "second", consent: sampleConsent(fields) })],
  });

describe("questions", () => {
  it("are those that are asked and not answered", () => {
    expect(consentRequests(asking("r1")).map(({ drop }) => drop.plan_item_id)).toEqual(["second"]);
    for (const state of ["pending", "granted", "refused", "timed_out", "withdrawn"] as const)
      expect(consentRequests(asking("r1", { state }))).toEqual([]);
  });

  it("end with their run", () => {
    expect(consentRequests({ ...asking("r1"), state: "lost" })).toEqual([]);
  });

  it("of several vehicles come with the most urgent one first", () => {
    const runs = {
      a: asking("a", { deadline_at: 300 }),
      b: asking("b", { deadline_at: 200 }),
      c: sampleRun({ id: "c" }),
    };
    expect(allConsentRequests(runs).map(({ run }) => run.id)).toEqual(["b", "a"]);
  });

  it("are counted down by the service's clock and never below zero", () => {
    expect(secondsLeft(sampleConsent({ deadline_at: 200 }), 188.5)).toBe(11.5);
    expect(secondsLeft(sampleConsent({ deadline_at: 200 }), 201)).toBe(0);
    expect(secondsLeft(sampleConsent({ deadline_at: 200 }), null)).toBeNull();
  });
});
