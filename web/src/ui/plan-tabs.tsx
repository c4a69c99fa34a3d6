import { signal } from "@preact/signals";
import { itemTitle } from "../plan/describe";
import { itemOfFinding, type PlanItemView, type PlanView } from "../plan/document";
import { moveItem } from "../plan/edits";
import type { ItemType } from "../plan/item-types";
import { itemTypes, planFields } from "../plan/schema";
import { draftTimeline, findings } from "../state/draft";
import { draftPlan, draftText, editPlan, writeDraft } from "../state/draft-text";
import { addItem } from "../state/editor";
import { planSchema } from "../state/plan-schema";
import { ItemEditor } from "./item-editor";
import { PlanArea } from "./plan-area";
import { PlanItems } from "./plan-items";
import { SchemaFields } from "./schema-fields";

const TABS = ["items", "area", "details", "json"] as const;
type Tab = (typeof TABS)[number];
const NAMES: Readonly<Record<Tab, string>> = { items: "Items", area: "Area", details: "Details", json: "JSON" };

const tab = signal<Tab>("items");

/** The plan from four sides; all of them change the same document. */
export function PlanTabs({ plan }: { plan: PlanView | null }) {
  const shown = plan === null ? "json" : tab.value; // a text that is no plan can only be mended as a text
  const onKeyDown = (event: KeyboardEvent) => {
    if (event.key !== "ArrowLeft" && event.key !== "ArrowRight") return;
    const step = event.key === "ArrowRight" ? 1 : -1;
    const next = TABS[(TABS.indexOf(shown) + step + TABS.length) % TABS.length] ?? shown;
    tab.value = next;
    document.getElementById(`plan-tab-${next}`)?.focus();
  };
  return (
    <div class="plan-tabs">
      <div class="tabs" role="tablist" aria-label="Edit the plan" onKeyDown={onKeyDown}>
        {TABS.map((name) => (
          <button key={name} id={`plan-tab-${name}`} type="button" role="tab" aria-selected={shown === name} aria-controls="plan-tab" tabIndex={shown === name ? 0 : -1} disabled={plan === null && name !== "json"} onClick={() => (tab.value = name)}>
            {NAMES[name]}
          </button>
        ))}
      </div>
      <div id="plan-tab" role="tabpanel" aria-labelledby={`plan-tab-${shown}`}>
        {shown === "items" && plan !== null && <Items plan={plan} />}
        {shown === "area" && <PlanArea />}
        {shown === "details" && <Details />}
        {shown === "json" && <PlanText />}
      </div>
    </div>
  );
}

function Items({ plan }: { plan: PlanView }) {
  const of = new Map(findings.value.map((finding) => [finding, itemOfFinding(finding, plan.items)]));
  const findingsOf = (item: PlanItemView) => findings.value.filter((finding) => of.get(finding) === item);
  return (
    <>
      <PlanItems
        items={plan.items}
        findingsOf={findingsOf}
        timeline={draftTimeline.value}
        progress={null}
        detail={(item) => <ItemEditor key={item.index} item={item} last={item.index === plan.items.length - 1} />}
        onMove={(from, to) => editPlan((document) => moveItem(document, from, to))}
      />
      <AddItem />
    </>
  );
}

/** After the chosen item, else before the end of the flight. What needs a place gets the middle of the map. */
function AddItem() {
  const schema = planSchema.value;
  if (schema === null) return null;
  const add = (type: string) => type !== "" && addItem(type as ItemType);
  return (
    <select class="small add-item" aria-label="Add an item" value="" onChange={(event) => { add(event.currentTarget.value); event.currentTarget.value = ""; }}>
      <option value="">Add an item…</option>
      {itemTypes(schema).map((type) => (
        <option key={type} value={type}>
          {itemTitle({ id: "", index: 0, type, at: null, fields: {} }).replace(/[: ]+(to )?\?$/, "")}
        </option>
      ))}
    </select>
  );
}

function Details() {
  const schema = planSchema.value;
  if (schema === null || draftPlan.value === null) return null;
  return <SchemaFields fields={planFields(schema)} pointer="" value={draftPlan.value} />;
}

function PlanText() {
  return (
    <textarea
      class="plan-text"
      aria-label="Plan as JSON"
      spellcheck={false}
      autocomplete="off"
      placeholder={"Paste a plan (JSON) here,\nor drop a file anywhere on the page."}
      value={draftText.value}
      onInput={(event) => writeDraft(event.currentTarget.value, "json")}
    />
  );
}
