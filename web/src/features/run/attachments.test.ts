import { describe, expect, it } from "vitest";
import { attachedName, bytes, MAX_BYTES, whyNotAttached } from "./attachments";

const photo = { name: "door.jpg", type: "image/jpeg", size: 2_000_000 };

describe("a file for a drop", () => {
  it("is a JPEG, PNG or PDF that is not too large, else it is said why not", () => {
    expect(whyNotAttached(photo)).toBe("");
    expect(whyNotAttached({ ...photo, size: MAX_BYTES })).toBe("");
    expect(whyNotAttached({ ...photo, size: MAX_BYTES + 100_000 })).toContain("the limit is 8 MiB");
    expect(whyNotAttached({ ...photo, size: 0 })).toBe("“door.jpg” is empty.");
    expect(whyNotAttached({ ...photo, name: "door.svg", type: "image/svg+xml" })).toContain("no JPEG, PNG or PDF");
  });

  it("has a name that the service takes, with its ending", () => {
    expect(attachedName("door.jpg")).toBe("door.jpg");
    expect(attachedName(" \u0000 ")).toBe("attachment");
    const long = attachedName(`${"ä".repeat(300)}.jpeg`);
    expect([...long]).toHaveLength(100);
    expect(long.endsWith("….jpeg")).toBe(true);
  });

  it("says its size as people do", () => {
    expect([bytes(12), bytes(1536), bytes(200_000), bytes(3_400_000)]).toEqual([
      "12 B",
      "1.5 KiB",
      "195 KiB",
      "3.2 MiB",
    ]);
  });
});
