// Capture: the frames that a display shows below an object.

import { api, at, frame, lengths, query, say, shortcuts, trying } from "./studio.js";

frame("capture");

const units = lengths(at("unit"), () => {});

// This display's own pixels: nothing is scaled then.
at("width_px").value = Math.round(screen.width * devicePixelRatio);
at("height_px").value = Math.round(screen.height * devicePixelRatio);

/** What the form says; undefined where a field is wrong, which then says so. */
function asked() {
  const width = units.read(at("width"));
  if (!at("display").reportValidity()) return undefined;
  return { width_px: at("width_px").valueAsNumber, height_px: at("height_px").valueAsNumber, width, stripes: at("stripes").checked };
}

function show() {
  const display = asked();
  if (display) open(query("api/capture/show", display), "_blank", "noopener");
}

async function write() {
  const display = asked();
  if (!display) return;
  say("drawing ..");
  await trying(async () => {
    const written = await api("api/capture/write", display);
    say(`saved: open ${written.page} in the browser of the other display`, "good");
  });
}

at("show").addEventListener("click", show);
at("write").addEventListener("click", write);
at("display").addEventListener("submit", (event) => { event.preventDefault(); show(); });
shortcuts([
  ["Enter", "show the frames here, in a new tab", show],
  ["w", "write them into the folder capture", write],
]);
