// Mattes: each photo of a list with its cut-out, strokes that correct it, and a verdict.
import { INKS, Stage } from "./mattes_stage.js";
import { photoList } from "./photo_list.js";
import { api, at, element, frame, picture, query, saveOrAsk, say, shortcuts, trying } from "./studio.js";

const LAYERS = [
  ["checker", "Checker", "1"],
  ["black", "Black", "2"],
  ["white", "White", "3"],
  ["plate", "Plate", "4"],
  ["matte", "Matte", "5"],
  ["transmittance", "V", "6"],
  ["uncertainty", "Uncertainty", "7"],
];

const LAYERS_IN_WORDS = {
  checker: "the cut-out over a checkerboard",
  black: "the cut-out over black",
  white: "the cut-out over white",
  plate: "the cut-out on a background photo",
  matte: "opacity: white hides what is behind",
  transmittance: "what is transmitted along the line of sight, in colour",
  uncertainty: "uncertainty of the transmittance: dark is none, yellow is 0.5",
};

const TOOLS = [
  [null, "Move", "m", "move the photo (or hold the middle button)"],
  ["object", "Object", "o", "this is the object"],
  ["not_object", "Not object", "n", "this is not the object"],
  ["see_through", "See-through", "t", "this is see-through"],
  ["opaque", "Opaque", "p", "this is opaque"],
];

const VERDICTS = { accepted: ["accepted", "good"], rejected: ["rejected", "bad"] };
const EMPTY = "There is no list of photos in this folder. Write photos.csv with the columns file, asset, class and length and a line for each photo.";
/** The finest brush and the coarsest, shares of the photo's longer side. */
const BRUSHES = [0.002, 0.12];

const stage = new Stage(at("canvas"), paint);
const list = photoList(at("photos"), open, mark);
/** `entry` is the photo that is shown, `shown` the layer that was asked for last, `unsaved` why what is shown is not kept. */
const state = { entry: null, layer: "checker", review: null, past: [], future: [], solved: null, shown: null, saving: Promise.resolve(), unsaved: null };

frame("mattes");

// The photos.

const base = (path) => path.split("/").at(-1);

function mark({ verdict, strokes }) {
  return VERDICTS[verdict] ?? [strokes ? `${strokes} ${strokes === 1 ? "stroke" : "strokes"}` : "", ""];
}

/** The list tells what is in the file. */
function markSaved(entry, { verdict, strokes }) {
  Object.assign(entry, { verdict, strokes: strokes.length });
  list.showMarks();
}

async function open(photo) {
  const entry = list.entryOf(photo);
  Object.assign(state, { entry, review: null, solved: null, past: [], future: [], shown: null, unsaved: null });
  Object.assign(stage, { size: null, strokes: [], current: null, held: null });
  stage.draw();
  list.choose(photo);
  document.title = `${base(photo)} · Mattes`;
  for (const id of ["flags", "facts"]) at(id).replaceChildren();
  showReview();
  await trying(async () => {
    await state.saving;
    const review = await api(query("api/mattes/review", { photo }));
    if (state.entry !== entry) return;
    state.review = review;
    markSaved(entry, review);
    stage.strokes = review.strokes;
    showReview();
    await solve();
  });
}

// Cutting out, and what is seen of it.

async function solve() {
  const { list: name, photo } = state.entry;
  const { strokes, size } = state.review;
  at("stage").classList.add("busy");
  say(`cutting out ${base(photo)} ...`);
  const solved = await api("api/mattes/solve", { list: name, photo, strokes, size }).finally(() => at("stage").classList.remove("busy"));
  if (state.review?.strokes !== strokes) return;
  state.solved = solved;
  if (solved.outdated) beginAgain(solved.outdated);
  state.review.size = solved.size;
  if (!stage.size) stage.open(solved.size);
  setRadius();
  showReview();
  showSolved();
  await showLayers();
  const trouble = state.unsaved ?? solved.refused;
  say(trouble ?? `${base(photo)}: cut out in ${(1000 * solved.seconds).toFixed(0)} ms`, trouble ? "bad" : "good");
}

/** Without the strokes that were painted on another size; the file has them until something else is said. */
function beginAgain(why) {
  Object.assign(state, { past: [], future: [], unsaved: why });
  Object.assign(state.review, { strokes: [], verdict: null });
  Object.assign(stage, { size: null, strokes: [] });
  showReview();
}

