/** The map that is configured for this page; it never changes while the page is open. */

import { tilesOf } from "../map/tiles";

export const tiles = tilesOf((name) => document.querySelector<HTMLMetaElement>(`meta[name="${name}"]`)?.content ?? null, location.origin);
