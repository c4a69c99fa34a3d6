import type { Rate, SentCommand, SentSetpoint } from "../../api/types";
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
  if (offboard.control_method === "commands")
    return offboard.command === null ? null : <SentCommandRows command={offboard.command} />;
  if (stage === null) return null;
  return (
    <section class="readout" aria-label="Setpoints sent">
      {offboard.sent?.source !== "task" && <DeadMan stage={stage} />}
      {offboard.sent !== null && <Sent sent={offboard.sent} rate={offboard.rate} />}
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

function Sent({ sent, rate }: { sent: SentSetpoint; rate: Rate | null }) {
  return (
    <dl class="facts sent" data-by={sent.source}>
      <div class="sent-words">
        <dt>Sent {SETPOINT_SOURCES[sent.source]}</dt>
        <dd title={`${sent.message}, type mask ${sent.type_mask}`}>{formatSetpoint(sent.setpoint)}</dd>
      </div>
      <div>
        <dt>Rate</dt>
        <dd>
          {rate?.achieved_hz == null
            ? UNKNOWN_VALUE
            : `${rate.achieved_hz.toFixed(1)}\u00a0of\u00a0${rate.target_hz}\u00a0Hz`}
        </dd>
      </div>
      <div>
        <dt>Interval p99</dt>
        <dd title={`longest of the last intervals: ${ms(rate?.max_ms)}`}>{ms(rate?.p99_ms)}</dd>
      </div>
      <div>
        <dt>Latency</dt>
        <dd title="how long the service takes to answer this page">{ms(manualControl.value.answer_ms)}</dd>
      </div>
    </dl>
  );
}

/** The newest command and its answer, of a vehicle that is flown by commands. */
function SentCommandRows({ command }: { command: SentCommand }) {
  return (
    <section class="readout" aria-label="Command sent">
      <dl class="facts sent" data-by="command">
        <div class="sent-words">
          <dt>Commanded</dt>
          <dd title={command.command}>{formatCommand(command)}</dd>
        </div>
        <div class="sent-command">
          <dt>Command</dt>
          <dd>{command.command}</dd>
        </div>
        <div>
          <dt>Result</dt>
          <dd>{formatCommandResult(command)}</dd>
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
