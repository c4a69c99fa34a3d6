/**
 * The service's hints are for programs too and name its calls: on the page, the page's own way to do the same. Pure.
 */

const CALL = /\b(?:GET|POST|PUT|PATCH|DELETE) (\/api\/v1\/[^\s,;:()]*[^\s,;:().])/g;

const WAYS: readonly (readonly [path: RegExp, words: string])[] = [
  [/\/runs\/[^/]+\/(\w+)$/, "“$1” on the panel Run"],
  [/\/job-queues\/[^/]+\/(\w+)$/, "“$1” on the panel Jobs"],
  [/\/(?:jobs|job-queues)$/, "the panel Jobs"],
  [/\/runs$/, "the panel Run"],
  [/\/plans$/, "the panel Plan"],
  [/\/vehicles$/, "the fleet"],
  [/\/docs$/, "the documentation of the API"],
];

/** "pause it first: POST /api/v1/runs/r1/pause" -> "pause it first: “Pause” on the panel Run". */
export function pageWords(text: string): string {
  return text.replace(CALL, (_, path: string) => {
    const way = WAYS.find(([known]) => known.test(path));
    if (way === undefined) return "the API";
    const action = way[0].exec(path)?.[1] ?? "";
    return way[1].replace("$1", action.charAt(0).toUpperCase() + action.slice(1));
  });
}
