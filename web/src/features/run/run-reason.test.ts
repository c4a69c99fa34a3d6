import { expect, it } from "vitest";
import type { ConsentState } from "../../api/types";
import { because, sampleConsent, sampleDrop, sampleRun } from "../../testing/samples";
import { notableReason } from "./run-reason";

it("a run that is ready says nothing of its upload", () => {
  expect(notableReason(sampleRun({ state: "uploaded", reason: because("run.upload_verified") }))).toBeNull();
  expect(notableReason(sampleRun({ state: "uploaded", reason: because("run.upload_read_back") }))).toBeNull();
});

it("a run whose start was refused says why, though it is uploaded as before", () => {
  const refused = because("error", { error: "vehicle.refused", detail: "the vehicle refused to arm" });
  expect(notableReason(sampleRun({ state: "uploaded", reason: refused }))).toBe(refused);
});

it("a run waits for a consent until it is given", () => {
  const reason = because("run.waits_for_consent", { plan_item_id: "drop" });
  const asked = (state: ConsentState) =>
    notableReason(sampleRun({ state: "at_drop", reason, drops: [sampleDrop({ consent: sampleConsent({ state }) })] }));
  expect(asked("asked")).toBe(reason);
  expect(asked("granted")).toBeNull();
});
