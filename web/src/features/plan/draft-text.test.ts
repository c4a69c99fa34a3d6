import { describe, expect, it, vi } from "vitest";
import {
  type History,
  markDraftSaved,
  openDraft,
  persistDraft,
  reduceHistory,
  startHistory,
  writeDraft,
} from "./draft-text";

function written(history: History, text: string, what: string | null = null, at = 0, gesture = false): History {
  return reduceHistory(history, { type: "write", text, what, at, gesture });
}

const undo = (history: History) => reduceHistory(history, { type: "undo" });
const redo = (history: History) => reduceHistory(history, { type: "redo" });

describe("the draft's history", () => {
  it("goes back and forth through every change", () => {
    const three = ["a", "b", "c"].reduce((history, text) => written(history, text), startHistory(""));
    expect([undo(three).text, undo(undo(undo(three))).text, undo(undo(undo(undo(three)))).text]).toEqual(["b", "", ""]);
    expect([redo(undo(three)).text, redo(three).text]).toEqual(["c", "c"]);
    expect(redo(redo(undo(undo(undo(three))))).text).toBe("b");
  });

  it("forgets what was undone as soon as something else is written", () => {
    const after = written(undo(written(written(startHistory(""), "a"), "b")), "x");
    expect([after.text, redo(after).text, undo(after).text]).toEqual(["x", "x", "a"]);
  });

  it("takes a drag as one change however slow it is, and the next drag of the same thing as another", () => {
    let history = startHistory("0");
    for (const [text, at] of [
      ["1", 0],
      ["2", 50],
      ["3", 60_000],
    ] as const)
      history = written(history, text, "drag 1", at, true);
    history = written(history, "4", "drag 2", 60_001, true);
    expect([undo(history).text, undo(undo(history)).text]).toEqual(["3", "0"]);
  });

  it("takes quick typing into a field as one change, and what is typed later as another", () => {
    let history = startHistory("0");
    for (const [text, at] of [
      ["1", 0],
      ["2", 50],
      ["3", 1400],
    ] as const)
      history = written(history, text, "/items/1/speed_m_s", at);
    history = written(history, "4", "/items/1/speed_m_s", 9000);
    expect([undo(history).text, undo(undo(history)).text]).toEqual(["3", "0"]);
  });

  it("does not join changes of different things, nor a change to the one before an undo", () => {
    const two = written(written(startHistory("0"), "1", "name", 0), "2", "speed", 1);
    expect(undo(two).text).toBe("1");
    expect(undo(written(undo(two), "5", "name", 2)).text).toBe("1");
  });

  it("is no longer than it must be, and nothing is written by writing the same", () => {
    let history = startHistory("");
    for (let i = 0; i < 500; i++) history = written(history, String(i));
    expect(history.past.length).toBe(200);
    const large = ["a", "b", "c", "d"]
      .map((letter) => letter.repeat(4_000_000))
      .reduce((kept, text) => written(kept, text), startHistory(""));
    expect(large.past.map((text) => text[0])).toEqual(["b", "c"]);
    expect(undo(written(startHistory("x".repeat(20_000_000)), "y")).text[0]).toBe("x");
    expect(written(history, history.text)).toBe(history);
  });
});

it("who closes the page is asked if the draft is neither as it was opened, nor stored or saved since", async () => {
  vi.stubGlobal("window", new EventTarget());
  persistDraft();
  const isAsked = () => !window.dispatchEvent(new Event("beforeunload", { cancelable: true }));
  const afterReload = async () => {
    vi.resetModules();
    return (await import("./draft-text")).isDraftUnsaved.value;
  };
  expect(isAsked()).toBe(false);
  openDraft('{"name": "stored"}');
  expect([isAsked(), await afterReload()]).toEqual([false, false]);
  writeDraft('{"name": "edited"}');
  expect([isAsked(), await afterReload()]).toEqual([true, true]);
  markDraftSaved('{"name": "edited"}');
  expect(isAsked()).toBe(false);
  writeDraft('{"name": "more"}');
  writeDraft("");
  expect(isAsked()).toBe(false);
  vi.unstubAllGlobals();
});
