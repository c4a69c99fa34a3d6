/** Icons of the page, drawn with the text colour. Decorative: the text beside them says what they mean. */

import type { VehicleType } from "../api/types";

const PATHS = {
  sun: "M12 4V2M12 22v-2M4 12H2M22 12h-2M6.300 6.300 4.900 4.900M19.100 19.100l-1.400-1.400M6.300 17.700l-1.400 1.400M19.100 4.900l-1.400 1.400M12 8a4 4 0 1 0 0 8 4 4 0 0 0 0-8Z",
  moon: "M20 14.500A8.500 8.500 0 0 1 9.500 4a8.500 8.500 0 1 0 10.500 10.500Z",
  map: "M9 4 3 6.500v13L9 17l6 2.500 6-2.500v-13L15 6.500 9 4Zm0 0v13m6-10.500v13",
  ruler: "M4 16 16 4l4 4L8 20l-4-4Zm4-4 2 2m1-5 2 2m1-5 2 2",
  search: "M10.500 4a6.500 6.500 0 1 0 0 13 6.500 6.500 0 0 0 0-13Zm5 11.500L21 21",
  layers: "M12 4 3 9l9 5 9-5-9-5ZM3 14l9 5 9-5",
  globe: "M12 3a9 9 0 1 0 0 18 9 9 0 0 0 0-18Zm-9 9h18M12 3c5 5 5 13 0 18M12 3c-5 5-5 13 0 18",
  satellite: "M9 9l6 6M12 6l6 6-6 6-6-6 6-6ZM4 8l4-4m8 16 4-4M3 21a6 6 0 0 1 6 0",
  fleet:
    "M12 12 6 6m6 6 6-6m-6 6-6 6m6-6 6 6M6 8.500a2.500 2.500 0 1 0 0-5 2.500 2.500 0 0 0 0 5Zm12 0a2.500 2.500 0 1 0 0-5 2.500 2.500 0 0 0 0 5Zm-12 12a2.500 2.500 0 1 0 0-5 2.500 2.500 0 0 0 0 5Zm12 0a2.500 2.500 0 1 0 0-5 2.500 2.500 0 0 0 0 5Z",
  plan: "M6 20a2 2 0 1 0 0-4 2 2 0 0 0 0 4Zm12-12a2 2 0 1 0 0-4 2 2 0 0 0 0 4ZM8 18h7a3 3 0 0 0 0-6H9a3 3 0 0 1 0-6h7",
  run: "M12 3c4 5 6 8 6 11a6 6 0 0 1-12 0c0-3 2-6 6-11Zm-3 11 3 3 3-3",
  joystick: "M4 15h16v5H4v-5Zm8 0V9m0 0a3 3 0 1 0 0-6 3 3 0 0 0 0 6Z",
  turnLeft: "M8 5 4 9l4 4M4 9h9a6 6 0 0 1 6 6v4",
  turnRight: "m16 5 4 4-4 4m4-4h-9a6 6 0 0 0-6 6v4",
  left: "M19 12H6m6 6-6-6 6-6",
  right: "M5 12h13m-6 6 6-6-6-6",
  gamepad:
    "M7 8h10a5 5 0 0 1 4 8c-1.500 2-3.500 1-4.500-1h-9c-1 2-3 3-4.500 1a5 5 0 0 1 4-8Zm1 2v3m-1.500-1.500h3M16 11.500h.01",
  jobs: "M4 7h16v13H4V7Zm0 5h16M9 7V4h6v3",
  feed: "M4 6h16M4 12h16M4 18h10",
  simulator: "M4 21V10m0-4V3m8 18v-6m0-4V3m8 18v-9m0-4V3M2 6h4M10 11h4m4-3h4",
  up: "M12 19V6m-6 6 6-6 6 6",
  down: "M12 5v13m-6-6 6 6 6-6",
  edit: "M4 20l1-4L16.500 4.500l3 3L8 19l-4 1Zm10.500-13.500 3 3",
  trash: "M5 7h14M9 7V4h6v3M7 7l1 13h8l1-13M10 11v5m4-5v5",
  undo: "M8 5 4 9l4 4M4 9h10a5 5 0 0 1 0 10h-3",
  redo: "m16 5 4 4-4 4m4-4H10a5 5 0 0 0 0 10h3",
  fence: "M5 6l9-2 6 7-4 9-11-3Z",
  keepOut: "M5 6l9-2 6 7-4 9-11-3ZM9 15l6-6",
  circle: "M12 4a8 8 0 1 0 0 16 8 8 0 0 0 0-16Z",
  keepOutCircle: "M12 4a8 8 0 1 0 0 16 8 8 0 0 0 0-16ZM6.500 17.500l11-11",
  rally: "M6 21V4m0 1h11l-3 4 3 4H6",
  store: "M4 6c0-3 16-3 16 0v12c0 3-16 3-16 0ZM4 6c0 3 16 3 16 0M4 12c0 3 16 3 16 0",
  save: "M12 4v11m-5-5 5 5 5-5M5 20h14",
  plus: "M12 5v14M5 12h14",
  minus: "M5 12h14",
  fit: "M4 9V4h5M20 9V4h-5M4 15v5h5M20 15v5h-5",
  segment: "M5 19 19 5M5 21a2 2 0 1 0 0-4 2 2 0 0 0 0 4ZM19 7a2 2 0 1 0 0-4 2 2 0 0 0 0 4Z",
  follow: "M12 8a4 4 0 1 0 0 8 4 4 0 0 0 0-8Zm0-6v4m0 12v4M2 12h4m12 0h4",
  close: "M6 6l12 12M18 6 6 18",
  battery: "M3 8h15v8H3V8Zm18 3v2",
  link: "M5 13a10 10 0 0 1 14 0M8.500 16.500a5 5 0 0 1 7 0M12 20h.01",
  warning: "M12 4 2.500 20h19L12 4Zm0 6v4m0 3h.01",
  error: "M12 3a9 9 0 1 0 0 18 9 9 0 0 0 0-18Zm0 5v5m0 3h.01",
  check: "M5 12.500 10 17.500 19 7",
  attach:
    "M20 11.500 12 19.500a5 5 0 0 1-7-7l8.500-8.500a3.300 3.300 0 0 1 4.700 4.700L9.800 17a1.600 1.600 0 0 1-2.300-2.300l7.500-7.500",
  file: "M14 3H6v18h12V7l-4-4Zm0 0v4h4",
} as const;

