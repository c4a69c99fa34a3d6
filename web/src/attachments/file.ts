/** What may be attached to a drop, said before it is sent: the service judges again. Pure. */

/** The media types that the service takes; browsers run none of them. */
export const TAKEN: readonly string[] = ["image/jpeg", "image/png", "application/pdf"];
/** The service's own limit for one file. */
export const MAX_BYTES = 8 * 1024 * 1024;
const MAX_NAME_CHARS = 100;

interface FileFacts {
  readonly name: string;
  readonly type: string;
  readonly size: number;
}

/** Why a file cannot be attached, in words; empty if nothing is known against it. */
export function whyNotAttached({ name, type, size }: FileFacts): string {
  if (!TAKEN.includes(type)) return `“${name}” is no JPEG, PNG or PDF: only these are taken.`;
  if (size === 0) return `“${name}” is empty.`;
  if (size > MAX_BYTES) return `“${name}” has ${bytes(size)}: at most ${bytes(MAX_BYTES)} are taken. Make the picture smaller and try again.`;
  return "";
}

/** A name that the service takes: phones give long ones. The ending stays. */
export function attachedName(name: string): string {
  const printable = name.replaceAll(/\p{C}/gu, "").trim() || "attachment";
  const letters = [...printable];
  if (letters.length <= MAX_NAME_CHARS) return printable;
  const ending = [.../(\.[^.]{1,8})?$/.exec(printable)![0]];
  return [...letters.slice(0, MAX_NAME_CHARS - ending.length - 1), "…", ...ending].join("");
}

export function isPicture({ media_type }: { readonly media_type: string }): boolean {
  return media_type.startsWith("image/");
}

export function bytes(size: number): string {
  if (size < 1000) return `${size} B`;
  const [value, unit] = size < 1024 * 1024 ? [size / 1024, "KiB"] : [size / (1024 * 1024), "MiB"];
  return `${value < 9.95 ? value.toFixed(1).replace(/\.0$/, "") : Math.round(value)} ${unit}`;
}
