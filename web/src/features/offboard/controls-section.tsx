import type { Signal } from "@preact/signals";
import { useRef } from "preact/hooks";
import type { VehicleType } from "../../api/types";
import { humanize } from "../../format/text";
import { formatClimbRate, formatDistance, formatSpeed } from "../../format/units";
import { metresBetween, vehiclePoint } from "../../geo/geometry";
import { HoldButton, TransientButton } from "../../ui/buttons";
import { Icon } from "../../ui/icons";
import { acceptsSetpoint, maxSpeeds } from "./capabilities";
import { leaveOffboard, requestedAxes } from "./control-session";
import {
  controlledRun,
  controlledVehicle,
  controlTab,
  gamepadName,
  gamepadState,
  goToArmed,
  goToTarget,
  heldKeys,
  leftKnob,
  manualControl,
  rightKnob,
  speedPreset,
} from "./control-state";
import { CENTRED, type GamepadState, type Knob, knobAt, knobsOf, NO_KEYS } from "./controls";
import { SPEED_PRESETS } from "./setpoint";

/** Everything that moves the vehicle. */
export function ControlsSection({ vehicle }: { vehicle: string }) {
  const knobs = knobsOf(requestedAxes.value);
  const type: VehicleType | null = controlledVehicle.value?.vehicle_type ?? null;
  return (
    <>
      <div class="sticks">
        <VirtualStick
          name={type === "rover" ? "" : "Climb and turn"}
          knob={leftKnob}
          shown={knobs.left}
          disabled={type === "rover"}
        />
        <VirtualStick name="Move" knob={rightKnob} shown={knobs.right} disabled={false} />
      </div>
      <div class="pace" role="group" aria-label="Speed">
        {SPEED_PRESETS.map((choice) => (
          <button
            key={choice}
            type="button"
            aria-pressed={speedPreset.value === choice}
            onClick={() => (speedPreset.value = choice)}
          >
            {humanize(choice)}
          </button>
        ))}
        <small>
          up to {formatSpeed(maxSpeeds.value.speed_m_s)}, climb {formatClimbRate(maxSpeeds.value.climb_m_s)}
        </small>
      </div>
      <GoTo vehicle={vehicle} />
      <KeyHints />
      <Gamepad />
    </>
  );
}

/** To Hold at once, by one press; what flies on is held to confirm. */
export function ExitButtons({ vehicle }: { vehicle: string }) {
  const waiting = manualControl.value.phase !== "flying";
  return (
    <div class="actions ways-out" role="group" aria-label="Exit manual control">
      <button type="button" class="primary" disabled={waiting} onClick={() => void leaveOffboard("hold")}>
        Exit to Hold
      </button>
      {controlledRun.value?.state === "paused" && (
        <HoldButton
          verb="Resume the mission of"
          vehicle={vehicle}
          tone="ok"
          disabled={waiting}
          onConfirm={() => void leaveOffboard("mission")}
        />
      )}
      <HoldButton
        verb="Return"
        vehicle={vehicle}
        tone="warn"
        disabled={waiting}
        onConfirm={() => void leaveOffboard("return")}
      />
    </div>
  );
}

function GoTo({ vehicle }: { vehicle: string }) {
  const place = goToTarget.value;
  const here = vehiclePoint(controlledVehicle.value);
  if (!acceptsSetpoint("position_global")) return null;
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
        Go to a point
      </button>
      {place === null ? (
        <small>
          {goToArmed.value ? "Click on the map." : "One click on the map. The vehicle flies at its own speed."}
        </small>
      ) : (
        <>
          <span role="status">
            {vehicle} is flying there
            {here !== null && <span aria-hidden="true">, {formatDistance(metresBetween(here, place.at))} left</span>}
          </span>
          <TransientButton name="Stop" onClick={() => (goToTarget.value = null)} />
        </>
      )}
    </div>
  );
}

const GAMEPAD_HINTS: Readonly<Record<GamepadState, string>> = {
  none: "No gamepad. Press one of its buttons to connect it.",
  unmapped: "cannot be used: this browser does not know its axes (no standard mapping).",
  uncentred: "is not active yet. Centre its sticks.",
  active: "is active: left stick climbs and turns, right stick moves.",
};

function Gamepad() {
  const state = gamepadState.value;
  return (
    <p class={`gamepad ${state}`} data-state={state}>
      <Icon name="gamepad" size={18} />
      <span>
        {state !== "none" && <b>{gamepadName.value} </b>}
        {GAMEPAD_HINTS[state]}
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
function KeyHints() {
  const now = heldKeys.value;
  return (
    <div class="keys">
      <ul aria-label="Keys">
        {CAPS.map(({ code, cap, other, does }) => (
          <li key={code} class={now.has(code) || (other !== undefined && now.has(other)) ? "held" : ""}>
            <kbd>{cap}</kbd> {does}
          </li>
        ))}
      </ul>
      <small>Arrow keys move too. Escape exits to Hold. Keys work while this panel has the focus.</small>
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

/** A stick for a finger or a mouse. It centres itself when released, also outside of it. */
function VirtualStick({ name, knob, shown, disabled }: Props) {
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

/** From here on keys type and scroll: held keys are released. */
function showTasks(): void {
  heldKeys.value = NO_KEYS;
  controlTab.value = "tasks";
}

/** While it is flown: the sticks, or the tasks. A gamepad counts with both, keys with the controls alone. */
export function ControlTabs() {
  const page = controlTab.value;
  const queued = manualControl.value.tasks?.tasks.length ?? 0;
  return (
    <div class="offboard-pages" role="group" aria-label="Control by">
      <button type="button" aria-pressed={page === "controls"} onClick={() => (controlTab.value = "controls")}>
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
