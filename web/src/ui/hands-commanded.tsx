import type { FlownBy } from "../api/types";
import { commandedWords, goneWords } from "../hands-on/commanded";
import { engaged } from "../state/hands-on";
import { flownBy } from "../state/offboard-facts";

/** For a vehicle whose tasks alone move it: that nobody flies it from here, and what becomes of it without this page. */
export function OffboardCommanded({ vehicle }: { vehicle: string }) {
  const by = flownBy.value;
  if (by === null) return null;
  return (
    <section class="offboard-note tone-info commanded" aria-label={`How ${vehicle} is commanded`} data-by={by}>
      <b>{vehicle} is commanded, not under manual control</b>
      <p>{commandedWords(vehicle, by)}</p>
      {engaged.value ? (
        <details>
          <summary>When this page goes away</summary>
          <Gone vehicle={vehicle} by={by} />
        </details>
      ) : (
        <Gone vehicle={vehicle} by={by} />
      )}
    </section>
  );
}

function Gone({ vehicle, by }: { vehicle: string; by: FlownBy }) {
  return (
    <dl class="gone">
      {goneWords(vehicle, by).map(([who, what]) => (
        <div key={who}>
          <dt>{who}</dt>
          <dd>{what}</dd>
        </div>
      ))}
    </dl>
  );
}
