import type { RefObject } from "preact";
import { useEffect, useLayoutEffect, useRef, useState } from "preact/hooks";
import type { Tone } from "../format/labels";

const HOLD_MS = 900;
const HINT_MS = 2500;
const SECOND_PRESS_MS = 4000;

type Phase = "idle" | "holding" | "hint" | "armed";

interface HoldProps {
  /** What it does: "Start". */
  verb: string;
  /** To which vehicle: a dangerous action always says so. */
  vehicle: string;
  tone?: Tone;
  /** It is the next thing to do in its view, as one button is. */
  primary?: boolean;
  disabled?: boolean;
  onConfirm: () => void;
}

/**
 * A button that acts only after it is held for a moment, by pointer or by Space or Enter. Assistive technology, which
 * can only click, presses twice.
 */
export function HoldButton({ verb, vehicle, tone = "info", primary = false, disabled = false, onConfirm }: HoldProps) {
  const ref = useReturnFocus();
  const name = `${verb} ${vehicle}`;
  const { phase, ...handlers } = useHold(name, disabled, onConfirm);
  return (
    <button
      type="button"
      ref={ref}
      class={`hold tone-${tone} ${phase}${primary ? " primary" : ""}`}
      style={{ "--hold-ms": `${HOLD_MS}ms` }}
      disabled={disabled}
      aria-label={phase === "armed" ? `Press again: ${name}` : `${name}, hold to confirm`}
      {...handlers}
    >
      <span>{LABELS[phase](name)}</span>
    </button>
  );
}

/** When something was pressed, by the clock of its events. */
type Press = Pick<Event, "timeStamp">;

/** How far a press is. Another name is another act: what was pressed was not meant for it. */
function usePress(name: string, disabled: boolean, onConfirm: () => void) {
  const [phase, setPhase] = useState<Phase>("idle");
  const began = useRef<Press | null>(null);
  const timer = useRef<ReturnType<typeof setTimeout>>(undefined);
  useEffect(() => () => clearTimeout(timer.current), []);
  const enter = (next: Phase, afterMs?: number, then?: () => void) => {
    clearTimeout(timer.current);
    setPhase(next);
    if (afterMs !== undefined) timer.current = setTimeout(then ?? (() => setPhase("idle")), afterMs);
  };
  useLayoutEffect(() => {
    began.current = null;
    enter("idle");
  }, [name, disabled]);
  const confirm = () => {
    began.current = null;
    enter("idle");
    onConfirm();
  };
  const press = (event: Press) => {
    if (disabled || began.current !== null) return;
    began.current = event;
    enter("holding", HOLD_MS, confirm);
  };
  const interrupt = () => {
    if (began.current === null) return;
    began.current = null;
    enter("hint", HINT_MS);
  };
  /** Held long enough counts, even where the page was too busy to notice it in time. */
  const letGo = ({ timeStamp }: Press) => {
    if (began.current !== null && timeStamp - began.current.timeStamp >= HOLD_MS && !disabled) confirm();
    else interrupt();
  };
  const click = () => {
    if (disabled) return;
    if (phase === "armed") confirm();
    else enter("armed", SECOND_PRESS_MS);
  };
  return { phase, press, letGo, interrupt, click };
}

/** The phase of a press, and the handlers of its button. */
function useHold(name: string, disabled: boolean, onConfirm: () => void) {
  const { phase, press, letGo, interrupt, click } = usePress(name, disabled, onConfirm);
  /** Where the button was as a pointer pressed it; null: a key did. */
  const pressedAt = useRef<DOMRect | null>(null);
  return {
    phase,
    onPointerDown: (event: PointerEvent) => {
      if (event.button !== 0) return;
      // The page may move beneath a pointer that stands still: the press still means this button.
      const button = event.currentTarget as HTMLElement;
      button.setPointerCapture(event.pointerId);
      pressedAt.current = button.getBoundingClientRect();
      press(event);
    },
    onPointerMove: (event: PointerEvent) => {
      if (pressedAt.current !== null && !isInside(event, pressedAt.current)) interrupt();
    },
    onPointerUp: letGo,
    onPointerCancel: interrupt,
    onBlur: interrupt,
    onKeyDown: (event: KeyboardEvent) => {
      if (event.key !== " " && event.key !== "Enter") return;
      event.preventDefault(); // else the browser makes a click of it
      if (event.repeat) return;
      pressedAt.current = null;
      press(event);
    },
    onKeyUp: letGo,
    /** A real pointer holds; assistive technology clicks. */
    onClick: (event: MouseEvent) => event.detail === 0 && click(),
    onContextMenu: (event: Event) => event.preventDefault(),
  };
}

function isInside({ clientX, clientY }: PointerEvent, { left, right, top, bottom }: DOMRect): boolean {
  return left <= clientX && clientX <= right && top <= clientY && clientY <= bottom;
}

const LABELS: Readonly<Record<Phase, (name: string) => string>> = {
  idle: (name) => name,
  holding: (name) => name,
  hint: (name) => `Hold to ${name.charAt(0).toLowerCase()}${name.slice(1)}`,
  armed: (name) => `Press again: ${name}`,
};

interface PassingProps {
  name: string;
  look?: "small" | "primary";
  /** Does nothing now. It can still have the focus: a button that is really disabled would lose it. */
  off?: boolean;
  onClick: () => void;
}

/** A button at the controls that its own press, or something else, takes away. */
export function TransientButton({ name, look = "small", off = false, onClick }: PassingProps) {
  const ref = useReturnFocus();
  return (
    <button type="button" class={look} aria-disabled={off || undefined} ref={ref} onClick={() => !off && onClick()}>
      {name}
    </button>
  );
}

/**
 * For a button at the controls that goes away, often by its own press, or a form with its fields: the panel takes its
 * focus over before it is gone.
 * Else nothing would have the focus, which counts as an unattended page.
 */
export function useReturnFocus<Part extends HTMLElement = HTMLButtonElement>(): RefObject<Part | null> {
  const ref = useRef<Part>(null);
  useLayoutEffect(() => {
    const part = ref.current;
    return () => {
      if (part === null || !part.contains(document.activeElement) || part.closest(".offboard, .map") === null) return;
      document.querySelector<HTMLElement>(".offboard")?.focus({ preventScroll: true });
    };
  }, []);
  return ref;
}
