/** Calls of the REST API. Every failure is a ProblemError. */

import { ProblemError, problemFrom, unreachable } from "./problem";
import { readToken } from "./token";
import type {
  Attachment,
  Comparison,
  EntryCheck,
  ForeignFormat,
  Job,
  JobQueue,
  JobQueues,
  JsonSchema,
  OffboardDetail,
  PlanCheck,
  PlanConversion,
  PlanDocument,
  PlanExports,
  PlanHead,
  Principal,
  Run,
  RunAction,
  SimulatorSpeed,
  SimulatorView,
  StoredPlan,
  Target,
  TargetFormat,
  TaskQueue,
  Vehicle,
  VehicleType,
  Wind,
} from "./types";

const BASE = "/api/v1";

export const api = {
  vehicles: async (): Promise<Vehicle[]> => (await get<{ vehicles: Vehicle[] }>("/vehicles")).vehicles,
  plans: async (): Promise<PlanHead[]> => (await get<{ plans: PlanHead[] }>("/plans")).plans,
  plan: (id: string): Promise<StoredPlan> => get(`/plans/${encodeURIComponent(id)}`),
  run: (id: string): Promise<Run> => get(`/runs/${encodeURIComponent(id)}`),
  comparison: (run: string): Promise<Comparison> => get(`/runs/${encodeURIComponent(run)}/comparison`),
  principal: (): Promise<Principal> => get("/principal"),
  planSchema: (): Promise<JsonSchema> => get("/schemas/plan"),
  simulator: (): Promise<SimulatorView> => get("/simulator"),
  offboard: (vehicle: string): Promise<OffboardDetail> => get(`/vehicles/${encodeURIComponent(vehicle)}/offboard`),
  tasks: (vehicle: string): Promise<TaskQueue> => get(`/vehicles/${encodeURIComponent(vehicle)}/tasks`),
  /** What an entry into offboard control would find now; nothing is commanded. */
  entryCheck: (vehicle: string, sticksHeld: boolean): Promise<EntryCheck> =>
    get(`/vehicles/${encodeURIComponent(vehicle)}/offboard/entry-check?sticks_held=${sticksHeld}`),
  /** The delivery report as a page (HTML) to file or print. */
  deliveryReportPage: async (run: string): Promise<string> =>
    (await file(`/runs/${encodeURIComponent(run)}/delivery-report.html`)).text(),
  attachments: async (run: string, drop: string): Promise<Attachment[]> =>
    (await get<{ attachments: Attachment[] }>(attachmentsOf(run, drop))).attachments,
  attachmentFile: async (run: string, { plan_item_id: drop, sha256 }: Attachment): Promise<Blob> =>
    (await file(`${attachmentsOf(run, drop)}/${sha256}`)).blob(),
  /** The same file is attached once, however often it is sent. */
  attach: (run: string, drop: string, name: string, content: File): Promise<Attachment> =>
    call(`${attachmentsOf(run, drop)}?name=${encodeURIComponent(name)}`, {
      method: "POST",
      headers: { "Content-Type": content.type },
      body: content,
    }),

  /** `wind` null: calm air. */
  checkPlan: (plan: PlanDocument, vehicle: string | null, wind: Wind | null, signal: AbortSignal): Promise<PlanCheck> =>
    send("/plan-checks", { plan, vehicle, wind }, { signal }),
  /** A file of other software as a plan; `name` and `vehicleType` count where it says none. Nothing is stored. */
  convertPlan: (
    content: Blob,
    format: ForeignFormat,
    name: string,
    vehicleType: VehicleType | null,
  ): Promise<PlanConversion> => {
    const query = new URLSearchParams({ format, name, ...(vehicleType === null ? {} : { vehicle_type: vehicleType }) });
    const media = format === "qgc" ? "application/json" : "application/octet-stream";
    return call(`/plan-conversions?${query}`, { method: "POST", headers: { "Content-Type": media }, body: content });
  },
  /** Which documents a stored plan can be had as, and what each leaves out. */
  exports: (plan: string): Promise<PlanExports> => get(`/plans/${encodeURIComponent(plan)}/exports`),
  exportFile: async (plan: string, format: TargetFormat): Promise<Blob> =>
    (await file(`/plans/${encodeURIComponent(plan)}/exports/${format}`)).blob(),
  createPlan: (plan: PlanDocument): Promise<StoredPlan> => send("/plans", plan, { once: true }),
  createRun: (plan: string, vehicle: string, start: boolean, wind: Wind | null): Promise<Run> =>
    send("/runs", { plan, vehicle, start, wind }, { once: true }),

  runAction: (id: string, action: RunAction): Promise<Run> => send(`/runs/${encodeURIComponent(id)}/${action}`, {}, {}),
  /** A flight goes on with a later item of its plan: answered once the vehicle has the rest. */
  skipTo: (id: string, item: string): Promise<Run> =>
    send(`/runs/${encodeURIComponent(id)}/mission`, { continue_at: item }, { once: true }),
  /** `question` is the number of the question that is answered: none that comes after it. */
  answerConsent: (run: string, drop: string, grant: boolean, question: number): Promise<Run> =>
    send(`/runs/${encodeURIComponent(run)}/drops/${encodeURIComponent(drop)}/consent`, { grant, question }, {}),
  vehicleAction: (id: string, action: "hold" | "return" | "land"): Promise<unknown> =>
    send(`/vehicles/${encodeURIComponent(id)}/${action}`, {}, {}),
  /** Every moving target that has reported. */
  targets: async (): Promise<Target[]> => (await get<{ targets: Target[] }>("/targets")).targets,
  /** One page of jobs, newest first; `next` begins the one behind it. */
  jobs: (query: Readonly<Record<string, string>>): Promise<{ jobs: Job[]; next: string | null }> =>
    get(`/jobs?${new URLSearchParams(query)}`),
  /** Of one that waits with what speaks against each vehicle now. */
  job: (id: string): Promise<Job> => get(`/jobs/${encodeURIComponent(id)}`),
  jobQueues: (): Promise<JobQueues> => get("/job-queues"),
  cancelJob: (id: string): Promise<Job> => send(`/jobs/${encodeURIComponent(id)}/cancel`, {}, {}),
  resumeJobQueue: async (vehicle: string): Promise<JobQueue> =>
    (await send<{ queue: JobQueue }>(`/job-queues/${encodeURIComponent(vehicle)}/resume`, {}, {})).queue,
  /** `vehicle` null: all simulated vehicles. */
  setFault: (vehicle: string | null, fault: string, value: unknown): Promise<unknown> =>
    send("/simulator/faults", { vehicle, fault, value }, {}),
  setSpeed: (speed: number): Promise<SimulatorSpeed> => send("/simulator/speed", { speed }, { method: "PUT" }),
};

