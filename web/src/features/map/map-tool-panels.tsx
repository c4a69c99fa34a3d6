import type { RefObject } from "preact";
import { useEffect, useRef, useState } from "preact/hooks";
import { Icon } from "../../ui/icons";
import {
  find,
  finderOpen,
  measure,
  measured,
  measuring,
  openFinder,
  openZones,
  removeZones,
  zones,
  zonesOpen,
  zonesProblem,
} from "./map-tools";
import { measuredText } from "./tool-layers";

export function MeasureHint() {
  if (!measuring.value) return null;
  const text = measuredText(measured.value);
  return (
    <div class="map-edit">
      <p class="map-hint" role="status">
        <span class="measured">
          {text ?? (measured.value.length === 0 ? "Click where to measure from." : "Click where to measure to.")}
        </span>
        <button type="button" class="small" onClick={() => measure(false)}>
          Done
        </button>
      </p>
    </div>
  );
}

/** Goes to coordinates or a plus code. */
export function Finder() {
  const [missed, setMissed] = useState(false);
  const input = useRef<HTMLInputElement>(null);
  useEffect(() => {
    if (finderOpen.value) input.current?.focus();
  }, [finderOpen.value]);
  if (!finderOpen.value) return null;
  return (
    <search class="map-popup">
      <form
        onSubmit={(event) => {
          event.preventDefault();
          setMissed(!find(input.current?.value ?? ""));
        }}
        onKeyDown={(event) => event.key === "Escape" && openFinder(false)}
      >
        <input
          ref={input}
          type="search"
          aria-label="Coordinates or plus code"
          aria-invalid={missed}
          placeholder="47.39, 8.54 or 9GXW+36"
          onInput={() => setMissed(false)}
        />
        <button type="submit" class="small">
          Go
        </button>
      </form>
      {missed && (
        <p role="alert">
          Enter latitude and longitude in degrees, such as 47.39, 8.54, or a plus code, such as 9GXW+36.
        </p>
      )}
    </search>
  );
}

export function ZonesPanel() {
  const input = useRef<HTMLInputElement>(null);
  if (!zonesOpen.value) return null;
  return (
    <section class="map-popup" aria-label="Zones">
      {zones.value.length === 0 && <p>Draw zones from a GeoJSON file. The file stays in this browser.</p>}
      <ul>
        {zones.value.map(({ name }) => (
          <li key={name}>
            <span>{name}</span>
            <button type="button" class="icon-button" aria-label={`Remove ${name}`} onClick={() => removeZones(name)}>
              <Icon name="trash" size={16} />
            </button>
          </li>
        ))}
      </ul>
      {zonesProblem.value !== null && <p role="alert">{zonesProblem.value}</p>}
      <button type="button" class="small" onClick={() => input.current?.click()}>
        <Icon name="file" size={15} />
        Open GeoJSON file
      </button>
      <input
        ref={input}
        type="file"
        accept=".geojson,.json,application/geo+json"
        hidden
        onChange={(event) => {
          const file = event.currentTarget.files?.[0];
          if (file) void openZones(file);
          event.currentTarget.value = "";
        }}
      />
    </section>
  );
}

/** A .geojson file that is dropped on the map is drawn; all other files are plans, which the whole page takes. */
export function useZonesDrop(map: RefObject<HTMLElement | null>): void {
  useEffect(() => {
    const onDrop = (event: DragEvent) => {
      const file = event.dataTransfer?.files[0];
      const isOnMap = event.target instanceof Node && map.current?.parentElement?.contains(event.target) === true;
      if (file === undefined || !isOnMap || !/\.geojson$/i.test(file.name)) return;
      event.preventDefault();
      void openZones(file);
    };
    window.addEventListener("drop", onDrop, true); // before the page takes it for a plan
    return () => window.removeEventListener("drop", onDrop, true);
  }, [map]);
}
