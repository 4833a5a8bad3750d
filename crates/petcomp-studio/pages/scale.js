// Scale: the two ends of a ruler, or the corners of the screen, and a photo has its pixels per metre.

import { api, at, element, frame, lengths, query, saveOrAsk, say, shortcuts, trying } from "./studio.js";
import { INK, PhotoView, loaded, viewKeys } from "./photo_view.js";
import { photoList } from "./photo_list.js";

frame("scale");

/** What is clicked, by what is known: a length between two points, or the size of the screen. */
const MODES = {
  ruler: { points: 2, hints: ["Click one end of a length that you know: a ruler, or the object itself.", "Click its other end."] },
  screen: { points: 4, hints: ["top left", "top right", "bottom right", "bottom left"].map((corner) => `Click the ${corner} corner of the screen.`) },
};

let mode = "ruler";
/** The photo on the stage, and what its list says: { photo, list, version, entry }. */
let open = null;
/** How many photos were asked for: what comes of all but the last is dropped. */
let asked = 0;
const points = { ruler: [], screen: [] };
const units = lengths(at("unit"), () => setMode(mode));
const sides = { width: null, height: null };

const view = new PhotoView(at("stage"), {
  click: addPoint,
  move: showFacts,
  moved: showFacts,
  draw: drawLines,
});

const list = photoList(at("photos"), show, (entry) => (entry.scaled ? ["scale", "good"] : ["", ""]));

async function show(photo) {
  asked += 1;
  const number = asked;
  const state = await trying(() => api(query("api/scale/photo", { photo })));
  const picture = state && await trying(() => loaded(photo));
  if (number !== asked) return;
  // Where one of them cannot be read, nothing of another photo is left that could be saved.
  open = picture ? { photo, ...state } : null;
  view.show(picture);
  history.replaceState(null, "", query("scale", { photo }));
  document.title = `${photo.split("/").pop()} · Scale`;
  at("title").textContent = photo.split("/").pop();
  list.choose(photo);
  [points.ruler, points.screen] = [[], []];
  takeOver(open?.entry ?? {});
  at("new").hidden = !open || Boolean(open.entry);
  at("asset").value = photo.split("/").pop().replace(/\.[^.]*$/, "");
  setMode(mode);
}

/** What the list says already. */
function takeOver(entry) {
  if (!entry.screen_corners) return;
  points.screen = entry.screen_corners;
  [sides.width, sides.height] = entry.screen_size;
  mode = "screen";
}

function setMode(next) {
  mode = next;
  for (const name of Object.keys(MODES)) at(name).setAttribute("aria-pressed", String(name === mode));
  at("first").textContent = mode === "ruler" ? "Length between them" : "Width of the screen";
  at("second").hidden = mode === "ruler";
  units.show(at("width"), sides.width);
  units.show(at("height"), sides.height);
  view.setPoints(points[mode], -1);
  showFacts();
}

function addPoint(px) {
  if (!open || points[mode].length >= MODES[mode].points) return;
  points[mode].push(px);
  view.setPoints(points[mode], points[mode].length - 1);
  showFacts();
}

function removePoint() {
  points[mode].splice(view.chosen >= 0 ? view.chosen : -1, 1);
  view.setPoints(points[mode], -1);
  showFacts();
}

async function findScreen() {
  if (!open) return;
  const here = open;
  say("looking for the screen ...");
  await trying(async () => {
    const { corners_px: corners } = await api("api/scale/screen", { photo: here.photo });
    if (open !== here) return;
    points.screen = corners;
    setMode("screen");
    say("found the screen", "good");
  });
}

// Pixels per metre.

const distance = (a, b) => Math.hypot(a[0] - b[0], a[1] - b[1]);

/** The scale; null where something is missing. */
function scaleNow() {
  const { width, height } = sides;
  const clicked = points[mode];
  if (clicked.length < MODES[mode].points || !width) return null;
  if (mode === "ruler") return { px_per_metre: distance(...clicked) / width };
  return height ? { screen: [[width, height], clicked] } : null;
}

