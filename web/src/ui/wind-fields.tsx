import { SYSTEMS, systemName } from "../format/units";
import { speedText } from "../plan/wind";
import { calm, typedWind, typeWind, wind, windTexts } from "../state/wind";
import { Icon } from "./icons";

/** The wind that the prediction reckons with. */
export function WindFields() {
  const typed = typedWind.value;
  const texts = windTexts.value;
  const error = "error" in typed ? typed.error : "";
  const hint = wind.value === null ? "Calm air" : "Counts for times, energy and where a parcel comes down";
  return (
    <div class="wind" role="group" aria-label="Wind">
      <b>Wind</b>
      <label>
        from
        <input type="text" inputMode="decimal" autocomplete="off" size={3} placeholder="–" aria-label="Wind from, degrees" aria-invalid={error !== ""} aria-describedby="wind-note" value={texts.from} onInput={(event) => typeWind({ from: event.currentTarget.value })} />
        °
      </label>
      <label>
        at
        <input type="text" inputMode="decimal" autocomplete="off" size={3} placeholder="–" aria-label={`Wind speed, ${SYSTEMS[systemName.value].speed.name}`} aria-invalid={error !== ""} aria-describedby="wind-note" value={speedText(texts, systemName.value)} onInput={(event) => typeWind({ speed: event.currentTarget.value })} />
        {SYSTEMS[systemName.value].speed.name}
      </label>
      {(texts.from !== "" || texts.speed !== "") && (
        <button type="button" class="icon-button" aria-label="Calm air" onClick={calm}>
          <Icon name="close" size={14} />
        </button>
      )}
      <small id="wind-note" class={error === "" ? "" : "field-wrong"}>
        {error || hint}
      </small>
    </div>
  );
}
