// Corners: four clicks on a photo become a label, and its camera is seen at once.

import { api, at, choice, element, frame, lengths, query, saveOrAsk, say, shortcuts, trying } from "./studio.js";
import { photoList } from "./photo_list.js";
import { INK, PhotoView, loaded, viewKeys } from "./photo_view.js";

frame("corners");

const NAMES = ["top left", "top right", "bottom right", "bottom left"];

/** What was changed and is not saved, by photo. */
const drafts = new Map();
/**
 * The photo on the stage: { photo, label, version, corners, wantsFirst, history, camera, markers, lensSigma, changes, saving }.
 * `wantsFirst` where the first corner was removed, and the next click is it.
 * `lensSigma` is the error of the lens's height as the file states it, `changes` counts what was changed here.
 */
let open = null;
/** How many photos were asked for: what comes of all but the last is dropped. */
let asked = 0;
/** The photo that was saved last: new labels begin like its. */
let last = null;

const view = new PhotoView(at("stage"), {
  click: addCorner,
  move: () => changed(false),
  moved: () => changed(true),
  choose: showHint,
  draw: drawCamera,
});

// Photos.

const list = photoList(at("photos"), show, mark);
const { entries: photos, entryOf } = list;
const units = lengths(at("unit"), () => open && showFields());

function mark(entry) {
  if (drafts.has(entry.photo)) return ["not saved", "warn"];
  if (entry.camera) return ["camera", "good"];
  return entry.label ? ["label, no camera", "warn"] : ["", ""];
}

function showMarks() {
  list.showMarks();
  at("joint").disabled = photos.filter((entry) => entry.label).length < 2;
}

async function show(photo) {
  asked += 1;
  const number = asked;
  const state = drafts.get(photo) ?? await load(photo);
  const image = state && await trying(() => photoOf(state));
  if (number !== asked) return;
  history.replaceState(null, "", query("corners", { photo }));
  document.title = `${photo.split("/").pop()} · Corners`;
  at("title").textContent = photo.split("/").pop();
  list.choose(photo);
  if (image) showOpened(state, image);
  else showNothing();
}

/** The photo of a label; null where this browser shows it in another size: clicks on that would lie elsewhere. */
async function photoOf({ photo, label }) {
  const image = await loaded(photo);
  const [shown, expected] = [[image.naturalWidth, image.naturalHeight], [label.image.width, label.image.height]];
  if (String(shown) === String(expected)) return image;
  say(`${photo}: ${shown.join(" x ")} pixels in this browser, expected ${expected.join(" x ")} as in its label`, "bad");
  return null;
}

function showOpened(state, image) {
  open = state;
  view.show(image);
  view.setPoints(open.corners, -1);
  showFields();
  showMarks();
  showHint();
  solve();
  if (open.label.markers && !open.version) findMarkers();
}

/** Where a photo or its label cannot be read, nothing of another one is left that could be saved. */
function showNothing() {
  open = null;
  view.show(null);
  view.setPoints([], -1);
  for (const id of Object.keys(LENGTHS)) units.show(at(id), null);
  for (const id of ["surface", "camera", "cropped"]) at(id).value = "";
  for (const id of ["facts", "advice"]) at(id).replaceChildren();
  for (const id of ["snap", "turn", "undo", "save"]) at(id).disabled = true;
  at("hint").textContent = "Choose another photo.";
}

/** The label that a new one begins like: that of the last photo that was saved, or the nearest one in the list. */
function likeOf(photo) {
  const here = photos.indexOf(entryOf(photo));
  const labelled = photos.filter((entry) => entry.label && entry.photo !== photo);
  const distance = (entry) => Math.abs(photos.indexOf(entry) - here);
  return last ?? labelled.sort((a, b) => distance(a) - distance(b))[0]?.photo;
}

async function load(photo) {
  const like = entryOf(photo)?.label ? null : likeOf(photo);
  return trying(async () => {
    const { label, version, remark } = await api(query("api/corners/label", { photo, like }));
    if (remark) say(`${remark}: the label of ${photo} starts without it`, "bad");
    return {
      photo, label, version, corners: fromLabel(label), wantsFirst: false, history: [], camera: null, markers: [],
      lensSigma: statedSigma(label.camera), changes: 0, saving: false,
    };
  });
}

// The label, and its corners in our convention: 0 is the edge of the picture.

const originOf = (label) => (label.pixel_origin === "center" ? 0.5 : 0);