async function loaded(path) {
  const image = new Image();
  const address = await picture(path);
  image.src = address;
  await image.decode();
  URL.revokeObjectURL(address);
  return image;
}

/** Fetches what is shown now; what another request has replaced since is dropped. */
async function showLayers() {
  const { solved, layer } = state;
  if (!solved) return;
  const shown = `${solved.number} ${layer} ${at("plate").value}`;
  state.shown = shown;
  const address = (name) => query("api/mattes/layer", { number: solved.number, layer: name, plate: name === "plate" ? at("plate").value || null : null });
  const photo = stage.images.photo ?? await loaded(address("photo"));
  const cut = solved.refused ? null : await loaded(address(layer));
  if (state.shown !== shown) return;
  stage.images = { photo, layer: cut };
  stage.draw();
  at("canvas").dataset.shown = shown;
}

function setLayer(layer) {
  state.layer = layer;
  for (const button of at("layers").children) button.setAttribute("aria-pressed", button.dataset.layer === layer);
  say(LAYERS_IN_WORDS[layer]);
  trying(showLayers);
}

const percent = (share) => share === null ? "unknown" : `${(100 * share).toFixed(0)} %`;

function showSolved() {
  const { refused, diagnostics, outline_confidence, color_confidence } = state.solved;
  const flags = diagnostics.map(({ severity, message }) => element("li", { class: severity === "note" ? "" : "warn" }, message));
  if (refused) flags.unshift(element("li", { class: "bad" }, refused, " (or mark what is the object and what is not)"));
  if (!flags.length) flags.push(element("li", { class: "good" }, "nothing"));
  at("flags").replaceChildren(...flags);
  at("facts").replaceChildren(...(refused ? [] : [
    element("dt", {}, "outline confidence"), element("dd", {}, percent(outline_confidence)),
    element("dt", {}, "colour confidence"), element("dd", {}, percent(color_confidence))]));
}

// Strokes.

function setTool(tool) {
  stage.tool = tool;
  for (const button of at("tools").children) button.setAttribute("aria-pressed", button.dataset.tool === (tool ?? ""));
  at("canvas").classList.toggle("brushes", tool !== null);
  at("radius").disabled = tool === null;
  stage.draw();
}

function setRadius() {
  if (!state.solved) return;
  const [fine, coarse] = BRUSHES.map((share) => share * Math.max(...state.solved.size));
  stage.radius = Math.round(10 * Math.max(fine * (coarse / fine) ** (at("radius").value / 100), 0.5)) / 10;
  stage.draw();
}

function changeRadius(by) {
  at("radius").value = Number(at("radius").value) + by;
  setRadius();
}

function paint(stroke) {
  if (!state.review) return;
  change([...state.review.strokes, stroke]);
}

/** Other strokes, which can be undone. */
function change(strokes) {
  state.past.push(state.review.strokes);
  state.future = [];
  setStrokes(strokes);
}

/** The strokes before the last change; of those that the file has, the last one goes. */
function undo() {
  const strokes = state.review?.strokes ?? [];
  if (!(state.past.length || strokes.length)) return;
  state.future.push(strokes);
  setStrokes(state.past.pop() ?? strokes.slice(0, -1));
}

function redo() {
  if (!state.review || !state.future.length) return;
  state.past.push(state.review.strokes);
  setStrokes(state.future.pop());
}

function clear() {
  if (state.review?.strokes.length) change([]);
}

/** What is painted is solved and kept at once; a verdict was on what was there before. */
function setStrokes(strokes) {
  Object.assign(state.review, { strokes, verdict: null });
  stage.strokes = strokes;
  stage.draw();
  showReview();
  keep();
  trying(solve);
}

function setVerdict(verdict) {
  if (!state.solved || !state.review) return;
  state.review.verdict = state.review.verdict === verdict ? null : verdict;
  showReview();
  keep();
  if (state.review.verdict) list.next(({ verdict }) => !verdict);
}

/** Saves the review of the photo, after what is being saved already. */
function keep() {
  const { entry, review } = state;
  const { photo } = entry;
  const { size, strokes, verdict } = review;
  const steps = {
    save: (version) => api("api/mattes/review", { photo, size, strokes, verdict, version }),
    now: async () => (await api(query("api/mattes/review", { photo }))).version,
    // Not awaited: it waits itself for what is being saved.
    load: () => { open(photo); },
  };
  state.saving = state.saving.then(() => trying(async () => {
    try {
      const saved = await saveOrAsk(review.version, steps);
      if (!saved) return;
      Object.assign(review, { version: saved.version });
      markSaved(entry, { verdict, strokes });
      state.unsaved = null;
      at("canvas").dataset.saved = `${saved.file} ${saved.version}`;
      say(`saved ${saved.file}`, "good");
    } catch (error) {
      state.unsaved = error.message;
      throw error;
    }
  }));
}

