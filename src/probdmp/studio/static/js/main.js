// Each part of the page listens to the bus; the connection comes last, when everybody listens.

import { startBands } from "./bands.js";
import { startBoard } from "./board.js";
import { on } from "./bus.js";
import { startCommands } from "./commands.js";
import { startConnection } from "./connection.js";
import { startFiles } from "./files.js";
import { startHint } from "./hint.js";
import { startLibrary } from "./library.js";
import { startModes } from "./modes.js";
import { startPaper } from "./paper.js";
import { lastFrame, startPlaying } from "./playing.js";
import { startReplay } from "./replay.js";
import { startSettings } from "./settings.js";
import { startStreams, tallied } from "./streams.js";
import { startTabs } from "./tabs.js";
import { startTask } from "./task.js";
import { startTeaching } from "./teaching.js";
import { startToast } from "./toast.js";
import { startVerdict } from "./verdict.js";

for (const start of [
  startTabs, startModes, startPaper, startBoard, startTeaching, startTask, startPlaying, startBands, startStreams, startVerdict,
  startLibrary, startReplay, startSettings, startFiles, startCommands, startHint, startToast, startConnection,
]) start();

// For benchmarks/studio.py and the tests in a browser.
window.studio = { lastFrame, on, tallied };
