import { beforeEach, describe, expect, it } from "vitest";
import { dismiss, notices } from "../../store/notices";
import { draftText, openDraft } from "./draft-text";
import { fileStem, foreignFormat, nameFromFile, openFile } from "./plan-files";

it("files of QGroundControl and Mission Planner are told by their content", () => {
  expect(foreignFormat('{"fileType": "Plan", "mission": {}}')).toBe("qgc");
  expect(foreignFormat('\uFEFF {"fileType": "GeoFence"}')).toBe("qgc"); // the service says what it is
  expect(foreignFormat("QGC WPL 110\n0\t1\t0")).toBe("waypoints");
});

it("Waydrop's own plans, and what is no document at all, are of no other software", () => {
  for (const text of ['{"version": 1, "items": []}', '{"version": 1,', "", "hello", "[1]"])
    expect(foreignFormat(text)).toBeNull();
});

describe("a file that is opened", () => {
  const open = (content: BlobPart, name = "x.json") => openFile(new File([content], name));
  const told = () => notices.value.map(({ action, problem }) => [action, problem.code, problem.detail]);
  beforeEach(() => {
    openDraft('{"version": 1, "name": "mine"}');
    for (const { id } of notices.value) dismiss(id);
  });

  it("replaces the draft if it is a JSON object, also one that is no valid plan", async () => {
    await open('\uFEFF{"version": 7}');
    expect([draftText.value, told()]).toEqual(['{"version": 7}', []]);
  });

  it("and is no plan leaves the draft alone, and it is said what it is", async () => {
    const mine = draftText.value;
    await open(new Uint8Array([0x89, 0x50, 0x4e, 0x47, 0, 0, 0xff]), "photo.png");
    expect(told()).toEqual([["Open photo.png", "file.not_a_plan", "It is not a text file."]]);
    await open('<?xml version="1.0"?><kml></kml>', "area.kml");
    expect(told().at(-1)?.[2]).toBe("It is KML, which can only be exported.");
    await open("[1]");
    expect(told().at(-1)?.[2]).toBe("A plan is a JSON object: { … }.");
    await open('{"version": 1,');
    expect(told().at(-1)?.[2]).toContain("This is not JSON");
    await open(" ");
    expect(told().at(-1)?.[2]).toBe("It is empty.");
    expect(draftText.value).toBe(mine);
  });

  it("and is too large is said to be, and how to mend it", async () => {
    await open(new Uint8Array(1_572_864), "large.json");
    expect(notices.value.map(({ problem: { title, detail, hint } }) => [title, detail, hint])).toEqual([
      ["The file is too large", "It has 1.5 MiB; the limit is 1 MiB.", expect.stringContaining("smaller")],
    ]);
  });
});

it("a plan whose file says no name is called as the file", () => {
  expect(nameFromFile("Field 3.waypoints")).toBe("Field 3");
  expect(nameFromFile(".plan")).toBe("Plan");
});

it("a plan's name becomes a file's name", () => {
  expect(fileStem("Clinic run: Nord!")).toBe("clinic-run-nord");
  expect(fileStem("…")).toBe("plan");
});
