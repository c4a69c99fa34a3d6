import type { SimulatorSpeed } from "../api/types";
import { paceWords, SPEEDS } from "../simulator/pace";
import { may } from "../state/principal";
import { setSpeed, settingFault, SPEED } from "../state/simulator";
import { live } from "../state/store";
import { FaultRefusal } from "./fault-refusal";

/** How fast the simulated vehicles' time runs, and what that rules out. */
export function SimulatorPace({ speed }: { speed: SimulatorSpeed }) {
  const disabled = !live.value || !may("pilot") || settingFault.value === SPEED;
  return (
    <section class="sim-speed" aria-labelledby="pace-title">
      <h3 id="pace-title">Speed of simulated time</h3>
      <div class="sim-speeds" role="group" aria-labelledby="pace-title" aria-describedby="pace-now">
        {SPEEDS.filter((one) => one <= speed.max).map((one) => (
          <button key={one} type="button" aria-pressed={one === speed.wanted} aria-label={one === 1 ? "Real time" : `${one} times real time`} class={one > speed.live_max ? "beyond" : ""} disabled={disabled} onClick={() => void setSpeed(one)}>
            {one}×
          </button>
        ))}
      </div>
      <p id="pace-now" class={`sim-speed-now tone-${speed.live && !speed.behind ? "neutral" : "warn"}`} role="status">
        {paceWords(speed)}
      </p>
      <FaultRefusal fault={SPEED} />
    </section>
  );
}