function fromLabel(label) {
  return (label.surface.corners_px ?? []).map(([x, y]) => [x + originOf(label), y + originOf(label)]);
}

const rounded = (value) => Math.round(value * 100) / 100;

function labelOf(state) {
  const label = structuredClone(state.label);
  const origin = originOf(label);
  if (state.corners.length === 4) {
    label.surface.corners_px = state.corners.map(([x, y]) => [rounded(x - origin), rounded(y - origin)]);
    label.surface.source ??= "manual";
  } else {
    delete label.surface.corners_px;
  }
  return label;
}

function remember() {
  open.history.push({ corners: open.corners.map((corner) => [...corner]), wantsFirst: open.wantsFirst });
}

/** What was changed since is not saved, however late the answers to what was asked before. */
function keep(state) {
  state.changes += 1;
  if (drafts.get(state.photo) === state) return;
  drafts.set(state.photo, state);
  showMarks();
}

function changed(finished) {
  keep(open);
  if (finished) remember();
  solve();
}

function setCorners(corners, chosen) {
  open.corners = corners;
  view.setPoints(corners, chosen);
  changed(true);
  showHint();
}

/** A click: the next corner; near a corner of a marker, that one. */
function addCorner(px) {
  if (!open || open.corners.length === 4) return;
  const near = open.markers.flatMap((marker) => marker.corners_px)
    .find((corner) => Math.hypot(corner[0] - px[0], corner[1] - px[1]) * view.zoom < 8);
  const corner = near ? [...near] : px;
  const corners = open.wantsFirst ? [corner, ...open.corners] : [...open.corners, corner];
  open.wantsFirst = false;
  const sorted = corners.length === 4 ? clockwise(corners) : corners;
  setCorners(sorted, sorted.indexOf(corner));
}

/** Corners in the order around their middle, from the first one on. */
function clockwise(corners) {
  const middle = [0, 1].map((i) => corners.reduce((sum, corner) => sum + corner[i], 0) / corners.length);
  const angle = ([x, y]) => Math.atan2(y - middle[1], x - middle[0]);
  const first = angle(corners[0]);
  const turn = (corner) => (angle(corner) - first + 4 * Math.PI) % (2 * Math.PI);
  return [corners[0], ...corners.slice(1).sort((a, b) => turn(a) - turn(b))];
}

function undo() {
  if (!open?.history.length) return;
  open.history.pop();
  const before = open.history.at(-1) ?? { corners: fromLabel(open.label), wantsFirst: false };
  open.corners = before.corners.map((corner) => [...corner]);
  open.wantsFirst = before.wantsFirst;
  view.setPoints(open.corners);
  changed(false);
  showHint();
}

function removeCorner() {
  if (!open?.corners.length) return;
  const i = view.chosen >= 0 ? view.chosen : open.corners.length - 1;
  open.wantsFirst = open.corners.length > 1 && (open.wantsFirst || i === 0);
  setCorners(open.corners.filter((_, k) => k !== i), -1);
}

/** The next corner becomes the first: the side that is the width becomes the height. */
function turn() {
  if (open?.corners.length === 4) setCorners([...open.corners.slice(1), open.corners[0]], view.chosen);
}

async function snap() {
  if (open?.corners.length !== 4) return;
  const here = open;
  const before = String(here.corners);
  say("looking for edges ...");
  await trying(async () => {
    const snapped = await api("api/corners/snap", { photo: here.photo, corners_px: here.corners });
    if (open !== here) return;
    if (String(here.corners) !== before) {
      say("the corners moved in the meantime and were kept: press S to snap them again");
      return;
    }
    const found = snapped.found.filter(Boolean).length;
    setCorners(snapped.corners_px, view.chosen);
    say(found === 4 ? "all four sides lie on edges" : `${found} of 4 sides show an edge; the others were kept`, found === 4 ? "good" : "");
  });
}

async function findMarkers() {
  if (!open) return;
  const here = open;
  say("looking for markers ...");
  await trying(async () => {
    const { markers, label } = await api("api/corners/markers", { photo: here.photo, label: labelOf(here) });
    here.markers = markers;
    if (label) {
      here.label.points = label.points;
      keep(here);
    }
    if (open !== here) return;
    const known = label ? `, ${label.points.length} corners with known positions` : markers.length ? "; click near a marker corner to use it" : "";
    say(`${markers.length} ${markers.length === 1 ? "marker" : "markers"}${known}`, markers.length ? "good" : "");
    showMarks();
    view.draw();
    solve();
  });
}

