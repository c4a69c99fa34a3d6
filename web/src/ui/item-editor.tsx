import { itemTitle } from "../plan/describe";
import type { PlanItemView } from "../plan/document";
import { changeType, moveItem, removeItem } from "../plan/edits";
import type { ItemType } from "../plan/item-types";
import { itemFields, itemTypes } from "../plan/schema";
import { viewCentre } from "../map/camera";
import { editPlan } from "../state/draft-text";
import { addItem } from "../state/editor";
import { planSchema } from "../state/plan-schema";
import { itemId } from "../state/selection";
import { Icon, type IconName } from "./icons";
import { SchemaFields } from "./schema-fields";

interface Props {
  item: PlanItemView;
  last: boolean;
}

/** The chosen item: its type, its place in the order, what can follow it, and its fields. */
export function ItemEditor({ item, last }: Props) {
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
      {schema !== null && <SchemaFields key={item.type} fields={itemFields(schema, item.type)} pointer={pointer} value={item.fields} />}
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
    editPlan((plan) => changeType(plan, item.index, type as ItemType, fields, item.at ?? viewCentre.value));
  };
  return (
    <select class="small" aria-label={`Type of ${item.id}`} value={item.type} onChange={(event) => change(event.currentTarget.value)}>
      {!types.includes(item.type) && <option value={item.type}>{item.type}</option>}
      {types.map((type) => (
        <option key={type} value={type}>
          {itemTitle({ id: "", index: 0, type, at: null, fields: {} }).replace(/[: ]+(to )?\?$/, "")}
        </option>
      ))}
    </select>
  );
}

function ItemTool({ icon, label, disabled = false, onClick }: { icon: IconName; label: string; disabled?: boolean; onClick: () => void }) {
  return (
    <button type="button" class="icon-button" aria-label={label} title={label} disabled={disabled} onClick={onClick}>
      <Icon name={icon} size={16} />
    </button>
  );
}
