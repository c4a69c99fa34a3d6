import { describe, expect, it } from "vitest";
import type { ConsentState, FlightMode, LandedState } from "../api/types";
import { sampleConsent, sampleDrop } from "../testing/samples";
import { dropLabel, flightModeLabel, flightModeTone, landedLabel, vehicleTypeNoun } from "./labels";

it("values that only a newer service knows are shown as they are", () => {
  const labels = [flightModeLabel("some_new_mode" as FlightMode), landedLabel("submerged" as LandedState)];
  expect(labels).toEqual(["Some new mode", "Submerged"]);
});

it("a vehicle type within a sentence keeps its acronym", () => {
  expect([vehicleTypeNoun("multicopter"), vehicleTypeNoun("vtol")]).toEqual(["multicopter", "VTOL"]);
});

describe("Mission mode", () => {
  const tone = (armed: boolean, landed: LandedState, mode: FlightMode = "mission") =>
    flightModeTone({ mode, armed, landed });

  it("looks like a flight only in one", () => {
    expect([tone(true, "in_air"), tone(true, "taking_off")]).toEqual(["info", "info"]);
    expect([tone(true, "on_ground"), tone(false, "undefined"), tone(true, "in_air", "hold")]).toEqual(
      Array(3).fill("neutral"),
    );
  });
});

it("a drop waits for consent until it is granted", () => {
  const asking = (state: ConsentState) => dropLabel(sampleDrop({ phase: "asking", consent: sampleConsent({ state }) }));
  expect([asking("asked"), asking("granted")]).toEqual(["Waiting for consent", "Consent granted"]);
});
