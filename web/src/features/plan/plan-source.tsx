import { useEffect, useRef, useState } from "preact/hooks";
import type { ConversionFinding, Finding, TargetFormat } from "../../api/types";
import { capitalize } from "../../format/text";
import { olderPlans, storedPlans } from "../../store/plans";
import { showPanel } from "../../store/selection";
import { live } from "../../store/store";
import { FindingNote } from "../../ui/finding-note";
import { Icon } from "../../ui/icons";
import { canStore, isStored, storeDraft } from "./draft";
import { draftGeneration, draftText, draftView, openDraft } from "./draft-text";
import { libraryShown } from "./library";
import { startNewPlan } from "./map-editor";
import { conversion, exportPlan, openFile, savePlan } from "./plan-files";

/** Where a plan comes from: begun anew, picked from disk, or one that the service has. And where it goes to. */
export function PlanSource() {
  const written = draftText.value !== "";
  return (
    <section class="plan-source-tools" aria-label="Plan files">
      <button type="button" class={draftView.value === null ? "primary" : "small"} onClick={startNewPlan}>
        <Icon name="plus" size={15} />
        New plan
      </button>
      <FilePicker />
      <LibraryButton />
      {written && (
        <>
          <button type="button" class="small" disabled={!canStore.value} onClick={() => void storeDraft()}>
            <Icon name={isStored.value ? "check" : "store"} size={15} />
            {isStored.value ? "Stored" : "Store"}
          </button>
          <button type="button" class="small" onClick={savePlan}>
            <Icon name="save" size={15} />
            Save file
          </button>
          <Export />
          <button type="button" class="small" onClick={() => openDraft("")}>
            Clear
          </button>
        </>
      )}
    </section>
  );
}

function FilePicker() {
  const input = useRef<HTMLInputElement>(null);
  return (
    <>
      <button type="button" class="small" onClick={() => input.current?.click()}>
        <Icon name="file" size={15} />
        Open file
      </button>
      <input
        ref={input}
        type="file"
        accept=".json,.plan,.waypoints,.txt,application/json"
        hidden
        onChange={(event) => {
          void openFile(event.currentTarget.files?.[0]);
          event.currentTarget.value = "";
        }}
      />
    </>
  );
}

/** The service writes only what it has: a draft is stored first. */
function Export() {
  const off = !isStored.value || !live.value;
  return (
    <select
      class="small"
      aria-label="Export the stored plan"
      title={off ? "Store the plan first" : undefined}
      disabled={off}
      value=""
      onChange={(event) => {
        void exportPlan(event.currentTarget.value as TargetFormat);
        event.currentTarget.value = "";
      }}
    >
      <option value="">{off ? "Export (store first)" : "Export…"}</option>
      <option value="qgc">QGroundControl .plan</option>
      <option value="geojson">GeoJSON</option>
      <option value="kml">KML</option>
    </select>
  );
}

function LibraryButton() {
  const shown = libraryShown.value;
  const count = `${storedPlans.value?.length ?? 0}${olderPlans.value === null ? "" : "+"}`;
  return (
    <button type="button" class="small" aria-expanded={shown} onClick={() => (libraryShown.value = !shown)}>
      <Icon name="store" size={15} />
      Plan library ({count})
    </button>
  );
}

const KINDS: readonly (readonly [ConversionFinding["kind"], string])[] = [
  ["lost", "Not converted"],
  ["assumed", "Assumed, because the source lacks it"],
  ["kept", "Kept for Waydrop only"],
];

/** What a file of other software lost on its way in or out, or why it was refused; until another plan is opened. */
export function ConversionNote() {
  const shown = conversion.value;
  if (shown === null || shown.draft !== draftGeneration.value) return null;
  const { title, findings, refused } = shown;
  return (
    <section
      class={`conversion ${refused === null ? "tone-info" : "tone-danger"}`}
      aria-label="Conversion"
      role={refused === null ? "status" : "alert"}
    >
      <header>
        <b>{title}</b>
        <button
          type="button"
          class="icon-button"
          aria-label="Dismiss: conversion"
          onClick={() => (conversion.value = null)}
        >
          <Icon name="close" size={16} />
        </button>
      </header>
      {refused === null && findings.length === 0 && <p>Nothing was lost or assumed.</p>}
      {KINDS.map(([kind, heading]) => (
        <Changes key={kind} heading={heading} findings={findings.filter((finding) => finding.kind === kind)} />
      ))}
      {refused !== null && refused.findings.length === 0 && (
        <p>{capitalize(refused.detail === "" ? refused.title : refused.detail)}</p>
      )}
      {refused?.findings.map((finding: Finding) => (
        <FindingNote key={finding.code + finding.pointer} finding={finding} />
      ))}
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
            {capitalize(message)} {hint !== "" && <span class="hint">{capitalize(hint)}</span>}
            <code>{pointer === "" ? code : `${code} at ${pointer}`}</code>
          </li>
        ))}
      </ul>
    </details>
  );
}

/** A plan's file can be dropped anywhere on the page. */
export function FileDrop() {
  const [over, setOver] = useState(false);
  useEffect(() => {
    const hasFile = (event: DragEvent) => event.dataTransfer?.types.includes("Files") === true;
    const onOver = (event: DragEvent) => {
      if (!hasFile(event)) return;
      const taken = event.defaultPrevented; // by what it is held over, which takes files of its own
      event.preventDefault(); // else the browser leaves the page and opens the file
      setOver(!taken);
    };
    const onLeave = (event: DragEvent) => event.relatedTarget === null && setOver(false);
    const onDrop = (event: DragEvent) => {
      if (!hasFile(event)) return;
      setOver(false);
      if (event.defaultPrevented) return;
      event.preventDefault();
      showPanel("plan");
      void openFile(event.dataTransfer?.files[0]);
    };
    window.addEventListener("dragover", onOver);
    window.addEventListener("dragleave", onLeave);
    window.addEventListener("drop", onDrop);
    return () => {
      window.removeEventListener("dragover", onOver);
      window.removeEventListener("dragleave", onLeave);
      window.removeEventListener("drop", onDrop);
    };
  }, []);
  return over ? <div class="file-drop">Drop the plan here</div> : null;
}
