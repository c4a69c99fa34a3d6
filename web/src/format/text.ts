/** How clauses and codes of the service become text. Pure. */

/** Capitalizes a clause, unless its first word is a name such as hold_s. */
export function capitalize(text: string): string {
  return /^[a-z]+(?![\w./])/.test(text) ? text.charAt(0).toUpperCase() + text.slice(1) : text;
}

/** The clause as a sentence: "the link is lost" -> "The link is lost." */
export function toSentence(clause: string): string {
  return closed(capitalize(clause));
}

/** Several clauses as sentences; empty ones are left out. */
export function toSentences(...clauses: readonly string[]): string {
  return clauses
    .filter((clause) => clause !== "")
    .map(toSentence)
    .join(" ");
}

/** Ends the text with a full stop, unless it ends with a mark of its own. */
export function closed(text: string): string {
  return /[.!?]$/.test(text) ? text : `${text}.`;
}

/** A code that has no label: "in_failsafe" -> "In failsafe". */
export function humanize(code: string): string {
  const spaced = code.replaceAll("_", " ");
  return spaced.charAt(0).toUpperCase() + spaced.slice(1);
}

/** The parts that say something, joined: "30 m · 5.0 m/s". */
export function joinParts(parts: readonly string[], separator = " · "): string {
  return parts.filter((part) => part !== "").join(separator);
}

/** "3 items", "1 item". */
export function countOf(count: number, noun: string): string {
  return `${count} ${noun}${count === 1 ? "" : "s"}`;
}

const LONGEST_NAME = 48;

/** A name as part of a sentence: a long one without its end, so that the rest of the sentence is seen. */
export function shortName(name: string): string {
  const letters = [...name];
  return letters.length <= LONGEST_NAME
    ? name
    : `${letters
        .slice(0, LONGEST_NAME - 1)
        .join("")
        .trimEnd()}…`;
}

/** Ids are long: enough of one to tell it from the others. */
export function shortId(id: string | null): string {
  return id === null ? "?" : id.length > 12 ? `${id.slice(0, 8)}…` : id;
}
