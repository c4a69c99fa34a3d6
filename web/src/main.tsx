import { render } from "preact";
import "maplibre-gl/dist/maplibre-gl.css";
import "./styles/index.css";
import { App } from "./app";
import { startClock } from "./state/clock";
import { watchDraft } from "./state/draft";
import { keepDraftText } from "./state/draft-text";
import { watchEditor } from "./state/editor";
import { watchPlanSchema } from "./state/plan-schema";
import { keepSelectionInAddress } from "./state/selection";
import { watchPrincipal } from "./state/principal";
import { watchSimulator } from "./state/simulator";
import { startSync } from "./state/sync";
import { applyTheme } from "./state/theme";

const root = document.getElementById("app");
if (root === null) throw new Error("index.html has no #app");

applyTheme();
keepSelectionInAddress();
startClock();
keepDraftText();
watchDraft();
watchEditor();
render(<App />, root);
startSync();
watchPrincipal();
watchSimulator();
watchPlanSchema();
