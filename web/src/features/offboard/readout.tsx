import type { Cadence, FlightOrder, SentSetpoint } from "../../api/types";
import { UNKNOWN } from "../../format/units";
import { manualControl, offboardNow } from "./control-state";
import { orderWords, resultWords, type Stage, setpointWords, stageOf } from "./labels";

/** What really leaves, as the service tells it, and where its dead-man is. */
export function OffboardReadout() {
  const offboard = offboardNow.value;
  const stage = stageOf(offboard, manualControl.value.fellSilent);
  if (offboard === null) return null;
  if (offboard.flown_by === "commands") return offboard.order === null ? null : <Ordered order={offboard.order} />;
  if (stage === null) return null;
  return (
    <section class="readout" aria-label="What is really sent">
      {offboard.sent?.source !== "task" && <DeadMan stage={stage} />}
      {offboard.sent !== null && <Sent sent={offboard.sent} cadence={offboard.cadence} />}
      <Clamps />
    </section>
  );
}

const STAGES: readonly (readonly [Stage, string, string])[] = [
  ["speaks", "Follows", "setpoints arrive"],
  ["silent", "Stands still", "silent for 0.4 s"],
  ["gone", "Hold", "1 s, or no lease"],
];

function DeadMan({ stage }: { stage: Stage | null }) {
  return (
    <ol class="dead-man" aria-label="Dead-man" data-stage={stage ?? ""}>
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

const SENDERS: Readonly<Record<SentSetpoint["source"], string>> = {
  client: "for the client",
  dead_man: "by the dead-man",
  task: "for a task",
};

function Sent({ sent, cadence }: { sent: SentSetpoint; cadence: Cadence | null }) {
  return (
    <dl class="facts sent" data-by={sent.source}>
      <div class="sent-words">
        <dt>Sent {SENDERS[sent.source]}</dt>
        <dd title={`${sent.message}, type mask ${sent.type_mask}`}>{setpointWords(sent.setpoint)}</dd>
      </div>
      <div>
        <dt>Rate held</dt>
        <dd>
          {cadence?.held_hz == null
            ? UNKNOWN
            : `${cadence.held_hz.toFixed(1)}\u00a0of\u00a0${cadence.wanted_hz}\u00a0Hz`}
        </dd>
      </div>
      <div>
        <dt>Interval p99</dt>
        <dd title={`longest of the last ones: ${ms(cadence?.max_ms)}`}>{ms(cadence?.p99_ms)}</dd>
      </div>
      <div>
        <dt>Answer</dt>
        <dd title="how long the service takes to answer this page">{ms(manualControl.value.answer_ms)}</dd>
      </div>
    </dl>
  );
}

/** The newest command and its answer, of a vehicle that is flown by commands. */
function Ordered({ order }: { order: FlightOrder }) {
  return (
    <section class="readout" aria-label="What is really sent">
      <dl class="facts sent" data-by="order">
        <div class="sent-words">
          <dt>Commanded</dt>
          <dd title={order.command}>{orderWords(order)}</dd>
        </div>
        <div class="sent-command">
          <dt>Command</dt>
          <dd>{order.command}</dd>
        </div>
        <div>
          <dt>Answer</dt>
          <dd>{resultWords(order)}</dd>
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
  return value == null ? UNKNOWN : `${value.toFixed(0)} ms`;
}
