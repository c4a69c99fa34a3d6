import { signal } from "@preact/signals";
import { useEffect, useRef } from "preact/hooks";
import { manualControl } from "../features/offboard/control-state";
import { TourOffer } from "../features/tour/tour-bar";

const shown = signal(false);

export function showShortcuts(): void {
  shown.value = true;
}

/** Where a key does what, and the keys with what each does. */
const SHORTCUTS: readonly (readonly [string, readonly (readonly [string, string])[]])[] = [
  ["Everywhere", [["?", "Show this list"]]],
  [
    "Hold buttons",
    [
      ["Space", "Hold to confirm"],
      ["Enter", "Hold to confirm"],
    ],
  ],
  ["Panel tabs", [["← →", "Previous or next panel"]]],
  [
    "Map",
    [
      ["← ↑ ↓ →", "Move"],
      ["+ −", "Zoom"],
      ["M", "Measure distance and bearing"],
      ["/", "Find a place"],
      ["Esc", "Close the tool"],
    ],
  ],
  [
    "Plan editor",
    [
      ["Ctrl Z", "Undo"],
      ["Ctrl Shift Z", "Redo"],
      ["Space", "Add a point at the center of the map"],
      ["Enter", "Close a fence"],
      ["Esc", "Close the tool"],
    ],
  ],
  [
    "Manual control",
    [
      ["W A S D", "Forward, left, back, right"],
      ["Q E", "Turn left or right"],
      ["R F", "Climb or descend"],
      ["Esc", "Exit to Hold"],
    ],
  ],
];

/** A key that is being typed is no shortcut; nothing takes the keyboard from a vehicle under manual control. */
function asksForHelp({ key, target, ctrlKey, altKey, metaKey }: KeyboardEvent): boolean {
  const typing = target instanceof Element && target.closest("input, textarea, select, [contenteditable]") !== null;
  return key === "?" && !ctrlKey && !altKey && !metaKey && !typing && manualControl.peek().phase === "off";
}

/** The list of all keyboard shortcuts, by "?" or from the header. */
export function Shortcuts() {
  const dialog = useRef<HTMLDialogElement>(null);
  useEffect(() => {
    const onKeyDown = (event: KeyboardEvent) => {
      if (asksForHelp(event)) showShortcuts();
    };
    window.addEventListener("keydown", onKeyDown);
    return () => window.removeEventListener("keydown", onKeyDown);
  }, []);
  useEffect(() => {
    if (shown.value && !dialog.current?.open) dialog.current?.showModal();
  }, [shown.value]);
  return (
    <dialog
      ref={dialog}
      class="dialog shortcuts"
      aria-labelledby="shortcuts-title"
      onClose={() => (shown.value = false)}
    >
      <form method="dialog">
        <h2 id="shortcuts-title">Keyboard shortcuts</h2>
        <TourOffer />
        <div class="shortcut-groups">
          {SHORTCUTS.map(([where, keys]) => (
            <section key={where} aria-label={where}>
              <h3>{where}</h3>
              <dl>
                {keys.map(([key, does]) => (
                  <div key={key}>
                    <dt>
                      <kbd>{key}</kbd>
                    </dt>
                    <dd>{does}</dd>
                  </div>
                ))}
              </dl>
            </section>
          ))}
        </div>
        <button type="submit" class="small">
          Close
        </button>
      </form>
    </dialog>
  );
}
