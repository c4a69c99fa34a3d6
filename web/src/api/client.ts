/** Calls of the REST API, checked against its paths, bodies and answers. Every failure is a ProblemError. */

import { parseProblem, tellsOutcome, unansweredRequest, unreachableProblem, unreadableProblem } from "./problem";
import { forgetKey, requestKey } from "./request-keys";
import type { paths } from "./schema";
import { readToken } from "./token";
import type {
  Attachment,
  ForeignFormat,
  JobRequest,
  JobUpdate,
  JsonSchema,
  PlanDocument,
  RunAction,
  TargetFormat,
  Wind,
} from "./types";

export type VehicleCommand = "hold" | "return" | "land";

export const api = {
  vehicles: async () => (await get("/api/v1/vehicles", {})).vehicles,
  /** The newest first. */
  plans: (older_than: string | null) => get("/api/v1/plans", {}, { limit: 500, older_than }),
  plan: (plan_id: string) => get("/api/v1/plans/{plan_id}", { plan_id }),
  run: (run_id: string) => get("/api/v1/runs/{run_id}", { run_id }),
  comparison: (run_id: string) => get("/api/v1/runs/{run_id}/comparison", { run_id }),
  principal: () => get("/api/v1/principal", {}),
  planSchema: (): Promise<JsonSchema> => get("/api/v1/schemas/plan", {}),
  simulator: () => get("/api/v1/simulator", {}),
  offboard: (vehicle_id: string) => get("/api/v1/vehicles/{vehicle_id}/offboard", { vehicle_id }),
  tasks: (vehicle_id: string) => get("/api/v1/vehicles/{vehicle_id}/tasks", { vehicle_id }),
  /** What an entry into offboard control would find now. Commands nothing. */
  entryCheck: (vehicle_id: string, sticks_held: boolean) =>
    get("/api/v1/vehicles/{vehicle_id}/offboard/entry-check", { vehicle_id }, { sticks_held }),
  /** The delivery report as a page (HTML) to file or print. */
  deliveryReportPage: async (run_id: string) =>
    (await getFile("/api/v1/runs/{run_id}/delivery-report.html", { run_id })).text(),

  attachments: async (run_id: string, item_id: string) =>
    (await get("/api/v1/runs/{run_id}/drops/{item_id}/attachments", { run_id, item_id })).attachments,
  attachmentFile: async (run_id: string, { plan_item_id: item_id, sha256 }: Attachment) =>
    (await getFile("/api/v1/runs/{run_id}/drops/{item_id}/attachments/{sha256}", { run_id, item_id, sha256 })).blob(),
  /** Sending the same file again attaches it once. */
  attach: (run_id: string, item_id: string, name: string, content: File) =>
    postFile("/api/v1/runs/{run_id}/drops/{item_id}/attachments", { run_id, item_id }, { name }, content, content.type),

  /** `wind` null: calm air. */
  checkPlan: (plan: PlanDocument, vehicle: string | null, wind: Wind | null, signal: AbortSignal) =>
    post("/api/v1/plan-checks", {}, { plan, vehicle, wind }, { signal }),
  /** Converts a file of other software into a plan; stores nothing. `name` and `vehicle_type` fill in what it lacks. */
  convertPlan: (content: Blob, query: { format: ForeignFormat } & Query<"/api/v1/plan-conversions", "post">) => {
    const media = query.format === "qgc" ? "application/json" : "application/octet-stream";
    return postFile("/api/v1/plan-conversions", {}, query, content, media);
  },
  /** The documents that a stored plan can be exported as, and what each leaves out. */
  exports: (plan_id: string) => get("/api/v1/plans/{plan_id}/exports", { plan_id }),
  exportFile: async (plan_id: string, format: TargetFormat) =>
    (await getFile(`/api/v1/plans/{plan_id}/exports/${format}`, { plan_id })).blob(),
  createPlan: (plan: PlanDocument) => post("/api/v1/plans", {}, plan, { once: true }),
  createRun: (plan: string, vehicle: string, start: boolean, wind: Wind | null) =>
    post("/api/v1/runs", {}, { plan, vehicle, start, wind }, { once: true }),

  runAction: (run_id: string, action: RunAction) => post(`/api/v1/runs/{run_id}/${action}`, { run_id }, {}),
  /** Continues a flight at a later item of its plan; answers once the vehicle has the rest. */
  skipTo: (run_id: string, continue_at: string) =>
    post("/api/v1/runs/{run_id}/mission", { run_id }, { continue_at }, { once: true }),
  /** Answers the question with this number, and none that comes after it. */
  answerConsent: (run_id: string, item_id: string, grant: boolean, question: number) =>
    post("/api/v1/runs/{run_id}/drops/{item_id}/consent", { run_id, item_id }, { grant, question }),
  vehicleAction: (vehicle_id: string, action: VehicleCommand) =>
    post(`/api/v1/vehicles/{vehicle_id}/${action}`, { vehicle_id }, {}),

  endQuarantine: (vehicle_id: string) => post("/api/v1/vehicles/{vehicle_id}/end-quarantine", { vehicle_id }, {}),

  /** All moving targets that have reported. */
  targets: async () => (await get("/api/v1/targets", {})).targets,
  /** One page of jobs, newest first; `next` begins the next page. */
  jobs: (query: Query<"/api/v1/jobs", "get">) => get("/api/v1/jobs", {}, query),
  /** A job that waits comes with what rules out each vehicle now. */
  job: (job_id: string) => get("/api/v1/jobs/{job_id}", { job_id }),
  jobQueues: () => get("/api/v1/job-queues", {}),
  createJob: (order: JobRequest) => post("/api/v1/jobs", {}, order, { once: true }),
  /** Which vehicle would get the job now. Creates nothing. */
  checkJob: (order: JobRequest, signal: AbortSignal) => post("/api/v1/job-checks", {}, order, { signal }),
  moveJob: (job_id: string, move: JobUpdate) => send("/api/v1/jobs/{job_id}", "patch", { job_id }, move, {}),
  cancelJob: (job_id: string) => post("/api/v1/jobs/{job_id}/cancel", { job_id }, {}),
  clearJobClaim: (job_id: string) => post("/api/v1/jobs/{job_id}/clear-claim", { job_id }, {}),
  resumeJobQueue: async (vehicle_id: string) =>
    (await post("/api/v1/job-queues/{vehicle_id}/resume", { vehicle_id }, {})).queue,

  /** `vehicle` null: all simulated vehicles. */
  setFault: (vehicle: string | null, fault: string, value: unknown) =>
    post("/api/v1/simulator/faults", {}, { vehicle, fault, value } as object),
  setSpeed: (speed: number) => send("/api/v1/simulator/speed", "put", {}, { speed }, {}),
};

