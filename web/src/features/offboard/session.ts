/**
 * One person's way through offboard control: lease, entry, flying, leaving. Whatever ends it, it stays ended: a new
 * lease
 * is asked for by manual control. It knows no DOM and no socket: both come from its host.
 */

import type { AuditEntry, Clamp, Offboard, TaskQueue } from "../../api/types";
import { closeWords, type GivenBack, givenBackWords, stopWords } from "./labels";
import { ended, type Refusal, refusalOf } from "./refusal";
import { SetpointSender, type StopReason } from "./sender";
import type { Setpoint } from "./setpoint";
import { type Answer, type Destination, givesLead, type QueueAsk, type Wire, type WireEvents } from "./socket";

/** `silent`: nothing is sent any more, and the service's dead-man acts. */
export type Phase = "off" | "opening" | "leased" | "entering" | "flying" | "leaving" | "silent";

/** Who has the vehicle: the controls send setpoints; for tasks the service sends them, while the lease is renewed. */
export type Lead = "controls" | "tasks";

export interface ManualControl {
  readonly phase: Phase;
  readonly vehicle: string | null;
  /** What the service says of it, newest. */
  readonly offboard: Offboard | null;
  readonly leads: Lead;
  /** It follows no setpoint of this page: its tasks alone move it, and none is ever sent in this session. */
  readonly tasksOnly: boolean;
  /** The task queue as the service tells it; null before the first task. */
  readonly tasks: TaskQueue | null;
  readonly refusal: Refusal | null;
  /** What the newest setpoint was clamped by. */
  readonly clamped: readonly Clamp[];
  readonly audit: readonly AuditEntry[];
  readonly answer_ms: number | null;
  /** Nobody was at the controls any more, and the dead-man ended it or will. */
  readonly fellSilent: boolean;
  /** Why the last one ended, in words. */
  readonly ended: string;
}

export const CONTROL_OFF: ManualControl = {
  phase: "off",
  vehicle: null,
  offboard: null,
  leads: "controls",
  tasksOnly: false,
  tasks: null,
  refusal: null,
  clamped: [],
  audit: [],
  answer_ms: null,
  fellSilent: false,
  ended: "",
};

export interface SessionHost {
  connect(vehicle: string, events: WireEvents): Wire;
  now(): number;
  /** The vehicle follows the setpoints of this page, as it flies now and as far as is known. */
  followsControls(): boolean;
  /** What the controls ask for, or why there are none. */
  ask(): Setpoint | StopReason;
  /** What makes the vehicle stand still. */
  neutral(): Setpoint;
  /** Somebody looks at the page: the lease is kept. */
  isPresent(): boolean;
  /** From now on controls count from their middle, and only what is pressed anew. */
  onResetControls(): void;
  onChange(next: ManualControl): void;
}

const ENGAGED: ReadonlySet<Phase> = new Set<Phase>(["entering", "flying", "leaving"]);
const RATE_HZ = 20;
const RENEW_MS = 3000; // a lease lasts 10 s
/** After this the service's dead-man has long acted; if nothing was heard of it, the network is gone. */
const SILENT_MS = 3000;

export class Session {
  #now: ManualControl = CONTROL_OFF;
  #wire: Wire | null = null;
  #renewals: ReturnType<typeof setInterval> | undefined;
  /** Questions to the queue that are not answered yet: what is told meanwhile may be from before. */
  #asking = 0;
  #patience: ReturnType<typeof setTimeout> | undefined;
  /** Settles with the lease: what was asked and not answered by then never will be. */
  #over: Promise<null> = Promise.resolve(null);
  #tellOver: () => void = () => undefined;
  readonly #sender: SetpointSender;

  constructor(private readonly host: SessionHost) {
    this.#sender = new SetpointSender(
      {
        now: () => host.now(),
        ask: () => (this.#now.phase === "leaving" ? host.neutral() : host.ask()),
        send: (setpoint) => this.#wire?.post({ type: "setpoint", setpoint }) ?? 0,
        onStop: (reason) => this.unattended(reason),
      },
      RATE_HZ,
    );
  }

