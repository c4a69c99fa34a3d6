/**
 * One person's way through offboard control: lease, entry, flying, leaving. Whatever ends it, it stays ended: a new
 * lease
 * is asked for by manual control. It knows no DOM and no socket: both come from its host.
 */

import type { AuditEntry, Clamp, Offboard, OffboardExit, QueueRequest, ServerAnswer, TaskQueue } from "../../api/types";
import { describeClose, describeRelease, describeStop, type ReleaseCause } from "./labels";
import { controlEnded, type Refusal, toRefusal } from "./refusal";
import { SetpointSender, type StopReason } from "./sender";
import type { Setpoint } from "./setpoint";
import { type OffboardSocket, type OffboardSocketEvents, startsTasks } from "./socket";

/** `silent`: nothing is sent any more, and the service's dead-man acts. */
export type Phase = "off" | "opening" | "leased" | "entering" | "flying" | "leaving" | "silent";

const FLOWN: ReadonlySet<Phase> = new Set<Phase>(["entering", "flying", "leaving"]);

/** Who has the vehicle: the controls send setpoints; for tasks the service sends them, while the lease is renewed. */
type ControlSource = "controls" | "tasks";

export interface ManualControl {
  readonly phase: Phase;
  readonly vehicle: string | null;
  /** What the service says of it, newest. */
  readonly offboard: Offboard | null;
  readonly source: ControlSource;
  /** It follows no setpoint of this page: its tasks alone move it, and none is ever sent in this session. */
  readonly tasksOnly: boolean;
  /** The task queue as the service reports it; null before the first task. */
  readonly tasks: TaskQueue | null;
  readonly refusal: Refusal | null;
  /** What the newest setpoint was clamped by. */
  readonly clamped: readonly Clamp[];
  readonly audit: readonly AuditEntry[];
  readonly answer_ms: number | null;
  /** The controls were unattended, and the dead-man switch ended it or will. */
  readonly fellSilent: boolean;
  /** Why the last one ended, in words. */
  readonly ended: string;
}

export const NO_CONTROL: ManualControl = {
  phase: "off",
  vehicle: null,
  offboard: null,
  source: "controls",
  tasksOnly: false,
  tasks: null,
  refusal: null,
  clamped: [],
  audit: [],
  answer_ms: null,
  fellSilent: false,
  ended: "",
};

interface SessionHost {
  connect(vehicle: string, events: OffboardSocketEvents): OffboardSocket;
  now(): number;
  /** The vehicle follows the setpoints of this page, as it flies now and as far as is known. */
  followsControls(): boolean;
  /** What the controls ask for, or why there are none. */
  nextSetpoint(): Setpoint | StopReason;
  /** What makes the vehicle stand still. */
  neutral(): Setpoint;
  /** The page is visible: the lease is renewed. */
  isPresent(): boolean;
  /** From now on controls count from their middle, and only what is pressed anew. */
  onResetControls(): void;
  onChange(next: ManualControl): void;
}

const ENGAGED: ReadonlySet<Phase> = new Set<Phase>(["entering", "flying", "leaving"]);
const RATE_HZ = 20;
const RENEW_MS = 3000; // a lease lasts 10 s
/** After this the service's dead-man switch has acted; without its report, the network is down. */
const SILENT_MS = 3000;