type Method = "get" | "post" | "put" | "patch";

/** The paths that have this method. */
type PathOf<M extends Method> = {
  [P in keyof paths]: paths[P][M] extends { responses: unknown } ? P : never;
}[keyof paths];

type Operation<P extends keyof paths, M extends Method> = NonNullable<paths[P][M]>;

type Content<T> = T extends { content: infer C } ? C[keyof C] : never;

/** What a call answers when it succeeds. */
type Answer<P extends keyof paths, M extends Method> =
  Operation<P, M> extends { responses: infer R } ? Content<R[Extract<keyof R, 200 | 201 | 202>]> : never;

/** The names in braces, each with its value. */
type Params<P extends string> = P extends `${string}{${infer Name}}${infer Rest}`
  ? Record<Name, string> & Params<Rest>
  : unknown;

type Query<P extends keyof paths, M extends Method> =
  Operation<P, M> extends { parameters: { query?: infer Q } } ? Partial<NonNullable<Q>> : never;

/** The fields of a body by their names. Objects in it are the caller's: a plan may be half-written. */
type Body<P extends keyof paths, M extends Method> = Loose<Content<NonNullable<RequestBody<Operation<P, M>>>>>;
type RequestBody<O> = O extends { requestBody: infer B } ? B : { content: { none: object } };
type Loose<T> = { readonly [K in keyof T]?: T[K] extends string | number | boolean | null ? T[K] : T[K] | object };

