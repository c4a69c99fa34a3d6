/** Whether the next click on the map is for a tool: it then chooses nothing. */

import { computed } from "@preact/signals";
import { goToArmed } from "./controls";
import { tool } from "./editor";
import { taskKind } from "./task-draft";

export const mapToolInHand = computed(() => tool.value !== null || goToArmed.value || taskKind.value !== null);
