import type { Signal } from "@preact/signals";
import { useRef } from "preact/hooks";
import type { VehicleType } from "../../api/types";
import { plain } from "../../format/labels";
import { climbRate, distance, speed } from "../../format/units";
import { metresBetween, vehiclePoint } from "../../geo/geometry";
import { HoldButton, PassingButton } from "../../ui/buttons";
import { Icon } from "../../ui/icons";
import { follows, speeds } from "./capabilities";
import { asked, leave } from "./control-session";
import {
  controlledRun,
  controlledVehicle,
  controlPage,
  goTo,
  goToArmed,
  held,
  leftKnob,
  manualControl,
  pace,
  padName,
  padState,
  rightKnob,
} from "./control-state";
import { CENTRED, type Knob, knobAt, knobsOf, NONE_HELD, type PadState } from "./controls";
import { PACES } from "./setpoint";

/** Everything that moves the vehicle. */
export function OffboardControls({ vehicle }: { vehicle: string }) {
  const knobs = knobsOf(asked.value);
  const type: VehicleType | null = controlledVehicle.value?.vehicle_type ?? null;
  return (
    <>
      <div class="sticks">
        <OffboardStick
          name={type === "rover" ? "" : "Climb and turn"}
          knob={leftKnob}
          shown={knobs.left}
          disabled={type === "rover"}
        />
        <OffboardStick name="Move" knob={rightKnob} shown={knobs.right} disabled={false} />
      </div>
      <div class="pace" role="group" aria-label="Speed">
        {PACES.map((choice) => (
          <button key={choice} type="button" aria-pressed={pace.value === choice} onClick={() => (pace.value = choice)}>
            {plain(choice)}
          </button>
        ))}
        <small>
          up to {speed(speeds.value.speed_m_s)}, climb {climbRate(speeds.value.climb_m_s)}
        </small>
      </div>
      <GoTo vehicle={vehicle} />
      <OffboardKeys />
      <Gamepad />
    </>
  );
}

/** To Hold at once, by one press; what flies on is held to confirm. */
export function WaysOut({ vehicle }: { vehicle: string }) {
  const waiting = manualControl.value.phase !== "flying";
  return (
    <div class="actions ways-out" role="group" aria-label="Ways out">
      <button type="button" class="primary" disabled={waiting} onClick={() => void leave("hold")}>
        Leave to hold
      </button>
      {controlledRun.value?.state === "paused" && (
        <HoldButton
          verb="Back to the mission:"
          vehicle={vehicle}
          tone="ok"
          disabled={waiting}
          onConfirm={() => void leave("mission")}
        />
      )}
      <HoldButton
        verb="Return"
        vehicle={vehicle}
        tone="warn"
        disabled={waiting}
        onConfirm={() => void leave("return")}
      />
    </div>
  );
}

function GoTo({ vehicle }: { vehicle: string }) {
  const place = goTo.value;
  const here = vehiclePoint(controlledVehicle.value);
  if (!follows("position_global")) return null;
  return (
    <div class="go-to">
      <button
        type="button"
        class="small"
        aria-pressed={goToArmed.value}
        disabled={manualControl.value.phase !== "flying"}
        onClick={() => (goToArmed.value = !goToArmed.value)}
      >
        <Icon name="follow" size={15} />
        Go to a place
      </button>
      {place === null ? (
        <small>{goToArmed.value ? "Click on the map." : "One click on the map, at the vehicle's own speed."}</small>
      ) : (
        <>
          <span role="status">
            {vehicle} goes there{here === null ? "" : `, ${distance(metresBetween(here, place.at))} left`}
          </span>
          <PassingButton name="Stop" onClick={() => (goTo.value = null)} />
        </>
      )}
    </div>
  );
}

const PAD_WORDS: Readonly<Record<PadState, string>> = {
  none: "No gamepad. Press a button on one to connect it.",
  unknown: "does not count: this browser does not know which of its axes is which (it has no standard mapping).",
  waits: "counts as soon as its sticks were in the middle.",
  counts: "counts: left stick climbs and turns, right stick moves.",
};

function Gamepad() {
  const state = padState.value;
  return (
    <p class={`gamepad ${state}`} data-state={state}>
      <Icon name="gamepad" size={18} />
      <span>
        {state !== "none" && <b>{padName.value} </b>}
        {PAD_WORDS[state]}
      </span>
    </p>
  );
}

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
    knob.value = knobAt(
      event.clientX - box.left - box.width / 2,
      event.clientY - box.top - box.height / 2,
      box.width / 2,
    );
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
      {/* biome-ignore lint/a11y/noStaticElementInteractions: keys and a gamepad do what this stick does */}
      <div
        class="stick-field"
        data-stick={name}
        onPointerDown={grip}
        onPointerMove={move}
        onPointerUp={letGo}
        onPointerCancel={letGo}
        onLostPointerCapture={letGo}
        onContextMenu={(event) => event.preventDefault()}
      >
        <i
          class="stick-knob"
          style={{ transform: `translate(calc(var(--reach) * ${shown[0]}), calc(var(--reach) * ${-shown[1]}))` }}
        />
      </div>
      <span>{name}</span>
    </div>
  );
}

/** Keys type and scroll from here on: none that is down goes on flying. */
function showTasks(): void {
  held.value = NONE_HELD;
  controlPage.value = "tasks";
}

/** While it is flown: the sticks, or the tasks. A gamepad counts with both, keys with the controls alone. */
export function OffboardPages() {
  const page = controlPage.value;
  const queued = manualControl.value.tasks?.tasks.length ?? 0;
  return (
    <div class="offboard-pages" role="group" aria-label="Fly by">
      <button type="button" aria-pressed={page === "controls"} onClick={() => (controlPage.value = "controls")}>
        <Icon name="joystick" size={17} />
        Controls
      </button>
      <button type="button" aria-pressed={page === "tasks"} onClick={showTasks}>
        <Icon name="plan" size={17} />
        Tasks{queued > 0 && ` (${queued})`}
      </button>
    </div>
  );
}