// Fields.

/** Lengths by the fields that show them: how to read and write each in a label. */
const LENGTHS = {
  width: [(label) => label.surface.width_m, (label, value) => set(label.surface, "width_m", value)],
  height: [(label) => label.surface.height_m, (label, value) => set(label.surface, "height_m", value)],
  lens: [(label) => label.camera.height_m, setLens],
  wall: [(label) => label.surface.wall?.height_m, setWall],
};

function set(table, key, value) {
  if (value === null || value === "") delete table[key];
  else table[key] = value;
}

/** A tape's height is known to 3 %, as the doctor takes it, unless the label says otherwise. */
const tapeSigma = (height) => rounded(3 * height) / 100;

/** What a label says of the error of the lens's height, beyond what this page writes there. */
function statedSigma({ height_m: height, height_sigma_m: sigma }) {
  return sigma === tapeSigma(height) ? undefined : sigma;
}

function setLens(label, value) {
  set(label.camera, "height_m", value);
  set(label.camera, "height_sigma_m", value === null ? null : open.lensSigma ?? tapeSigma(value));
}

/** Their slope is not typed here, and stays. */
function setWall(label, value) {
  const wall = { ...label.surface.wall };
  set(wall, "height_m", value);
  set(label.surface, "wall", Object.keys(wall).length ? wall : null);
}

function showFields() {
  const { label } = open;
  for (const [id, [read]] of Object.entries(LENGTHS)) units.show(at(id), read(label));
  at("surface").value = label.surface.id;
  at("camera").value = label.camera.id ?? "";
  at("cropped").value = label.image.cropped === undefined ? "" : String(label.image.cropped);
}

function readLength(id) {
  const value = units.read(at(id));
  if (value === undefined || !open) return;
  LENGTHS[id][1](open.label, value);
  changed(false);
}

for (const id of Object.keys(LENGTHS)) at(id).addEventListener("input", () => readLength(id));
at("surface").addEventListener("input", () => edit((label) => { label.surface.id = at("surface").value || "surface"; }));
at("camera").addEventListener("input", () => edit((label) => set(label.camera, "id", at("camera").value)));
at("cropped").addEventListener("change", () => edit((label) => set(label.image, "cropped", at("cropped").value && at("cropped").value === "true")));

function edit(change) {
  if (!open) return;
  change(open.label);
  changed(false);
}

// The camera, solved anew while corners move: one request at a time, the last state always.

let solving = false;
let again = false;

async function solve() {
  if (solving) {
    again = true;
    return;
  }
  solving = true;
  do {
    again = false;
    await solveOnce();
  } while (again);
  solving = false;
}

async function solveOnce() {
  const here = open;
  if (!here) return;
  if (!isComplete()) {
    here.camera = null;
    showCamera(missing());
    return;
  }
  try {
    here.camera = await api("api/corners/solve", { photo: here.photo, label: labelOf(here) });
    if (open === here) showCamera();
  } catch (error) {
    if (error.superseded) return;
    here.camera = null;
    if (open === here) showCamera(error.message, "bad");
  }
}

function hasSide() {
  return open.label.surface.width_m || open.label.surface.height_m;
}

function isComplete() {
  return (open.corners.length === 4 && hasSide()) || open.label.points?.length >= 4;
}

function missing() {
  return open.corners.length < 4 ? "Mark four corners and type the size to see the camera." : "Type the size of the rectangle.";
}

const plusMinus = (value, sigma, digits) => `${value.toFixed(digits)} ± ${sigma.toFixed(digits)}`;

function facts(camera) {
  const focal = camera.focal_sigma === null ? "not known" : `± ${(100 * camera.focal_sigma).toFixed(1)} %`;
  return [
    ["Lens above surface", `${plusMinus(camera.height[0], camera.height[1], 3)} m`],
    ["Tilt", `${plusMinus(camera.tilt_deg[0], camera.tilt_deg[1], 1)}°`],
    ["Focal length", `${camera.focal_px.toFixed(0)} px ${focal}`],
    [`${camera.per_corner_px ? "Corners" : "Points"} fit to`, `${camera.rms_px.toFixed(2)} px`],
    ["Rectangle", `${camera.size.map((side) => side.toFixed(3)).join(" × ")} m`],
    ["Scale", `${camera.px_per_metre.toFixed(0)} px/m`],
    [`${(1000 * camera.reference_height).toFixed(0)} mm above it`, `accurate to ${camera.height_px.toFixed(1)} px`],
    ["Grid", `${camera.sketch.grid_step} m`],
  ];
}

