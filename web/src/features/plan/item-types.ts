/** The item types of a plan, as the service declares them (item-types.json is written by it). Pure. */

import type { components } from "../../api/schema";
import types from "./item-types.json";

export type ItemType = components["schemas"]["Plan"]["items"][number]["type"];

interface ItemTypeView {
  readonly type: ItemType;
  readonly title: string;
  /** What the id of a new one begins with. */
  readonly stem: string;
  /** What a new one says besides its place. */
  readonly fresh: Readonly<Record<string, unknown>>;
  readonly has_place: boolean;
  /** The flight ends with it. */
  readonly ends: boolean;
  readonly is_drop: boolean;
  /** Done at the stop before it. */
  readonly at_stop: boolean;
  /** The mission cannot be changed while it is flown. */
  readonly near_ground: boolean;
  /** A flight may go on with it: it is not only about the way to another item. */
  readonly can_skip_to: boolean;
}

export const ITEM_TYPE_VIEWS = types as readonly ItemTypeView[];
const UNKNOWN = {
  stem: "item",
  fresh: {},
  has_place: false,
  ends: false,
  is_drop: false,
  at_stop: false,
  near_ground: false,
  can_skip_to: true,
};

/** The properties of a type; a plan may name any text as its type. */
export function itemType(type: string): Omit<ItemTypeView, "type"> {
  return ITEM_TYPE_VIEWS.find((known) => known.type === type) ?? { ...UNKNOWN, title: type };
}
