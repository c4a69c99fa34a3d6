import { useComputed } from "@preact/signals";
import { formatAltitude, formatPercent, formatSpeed } from "../../format/units";
import { isHeard } from "../../store/link-loss";
import { type Sample, stripPath, telemetryHistory, telemetryVersion } from "../../store/telemetry-history";

const WIDTH = 200;
const HEIGHT = 36;

interface Quantity {
  readonly name: string;
  readonly of: (sample: Sample) => number | null;
  readonly say: (value: number | null) => string;
  /** Less than this is drawn flat: noise is no news. */
  readonly least_range: number;
}

const QUANTITIES: readonly Quantity[] = [
  { name: "Altitude", of: (sample) => sample.relative_altitude_m, say: formatAltitude, least_range: 2 },
  { name: "Ground speed", of: (sample) => sample.ground_speed_m_s, say: formatSpeed, least_range: 1 },
  { name: "Battery", of: (sample) => sample.battery_percent, say: formatPercent, least_range: 5 },
];

/** Height, speed and battery of the last minutes, as this page has seen them; grey if the vehicle is not heard. */
export function TelemetryStrips({ vehicle }: { vehicle: string }) {
  const isLost = useComputed(() => !isHeard(vehicle)).value;
  void telemetryVersion.value;
  const samples = telemetryHistory.of(vehicle);
  if (samples.length < 2) return null;
  return (
    <section class={isLost ? "strips stale" : "strips"} aria-label={`Telemetry of ${vehicle}`}>
      {QUANTITIES.map((quantity) => (
        <Strip key={quantity.name} quantity={quantity} samples={samples} />
      ))}
    </section>
  );
}

function Strip({
  quantity: { name, of, say, least_range },
  samples,
}: {
  quantity: Quantity;
  samples: readonly Sample[];
}) {
  const drawn = stripPath(samples, of, WIDTH, HEIGHT, least_range);
  const last = samples.at(-1);
  const now = last === undefined ? null : of(last);
  const range = drawn === null ? "" : `${say(drawn.low)} to ${say(drawn.high)}`;
  return (
    <figure class="strip" title={range}>
      <figcaption>
        {name} <b>{say(now)}</b>
      </figcaption>
      <svg
        viewBox={`0 -2 ${WIDTH} ${HEIGHT + 4}`}
        preserveAspectRatio="none"
        role="img"
        aria-label={`${name} of the last minutes: ${range || "not known"}`}
      >
        {drawn !== null && <path d={drawn.path} />}
      </svg>
    </figure>
  );
}
