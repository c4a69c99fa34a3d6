import { describe, expect, it } from "vitest";
import { stageOf } from "./words";

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