/** The doctor's words for files, as this page says them. */
const IN_THIS_PAGE = [
  [/ If it was not, write "cropped": false under "image": the principal point is then its centre and the focal length known/,
    " If it was not, say so below: the focal length is then known"],
  [/write "cropped": false under "image": the principal point is then its centre/, "say so below"],
  [/ and write it as camera\.height_m/, " and type it below"],
  [/\(camera joint\)/, "(solve all together)"],
  [/\+-/g, "±"],
];

/** Lines of the doctor that the numbers do not say already. */
function advice(camera) {
  return camera.advice
    .filter((line) => /^(Warning|This camera|Measure)|not known|does not show/.test(line))
    .map((line) => element("li", { class: /^This camera/.test(line) ? "bad" : /^Warning/.test(line) ? "warn" : "" },
      IN_THIS_PAGE.reduce((text, [words, here]) => text.replace(words, here), line),
      ...remedies(line)));
}

/** Buttons that do what a line advises. */
function remedies(line) {
  if (line.includes("\"cropped\": false")) return [element("button", { type: "button", onclick: sayWhole }, "It was not cropped")];
  if (line.startsWith("Measure")) return [element("button", { type: "button", onclick: askLens }, "Type the height")];
  return [];
}

function sayWhole() {
  at("cropped").value = "false";
  edit((label) => set(label.image, "cropped", false));
}

function askLens() {
  at("more").open = true;
  at("lens").focus();
}

function showCamera(why, kind = "") {
  const { camera } = open;
  const rows = camera ? facts(camera) : [];
  at("facts").replaceChildren(...rows.flatMap(([term, text]) => [element("dt", {}, term), element("dd", {}, text)]));
  const lines = camera ? advice(camera) : [element("li", { class: kind }, why)];
  at("advice").replaceChildren(...(lines.length ? lines : [element("li", { class: "good" }, "Everything is known well.")]));
  at("snap").disabled = at("turn").disabled = open.corners.length !== 4;
  at("undo").disabled = open.history.length === 0;
  at("save").disabled = false;
  view.draw();
}

function showHint() {
  if (!open) return;
  const count = open.corners.length;
  at("hint").textContent = count < 4
    ? `Click the ${NAMES[open.wantsFirst ? 0 : count]} corner${count === 0 ? " of the surface (its inner edge)" : ""}.`
    : view.chosen < 0 ? "Drag a corner, or choose one and press the arrow keys." : `Corner ${view.chosen + 1}, ${NAMES[view.chosen]}.`;
}

function middle(a, b) {
  return [(a[0] + b[0]) / 2, (a[1] + b[1]) / 2];
}

function drawCamera() {
  if (!open) return;
  const sketch = open.camera?.sketch;
  for (const marker of open.markers) {
    view.line([...marker.corners_px, marker.corners_px[0]], INK.marker, 2);
    view.word(String(marker.id), middle(marker.corners_px[0], marker.corners_px[2]), INK.marker);
  }
  sketch?.grid.forEach((line) => view.line(line, INK.grid, 1));
  sketch?.walls.forEach((line) => view.line(line, INK.walls, 1.5));
  if (sketch?.horizon) view.line(sketch.horizon, INK.horizon, 1.5, [8, 6]);
  if (sketch) sketch.rectangle.forEach((line) => view.line(line, INK.rectangle, 2));
  else view.line(open.corners.length === 4 ? [...open.corners, open.corners[0]] : open.corners, INK.rectangle, 1.5, [4, 4]);
  if (open.corners.length === 4) {
    const { width_m: width, height_m: height } = open.label.surface;
    view.word(width ? `width ${units.shown(width)}` : "width", middle(open.corners[0], open.corners[1]));
    view.word(height ? `height ${units.shown(height)}` : "height", middle(open.corners[1], open.corners[2]));
  }
}

// Saving.

async function save(next = true) {
  if (!open || open.saving || !isReadable() || !isWorthSaving()) return;
  const here = open;
  here.saving = true;
  await trying(() => saveOpened(here, next));
  here.saving = false;
}

/** Whether there is something to save, and no part of it would be lost. */
function isWorthSaving() {
  const count = open.corners.length;
  if (!open.version && !drafts.has(open.photo)) say("nothing is marked in this photo yet");
  else if (count % 4) say(`not saved: ${count} of 4 corners are marked`, "bad");
  else return true;
  return false;
}