/** Pixels per metre in the middle of a quadrangle, by its homography (Heckbert 1989): of an area, its root. */
function middleScale([[a, b], [c, d], [e, f], [g, h]], [width, height]) {
  const [dx1, dx2, sx] = [c - e, g - e, a - c + e - g];
  const [dy1, dy2, sy] = [d - f, h - f, b - d + f - h];
  const det = dx1 * dy2 - dx2 * dy1;
  const [p, q] = [(sx * dy2 - dx2 * sy) / det, (dx1 * sy - sx * dy1) / det];
  const w = 1 + p / 2 + q / 2;
  const [x, y] = [(a + (c - a + p * c) / 2 + (g - a + q * g) / 2) / w, (b + (d - b + p * d) / 2 + (h - b + q * h) / 2) / w];
  const [xu, yu] = [(c - a + p * c - p * x) / w, (d - b + p * d - p * y) / w];
  const [xv, yv] = [(g - a + q * g - q * x) / w, (h - b + q * h - q * y) / w];
  return Math.sqrt(Math.abs(xu * yv - xv * yu) / (width * height));
}

function facts(scale) {
  if (mode === "ruler") {
    const length = distance(...points.ruler);
    // Each end is clicked to about half a pixel.
    const error = 100 * Math.SQRT1_2 / length;
    return [["Pixels per metre", scale.px_per_metre.toFixed(1)], ["Clicked", `${length.toFixed(1)} px`], ["If each end is 0.5 px off", `± ${error.toFixed(2)} %`]];
  }
  return [["Pixels per metre, at its centre", middleScale(points.screen, scale.screen[0]).toFixed(1)]];
}

const ADVICE = {
  ruler: "It is valid at the height of the clicked points: lay the ruler on something half as high as the object.",
  screen: "The object's scale is taken at half its thickness above the screen.",
};

function showFacts() {
  const scale = open && scaleNow();
  const rows = scale ? facts(scale) : [];
  at("facts").replaceChildren(...rows.flatMap(([term, text]) => [element("dt", {}, term), element("dd", {}, text)]));
  at("advice").replaceChildren(element("li", {}, scale ? ADVICE[mode] : "Click the points and type the known size to see the scale."));
  const hint = MODES[mode].hints[points[mode].length] ?? "Drag a point, or choose one and press the arrow keys.";
  at("hint").textContent = open ? hint : "Choose another photo.";
  at("save").disabled = !scale;
  view.draw();
}

function drawLines() {
  const line = mode === "screen" && points.screen.length === 4 ? [...points.screen, points.screen[0]] : points[mode];
  if (line.length > 1) view.line(line, INK.rectangle, 2);
  if (mode === "ruler" && line.length === 2 && sides.width) {
    view.word(units.shown(sides.width), [(line[0][0] + line[1][0]) / 2, (line[0][1] + line[1][1]) / 2]);
  }
}

async function save() {
  const scale = scaleNow();
  if (!open || open.isSaving || !scale) return;
  const here = open;
  here.isSaving = true;
  await trying(async () => {
    const { photo } = here;
    const asked = { photo, scale, asset: at("asset").value, class: at("class").value };
    const saved = await saveOrAsk(here.version, {
      save: (version) => api("api/scale/save", { ...asked, version }),
      now: async () => (await api(query("api/scale/photo", { photo }))).version,
      load: () => show(photo),
    });
    if (!saved) return;
    Object.assign(here, saved);
    list.entryOf(photo).scaled = true;
    list.showMarks();
    say(`saved in ${saved.list}`, "good");
    if (open === here) list.next((entry) => !entry.scaled);
  });
  here.isSaving = false;
}

for (const id of ["width", "height"]) {
  at(id).addEventListener("input", () => {
    sides[id] = units.read(at(id));
    showFacts();
  });
}
at("ruler").addEventListener("click", () => setMode("ruler"));
at("screen").addEventListener("click", () => setMode("screen"));
at("find").addEventListener("click", findScreen);
at("panel").addEventListener("submit", (event) => {
  event.preventDefault();
  save();
});

shortcuts([
  ["Enter", "save and go to the next photo", save],
  ["l", "a length", () => setMode("ruler")],
  ["c", "the corners of the screen", () => setMode("screen")],
  ["m", "find the screen", findScreen],
  ["g", "type the length", () => at("width").select()],
  ["Delete", "remove the point", removePoint],
  ["Backspace", "", removePoint],
  ["n", "next photo", () => list.step(1)],
  ["p", "previous photo", () => list.step(-1)],
  ...viewKeys(view),
]);

await trying(async () => list.fill(await api("api/scale/photos"), (entry) => !entry.scaled));