export type IconName = keyof typeof PATHS;

/** Icons grow with the text beside them; sizes are in pixels of a laptop's 15 px text. */
function rem(size_px: number): string {
  return `${size_px / 15}rem`;
}

export function Icon({ name, size = 18 }: { name: IconName; size?: number }) {
  return (
    <svg class="icon" width={rem(size)} height={rem(size)} viewBox="0 0 24 24" aria-hidden="true">
      <path d={PATHS[name]} />
    </svg>
  );
}

const VEHICLES: Readonly<Record<VehicleType, string>> = {
  multicopter: PATHS.fleet,
  fixed_wing:
    "M12 2.500c1 0 1.500 2 1.500 5l8 5v2l-8-2-.5 5.500 3 2v1.500l-4-1-4 1v-1.500l3-2-.5-5.500-8 2v-2l8-5c0-3 .5-5 1.500-5Z",
  vtol: "M12 2.500c1 0 1.500 2 1.500 5l7 2.500v2l-7-.5-.5 6 3 2v1.500l-4-1-4 1v-1.500l3-2-.5-6-7 .5v-2l7-2.500c0-3 .5-5 1.500-5ZM5 6.500a2 2 0 1 0 0-4M19 6.500a2 2 0 1 1 0-4",
  rover:
    "M4 15V9h9l4 3h3v3M7 18a2.500 2.500 0 1 0 0-5 2.500 2.500 0 0 0 0 5Zm10 0a2.500 2.500 0 1 0 0-5 2.500 2.500 0 0 0 0 5Z",
  airship: "M3 10c3-5 13-5 16-1l2-2v7l-2-2c-3 4-13 4-16-2Zm6 5v3h5v-3",
};

export function VehicleIcon({ type, size = 22 }: { type: VehicleType | null; size?: number }) {
  return (
    <svg class="icon" width={rem(size)} height={rem(size)} viewBox="0 0 24 24" aria-hidden="true">
      <path d={type === null ? PATHS.error : (VEHICLES[type] ?? PATHS.error)} />
    </svg>
  );
}

/** Waydrop's mark: a drop with the way down in it. */
export function Logo() {
  return (
    <svg class="mark" width="1.75rem" height="1.75rem" viewBox="0 0 32 32" aria-hidden="true">
      <path
        class="mark-drop"
        d="M16 3.500c5.300 6.400 8.300 11 8.300 15.100a8.300 8.300 0 0 1-16.600 0C7.700 14.500 10.700 9.900 16 3.500Z"
      />
      <path class="mark-way" d="m12 18.500 4 4 4-4" />
    </svg>
  );
}
