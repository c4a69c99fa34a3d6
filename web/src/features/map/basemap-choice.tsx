import { country, mapExtent } from "../../store/map-view";
import type { IconName } from "../../ui/icons";
import { availableBasemaps, type BasemapName, serverOf } from "./basemaps";
import { basemap, basemapProblem, chooseBasemap, mapSettings, offersStreets } from "./chosen-basemap";
import { MapTool } from "./map-tool";
import { mapToolActive } from "./shown";

type Extra = Exclude<BasemapName, "world">;

const ICONS: Readonly<Record<Extra, IconName>> = { tiles: "map", streets: "globe", satellite: "satellite" };

function nameOf(name: Extra): string {
  const server = serverOf(name, mapSettings);
  const from = server === "" ? "" : ` from ${server}`;
  return name === "satellite" ? `Satellite pictures${from}` : `${name === "tiles" ? "Map" : "Street map"}${from}`;
}

/** A button for each map that is configured: one click shows it, another one turns it off. */
export function BasemapTools() {
  return (
    <>
      {availableBasemaps(mapSettings)
        .filter((name) => name !== "world")
        .map((name) => (
          <MapTool
            key={name}
            icon={ICONS[name]}
            label={nameOf(name)}
            pressed={basemap.value === name}
            onClick={() => chooseBasemap(basemap.value === name ? "world" : name)}
          />
        ))}
    </>
  );
}

/** Asked once, before anything is requested from a server outside; not while the map is needed for clicks. */
export function BasemapOffer() {
  if (!offersStreets.value || mapToolActive.value) return null;
  const server = serverOf("streets", mapSettings);
  return (
    <section class="map-offer" aria-label="Street map">
      <p>
        Show streets and places? Your browser then requests map data from <b>{server}</b>, which learns where you look.
      </p>
      <div>
        <button type="button" class="small" onClick={() => chooseBasemap("streets")}>
          Show street map
        </button>
        <button type="button" class="small" onClick={() => chooseBasemap("world")}>
          Not now
        </button>
      </div>
    </section>
  );
}

/** What lies under the grid while there is no better map, in words; or why the chosen one is missing. */
export function BasemapCaption() {
  const problem = basemapProblem.value;
  if (problem !== null)
    return (
      <small class="map-caption problem" role="status">
        {problem}
      </small>
    );
  if (basemap.value !== "world" || mapExtent.value === null || offersStreets.value) return null;
  return <small class="map-caption">{country.value === null ? "" : `${country.value} · `}Coarse world map</small>;
}
