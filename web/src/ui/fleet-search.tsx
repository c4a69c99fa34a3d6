import { GROUP_NAMES, GROUPS } from "../fleet/filter";
import { fleetGroup, fleetQuery } from "../state/fleet-filter";

/** Find vehicles by words, or by what they are doing. */
export function FleetSearch() {
  return (
    <div class="fleet-search" role="search" aria-label="Find">
      <input type="search" aria-label="Find in the fleet" placeholder="Find…" autocomplete="off" spellcheck={false} value={fleetQuery.value} onInput={(event) => (fleetQuery.value = event.currentTarget.value)} />
      <select class="small" aria-label="Show of the fleet" value={fleetGroup.value} onChange={(event) => (fleetGroup.value = GROUPS.find((group) => group === event.currentTarget.value) ?? "all")}>
        {GROUPS.map((group) => (
          <option key={group} value={group}>
            {GROUP_NAMES[group]}
          </option>
        ))}
      </select>
    </div>
  );
}