  /** `override` takes it from whoever has it, and needs an admin. */
  take(vehicle: string, override = false): void {
    if (this.#wire !== null) return;
    this.#asking = 0;
    this.#over = new Promise((resolve) => (this.#tellOver = () => resolve(null)));
    this.#set({ ...CONTROL_OFF, phase: "opening", vehicle });
    this.#mayBeTasksOnly();
    const wire: Wire = this.host.connect(vehicle, {
      onOpen: () => void this.#askForLease(wire, override),
      onState: (offboard) => wire === this.#wire && this.#onState(offboard),
      onTasks: (tasks) => wire === this.#wire && this.#onTasks(tasks),
      onAnswer: (answer) => wire === this.#wire && this.#onSetpointAnswer(answer),
      onClosed: (code, reason) => wire === this.#wire && this.#end(closeWords(code, reason, this.#now)),
    });
    this.#wire = wire;
  }

  async enter(sticksHeld: boolean): Promise<void> {
    const wire = this.#wire;
    if (wire === null || this.#now.phase !== "leased") return;
    this.#mayBeTasksOnly(); // a VTOL may be a wing by now
    this.host.onResetControls();
    this.#set({ phase: "entering", refusal: null, clamped: [], audit: [] });
    this.#speak();
    const answer = await wire.ask({ type: "enter", sticks_held: sticksHeld });
    if (wire !== this.#wire || !this.#is("entering")) return;
    if (answer.type === "done") return this.#set({ phase: "flying", audit: answer.audit });
    this.#sender.stop();
    this.#keepLease(true);
    this.#set({ phase: "leased", refusal: refusalOf(`Enter offboard control of ${this.#now.vehicle}`, answer) });
  }

  async leave(to: Destination): Promise<void> {
    const wire = this.#wire;
    if (wire === null || this.#now.phase !== "flying") return;
    this.host.onResetControls();
    this.#set({ phase: "leaving", refusal: null });
    const answer = await wire.ask({ type: "leave", to });
    if (wire !== this.#wire) return;
    if (answer.type === "done") return this.#end(LEFT[to], true);
    if (this.#is("leaving")) this.#set({ phase: "flying", refusal: refusalOf(`Leave to ${to}`, answer) });
  }

  /**
   * Let somebody else take the lease over, in flight too; null takes the offer back. Nothing changes until it is
   * taken.
   */
  async handOver(to: string | null): Promise<void> {
    const wire = this.#wire;
    if (wire === null || !(this.#is("leased") || this.#is("flying"))) return;
    const answer = await wire.ask({ type: "hand_over_lease", to });
    if (wire !== this.#wire) return;
    const doing = to === null ? `Take the offer of ${this.#now.vehicle} back` : `Offer ${this.#now.vehicle} to ${to}`;
    this.#set({ refusal: answer.type === "done" ? null : refusalOf(doing, answer) });
  }

  /**
   * Ask something of the task queue. Null: it is done; else why it is not. `onQueued` hears the id of a new task
   * first.
   */
  async queue(doing: string, frame: QueueAsk, onQueued?: (task_id: string) => void): Promise<Refusal | null> {
    const wire = this.#wire;
    if (wire === null || this.#is("silent")) return ended(doing, "not sent: control has ended");
    const gives = this.#now.leads === "controls" && givesLead(frame, this.#now.tasks);
    if (gives) {
      this.host.onResetControls();
      this.#lead("tasks"); // first: a setpoint that came behind would take the vehicle back
    }
    this.#asking += 1;
    const answer = await Promise.race([wire.ask(frame), this.#over]);
    if (answer === null || wire !== this.#wire) return ended(doing, "not answered: control has ended");
    this.#asking -= 1;
    if (answer.type === "queued") onQueued?.(answer.task_id);
    if (answer.type !== "error") return null;
    if (gives) this.#lead("controls");
    return refusalOf(doing, answer);
  }

  /** The controls move: they have the vehicle at once, and the queue waits. */
  takeOver(): void {
    if (this.#now.phase === "flying") this.#lead("controls");
  }

  /** Give the lease back, or stop asking for it. A vehicle that is flown is told to hold: the socket's end says so. */
  giveBack(why: GivenBack = "asked"): void {
    if (this.#wire !== null) this.#end(givenBackWords(why, this.#now), true);
  }

  /** Nobody is at the controls any more. */
  unattended(reason: StopReason): void {
    const words = stopWords(reason);
    switch (this.#now.phase) {
      case "flying":
      case "leaving":
        if (this.#now.leads === "tasks") break; // no controls are needed: the lease is renewed while somebody looks
        this.#sender.stop();
        this.#set({ phase: "silent", fellSilent: true, ended: words });
        clearTimeout(this.#patience);
        this.#patience = setTimeout(
          () => this.#end(`${words} The service did not answer: the vehicle's own failsafe acts.`, true),
          SILENT_MS,
        );
        break;
      case "entering":
        if (this.#now.tasksOnly && reason === "focus_left") break; // no controls are awaited
        // it must not come into a mode in which nobody flies it
        this.#end(`${words} The entry was broken off, and the lease given back.`, true);
        break;
      default:
    }
    if (reason === "page_closed" && this.#wire !== null) this.#end(words, true);
  }

  async #askForLease(wire: Wire, override: boolean): Promise<void> {
    const answer = await wire.ask({ type: "acquire_lease", rate_hz: RATE_HZ, override });
    if (wire !== this.#wire) return;
    if (answer.type === "lease_granted" && this.#now.offboard?.state === "active") return this.#flyOn();
    if (answer.type === "lease_granted") {
      this.#keepLease(true);
      return this.#set({ phase: "leased" });
    }
    const refusal = refusalOf(`Take the lease of ${this.#now.vehicle}`, answer);
    this.#end("", true);
    this.#set({ refusal });
  }

  /** Taken over in flight: somebody must speak before the dead-man acts. */
  #flyOn(): void {
    this.host.onResetControls();
    this.#set({ phase: "flying" });
    this.#speak();
  }

  #onState(offboard: Offboard): void {
    this.#set({ offboard, answer_ms: this.#sender.answer_ms });
    if (offboard.flown_by === "commands") this.#leaveToTasks();
  }

  /** Looked at before the sender could ever start. */
  #mayBeTasksOnly(): void {
    if (!this.host.followsControls()) this.#leaveToTasks();
  }

  /** For as long as this session lasts. */
  #leaveToTasks(): void {
    this.#lead("tasks");
    if (!this.#now.tasksOnly) this.#set({ tasksOnly: true });
  }

  /** Only this page gives the queue the vehicle; the service takes it away again. */
  #onTasks(tasks: TaskQueue): void {
    this.#set({ tasks });
    const { state } = tasks.report;
    if (this.#asking === 0 && (state === "idle" || state === "manual")) this.#lead("controls");
  }

  #lead(leads: Lead): void {
    if (leads === this.#now.leads || this.#now.tasksOnly) return;
    this.#set({ leads });
    if (ENGAGED.has(this.#now.phase)) this.#speak();
  }

  /** The controls send all the time; for tasks it is enough that the lease is kept. */
  #speak(): void {
    const controls = this.#now.leads === "controls";
    if (controls) this.#sender.start();
    else this.#sender.stop();
    this.#keepLease(!controls);
  }

  #onSetpointAnswer(answer: Answer): void {
    if (answer.id !== null) this.#sender.answered(answer.id);
    if (answer.type === "setpoint_ack") {
      if (!sameClamps(answer.clamped, this.#now.clamped))
        this.#set({ clamped: answer.clamped, answer_ms: this.#sender.answer_ms });
    } else if (answer.type === "error" && this.#sender.sending) {
      this.host.onResetControls(); // the same again would be refused again, and count as silence
      this.#set({ refusal: refusalOf("Setpoint", answer) });
    }
  }

  #keepLease(keep: boolean): void {
    clearInterval(this.#renewals);
    if (keep)
      this.#renewals = setInterval(
        () => this.host.isPresent() && void this.#wire?.ask({ type: "renew_lease" }),
        RENEW_MS,
      );
  }

  #end(why: string, close = false): void {
    this.#sender.stop();
    this.#keepLease(false);
    clearTimeout(this.#patience);
    const wire = this.#wire;
    this.#wire = null;
    this.#tellOver();
    if (close) wire?.close();
    this.#set({
      phase: "off",
      ended: why,
      offboard: null,
      leads: "controls",
      tasksOnly: false,
      tasks: null,
      clamped: [],
      answer_ms: null,
    });
  }

  /** Phases change while an answer is waited for. */
  #is(phase: Phase): boolean {
    return this.#now.phase === phase;
  }

  #set(change: Partial<ManualControl>): void {
    this.#now = { ...this.#now, ...change };
    this.host.onChange(this.#now);
  }
}

const LEFT: Readonly<Record<Destination, string>> = {
  hold: "Left to Hold, as asked.",
  mission: "Left to the mission, which goes on.",
  return: "Left to a return.",
};

function sameClamps(one: readonly Clamp[], other: readonly Clamp[]): boolean {
  return one.length === other.length && one.every(({ detail }, i) => detail === other[i]?.detail);
}
