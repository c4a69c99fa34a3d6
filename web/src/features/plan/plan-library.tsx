import { useEffect, useState } from "preact/hooks";
import type { PlanHead } from "../../api/types";
import { vehicleTypeLabel } from "../../format/labels";
import { formatTimestamp } from "../../format/units";
import { loadOlderPlans, loadStoredPlans, olderPlans, storedPlans } from "../../store/plans";
import { hasRole } from "../../store/principal";
import { live } from "../../store/store";
import { openStored } from "./draft";
import { copyingPlan, copyName, copyPlan, findPlans, libraryShown } from "./library";

/** Rows that are drawn; a search finds the others. */
const MOST_ROWS = 50;

/** The stored plans, to be opened, duplicated or stored under another name. */
export function PlanLibrary() {
  const [query, setQuery] = useState("");
  const [renamed, setRenamed] = useState<string | null>(null);
  useEffect(() => void loadStoredPlans(), []);
  const plans = storedPlans.value ?? [];
  const isCut = olderPlans.value !== null;
  const found = findPlans(plans, query);
  return (
    <section class="plan-library" aria-label="Plan library">
      <input
        type="search"
        aria-label="Search the plan library"
        placeholder="Search by name, type or author"
        value={query}
        onInput={(event) => setQuery(event.currentTarget.value)}
      />
      {found.length === 0 && (
        <p class="muted">
          {plans.length === 0 && "No plan is stored yet. Store one with the Store button."}
          {plans.length > 0 && (isCut ? `None of the newest ${plans.length} plans matches.` : "No plan matches.")}
        </p>
      )}
      <ul>
        {found.slice(0, MOST_ROWS).map((plan) => (
          <li key={plan.id} data-plan={plan.id}>
            {renamed === plan.id ? (
              <RenameForm plan={plan} onClose={() => setRenamed(null)} />
            ) : (
              <StoredPlan plan={plan} plans={plans} onRename={() => setRenamed(plan.id)} />
            )}
          </li>
        ))}
      </ul>
      {found.length > MOST_ROWS && <p class="muted">{found.length - MOST_ROWS} more. Search to find them.</p>}
      {isCut && (
        <button type="button" class="small" disabled={!live.value} onClick={() => void loadOlderPlans()}>
          Load older plans
        </button>
      )}
    </section>
  );
}

interface RowProps {
  plan: PlanHead;
  plans: readonly PlanHead[];
  onRename: () => void;
}

function StoredPlan({ plan, plans, onRename }: RowProps) {
  const open = async () => {
    await openStored(plan.id);
    libraryShown.value = false;
  };
  const off = !live.value || copyingPlan.value || !hasRole("dispatcher");
  return (
    <>
      <button type="button" class="plan-library-open" onClick={() => void open()}>
        <b>{plan.name}</b>
        <small>
          {vehicleTypeLabel(plan.vehicle_type)} · {formatTimestamp(plan.created_at).slice(0, 16)}
          {plan.created_by !== "" && ` · ${plan.created_by}`}
        </small>
      </button>
      <button
        type="button"
        class="small"
        aria-label={`Duplicate “${plan.name}”`}
        disabled={off}
        onClick={() => void copyPlan(plan, copyName(plan.name, plans))}
      >
        Duplicate
      </button>
      <button type="button" class="small" aria-label={`Rename “${plan.name}”`} disabled={off} onClick={onRename}>
        Rename
      </button>
    </>
  );
}

/** A stored plan never changes, so another name makes another plan. */
function RenameForm({ plan, onClose }: { plan: PlanHead; onClose: () => void }) {
  const [name, setName] = useState(plan.name);
  const wanted = name.trim();
  const submit = async (event: Event) => {
    event.preventDefault();
    if (wanted === "" || wanted === plan.name) return onClose();
    if (await copyPlan(plan, wanted)) onClose();
  };
  return (
    <form class="plan-rename" aria-label={`Rename “${plan.name}”`} onSubmit={(event) => void submit(event)}>
      <label>
        New name
        <input
          value={name}
          maxLength={200}
          ref={(input) => input?.focus()}
          onInput={(event) => setName(event.currentTarget.value)}
        />
      </label>
      <small>It is stored as a new plan. “{plan.name}” stays for the runs that flew it.</small>
      <div class="actions">
        <button type="submit" class="small" disabled={copyingPlan.value || wanted === ""}>
          Store as a new plan
        </button>
        <button type="button" class="small" onClick={onClose}>
          Cancel
        </button>
      </div>
    </form>
  );
}
