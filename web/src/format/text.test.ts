import { expect, it } from "vitest";
import { capitalize, countOf, joinParts, shortId, shortName, toSentences } from "./text";

it("clauses become sentences, and names in them stay names", () => {
  expect(["the gripper follows no item", "hold_s is too long", "v1 is busy", ""].map(capitalize)).toEqual([
    "The gripper follows no item",
    "hold_s is too long",
    "v1 is busy",
    "",
  ]);
  expect(toSentences("the link is lost", "", "wait for it!")).toBe("The link is lost. Wait for it!");
});

it("parts without words are left out", () => {
  expect(joinParts(["30 m", "", "5 m/s"])).toBe("30 m · 5 m/s");
});

it("counts and ids are short", () => {
  expect([countOf(1, "item"), countOf(2, "item"), shortId("run-1a6e4c07d9"), shortId("r1"), shortId(null)]).toEqual([
    "1 item",
    "2 items",
    "run-1a6e…",
    "r1",
    "?",
  ]);
});

it("a long name leaves room for its sentence, and no letter is cut in two", () => {
  expect([shortName("Clinic run"), shortName("n".repeat(48))]).toEqual(["Clinic run", "n".repeat(48)]);
  expect(shortName("n".repeat(200))).toBe(`${"n".repeat(47)}…`);
  expect(shortName("🚁".repeat(60))).toBe(`${"🚁".repeat(47)}…`);
});
