import { beforeEach, describe, expect, it } from "vitest";
import { ActivityMonitor, watchKeys } from "./activity";

const pad = (axes: number[], pressed = false, mapping = "standard") => ({
  id: "pad",
  connected: true,
  mapping,
  axes,
  buttons: [{ pressed }],
});
const LATER = 50_000; // warned by then

let presence: ActivityMonitor;
beforeEach(() => {
  presence = new ActivityMonitor();
  presence.pointer(100, 100, 0);
  presence.touch(0);
});

describe("somebody at the page", () => {
  it("is there for 45 s after the last touch, warned until 60 s, and then nobody", () => {
    expect([0, 44_999, 45_000, 59_999, 60_000].map((at) => presence.at(at))).toEqual([
      "active",
      "active",
      "warned",
      "warned",
      "inactive",
    ]);
  });

  it("is there again by a key that goes down, and not by one that something lies on", () => {
    presence.key({ repeat: true }, LATER);
    expect(presence.at(LATER)).toBe("warned");
    presence.key({ repeat: false }, LATER);
    expect(presence.at(LATER)).toBe("active");
  });

  it("is there by a pointer that moves, and not by one that trembles or that the page moves under", () => {
    for (const x of [100, 102, 99, 101]) presence.pointer(x, 100, LATER);
    expect(presence.at(LATER)).toBe("warned");
    presence.pointer(110, 100, LATER);
    expect(presence.at(LATER)).toBe("active");
  });

  it("is there by a stick or a button of a gamepad that changes, and not by one that stays", () => {
    presence.pad(pad([0, 0, 0, -1]), 10_000);
    presence.pad(pad([0.1, 0, 0, -0.99]), LATER);
    expect(presence.at(LATER + 10_000)).toBe("warned");
    presence.pad(pad([0, 0, 0, -0.5]), LATER);
    expect(presence.at(LATER + 10_000)).toBe("active");
    presence.pad(pad([0, 0, 0, -0.5], true), 2 * LATER);
    expect(presence.at(2 * LATER)).toBe("active");
  });

  it("is not there by a gamepad whose axes nobody knows, or by none", () => {
    presence.pad(pad([0, 0, 1, 1], true, ""), LATER);
    presence.pad(null, LATER);
    expect(presence.at(LATER)).toBe("warned");
  });
});

const key = (type: "keydown" | "keyup", code: string, repeat = false) =>
  Object.assign(new Event(type), { code, repeat });

function watched() {
  const [page, released, escapes] = [new EventTarget(), [] as string[], [] as string[]];
  const stop = watchKeys(page, { onRelease: (code) => released.push(code), onEscape: () => escapes.push("Escape") });
  return { page, released, escapes, stop };
}

describe("the watch on all keys", () => {
  it("hears a release wherever the focus is by then", () => {
    const { page, released } = watched();
    page.dispatchEvent(key("keydown", "KeyW"));
    page.dispatchEvent(key("keyup", "KeyW"));
    expect(released).toEqual(["KeyW"]);
  });

  it("hears Escape once, however long it is held", () => {
    const { page, escapes } = watched();
    page.dispatchEvent(key("keydown", "Escape"));
    page.dispatchEvent(key("keydown", "Escape", true));
    page.dispatchEvent(key("keydown", "KeyW"));
    expect(escapes.length).toBe(1);
  });

  it("hears nothing after its end", () => {
    const { page, released, escapes, stop } = watched();
    stop();
    page.dispatchEvent(key("keyup", "KeyW"));
    page.dispatchEvent(key("keydown", "Escape"));
    expect([released, escapes]).toEqual([[], []]);
  });
});