export class Session {
  #now: ManualControl = NO_CONTROL;
  #wire: OffboardSocket | null = null;
  #renewals: ReturnType<typeof setInterval> | undefined;
  /** Unanswered requests to the queue: reports meanwhile may be older. */
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
        nextSetpoint: () => (this.#now.phase === "leaving" ? host.neutral() : host.nextSetpoint()),
        send: (setpoint) => this.#wire?.post({ type: "setpoint", setpoint }) ?? 0,
        onStop: (reason) => this.unattended(reason),
      },
      RATE_HZ,
    );
  }

  /** `override` takes it from its holder, and needs an admin. */
  acquireLease(vehicle: string, override = false): void {
    if (this.#wire !== null) return;
    this.#asking = 0;
    this.#over = new Promise((resolve) => (this.#tellOver = () => resolve(null)));
    this.#set({ ...NO_CONTROL, phase: "opening", vehicle });
    this.#checkTasksOnly();
    const wire: OffboardSocket = this.host.connect(vehicle, {
      onOpen: () => void this.#requestLease(wire, override),
      onState: (offboard) => wire === this.#wire && this.#onState(offboard),
      onTasks: (tasks) => wire === this.#wire && this.#onTasks(tasks),
      onAnswer: (answer) => wire === this.#wire && this.#onSetpointAnswer(answer),
      onClosed: (code, reason) => wire === this.#wire && this.#end(describeClose(code, reason, this.#now)),
    });
    this.#wire = wire;
  }

  async enter(sticksHeld: boolean): Promise<void> {
    const wire = this.#wire;
    if (wire === null || this.#now.phase !== "leased") return;
    this.#checkTasksOnly(); // a VTOL may be a wing by now
    this.host.onResetControls();
    this.#set({ phase: "entering", refusal: null, clamped: [], audit: [] });
    this.#startSource();
    const answer = await wire.request({ type: "enter", sticks_held: sticksHeld });
    if (wire !== this.#wire || !this.#is("entering")) return;
    if (answer.type === "done") return this.#set({ phase: "flying", audit: answer.audit });
    this.#sender.stop();
    this.#keepLease(true);
    this.#set({ phase: "leased", refusal: toRefusal(`Take control of ${this.#now.vehicle}`, answer) });
  }

  async leave(to: OffboardExit): Promise<void> {
    const wire = this.#wire;
    if (wire === null || this.#now.phase !== "flying") return;
    this.host.onResetControls();
    this.#set({ phase: "leaving", refusal: null });
    const answer = await wire.request({ type: "leave", to });
    if (wire !== this.#wire) return;
    if (answer.type === "done") return this.#end(EXITED[to], true);
    if (this.#is("leaving")) this.#set({ phase: "flying", refusal: toRefusal(`Exit to ${EXITS[to]}`, answer) });
  }

  /**
   * Let another client take the lease over, in flight too; null withdraws the offer. Nothing changes until it is
   * taken.
   */
  async offerLease(to: string | null): Promise<void> {
    const wire = this.#wire;
    if (wire === null || !(this.#is("leased") || this.#is("flying"))) return;
    const answer = await wire.request({ type: "hand_over_lease", to });
    if (wire !== this.#wire) return;
    const action = to === null ? `Withdraw the offer of ${this.#now.vehicle}` : `Offer ${this.#now.vehicle} to ${to}`;
    this.#set({ refusal: answer.type === "done" ? null : toRefusal(action, answer) });
  }

  /**
   * Send a request to the task queue. Null: it is done; else why it is not. `onQueued` hears the id of a new task
   * first.
   */
  async queue(action: string, frame: QueueRequest, onQueued?: (task_id: string) => void): Promise<Refusal | null> {
    const wire = this.#wire;
    if (wire === null || this.#is("silent")) return controlEnded(action, "control has ended, so nothing was sent");
    const gives = this.#now.source === "controls" && startsTasks(frame, this.#now.tasks);
    if (gives) {
      this.host.onResetControls();
      this.#switchSource("tasks"); // first: a setpoint that came behind would take the vehicle back
    }
    this.#asking += 1;
    const answer = await Promise.race([wire.request(frame), this.#over]);
    if (answer === null || wire !== this.#wire) return controlEnded(action, "control ended before an answer came");
    this.#asking -= 1;
    if (answer.type === "queued") onQueued?.(answer.task_id);
    if (answer.type !== "error") return null;
    if (gives) this.#switchSource("controls");
    return toRefusal(action, answer);
  }

  /** The controls move: they have the vehicle at once, and the queue waits. */
  switchToControls(): void {
    if (this.#now.phase === "flying") this.#switchSource("controls");
  }

  /** Release the lease, or stop asking for it. A vehicle that is flown is told to hold: the socket's end says so. */
  releaseLease(why: ReleaseCause = "asked"): void {
    if (this.#wire !== null)
      this.#end(describeRelease(why, { flown: FLOWN.has(this.#now.phase), vehicle: this.#now.vehicle }), true);
  }

  /** The controls are unattended. */
  unattended(reason: StopReason): void {
    const words = describeStop(reason);
    switch (this.#now.phase) {
      case "flying":
      case "leaving":
        if (this.#now.source === "tasks") break; // no controls: the lease is renewed while the page is visible
        this.#sender.stop();
        this.#set({ phase: "silent", fellSilent: true, ended: words });
        clearTimeout(this.#patience);
        this.#patience = setTimeout(
          () => this.#end(`${words} The service did not answer either: the failsafe of the vehicle acts.`, true),
          SILENT_MS,
        );
        break;
      case "entering":
        if (this.#now.tasksOnly && reason === "focus_lost") break; // no controls are awaited
        // it must not enter a mode in which no pilot flies it
        this.#end(`${words} Entry was cancelled and the lease released.`, true);
        break;
      default:
    }
    if (reason === "page_closed" && this.#wire !== null) this.#end(words, true);
  }

  async #requestLease(wire: OffboardSocket, override: boolean): Promise<void> {
    const answer = await wire.request({ type: "acquire_lease", rate_hz: RATE_HZ, override });
    if (wire !== this.#wire) return;
    if (answer.type === "lease_granted" && this.#now.offboard?.state === "active") return this.#continueFlying();
    if (answer.type === "lease_granted") {
      this.#keepLease(true);
      return this.#set({ phase: "leased" });
    }
    const refusal = toRefusal(`Take the lease of ${this.#now.vehicle}`, answer);
    this.#end("", true);
    this.#set({ refusal });
  }

  /** Taken over in flight: this page must send before the dead-man acts. */
  #continueFlying(): void {
    this.host.onResetControls();
    this.#set({ phase: "flying" });
    this.#startSource();
  }

  #onState(offboard: Offboard): void {
    this.#set({ offboard, answer_ms: this.#sender.answer_ms });
    if (offboard.control_method === "commands") this.#setTasksOnly();
  }

  /** Checked before the sender could ever start. */
  #checkTasksOnly(): void {
    if (!this.host.followsControls()) this.#setTasksOnly();
  }

  /** For as long as this session lasts. */
  #setTasksOnly(): void {
    this.#switchSource("tasks");
    if (!this.#now.tasksOnly) this.#set({ tasksOnly: true });
  }

  /** Only this page gives the queue the vehicle; the service takes it away again. */
  #onTasks(tasks: TaskQueue): void {
    this.#set({ tasks });
    const { state } = tasks.report;
    if (this.#asking === 0 && (state === "idle" || state === "manual")) this.#switchSource("controls");
  }

  #switchSource(source: ControlSource): void {
    if (source === this.#now.source || this.#now.tasksOnly) return;
    this.#set({ source });
    if (ENGAGED.has(this.#now.phase)) this.#startSource();
  }

  /** The controls send all the time; for tasks it is enough that the lease is kept. */
  #startSource(): void {
    const controls = this.#now.source === "controls";
    if (controls) this.#sender.start();
    else this.#sender.stop();
    this.#keepLease(!controls);
  }

  #onSetpointAnswer(answer: ServerAnswer): void {
    if (answer.id !== null) this.#sender.answered(answer.id);
    if (answer.type === "setpoint_ack") {
      if (!sameClamps(answer.clamped, this.#now.clamped))
        this.#set({ clamped: answer.clamped, answer_ms: this.#sender.answer_ms });
    } else if (answer.type === "error" && this.#sender.sending) {
      this.host.onResetControls(); // the same again would be refused again, and count as silence
      this.#set({ refusal: toRefusal("Setpoint", answer) });
    }
  }

  #keepLease(keep: boolean): void {
    clearInterval(this.#renewals);
    if (keep)
      this.#renewals = setInterval(
        () => this.host.isPresent() && void this.#wire?.request({ type: "renew_lease" }),
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
      source: "controls",
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

const EXITS: Readonly<Record<OffboardExit, string>> = { hold: "Hold", mission: "the mission", return: "Return" };

const EXITED: Readonly<Record<OffboardExit, string>> = {
  hold: "You exited to Hold.",
  mission: "You exited to the mission, which continues.",
  return: "You exited to Return.",
};

function sameClamps(one: readonly Clamp[], other: readonly Clamp[]): boolean {
  return JSON.stringify(one) === JSON.stringify(other);
}
