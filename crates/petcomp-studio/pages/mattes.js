// Mattes: each photo of a list with its cut-out, strokes that correct it, and a verdict.
import { api, at, element, frame, picture, query, say, shortcuts, trying } from "./studio.js";
import { INKS, Stage } from "./mattes_stage.js";

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
  plate: "the cut-out in the photo of a place",
  matte: "opacity: white hides what is behind",
  transmittance: "what the line of sight lets through, in its colour",
  uncertainty: "how far the transmittance may be off: dark not at all, yellow by half",
};

const TOOLS = [
  [null, "Move", "m", "move the photo (or hold the middle button)"],
  ["object", "Object", "o", "this is the object"],
  ["not_object", "Not object", "n", "this is not the object"],
  ["see_through", "See-through", "t", "one sees through this"],
  ["opaque", "Opaque", "p", "nothing is seen through this"],
];

const VERDICTS = { accepted: ["accepted", "good"], rejected: ["rejected", "bad"] };
/** The finest brush and the coarsest, shares of the photo's longer side. */
const BRUSHES = [0.002, 0.12];

const stage = new Stage(at("canvas"), paint);
const state = { photos: [], plates: [], current: null, layer: "checker", review: null, undone: [], solved: null, shown: null, saving: Promise.resolve() };

frame("mattes");

// The photos.

const base = (path) => path.split("/").at(-1);

function listItem(photo, i) {
  return element("li", {},
    element("button", { onclick: () => open(i), title: `${photo.photo}: ${photo.asset}` },
      element("img", { src: query("api/photo", { file: photo.photo, side: 112 }), alt: "", loading: "lazy" }),
      element("span", { class: "name" }, base(photo.photo)),
      markOf(photo)));
}

function markOf({ verdict, strokes }) {
  const [word, kind] = VERDICTS[verdict] ?? [strokes ? `${strokes} strokes` : "", ""];
  return element("span", { class: `mark ${kind}` }, word);
}

function showList() {
  const items = [];
  let list = null;
  state.photos.forEach((photo, i) => {
    if (photo.list !== list) items.push(element("li", { class: "folder" }, photo.list));
    list = photo.list;
    items.push(listItem(photo, i));
  });
  at("photos").replaceChildren(...items);
}

/** Marks the photo that is shown, and what was said of it. */
function showCurrent() {
  const buttons = [...document.querySelectorAll("#photos button")];
  buttons.forEach((button, i) => button.toggleAttribute("aria-current", i === state.current));
  const button = buttons[state.current];
  const photo = state.photos[state.current];
  button?.lastChild.replaceWith(markOf({ verdict: state.review?.verdict ?? photo.verdict, strokes: (state.review?.strokes ?? []).length }));
  button?.scrollIntoView({ block: "nearest", inline: "nearest" });
}

async function open(i) {
  if (!state.photos[i]) return;
  Object.assign(state, { current: i, review: null, solved: null, undone: [], shown: null });
  Object.assign(stage, { size: null, strokes: [] });
  stage.draw();
  showCurrent();
  showReview();
  await trying(async () => {
    await state.saving;
    const review = await api(query("api/mattes/review", { photo: state.photos[i].photo }));
    if (state.current !== i) return;
    state.review = review;
    stage.strokes = review.strokes;
    showReview();
    await solve();
  });
}

const step = (by) => open(Math.min(Math.max((state.current ?? 0) + by, 0), state.photos.length - 1));

/** After a verdict: the next photo that has none. */
function next() {
  const rest = state.photos.findIndex((photo, i) => i > state.current && !photo.verdict);
  if (rest >= 0) open(rest);
}

// Cutting out, and what is seen of it.

async function solve() {
  const { list, photo } = state.photos[state.current];
  const { strokes } = state.review;
  at("stage").classList.add("busy");
  say(`cutting out ${base(photo)} …`);
  const solved = await api("api/mattes/solve", { list, photo, strokes });
  if (state.review?.strokes !== strokes) return;
  state.solved = solved;
  if (!stage.size) stage.open(solved.size);
  setRadius();
  showSolved();
  await showLayers();
  at("stage").classList.remove("busy");
  if (solved.refused) say(solved.refused, "bad");
  else say(`${base(photo)}: cut out in ${(1000 * solved.seconds).toFixed(0)} ms`, "good");
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
  at("plate").hidden = layer !== "plate" || !state.plates.length;
  say(LAYERS_IN_WORDS[layer]);
  trying(showLayers);
}

const percent = (share) => share === null ? "unknown" : `${(100 * share).toFixed(0)} %`;

