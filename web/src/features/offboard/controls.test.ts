import { describe, expect, it } from "vitest";
import {
  applyDeadZone,
  combineAxes,
  GamepadGate,
  gamepadAxes,
  isNeutral,
  type KeyPress,
  keyAxes,
  knobAt,
  NEUTRAL,
  NO_KEYS,
  pressKey,
  releaseKey,
  selectGamepad,
  stickAxes,
} from "./controls";
import { positionSetpoint, presetSpeeds, velocitySetpoint, zeroSetpoint } from "./setpoint";

const press = (code: string, more: Partial<KeyPress> = {}): KeyPress => ({
  code,
  repeat: false,
  ctrlKey: false,
  altKey: false,
  metaKey: false,
  ...more,
});

describe("keys", () => {
  it("fly by their place on the keyboard while they are held", () => {
    const held = pressKey(pressKey(NO_KEYS, press("KeyW")), press("KeyE"));
    expect(keyAxes(held)).toEqual({ forward: 1, right: 0, up: 0, clockwise: 1 });
    expect(keyAxes(releaseKey(held, "KeyW"))).toEqual({ ...NEUTRAL, clockwise: 1 });
  });

  it("that are opposite are none, and a corner is no faster than straight on", () => {
    const corner = keyAxes(new Set(["KeyW", "ArrowUp", "KeyD"]));
    expect(Math.hypot(corner.forward, corner.right)).toBeCloseTo(1);
    expect(isNeutral(keyAxes(new Set(["KeyW", "KeyS", "KeyQ", "KeyE"])))).toBe(true);
  });

  it("that repeat begin nothing: they are held from before somebody was at the controls", () => {
    expect(pressKey(NO_KEYS, press("KeyW", { repeat: true }))).toBe(NO_KEYS);
  });

  it("are all let go with a modifier, whose release may never be told", () => {
    const held = pressKey(NO_KEYS, press("KeyW"));
    for (const modifier of ["ctrlKey", "altKey", "metaKey"])
      expect(pressKey(held, press("KeyS", { [modifier]: true }))).toBe(NO_KEYS);
  });

  it("that mean nothing change nothing", () => {
    expect(pressKey(NO_KEYS, press("KeyX"))).toBe(NO_KEYS);
    expect(releaseKey(NO_KEYS, "KeyW")).toBe(NO_KEYS);
  });
});

describe("a gamepad", () => {
  const pad = (...axes: number[]) => ({ id: "pad", connected: true, mapping: "standard", axes, buttons: [] });

  it("climbs and turns with its left stick and moves with its right one", () => {
    expect(gamepadAxes([1, -1, 0, 0])).toEqual({ forward: 0, right: 0, up: 1, clockwise: 1 });
    expect(gamepadAxes([0, 0, 1, -1])).toEqual({ forward: 1, right: 1, up: 0, clockwise: 0 });
  });

  it("rests in a dead zone, without a jump at its edge, and what is no number is none", () => {
    expect(isNeutral(gamepadAxes([0.14, -0.14, 0.1, Number.NaN]))).toBe(true);
    expect(applyDeadZone(0.16, 0.15)).toBeCloseTo(0.0118, 3);
    expect(applyDeadZone(-1, 0.15)).toBe(-1);
    expect(isNeutral(gamepadAxes([]))).toBe(true);
  });

  it("counts only after its sticks were in the middle, and from there on", () => {
    const gate = new GamepadGate();
    expect([isNeutral(gate.read(pad(0, 0, 0, -1))), gate.state]).toEqual([true, "uncentred"]);
    expect([isNeutral(gate.read(pad(0, 0, 0, 0))), gate.state]).toEqual([true, "active"]);
    expect(gate.read(pad(0, 0, 0, -1)).forward).toBe(1);
    gate.shut();
    expect(isNeutral(gate.read(pad(0, 0, 0, -1)))).toBe(true);
  });

  it("that is unplugged asks for nothing, and another one starts from the middle too", () => {
    const gate = new GamepadGate();
    gate.read(pad(0, 0, 0, 0));
    expect([isNeutral(gate.read(null)), gate.state]).toEqual([true, "none"]);
    expect(isNeutral(gate.read(pad(0, 0, 0, -1)))).toBe(true);
    gate.read(pad(0, 0, 0, 0));
    expect(isNeutral(gate.read({ ...pad(0, 0, 0, -1), id: "other" }))).toBe(true);
  });

  it("is looked for past the holes that unplugged ones leave", () => {
    expect(selectGamepad([null, { ...pad(0), connected: false }, pad(0, 0, 0, 0)])).toEqual(pad(0, 0, 0, 0));
    expect(selectGamepad([])).toBeNull();
  });

  it("of which the browser does not know what its axes mean never counts: a trigger may rest at -1 there", () => {
    const gate = new GamepadGate();
    const other = { ...pad(0, 0, 0, 0), id: "other", mapping: "" };
    gate.read(other); // in the middle, until its trigger is touched
    expect([isNeutral(gate.read({ ...other, axes: [0, 0, -1, 0] })), gate.state]).toEqual([true, "unmapped"]);
    expect(selectGamepad([other, pad(0, 0, 0, 0)])?.id).toBe("pad");
    expect(selectGamepad([null, other])?.id).toBe("other");
  });
});

