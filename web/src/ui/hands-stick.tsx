import type { Signal } from "@preact/signals";
import { useRef } from "preact/hooks";
import { CENTRED, knobAt, type Knob } from "../hands-on/sticks";

interface Props {
  name: string;
  /** Where this stick's own pointer holds it. */
  knob: Signal<Knob>;
  /** Where the knob is drawn: what is asked, whatever control asks for it. */
  shown: Knob;
  disabled: boolean;
}

/** A stick for a finger or a mouse. It goes back to its middle when it is let go, wherever that is. */
export function OffboardStick({ name, knob, shown, disabled }: Props) {
  const pointer = useRef<number | null>(null);
  if (disabled) return null;
  const move = (event: PointerEvent) => {
    if (event.pointerId !== pointer.current) return;
    const box = (event.currentTarget as HTMLElement).getBoundingClientRect();
    knob.value = knobAt(event.clientX - box.left - box.width / 2, event.clientY - box.top - box.height / 2, box.width / 2);
  };
  const grip = (event: PointerEvent) => {
    if (pointer.current !== null || event.button !== 0) return;
    pointer.current = event.pointerId;
    (event.currentTarget as HTMLElement).setPointerCapture(event.pointerId);
    move(event);
  };
  const letGo = (event: PointerEvent) => {
    if (event.pointerId !== pointer.current) return;
    pointer.current = null;
    knob.value = CENTRED;
  };
  return (
    <div class="stick">
      <div class="stick-field" data-stick={name} onPointerDown={grip} onPointerMove={move} onPointerUp={letGo} onPointerCancel={letGo} onLostPointerCapture={letGo} onContextMenu={(event) => event.preventDefault()}>
        <i class="stick-knob" style={{ transform: `translate(calc(var(--reach) * ${shown[0]}), calc(var(--reach) * ${-shown[1]}))` }} />
      </div>
      <span>{name}</span>
    </div>
  );
}
