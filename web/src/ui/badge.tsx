import type { ComponentChildren } from "preact";
import type { Tone } from "../format/labels";

/** A word with a colour. The word alone says it all: colour only helps to find it. */
export function Badge({ tone = "neutral", children }: { tone?: Tone; children: ComponentChildren }) {
  return <span class={`badge tone-${tone}`}>{children}</span>;
}
