import type { Cadence, FlightOrder, SentSetpoint } from "../../api/types";
import { UNKNOWN_VALUE } from "../../format/units";
import { manualControl, offboardState } from "./control-state";
import {
  type DeadManStage,
  deadManStage,
  formatCommand,
  formatCommandResult,
  formatSetpoint,
  SETPOINT_SOURCES,
} from "./labels";

/** What the service really sends, and the stage of its dead-man switch. */
export function Readout() {
  const offboard = offboardState.value;
  const stage = deadManStage(offboard, manualControl.value.fellSilent);
  if (offboard === null) return null;
  if (offboard.flown_by === "commands") return offboard.order === null ? null : <SentCommand order={offboard.order} />;
  if (stage === null) return null;
  return (
    <section class="readout" aria-label="Setpoints sent">
      {offboard.sent?.source !== "task" && <DeadMan stage={stage} />}
      {offboard.sent !== null && <Sent sent={offboard.sent} cadence={offboard.cadence} />}
      <Clamps />
    </section>
  );
}

const STAGES: readonly (readonly [DeadManStage, string, string])[] = [
  ["active", "Active", "setpoints arrive"],
  ["zero_velocity", "Zero velocity", "none for 0.4 s"],
  ["hold", "Hold", "none for 1 s, or no lease"],
];

function DeadMan({ stage }: { stage: DeadManStage | null }) {
  return (
    <ol class="dead-man" aria-label="Dead-man switch" data-stage={stage ?? ""}>
      {STAGES.map(([name, what, when]) => (
        <li
          key={name}
          class={name === stage ? `current ${name}` : ""}
          aria-current={name === stage ? "step" : undefined}
        >
          <b>{what}</b>
          <small>{when}</small>
        </li>
      ))}
    </ol>
  );
}

function Sent({ sent, cadence }: { sent: SentSetpoint; cadence: Cadence | null }) {
  return (
    <dl class="facts sent" data-by={sent.source}>
      <div class="sent-words">
        <dt>Sent {SETPOINT_SOURCES[sent.source]}</dt>
        <dd title={`${sent.message}, type mask ${sent.type_mask}`}>{formatSetpoint(sent.setpoint)}</dd>
      </div>
      <div>
        <dt>Rate</dt>
        <dd>
          {cadence?.held_hz == null
            ? UNKNOWN_VALUE
            : `${cadence.held_hz.toFixed(1)}\u00a0of\u00a0${cadence.wanted_hz}\u00a0Hz`}
        </dd>
      </div>
      <div>
        <dt>Interval p99</dt>
        <dd title={`longest of the last intervals: ${ms(cadence?.max_ms)}`}>{ms(cadence?.p99_ms)}</dd>
      </div>
      <div>
        <dt>Latency</dt>
        <dd title="how long the service takes to answer this page">{ms(manualControl.value.answer_ms)}</dd>
      </div>
    </dl>
  );
}

/** The newest command and its answer, of a vehicle that is flown by commands. */
function SentCommand({ order }: { order: FlightOrder }) {
  return (
    <section class="readout" aria-label="Command sent">
      <dl class="facts sent" data-by="order">
        <div class="sent-words">
          <dt>Commanded</dt>
          <dd title={order.command}>{formatCommand(order)}</dd>
        </div>
        <div class="sent-command">
          <dt>Command</dt>
          <dd>{order.command}</dd>
        </div>
        <div>
          <dt>Result</dt>
          <dd>{formatCommandResult(order)}</dd>
        </div>
      </dl>
    </section>
  );
}

function Clamps() {
  const { clamped } = manualControl.value;
  if (clamped.length === 0) return null;
  return (
    <ul class="clamps" aria-label="Clamped" role="status">
      {clamped.map(({ code, detail }) => (
        <li key={code}>
          <code>{code}</code> {detail}
        </li>
      ))}
    </ul>
  );
}

function ms(value: number | null | undefined): string {
  return value == null ? UNKNOWN_VALUE : `${value.toFixed(0)} ms`;
}
