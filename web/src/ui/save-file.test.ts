import { afterEach, beforeEach, expect, test, vi } from "vitest";
import { saveFile, URL_LIFETIME_MS } from "./save-file";

const steps: string[] = [];

beforeEach(() => {
  steps.length = 0;
  vi.useFakeTimers();
  const link = {
    href: "",
    download: "",
    click: () => steps.push(`click ${link.download} at ${link.href}`),
    remove: () => steps.push("remove"),
  };
  vi.stubGlobal("document", { createElement: () => link, body: { append: () => steps.push("append") } });
  vi.spyOn(URL, "createObjectURL").mockReturnValue("blob:1");
  vi.spyOn(URL, "revokeObjectURL").mockImplementation((url) => void steps.push(`revoke ${url}`));
});

afterEach(() => {
  vi.useRealTimers();
  vi.unstubAllGlobals();
  vi.restoreAllMocks();
});

test("the link is in the document while it is clicked, and what it names can be read for a while after", () => {
  saveFile("proof.html", "<p>", "text/html");
  expect(steps).toEqual(["append", "click proof.html at blob:1", "remove"]);
  vi.advanceTimersByTime(URL_LIFETIME_MS - 1);
  expect(steps).toHaveLength(3);
  vi.advanceTimersByTime(1);
  expect(steps.at(-1)).toBe("revoke blob:1");
});
