import { signal } from "@preact/signals";
import { mapCentre } from "../../store/map-view";
import { itemId } from "../../store/selection";
import { Icon, type IconName } from "../../ui/icons";
import { findingItem, type PlanItemView, type PlanView } from "./document";
import { draftTimeline, findings } from "./draft";
import { draftPlan, draftText, draftView, editPlan, writeDraft } from "./draft-text";
import { changeType, moveItem, removeItem } from "./edits";
import type { ItemType } from "./item-types";
import { itemTitle } from "./labels";
import { addItem } from "./map-editor";
import { PlanArea } from "./plan-area";
import { PlanItems } from "./plan-items";
import { itemFields, itemTypes, planFields, planSchema } from "./schema";
import { SchemaFields } from "./schema-fields";

const TABS = ["items", "area", "details", "json"] as const;
type Tab = (typeof TABS)[number];
const NAMES: Readonly<Record<Tab, string>> = { items: "Items", area: "Area", details: "Details", json: "JSON" };

const tab = signal<Tab>("items");

/** Bring the first error into view: those of items are in their tab. */
export function showFirstError(): void {
  if (draftView.peek() !== null) tab.value = "items";
  requestAnimationFrame(() => document.querySelector(".finding.tone-danger")?.scrollIntoView({ block: "center" }));
}

/** The plan from four sides; all of them change the same document. */
export function PlanTabs({ plan }: { plan: PlanView | null }) {
  const shown = plan === null ? "json" : tab.value; // a text that is no plan can only be edited as text
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
          <button
            key={name}
            id={`plan-tab-${name}`}
            type="button"
            role="tab"
            aria-selected={shown === name}
            aria-controls="plan-tab"
            tabIndex={shown === name ? 0 : -1}
            disabled={plan === null && name !== "json"}
            onClick={() => (tab.value = name)}
          >
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
  const of = new Map(findings.value.map((finding) => [finding, findingItem(finding, plan.items)]));
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
    <select
      class="small add-item"
      aria-label="Add an item"
      value=""
      onChange={(event) => {
        add(event.currentTarget.value);
        event.currentTarget.value = "";
      }}
    >
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

interface Props {
  item: PlanItemView;
  last: boolean;
}

/** The chosen item: its type, its place in the order, what can follow it, and its fields. */
function ItemEditor({ item, last }: Props) {
  const schema = planSchema.value;
  const name = `${itemTitle(item)} ${item.id}`;
  const pointer = `/items/${item.index}`;
  const move = (step: number) => editPlan((plan) => moveItem(plan, item.index, item.index + step));
  const remove = () => {
    itemId.value = null;
    editPlan((plan) => removeItem(plan, item.index));
  };
  return (
    <div class="item-editor" role="group" aria-label={`Edit ${name}`}>
      <div class="item-tools">
        <TypeChoice item={item} />
        <ItemTool icon="up" label={`Move ${item.id} up`} disabled={item.index === 0} onClick={() => move(-1)} />
        <ItemTool icon="down" label={`Move ${item.id} down`} disabled={last} onClick={() => move(1)} />
        <ItemTool icon="trash" label={`Delete ${item.id}`} onClick={remove} />
      </div>
      {schema !== null && (
        <SchemaFields key={item.type} fields={itemFields(schema, item.type)} pointer={pointer} value={item.fields} />
      )}
      {(item.type === "waypoint" || item.type === "loiter") && (
        <div class="item-tools">
          <button type="button" class="small" onClick={() => addItem("gripper")}>
            <Icon name="run" size={14} />
            Drop a parcel here
          </button>
          <button type="button" class="small" onClick={() => addItem("delay")}>
            Wait here
          </button>
        </div>
      )}
    </div>
  );
}

function TypeChoice({ item }: { item: PlanItemView }) {
  const schema = planSchema.value;
  if (schema === null) return null;
  const types = itemTypes(schema);
  const change = (type: string) => {
    const fields = new Set(itemFields(schema, type).map((field) => field.name));
    editPlan((plan) => changeType(plan, item.index, type as ItemType, fields, item.at ?? mapCentre.value));
  };
  return (
    <select
      class="small"
      aria-label={`Type of ${item.id}`}
      value={item.type}
      onChange={(event) => change(event.currentTarget.value)}
    >
      {!types.includes(item.type) && <option value={item.type}>{item.type}</option>}
      {types.map((type) => (
        <option key={type} value={type}>
          {itemTitle({ id: "", index: 0, type, at: null, fields: {} }).replace(/[: ]+(to )?\?$/, "")}
        </option>
      ))}
    </select>
  );
}

function ItemTool({
  icon,
  label,
  disabled = false,
  onClick,
}: {
  icon: IconName;
  label: string;
  disabled?: boolean;
  onClick: () => void;
}) {
  return (
    <button type="button" class="icon-button" aria-label={label} title={label} disabled={disabled} onClick={onClick}>
      <Icon name={icon} size={16} />
    </button>
  );
}
