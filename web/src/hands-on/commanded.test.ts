import { describe, expect, it } from "vitest";
import type { FlightOrder, Offboard, Reason } from "../api/types";
import { because } from "../testing/samples";
import { commandedWords, goneWords, lookAwayWords, orderWords, resultWords, takeOverWords } from "./commanded";
import { closeWords } from "./words";

const spaced = (text: string) => text.replaceAll("\u00a0", " ");
const ORDER: FlightOrder = { command: "DO_REPOSITION", latitude_deg: 47.4, longitude_deg: 8.55, altitude_m: 540, radius_m: null, result: "sent", age_s: 0.1 };

describe("a vehicle that is commanded", () => {
  it("is told from one under manual control", () => {
    for (const by of ["commands", "setpoints"] as const) expect(commandedWords("v3", by)).toContain("this page sends no setpoints");
    expect([lookAwayWords("v3", "commands"), lookAwayWords("v3", "setpoints")]).toEqual([expect.stringContaining("circles where it is"), expect.stringContaining("v3 holds")]);
    expect(commandedWords("v3", "commands")).toContain("stays in Hold");
    expect(commandedWords("v3", "setpoints")).toContain("OFFBOARD");
  });

  it("says what becomes of it when the page, or Waydrop, goes away", () => {
    const [closed, hidden, dead] = goneWords("v3", "commands").map(([, what]) => what);
    expect(closed).toBe("v3 is told to circle where it is at once, and the rest of its tasks is dropped.");
    expect(hidden).toBe("The same within 10 s.");
    expect(dead).toContain("flies on to the place it was last sent to");
    const streamed = goneWords("v3", "setpoints").map(([, what]) => what);
    expect([streamed[0], streamed[2]]).toEqual([expect.stringContaining("told to hold"), expect.stringContaining("COM_OBL_RC_ACT")]);
  });

  it("says what a new holder finds: no tasks, and where there is no stream without a task, no control", () => {
    expect(takeOverWords("v3", "commands")).toContain("circles where it is");
    expect(takeOverWords("v3", "setpoints")).toContain("ends the lease");
  });

  it("has its newest command and the answer in words", () => {
    expect(spaced(orderWords(ORDER))).toBe("fly to a place, 540 m AMSL");
    expect(orderWords({ ...ORDER, latitude_deg: null, altitude_m: null })).toBe("circle where it is");
    expect(spaced(orderWords({ ...ORDER, command: "DO_ORBIT", radius_m: -80 }))).toBe("circle of 80 m, counter-clockwise, 540 m AMSL");
    expect(["sent", "ACCEPTED", "TEMPORARILY_REJECTED", "no answer"].map((result) => resultWords({ ...ORDER, result }))).toEqual(["no answer yet", "accepted", "temporarily rejected", "no answer"]);
  });

  it("is told that control went back when no task was left", () => {
    const left = (reason: Reason) => closeWords(4410, "the lease has ended", { ended: "", offboard: { lease: null, reason } as Offboard });
    expect(left(because("offboard.left", { to: "mission" }))).toBe("No task was left: control went back, and the run goes on.");
    expect(left(because("offboard.left", { to: "hold" }))).toBe("No task was left: control went back, and the vehicle holds.");
    expect(left(because("offboard.commanded", { command: "hold" }))).toBe("A person commanded hold.");
  });
});
