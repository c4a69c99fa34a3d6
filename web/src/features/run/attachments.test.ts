import { beforeEach, describe, expect, it, vi } from "vitest";
import type { Attachment } from "../../api/types";

const attachments = vi.fn<() => Promise<readonly Attachment[]>>();
vi.doMock("../../api/client", () => ({ api: { attachments } }));
const { status } = await import("../../store/store");
const { attachmentName, attachmentProblem, attachmentsOf, formatBytes, loadAttachments, MAX_BYTES } = await import(
  "./attachments"
);

const photo = { name: "door.jpg", type: "image/jpeg", size: 2_000_000 };

describe("a file for a drop", () => {
  it("is a JPEG, PNG or PDF that is not too large, else it is said why not", () => {
    expect(attachmentProblem(photo)).toBe("");
    expect(attachmentProblem({ ...photo, size: MAX_BYTES })).toBe("");
    expect(attachmentProblem({ ...photo, size: MAX_BYTES + 100_000 })).toContain("the limit is 8 MiB");
    expect(attachmentProblem({ ...photo, size: 0 })).toBe("“door.jpg” is empty.");
    expect(attachmentProblem({ ...photo, name: "door.svg", type: "image/svg+xml" })).toContain(
      "not a JPEG, PNG or PDF",
    );
  });

  it("has a name that the service takes, with its ending", () => {
    expect(attachmentName("door.jpg")).toBe("door.jpg");
    expect(attachmentName(" \u0000 ")).toBe("attachment");
    const long = attachmentName(`${"ä".repeat(300)}.jpeg`);
    expect([...long]).toHaveLength(100);
    expect(long.endsWith("….jpeg")).toBe(true);
  });

  it("says its size as people do", () => {
    expect([formatBytes(12), formatBytes(1536), formatBytes(200_000), formatBytes(3_400_000)]).toEqual([
      "12 B",
      "1.5 KiB",
      "195 KiB",
      "3.2 MiB",
    ]);
  });
});

describe("the attachments of a drop", () => {
  beforeEach(() => {
    attachments.mockReset();
    status.value = { kind: "live" };
  });

  it("that could not be loaded are told so once, until they are", async () => {
    attachments.mockRejectedValue(new Error("network"));
    await loadAttachments("r1", "drop");
    await loadAttachments("r1", "drop");
    const { loadProblem, problems } = attachmentsOf("r1", "drop");
    expect([loadProblem, problems]).toEqual([expect.stringContaining("The attachments could not be loaded."), []]);
    attachments.mockResolvedValue([]);
    await loadAttachments("r1", "drop");
    expect(attachmentsOf("r1", "drop")).toMatchObject({ list: [], loadProblem: "", problems: [] });
  });

  it("are not asked for while the page is not live", async () => {
    status.value = { kind: "connecting" };
    await loadAttachments("r1", "other");
    expect([attachments.mock.calls.length, attachmentsOf("r1", "other").loadProblem]).toEqual([0, ""]);
  });
});
