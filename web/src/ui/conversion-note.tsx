import type { ConversionFinding, Finding } from "../api/types";
import { asSentence } from "../format/words";
import { draftNumber } from "../state/draft-text";
import { converted } from "../state/plan-file";
import { FindingNote } from "./finding-note";
import { Icon } from "./icons";

const KINDS: readonly (readonly [ConversionFinding["kind"], string])[] = [
  ["lost", "Lost: not in the result"],
  ["assumed", "Assumed: the source does not say it"],
  ["kept", "Kept where only Waydrop reads it"],
];

/** What a file of other software lost on its way in or out, or why it was refused; until another plan is opened. */
export function ConversionNote() {
  const shown = converted.value;
  if (shown === null || shown.draft !== draftNumber.value) return null;
  const { title, findings, refused } = shown;
  return (
    <section class={`conversion ${refused === null ? "tone-info" : "tone-danger"}`} aria-label="Conversion" role={refused === null ? "status" : "alert"}>
      <header>
        <b>{title}</b>
        <button type="button" class="icon-button" aria-label="Dismiss: conversion" onClick={() => (converted.value = null)}>
          <Icon name="close" size={16} />
        </button>
      </header>
      {refused === null && findings.length === 0 && <p>Nothing was lost or assumed.</p>}
      {KINDS.map(([kind, heading]) => (
        <Changes key={kind} heading={heading} findings={findings.filter((finding) => finding.kind === kind)} />
      ))}
      {refused !== null && refused.findings.length === 0 && <p>{asSentence(refused.detail === "" ? refused.title : refused.detail)}</p>}
      {refused?.findings.map((finding: Finding) => <FindingNote key={finding.code + finding.pointer} finding={finding} />)}
    </section>
  );
}

function Changes({ heading, findings }: { heading: string; findings: readonly ConversionFinding[] }) {
  if (findings.length === 0) return null;
  return (
    <details open={findings.length <= 3}>
      <summary>
        {heading} ({findings.length})
      </summary>
      <ul>
        {findings.map(({ code, pointer, message, hint }) => (
          <li key={code + pointer}>
            {asSentence(message)} {hint !== "" && <span class="hint">{asSentence(hint)}</span>}
            <code>{pointer === "" ? code : `${code} at ${pointer}`}</code>
          </li>
        ))}
      </ul>
    </details>
  );
}
