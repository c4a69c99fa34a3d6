/**
 * The files attached to the drops that are shown: read when a drop is shown, and again when an event reports a new
 * one.
 */

import { signal } from "@preact/signals";
import { api } from "../../api/client";
import { tellsOutcome, toProblem } from "../../api/problem";
import type { Attachment } from "../../api/types";
import { toSentences } from "../../format/text";
import { feed, live } from "../../store/store";

interface AttachmentState {
  /** Null until it was read. */
  readonly list: readonly Attachment[] | null;
  /** Names of what is being sent. */
  readonly sending: readonly string[];
  /** Why the list is not the newest, in words; empty if it is. */
  readonly loadProblem: string;
  /** What went wrong when files were attached last, in words; gone with the next try. */
  readonly problems: readonly string[];
}

const NONE: AttachmentState = { list: null, sending: [], loadProblem: "", problems: [] };

const all = signal<Readonly<Record<string, AttachmentState>>>({});

export function attachmentsOf(run: string, drop: string): AttachmentState {
  return all.value[keyOf(run, drop)] ?? NONE;
}

/** The position of the newest event about a file of this drop: the list is read again when it grows. */
export function newestAttachment(run: string, drop: string): number {
  return (
    feed.value.find(
      ({ kind, run_id, data }) => kind === "run.attachment" && run_id === run && data["plan_item_id"] === drop,
    )?.position ?? 0
  );
}

/** Asks nothing while the page is not live: it is asked again with the next connection. */
export async function loadAttachments(run: string, drop: string): Promise<void> {
  if (!live.peek()) return;
  try {
    const list = await api.attachments(run, drop);
    change(run, drop, () => ({ list, loadProblem: "" }));
  } catch (error) {
    const { title, hint } = toProblem(error);
    change(run, drop, () => ({ loadProblem: toSentences("the attachments could not be loaded", title, hint) }));
  }
}

/** One after the other: an operator's uplink is thin. */
export async function attach(run: string, drop: string, files: readonly File[]): Promise<void> {
  change(run, drop, () => ({ problems: [] }));
  for (const file of files) {
    const why = attachmentProblem(file);
    if (why !== "") change(run, drop, ({ problems }) => ({ problems: [...problems, why] }));
    else await send(run, drop, file);
  }
}

async function send(run: string, drop: string, file: File): Promise<void> {
  const name = attachmentName(file.name);
  change(run, drop, ({ sending }) => ({ sending: [...sending, name] }));
  try {
    await api.attach(run, drop, name, file);
    await loadAttachments(run, drop);
  } catch (error) {
    const problem = toProblem(error);
    const what = tellsOutcome(problem) ? `“${name}” was not attached` : `“${name}” may not have been attached`;
    const words = toSentences(what, problem.message, problem.hint);
    change(run, drop, ({ problems }) => ({ problems: [...problems, words] }));
  } finally {
    change(run, drop, ({ sending }) => ({ sending: sending.filter((other) => other !== name) }));
  }
}

function change(run: string, drop: string, next: (before: AttachmentState) => Partial<AttachmentState>): void {
  const key = keyOf(run, drop);
  const before = all.peek()[key] ?? NONE;
  all.value = { ...all.peek(), [key]: { ...before, ...next(before) } };
}

function keyOf(run: string, drop: string): string {
  return `${run}\n${drop}`;
}

// What may be attached to a drop, said before it is sent: the service judges again. Pure.

/** The media types that the service takes; browsers run none of them. */
export const ACCEPTED_TYPES: readonly string[] = ["image/jpeg", "image/png", "application/pdf"];
/** The service's own limit for one file. */
export const MAX_BYTES = 8 * 1024 * 1024;
const MAX_NAME_CHARS = 100;

interface FileFacts {
  readonly name: string;
  readonly type: string;
  readonly size: number;
}

/** Why a file cannot be attached, in words; empty if nothing is known against it. */
export function attachmentProblem({ name, type, size }: FileFacts): string {
  if (!ACCEPTED_TYPES.includes(type)) return `“${name}” is not a JPEG, PNG or PDF. Attach one of these.`;
  if (size === 0) return `“${name}” is empty.`;
  if (size > MAX_BYTES)
    return `“${name}” has ${formatBytes(size)}; the limit is ${formatBytes(MAX_BYTES)}. Make it smaller and try again.`;
  return "";
}

/** A name that the service takes: phones give long ones. The ending stays. */
export function attachmentName(name: string): string {
  const printable = name.replaceAll(/\p{C}/gu, "").trim() || "attachment";
  const letters = [...printable];
  if (letters.length <= MAX_NAME_CHARS) return printable;
  const ending = [...(/\.[^.]{1,8}$/.exec(printable)?.[0] ?? "")];
  return [...letters.slice(0, MAX_NAME_CHARS - ending.length - 1), "…", ...ending].join("");
}

export function isPicture({ media_type }: { readonly media_type: string }): boolean {
  return media_type.startsWith("image/");
}

export function formatBytes(size: number): string {
  if (size < 1000) return `${size} B`;
  const [value, unit] = size < 1024 * 1024 ? [size / 1024, "KiB"] : [size / (1024 * 1024), "MiB"];
  return `${value < 9.95 ? value.toFixed(1).replace(/\.0$/, "") : Math.round(value)} ${unit}`;
}