interface SendOptions {
  readonly signal?: AbortSignal;
  /** Adds an Idempotency-Key, so that a request acts once if the network repeats it, or a user after a lost answer. */
  readonly once?: boolean;
}

/** A request as it is sent, and what is to be said if no answer comes. */
interface Outgoing {
  readonly url: string;
  readonly init: RequestInit;
  readonly unanswered: ReturnType<typeof unansweredRequest>;
}

function get<P extends PathOf<"get">>(
  path: P,
  params: Params<P>,
  query: Query<P, "get"> | object = {},
): Promise<Answer<P, "get">> {
  return call(outgoing(path, params, query, { method: "GET" }));
}

/** An answer that is no JSON. */
async function getFile<P extends PathOf<"get">>(path: P, params: Params<P>): Promise<Response> {
  const request = outgoing(path, params, {}, { method: "GET" });
  const answer = await answerTo(request);
  if (!answer.ok) throw parseProblem(answer.status, await answer.json().catch(() => null), request.unanswered);
  return answer;
}

function post<P extends PathOf<"post">>(
  path: P,
  params: Params<P>,
  body: Body<P, "post">,
  options: SendOptions = {},
): Promise<Answer<P, "post">> {
  return send(path, "post", params, body, options);
}

function send<M extends "post" | "put" | "patch", P extends PathOf<M>>(
  path: P,
  method: M,
  params: Params<P>,
  body: Body<P, M>,
  { signal, once = false }: SendOptions,
): Promise<Answer<P, M>> {
  const headers = { "Content-Type": "application/json" };
  const init = { method: method.toUpperCase(), headers, body: JSON.stringify(body), signal: signal ?? null };
  const request = outgoing(path, params, {}, init);
  return once ? callOnce(request) : call(request);
}

function postFile<P extends PathOf<"post">>(
  path: P,
  params: Params<P>,
  query: Query<P, "post">,
  body: Blob,
  media: string,
): Promise<Answer<P, "post">> {
  return call(outgoing(path, params, query, { method: "POST", headers: { "Content-Type": media }, body }));
}

function outgoing(path: string, params: unknown, query: object, init: RequestInit): Outgoing {
  return { url: urlOf(path, params, query), init, unanswered: unansweredRequest(init.method ?? "GET", path) };
}

function urlOf(path: string, params: unknown, query: object): string {
  const values = params as Readonly<Record<string, string>>;
  const filled = path.replace(/\{(\w+)\}/g, (_, name: string) => encodeURIComponent(values[name] ?? ""));
  const given = Object.entries(query).filter(([, value]) => value !== null && value !== undefined);
  return given.length === 0 ? filled : `${filled}?${new URLSearchParams(given.map(([k, v]) => [k, String(v)]))}`;
}

/** With a key that the same request keeps until it is known what came of it. */
async function callOnce<T>(request: Outgoing): Promise<T> {
  const { url, init } = request;
  const name = `${init.method} ${url}\n${init.body}`;
  const headers = { ...init.headers, "Idempotency-Key": requestKey(name) };
  try {
    const answer = await call<T>({ ...request, init: { ...init, headers } });
    forgetKey(name);
    return answer;
  } catch (error) {
    if (tellsOutcome(error)) forgetKey(name);
    throw error;
  }
}

async function call<T>(request: Outgoing): Promise<T> {
  const answer = await answerTo(request);
  const body: unknown = await answer.json().catch(() => null);
  if (answer.ok && body !== null) return body as T;
  if (answer.ok) throw unreadableProblem(answer.status, request.unanswered);
  throw parseProblem(answer.status, body, request.unanswered);
}

async function answerTo({ url, init, unanswered }: Outgoing): Promise<Response> {
  const token = readToken();
  const headers = new Headers(init.headers);
  headers.set("Accept", "application/json, application/problem+json");
  if (token !== null) headers.set("Authorization", `Bearer ${token}`);
  try {
    return await fetch(url, { ...init, headers });
  } catch (error) {
    if (error instanceof DOMException && error.name === "AbortError") throw error;
    throw unreachableProblem(unanswered);
  }
}
