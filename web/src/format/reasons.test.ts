import { expect, it } from "vitest";
import type { ReasonCode } from "../api/types";
import { because } from "../testing/samples";
import { formatReason } from "./reasons";

it("fills in what the reason is about, as the service formats it", () => {
  expect(formatReason(because("run.not_heard", { silent_s: 30.4 }))).toBe("no message from the vehicle for 30 s");
  expect(formatReason(because("drop.too_far", { max_offset_m: 2.5 }))).toBe(
    "the vehicle is more than 2.5 m from the drop point",
  );
  expect(formatReason(because("target.unreachable", { speed_m_s: 4.98765 }))).toBe(
    "at 4.99 m/s the vehicle cannot catch up with the target",
  );
});

it("tells what is behind it", () => {
  expect(formatReason(because("drop.acknowledged_then", {}, because("run.rebooted")))).toBe(
    "acknowledged; then the vehicle rebooted in flight",
  );
});

it("says nothing of no reason, and shows a code that it does not know", () => {
  expect([formatReason(null), formatReason(undefined), formatReason(because("run.of_tomorrow" as ReasonCode))]).toEqual(
    ["", "", "run.of_tomorrow"],
  );
});

it("leaves a gap open rather than out", () => {
  expect(formatReason(because("run.not_heard"))).toBe("no message from the vehicle for ? s");
});
