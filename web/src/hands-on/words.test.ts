import { describe, expect, it } from "vitest";
import { closeWords, stageOf } from "./words";

type Offboard = NonNullable<Parameters<typeof stageOf>[0]>;
type Sent = NonNullable<Offboard["sent"]>;

const sentBy = (by: Sent["by"]): Offboard => ({ state: "active", sent: { by } }) as Offboard;

describe("the dead-man's stage", () => {
  it("is silence only where the dead-man itself sends: a task speaks for its client", () => {
    expect((["client", "task", "dead_man"] as const).map((by) => stageOf(sentBy(by), false))).toEqual(["speaks", "speaks", "silent"]);
  });

  it("is nothing where nothing is sent, and gone where it has ended the flight", () => {
    const idle = { state: "idle", sent: null } as Offboard;
    expect([stageOf(null, false), stageOf(idle, false), stageOf(idle, true)]).toEqual([null, null, "gone"]);
  });
});

describe("the end of the socket", () => {
  const said = (code: number, reason = "") => closeWords(code, reason, { ended: "", offboard: null });

  it("is told in the page's words where it knows the code, else in the service's", () => {
    expect(said(1013, "the token cannot be looked at now")).toBe("The service cannot look at the token now; try again in a moment.");
    expect(said(4403)).toBe("Only a pilot may fly by hand.");
    expect(said(4999, "why not")).toBe("Why not.");
    expect(said(4999)).toBe("Closed with 4999.");
  });
});
