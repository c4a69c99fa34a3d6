/** A session over a fake wire for each test of a file, driven and looked at by it. The clock is the test's. */

import { afterEach, beforeEach, vi } from "vitest";
import type { VehicleType } from "../../../api/types";
import type { StopReason } from "../sender";
import { type ManualControl, NO_CONTROL, Session } from "../session";
import { presetSpeeds, type Setpoint, zeroSetpoint } from "../setpoint";
import { DONE, FakeWire, GRANTED } from "./fake-socket";

export class SessionFixture {
  now: ManualControl = NO_CONTROL;
  present = true;
  /** How often controls were to count from their middle. */
  fresh = 0;
  readonly still: Setpoint;
  readonly session: Session;

  /** `nextSetpoint`: what the controls ask for, or why there are none. */
  constructor(
    private readonly vehicle: string,
    type: VehicleType,
    public followsControls: boolean,
    public nextSetpoint: () => Setpoint | StopReason = () => this.still,
  ) {
    this.still = zeroSetpoint(presetSpeeds("slow", null), type);
    this.session = new Session({
      connect: (_, events) => new FakeWire(events),
      now: () => Date.now(),
      followsControls: () => this.followsControls,
      nextSetpoint: () => this.nextSetpoint(),
      neutral: () => this.still,
      isPresent: () => this.present,
      onResetControls: () => (this.fresh += 1),
      onChange: (next) => (this.now = next),
    });
  }

  get wire(): FakeWire {
    return FakeWire.all.at(-1) as FakeWire;
  }

  async leased(): Promise<void> {
    this.session.acquireLease(this.vehicle);
    this.wire.events.onOpen();
    await this.wire.answer(GRANTED);
  }

  async flying(): Promise<void> {
    await this.leased();
    void this.session.enter(false);
    await this.wire.answer(DONE);
  }
}

/** A new bench before each test of the file, which `onNew` is given; its session ends with the test. */
export function eachWithFixture(make: () => SessionFixture, onNew: (bench: SessionFixture) => void): void {
  let bench: SessionFixture;
  beforeEach(() => {
    vi.useFakeTimers();
    FakeWire.all = [];
    bench = make();
    onNew(bench);
  });
  afterEach(() => {
    bench.session.releaseLease();
    vi.useRealTimers();
  });
}
