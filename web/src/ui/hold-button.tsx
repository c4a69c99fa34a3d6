import { useEffect, useRef, useState } from "preact/hooks";
import type { Tone } from "../format/words";
import { useFocusBack } from "./use-focus-back";

const HOLD_MS = 900;
const HINT_MS = 2500;
const SECOND_PRESS_MS = 4000;

type Phase = "idle" | "holding" | "hint" | "armed";

interface Props {
  /** What it does: "Start". */
  verb: string;
  /** To which vehicle: a dangerous action always says so. */
  vehicle: string;
  tone?: Tone;
  disabled?: boolean;
  onConfirm: () => void;
}

/**
 * A button that acts only after it is held for a moment, by pointer or by Space or Enter. Assistive technology, which
 * can only click, presses twice.
 */
export function HoldButton({ verb, vehicle, tone = "info", disabled = false, onConfirm }: Props) {
  const [phase, setPhase] = useState<Phase>("idle");
  const timer = useRef<ReturnType<typeof setTimeout>>(undefined);
  useEffect(() => () => clearTimeout(timer.current), []);
  const ref = useFocusBack();

  const enter = (next: Phase, afterMs?: number, then?: () => void) => {
    clearTimeout(timer.current);
    setPhase(next);
    if (afterMs !== undefined) timer.current = setTimeout(then ?? (() => setPhase("idle")), afterMs);
  };
  const confirm = () => {
    enter("idle");
    onConfirm();
  };
  const press = () => {
    if (!disabled && phase !== "holding") enter("holding", HOLD_MS, confirm);
  };
  const release = () => {
    if (phase === "holding") enter("hint", HINT_MS);
  };
  const onKeyDown = (event: KeyboardEvent) => {
    if (event.key !== " " && event.key !== "Enter") return;
    event.preventDefault(); // else the browser makes a click of it
    if (!event.repeat) press();
  };
  const onClick = (event: MouseEvent) => {
    if (event.detail !== 0 || disabled) return; // a real pointer: it holds
    if (phase === "armed") confirm();
    else enter("armed", SECOND_PRESS_MS);
  };

  const name = `${verb} ${vehicle}`;
  return (
    <button
      type="button"
      ref={ref}
      class={`hold tone-${tone} ${phase}`}
      style={{ "--hold-ms": `${HOLD_MS}ms` }}
      disabled={disabled}
      aria-label={phase === "armed" ? `Press again: ${name}` : `${name}, hold to confirm`}
      onPointerDown={(event) => event.button === 0 && press()}
      onPointerUp={release}
      onPointerLeave={release}
      onPointerCancel={release}
      onBlur={release}
      onKeyDown={onKeyDown}
      onKeyUp={release}
      onClick={onClick}
      onContextMenu={(event) => event.preventDefault()}
    >
      <span>{LABELS[phase](name)}</span>
    </button>
  );
}

const LABELS: Readonly<Record<Phase, (name: string) => string>> = {
  idle: (name) => name,
  holding: (name) => name,
  hint: (name) => `Hold to ${name.charAt(0).toLowerCase()}${name.slice(1)}`,
  armed: (name) => `Press again: ${name}`,
};
