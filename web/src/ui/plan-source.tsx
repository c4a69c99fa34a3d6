import { useEffect, useId, useRef, useState } from "preact/hooks";
import { fullTime } from "../format/units";
import { draftText, editDraft, openStored } from "../state/draft";
import { report } from "../state/notices";
import { readStoredPlans, storedPlans } from "../state/plans";
import { live } from "../state/store";
import { Icon } from "./icons";

/** Larger files are no plans: the service takes no more. */
const MAX_BYTES = 1_048_576;

/** Where a plan comes from: pasted, dropped, picked from disk, or one that the service has. */
export function PlanSource() {
  const [over, setOver] = useState(false);
  const id = useId();
  const onDrop = (event: DragEvent) => {
    event.preventDefault();
    setOver(false);
    void readFile(event.dataTransfer?.files[0]);
  };
  return (
    <section class={`plan-source${over ? " over" : ""}`} aria-label="Where the plan comes from" onDragOver={(event) => { event.preventDefault(); setOver(true); }} onDragLeave={() => setOver(false)} onDrop={onDrop}>
      <div class="plan-source-tools">
        <FilePicker />
        <StoredPlans />
        {draftText.value !== "" && (
          <button type="button" class="small" onClick={() => editDraft("")}>
            Clear
          </button>
        )}
      </div>
      <label class="visually-hidden" for={id}>
        Plan as JSON
      </label>
      <textarea
        id={id}
        class={draftText.value === "" ? "plan-text" : "plan-text filled"}
        spellcheck={false}
        autocomplete="off"
        placeholder={"Paste a plan (JSON) here,\nor drop a file."}
        value={draftText.value}
        onInput={(event) => editDraft(event.currentTarget.value)}
      />
    </section>
  );
}

function FilePicker() {
  const input = useRef<HTMLInputElement>(null);
  return (
    <>
      <button type="button" class="small" onClick={() => input.current?.click()}>
        <Icon name="file" size={15} />
        Open a file
      </button>
      <input ref={input} type="file" accept=".json,application/json" hidden onChange={(event) => { void readFile(event.currentTarget.files?.[0]); event.currentTarget.value = ""; }} />
    </>
  );
}

function StoredPlans() {
  const connected = live.value;
  useEffect(() => {
    if (connected) void readStoredPlans();
  }, [connected]);
  const plans = storedPlans.value ?? [];
  if (plans.length === 0) return null;
  return (
    <select class="small" aria-label="Open a stored plan" value="" onFocus={() => void readStoredPlans()} onChange={(event) => { void openStored(event.currentTarget.value); event.currentTarget.value = ""; }}>
      <option value="">Stored plans ({plans.length})</option>
      {plans.map((plan) => (
        <option key={plan.id} value={plan.id} title={fullTime(plan.created_at)}>
          {plan.name}
        </option>
      ))}
    </select>
  );
}

async function readFile(file: File | undefined): Promise<void> {
  if (!file) return;
  if (file.size > MAX_BYTES) return report(`Open ${file.name}`, new Error("The file is larger than a plan can be (1 MiB)."));
  editDraft(await file.text());
}