function showSolved() {
  const { refused, diagnostics, outline_confidence, color_confidence } = state.solved;
  const flags = diagnostics.map(({ severity, message }) => element("li", { class: severity === "note" ? "" : "warn" }, message));
  if (refused) flags.unshift(element("li", { class: "bad" }, refused, " (or paint what is the object and what is not)"));
  if (!flags.length) flags.push(element("li", { class: "good" }, "nothing"));
  at("flags").replaceChildren(...flags);
  at("facts").replaceChildren(...(refused ? [] : [
    element("dt", {}, "outline is certain to"), element("dd", {}, percent(outline_confidence)),
    element("dt", {}, "colour is certain to"), element("dd", {}, percent(color_confidence))]));
}

// Strokes.

function setTool(tool) {
  stage.tool = tool;
  for (const button of at("tools").children) button.setAttribute("aria-pressed", button.dataset.tool === (tool ?? ""));
  at("canvas").classList.toggle("brushes", tool !== null);
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
  state.undone = [];
  setStrokes([...state.review.strokes, stroke]);
}

function undo() {
  const strokes = state.review?.strokes ?? [];
  if (!strokes.length) return;
  state.undone.push(strokes.at(-1));
  setStrokes(strokes.slice(0, -1));
}

function redo() {
  const stroke = state.undone.pop();
  if (stroke) setStrokes([...state.review.strokes, stroke]);
}

function clear() {
  if (!state.review?.strokes.length) return;
  state.undone = [...state.review.strokes].reverse();
  setStrokes([]);
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
  if (state.review.verdict) next();
}

/** Saves the review of the photo, after what is being saved already. */
function keep() {
  const [photo, review, { size }] = [state.photos[state.current], state.review, state.solved];
  Object.assign(photo, { verdict: review.verdict, strokes: review.strokes.length });
  state.saving = state.saving.then(() => trying(async () => {
    const { strokes, verdict, version } = review;
    const saved = await api("api/mattes/review", { photo: photo.photo, size, strokes, verdict, version });
    review.version = saved.version;
    at("canvas").dataset.saved = `${saved.file} ${saved.version}`;
  }));
}

function showReview() {
  const { strokes, verdict } = state.review ?? { strokes: [], verdict: null };
  at("undo").disabled = at("clear").disabled = !strokes.length;
  at("redo").disabled = !state.undone.length;
  for (const [id, said] of [["accept", "accepted"], ["reject", "rejected"]]) {
    at(id).disabled = !state.review;
    at(id).setAttribute("aria-pressed", verdict === said);
  }
  showCurrent();
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
at("plate").addEventListener("change", () => trying(showLayers));

function showStrokes() {
  stage.showsStrokes = !stage.showsStrokes;
  stage.draw();
}

shortcuts([
  ...LAYERS.map(([layer, , key]) => [key, LAYERS_IN_WORDS[layer], () => setLayer(layer)]),
  ...TOOLS.map(([tool, , key, what]) => [key, what, () => setTool(tool)]),
  ["[", "finer brush", () => changeRadius(-8)],
  ["]", "coarser brush", () => changeRadius(8)],
  ["Ctrl+z", "take back the last stroke", undo],
  ["Ctrl+Shift+z", "paint it again", redo],
  ["h", "hide or show the strokes", showStrokes],
  ["ArrowLeft", "more of the cut-out", () => setWipe(stage.wipe * 100 - 5)],
  ["ArrowRight", "more of the photo", () => setWipe(stage.wipe * 100 + 5)],
  ["b", "photo or cut-out", () => setWipe(stage.wipe > 0.5 ? 0 : 100)],
  ["+", "larger", () => stage.zoom(1.5)],
  ["-", "smaller", () => stage.zoom(1 / 1.5)],
  ["0", "all of it", () => stage.fit()],
  ["a", "accept, and to the next one", () => setVerdict("accepted")],
  ["x", "reject, and to the next one", () => setVerdict("rejected")],
  ["ArrowDown", "next photo", () => step(1)],
  ["ArrowUp", "photo before", () => step(-1)],
]);

await trying(async () => {
  const { photos, problems, plates } = await api("api/mattes/photos");
  Object.assign(state, { photos, plates });
  at("plate").replaceChildren(...plates.map((plate) => element("option", { value: plate }, plate)));
  showList();
  setTool(null);
  setLayer("checker");
  const asked = new URLSearchParams(location.search).get("photo");
  if (photos.length) return open(Math.max(photos.findIndex(({ photo }) => photo === asked), 0));
  at("empty").hidden = false;
  at("empty").textContent = problems.length ? problems.join("\n")
    : "There is no list of photos in this folder. Write photos.csv with the columns file, asset, class and length, a line for each photo.";
}).then(() => undefined);