/** Whether each field holds what it should; the first that does not is shown. */
function isReadable() {
  const wrong = at("panel").querySelector("input:invalid");
  if (!wrong) return true;
  if (at("more").contains(wrong)) at("more").open = true;
  wrong.reportValidity();
  say(`not saved: ${wrong.id}: ${wrong.value}, ${wrong.validationMessage}`, "bad");
  return false;
}

/** Whether a photo still wants a label: the one beside it may be of a photo with another ending. */
const isOpen = (entry) => !entry.label && !entry.taken;

async function saveOpened(here, next) {
  const before = here.changes;
  const saved = await saveLabel(here);
  if (!saved) return;
  const isWhole = here.changes === before;
  here.version = saved.version;
  if (isWhole && drafts.get(here.photo) === here) drafts.delete(here.photo);
  last = here.photo;
  Object.assign(entryOf(here.photo), { label: true, camera: Boolean(saved.camera) });
  showMarks();
  const rest = isWhole ? "" : "; not the changes made since";
  say(saved.camera ? `saved ${saved.name} and ${saved.camera}${rest}` : `saved ${saved.name}${rest}; no camera: ${saved.why}`,
    saved.camera && isWhole ? "good" : "bad");
  if (next && saved.camera && isWhole && open === here) list.next(isOpen);
}

/** Saves the label of a photo; null where theirs is loaded in its place. */
function saveLabel(here) {
  const { photo } = here;
  return saveOrAsk(here.version, {
    save: (version) => api("api/corners/save", { photo, label: labelOf(here), version }),
    now: async () => (await api(query("api/corners/label", { photo }))).version,
    load: () => {
      drafts.delete(photo);
      return show(photo);
    },
  });
}

async function solveTogether() {
  const labelled = photos.filter((entry) => entry.label).map((entry) => entry.photo);
  say("solving ...");
  await trying(async () => {
    const solved = await api("api/corners/joint", { photos: labelled });
    for (const { photo, focal_px: focal } of solved) entryOf(photo).camera = focal !== null;
    showMarks();
    const shared = solved.filter((one) => one.together > 1).length;
    say("");
    await choice("Solved together", table(solved), ["Close"]);
    say(shared ? `${shared} of ${solved.length} photos share a camera` : "no two photos share a camera: give them the same camera name", shared ? "good" : "");
  });
}

function focalText({ focal_px: px, focal_sigma: sigma }) {
  if (px === null) return "none";
  return sigma === null ? `${px.toFixed(0)} px, not known` : `${px.toFixed(0)} px ± ${(100 * sigma).toFixed(1)} %`;
}

function table(solved) {
  const row = (cell, cells) => element("tr", {}, ...cells.map((text) => element(cell, {}, text)));
  return element("table", { class: "solved" },
    row("th", ["Photo", "Shares", "Focal length", "Corners", "Remark"]),
    ...solved.map((one) => row("td", [
      one.photo.split("/").pop(),
      one.together > 1 ? `${one.together} photos` : "alone",
      focalText(one),
      one.rms_px === null ? "" : `${one.rms_px.toFixed(2)} px`,
      one.why ?? "",
    ])));
}

at("panel").addEventListener("submit", (event) => {
  event.preventDefault();
  save();
});
for (const [id, act] of [["snap", snap], ["turn", turn], ["undo", undo], ["markers", findMarkers], ["joint", solveTogether]]) {
  at(id).addEventListener("click", act);
}
addEventListener("beforeunload", (event) => drafts.size && event.preventDefault());

shortcuts([
  ["Enter", "save and go to the next photo", () => save()],
  ["Ctrl+s", "save", () => save(false)],
  ["s", "snap corners to edges", snap],
  ["m", "find markers", findMarkers],
  ["r", "turn: make the next corner the first", turn],
  ...[1, 2, 3, 4].map((i) => [String(i), i === 1 ? "choose corner 1 (to 4)" : "", () => view.choose(i - 1)]),
  ...viewKeys(view),
  ["Ctrl+z", "undo", undo],
  ["Delete", "remove the corner", removeCorner],
  ["Backspace", "", removeCorner],
  ["n", "next photo", () => list.step(1)],
  ["p", "previous photo", () => list.step(-1)],
  ["g", "type the size", () => at("width").select()],
]);

await trying(async () => {
  await list.fill(await api("api/corners/photos"), isOpen);
  showMarks();
});