function showReview() {
  const { strokes, verdict } = state.review ?? { strokes: [], verdict: null };
  at("clear").disabled = !strokes.length;
  at("undo").disabled = !(state.past.length || strokes.length);
  at("redo").disabled = !state.future.length;
  for (const [id, said] of [["accept", "accepted"], ["reject", "rejected"]]) {
    at(id).disabled = !state.review || !state.solved;
    at(id).setAttribute("aria-pressed", verdict === said);
  }
}

// The page.

function choice(label, key, attributes) {
  return element("button", { ...attributes, "aria-pressed": "false" }, label, element("kbd", {}, key.toUpperCase()));
}

function setWipe(percent) {
  at("wipe").value = percent;
  stage.wipe = at("wipe").value / 100;
  stage.draw();
}

at("layers").replaceChildren(...LAYERS.map(([layer, title, key]) =>
  choice(title, key, { "data-layer": layer, title: LAYERS_IN_WORDS[layer], onclick: () => setLayer(layer) })));
at("tools").replaceChildren(...TOOLS.map(([tool, title, key, what]) =>
  choice(title, key, { "data-tool": tool ?? "", title: what, onclick: () => setTool(tool) })));
for (const button of at("tools").children) {
  const ink = INKS[button.dataset.tool];
  if (ink) button.style.setProperty("--ink-of-tool", ink);
}
for (const [id, act] of [["undo", undo], ["redo", redo], ["clear", clear]]) at(id).addEventListener("click", act);
at("accept").addEventListener("click", () => setVerdict("accepted"));
at("reject").addEventListener("click", () => setVerdict("rejected"));
at("wipe").addEventListener("input", () => setWipe(at("wipe").value));
at("radius").addEventListener("input", setRadius);
// These keys are the brush's while it has the focus, and the wipe's otherwise.
at("radius").addEventListener("keydown", (event) => { if (["ArrowLeft", "ArrowRight"].includes(event.key)) event.stopPropagation(); });
at("plate").addEventListener("change", () => setLayer("plate"));

function showStrokes() {
  stage.showsStrokes = !stage.showsStrokes;
  stage.draw();
}

shortcuts([
  ...LAYERS.map(([layer, , key]) => [key, LAYERS_IN_WORDS[layer], () => setLayer(layer)]),
  ...TOOLS.map(([tool, , key, what]) => [key, what, () => setTool(tool)]),
  ["[", "smaller brush", () => changeRadius(-8)],
  ["]", "larger brush", () => changeRadius(8)],
  ["Ctrl+z", "undo the last stroke", undo],
  ["Ctrl+Shift+z", "redo it", redo],
  ["h", "hide or show the strokes", showStrokes],
  ["ArrowLeft", "more of the cut-out", () => setWipe(stage.wipe * 100 - 5)],
  ["ArrowRight", "more of the photo", () => setWipe(stage.wipe * 100 + 5)],
  ["b", "photo or cut-out", () => setWipe(stage.wipe > 0.5 ? 0 : 100)],
  ["+", "zoom in", () => stage.zoom(1.5)],
  ["-", "zoom out", () => stage.zoom(1 / 1.5)],
  ["0", "fit the photo", () => stage.fit()],
  ["a", "accept and go to the next photo", () => setVerdict("accepted")],
  ["x", "reject and go to the next photo", () => setVerdict("rejected")],
  ["ArrowDown", "next photo", () => list.step(1)],
  ["ArrowUp", "previous photo", () => list.step(-1)],
]);

setTool(null);
setLayer("checker");
await trying(async () => {
  const { photos, problems, plates } = await api("api/mattes/photos");
  const options = plates.map((plate) => element("option", { value: plate }, plate));
  at("plate").replaceChildren(...(options.length ? options : [element("option", { value: "" }, "no labelled background photo")]));
  at("plate").disabled = !plates.length;
  at("empty").hidden = photos.length > 0;
  at("empty").textContent = problems.join("\n") || EMPTY;
  if (photos.length) await list.fill(photos, ({ verdict }) => !verdict);
});