interface SendOptions {
  method?: "POST" | "PUT" | "PATCH";
  signal?: AbortSignal;
  /** Goes with an Idempotency-Key, so that a repeat by the network is not done twice. */
  once?: boolean;
}

function attachmentsOf(run: string, drop: string): string {
  return `/runs/${encodeURIComponent(run)}/drops/${encodeURIComponent(drop)}/attachments`;
}

/** An answer that is no JSON. */
async function file(path: string): Promise<Response> {
  const answer = await answerTo(path, { method: "GET" });
  if (!answer.ok) throw problemFrom(answer.status, await answer.json().catch(() => null));
  return answer;
}

function get<T>(path: string): Promise<T> {
  return call<T>(path, { method: "GET" });
}

function send<T>(path: string, body: unknown, { method = "POST", signal, once = false }: SendOptions): Promise<T> {
  const headers: Record<string, string> = { "Content-Type": "application/json" };
  if (once) headers["Idempotency-Key"] = randomKey();
  return call<T>(path, { method, headers, body: JSON.stringify(body), signal: signal ?? null });
}

async function call<T>(path: string, init: RequestInit): Promise<T> {
  const answer = await answerTo(path, init);
  const body: unknown = await answer.json().catch(() => null);
  if (answer.ok && body !== null) return body as T;
  if (answer.ok)
    throw new ProblemError(answer.status, "answer.unreadable", "The service's answer cannot be read", "", "", []);
  throw problemFrom(answer.status, body);
}

async function answerTo(path: string, init: RequestInit): Promise<Response> {
  const token = readToken();
  const headers = new Headers(init.headers);
  headers.set("Accept", "application/json, application/problem+json");
  if (token !== null) headers.set("Authorization", `Bearer ${token}`);
  try {
    return await fetch(BASE + path, { ...init, headers });
  } catch (error) {
    if (error instanceof DOMException && error.name === "AbortError") throw error;
    throw unreachable();
  }
}

/** 128 random bits. crypto.randomUUID would need https where the service is not on this machine. */
function randomKey(): string {
  return Array.from(crypto.getRandomValues(new Uint8Array(16)), (byte) => byte.toString(16).padStart(2, "0")).join("");
}
