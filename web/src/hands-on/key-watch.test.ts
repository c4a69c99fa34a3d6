import { describe, expect, it } from "vitest";
import { watchKeys } from "./key-watch";

const key = (type: "keydown" | "keyup", code: string, repeat = false) => Object.assign(new Event(type), { code, repeat });

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
