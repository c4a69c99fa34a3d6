import { held } from "../state/controls";

interface Cap {
  readonly code: string;
  readonly cap: string;
  /** The other key that does the same. */
  readonly other?: string;
  readonly does: string;
}

const CAPS: readonly Cap[] = [
  { code: "KeyQ", cap: "Q", does: "turn left" },
  { code: "KeyW", cap: "W", other: "ArrowUp", does: "forward" },
  { code: "KeyE", cap: "E", does: "turn right" },
  { code: "KeyR", cap: "R", other: "PageUp", does: "climb" },
  { code: "KeyA", cap: "A", other: "ArrowLeft", does: "left" },
  { code: "KeyS", cap: "S", other: "ArrowDown", does: "back" },
  { code: "KeyD", cap: "D", other: "ArrowRight", does: "right" },
  { code: "KeyF", cap: "F", other: "PageDown", does: "descend" },
];

/** The keys that fly, lit while they are held. Arrow keys move as well; Escape leaves to Hold, also from the map. */
export function OffboardKeys() {
  const now = held.value;
  return (
    <div class="keys">
      <ul aria-label="Keys">
        {CAPS.map(({ code, cap, other, does }) => (
          <li key={code} class={now.has(code) || (other !== undefined && now.has(other)) ? "held" : ""}>
            <kbd>{cap}</kbd> {does}
          </li>
        ))}
      </ul>
      <small>Arrow keys move too. Escape leaves to Hold. Keys count while this panel has the focus.</small>
    </div>
  );
}
