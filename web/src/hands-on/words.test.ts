import { describe, expect, it } from "vitest";
import { closeWords, givenBackWords, stageOf } from "./words";

type Offboard = NonNullable<Parameters<typeof stageOf>[0]>;
type Sent = NonNullable<Offboard["sent"]>;

const sentBy = (source: Sent["source"]): Offboard => ({ state: "active", sent: { source } }) as Offboard;

describe("the dead-man's stage", () => {
  it("is silence only where the dead-man itself sends: a task speaks for its client", () => {
    expect((["client", "task", "dead_man"] as const).map((by) => stageOf(sentBy(by), false))).toEqual(["speaks", "speaks", "silent"]);
  });

  it("is nothing where nothing is sent, and gone where it has ended the flight", () => {
    const idle = { state: "idle", sent: null } as Offboard;
    expect([stageOf(null, false), stageOf(idle, false), stageOf(idle, true)]).toEqual([null, null, "gone"]);
  });
});

describe("a lease that this page gave back", () => {
  it("says whose it was, why, and what became of a vehicle that was flown", () => {
    expect(givenBackWords("asked", { phase: "leased", vehicle: "v2" })).toBe("The lease was given back.");
    expect(givenBackWords("left_view", { phase: "leased", vehicle: "v2" })).toBe("You left this view: the lease of v2 was given back.");
    expect(givenBackWords("other_vehicle", { phase: "flying", vehicle: "v2" })).toBe("You chose another vehicle: the lease of v2 was given back, and v2 was told to hold.");
  });
});

describe("the end of the socket", () => {
  const said = (code: number, reason = "") => closeWords(code, reason, { ended: "", offboard: null });

  it("is told in the page's words where it knows the code, else in the service's", () => {
    expect(said(1013, "the token cannot be looked at now")).toBe("The service cannot look at the token now; try again in a moment.");
    expect(said(4403)).toBe("Only a pilot may use manual control.");
    expect(said(4999, "why not")).toBe("Why not.");
    expect(said(4999)).toBe("Closed with 4999.");
  });
});
