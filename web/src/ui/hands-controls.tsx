import type { VehicleType } from "../api/types";
import { climbRate, distance, speed } from "../format/units";
import { plain } from "../format/words";
import { PACES } from "../hands-on/setpoint";
import type { PadState } from "../hands-on/gamepad";
import { knobsOf } from "../hands-on/sticks";
import { metresBetween } from "../map/geometry";
import { vehiclePoint } from "../map/camera";
import { goTo, goToArmed, leftKnob, padName, padState, pace, rightKnob } from "../state/controls";
import { manualControl, controlledRun, controlledVehicle } from "../state/hands-on";
import { asked, leave } from "../state/hands-session";
import { follows, speeds } from "../state/offboard-facts";
import { OffboardKeys } from "./hands-keys";
import { OffboardStick } from "./hands-stick";
import { HoldButton } from "./hold-button";
import { Icon } from "./icons";
import { PassingButton } from "./passing-button";

/** Everything that moves the vehicle. */
export function OffboardControls({ vehicle }: { vehicle: string }) {
  const knobs = knobsOf(asked.value);
  const type: VehicleType | null = controlledVehicle.value?.vehicle_type ?? null;
  return (
    <>
      <div class="sticks">
        <OffboardStick name={type === "rover" ? "" : "Climb and turn"} knob={leftKnob} shown={knobs.left} disabled={type === "rover"} />
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
      {controlledRun.value?.state === "paused" && <HoldButton verb="Back to the mission:" vehicle={vehicle} tone="ok" disabled={waiting} onConfirm={() => void leave("mission")} />}
      <HoldButton verb="Return" vehicle={vehicle} tone="warn" disabled={waiting} onConfirm={() => void leave("return")} />
    </div>
  );
}

function GoTo({ vehicle }: { vehicle: string }) {
  const place = goTo.value;
  const here = vehiclePoint(controlledVehicle.value);
  if (!follows("position_global")) return null;
  return (
    <div class="go-to">
      <button type="button" class="small" aria-pressed={goToArmed.value} disabled={manualControl.value.phase !== "flying"} onClick={() => (goToArmed.value = !goToArmed.value)}>
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