describe("sticks on the screen", () => {
  it("go no farther than their edge", () => {
    expect(knobAt(0, -50, 100)).toEqual([0, 0.5]);
    expect(knobAt(300, 400, 100)).toEqual([0.6, -0.8]);
  });

  it("rest where a finger is put down nearly in the middle", () => {
    expect(isNeutral(stickAxes([0.05, -0.05], [0.07, 0]))).toBe(true);
    expect(stickAxes([-1, 0], [0, 1])).toEqual({ forward: 1, right: 0, up: 0, clockwise: -1 });
  });
});

describe("a setpoint", () => {
  const limits = {
    max_speed_m_s: 3,
    max_climb_m_s: null,
    max_descend_m_s: 0.2,
    max_tilt_deg: null,
    max_distance_m: null,
    min_altitude_m: null,
    max_altitude_m: null,
    when_exceeded: "clamp",
  } as const;
  const all = { forward: 1, right: 0, up: 1, clockwise: -1 };

  it("is never faster than the service's limits, whatever speed is chosen", () => {
    expect(presetSpeeds("normal", limits)).toMatchObject({ speed_m_s: 3, climb_m_s: 2, descend_m_s: 0.2 });
    expect(presetSpeeds("slow", limits)).toMatchObject({ speed_m_s: 1.5, descend_m_s: 0.2 });
    expect(presetSpeeds("normal", null)).toMatchObject({ speed_m_s: 5 });
  });

  it("says up as a negative down, and descends by its own speed", () => {
    const speeds = presetSpeeds("normal", limits);
    expect(velocitySetpoint(all, speeds, "multicopter")).toMatchObject({
      type: "velocity_body",
      forward_m_s: 3,
      right_m_s: 0,
      down_m_s: -2,
      yawspeed_deg_s: -45,
    });
    expect(velocitySetpoint({ ...NEUTRAL, up: -0.5 }, speeds, "multicopter").down_m_s).toBe(0.1);
  });

  it("of untouched controls is to stand still, and never NaN", () => {
    expect(zeroSetpoint(presetSpeeds("slow", null), "multicopter")).toEqual({
      type: "velocity_body",
      forward_m_s: 0,
      right_m_s: 0,
      down_m_s: 0,
      yaw_deg: null,
      yawspeed_deg_s: 0,
    });
    expect(combineAxes({ ...NEUTRAL, forward: Number.NaN }, { ...NEUTRAL, up: Number.POSITIVE_INFINITY })).toEqual(
      NEUTRAL,
    );
  });

  it("to a rover has neither climb nor heading", () => {
    expect(velocitySetpoint(all, presetSpeeds("slow", null), "rover")).toMatchObject({
      forward_m_s: 1.5,
      down_m_s: 0,
      yawspeed_deg_s: null,
    });
  });

  it("to a place keeps the altitude above sea level", () => {
    expect(positionSetpoint([8.5, 47.4], 510)).toMatchObject({
      type: "position_global",
      latitude_deg: 47.4,
      longitude_deg: 8.5,
      altitude_m: 510,
      altitude_type: "amsl",
    });
  });
});
