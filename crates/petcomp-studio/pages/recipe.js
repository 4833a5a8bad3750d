import { withEdit } from "./recipe_edits.js";
import { api, at, element, frame, picture, query, saveOrAsk, say, shortcuts, trying } from "./studio.js";

frame("recipe");

/** Longer side of the small pictures, pixels: what a cell shows. */
const SIDE_PX = 384;
/** Keystrokes and moves that follow each other this soon are one step of Undo, milliseconds. */
const ONE_STEP_MS = 700;

/** The recipe's file as it was read, and what its edits make of it. */
const recipe = { file: "", version: "", saved: null, draft: null, edits: [] };
const steps = { past: [], future: [], last: 0, path: "" };
/** What is edited while a save runs, and is not in what it has sent; null where none runs. */
let meanwhile = null;
let groups = [];

// Values as TOML.

function toToml(value) {
  if (typeof value === "string") return JSON.stringify(value);
  if (Array.isArray(value)) return `[${value.map(toToml).join(", ")}]`;
  if (value !== null && typeof value === "object") {
    const pairs = Object.entries(value).map(([key, inner]) => `${key} = ${toToml(inner)}`);
    return pairs.length ? `{ ${pairs.join(", ")} }` : "{}";
  }
  return String(value);
}

const own = (path) => recipe.draft.own[path];
const fallback = (setting, path) => recipe.draft.preset[path] ?? (setting.is_example ? undefined : setting.value);
const valueOf = (setting, path) => own(path) ?? fallback(setting, path);

// Editing.

function edit(path, toml) {
  const now = performance.now();
  const isSameMove = path === steps.path && now - steps.last < ONE_STEP_MS;
  if (!isSameMove) steps.past.push(recipe.edits);
  Object.assign(steps, { future: [], last: now, path });
  recipe.edits = withEdit(recipe.edits, path, toml, recipe.saved.own);
  meanwhile?.push([path, toml]);
  changed();
}

function travel(from, to) {
  // What a save has sent cannot be taken back from it.
  if (!from.length || meanwhile) return;
  to.push(recipe.edits);
  recipe.edits = from.pop();
  steps.path = "";
  changed({ redraw: true });
}

const undo = () => travel(steps.past, steps.future);
const redo = () => travel(steps.future, steps.past);

const drafting = { wanted: false, isRunning: false, redraw: false };

/** Asks what the edited recipe says, and for its pictures; what was asked before is given up. */
async function changed({ redraw = false } = {}) {
  drafting.wanted = true;
  drafting.redraw ||= redraw;
  at("undo").disabled = !steps.past.length;
  at("redo").disabled = !steps.future.length;
  if (drafting.isRunning) return;
  drafting.isRunning = true;
  while (drafting.wanted) {
    drafting.wanted = false;
    await trying(draftOnce);
  }
  drafting.isRunning = false;
}

async function draftOnce() {
  const { file, saved, edits } = recipe;
  try {
    const draft = await api("api/recipe/draft", { file, edits });
    // Another recipe was opened meanwhile, or this one as it is now.
    if (saved !== recipe.saved) return;
    recipe.draft = draft;
  } finally {
    at("save").disabled = !recipe.edits.length;
    document.title = `${recipe.edits.length ? "• " : ""}${recipe.file} · petcomp studio`;
  }
  if (drafting.redraw) showSettings();
  else markSettings();
  // Something newer was asked for meanwhile, and is not in these controls yet.
  drafting.redraw &&= drafting.wanted;
  pictures.show();
}

async function save() {
  if (!recipe.edits.length || meanwhile) return;
  const newer = [];
  meanwhile = newer;
  const { file, version, edits: sent } = recipe;
  try {
    const next = await saveOrAsk(version, {
      save: (over) => api("api/recipe/save", { file, version: over, edits: sent }),
      now: async () => (await api(query("api/recipe/open", { file }))).version,
      load: () => open(file),
    });
    if (!next) return;
    const saved = await api(query("api/recipe/open", { file }));
    // Another recipe was opened.
    if (meanwhile !== newer) return;
    const edits = newer.reduce((done, [path, toml]) => withEdit(done, path, toml, saved.own), []);
    Object.assign(recipe, { version: next, saved, edits });
    Object.assign(steps, { past: edits.length ? [[]] : [], future: [], path: "" });
  } finally {
    if (meanwhile === newer) meanwhile = null;
  }
  pictures.forgetBefore();
  await changed({ redraw: true });
  say(`${file} saved`, "good");
}

// Pictures.

/** A place for a scene: what was before, and what it is now. */
function cell(i) {
  const image = (what) => element("img", { alt: `${what} of scene ${i}`, "data-what": what });
  const made = element("figure", { tabindex: "0", onclick: () => showWhole(i) },
    element("div", { class: "pair" }, image("before"), image("after")), element("figcaption", {}));
  made.addEventListener("keydown", (event) => { if (event.key === "Enter") showWhole(i); });
  return made;
}

const pictures = {
  count: 6, first: 0, seed: 0, compare: false, labels: false,
  before: new Map(), comparison: new AbortController(), isWanted: false, isRunning: false,

  arrange() {
    const room = at("pictures");
    room.replaceChildren(...Array.from({ length: this.count }, (_, i) => cell(this.first + i)));
    room.className = `of-${this.count}${this.compare ? " compare" : ""}`;
    [...room.children].forEach((figure, i) => {
      figure.querySelector("figcaption").textContent = `scene ${this.first + i}`;
      figure.style.setProperty("--shape", (recipe.draft?.image ?? [4, 3]).join(" / "));
    });
    this.show();
  },

  forgetBefore() {
    for (const address of this.before.values()) URL.revokeObjectURL(address);
    this.before.clear();
  },

  asked(k, edits, slot) {
    const { seed, labels } = this;
    return { file: recipe.file, edits, seed, k, labels, side: SIDE_PX, slot: `${slot} ${k - this.first}` };
  },

  /** Begins anew, once a picture of what was asked before is there: a slider that moves shows something. */
  async show() {
    this.isWanted = true;
    this.since ??= performance.now();
    this.markOld();
    this.comparison.abort();
    if (this.isRunning) return;
    this.isRunning = true;
    while (this.isWanted) {
      this.isWanted = false;
      await this.showOnce();
    }
    this.isRunning = false;
  },

  async showOnce() {
    const wave = new AbortController();
    const begun = this.since;
    this.since = undefined;
    const { edits } = recipe;
    let shown = 0;
    const figures = this.markOld();
    const showAfter = async (figure, i) => {
      await this.fill(figure, "after", this.asked(this.first + i, edits, "after"), wave.signal);
      shown += 1;
      figure.classList.toggle("old", this.isWanted);
      if (shown === 1) this.firstMs = performance.now() - begun;
      if (this.isWanted) wave.abort();
    };
    await Promise.all(figures.map((figure, i) => trying(() => showAfter(figure, i))));
    if (this.compare && !this.isWanted) await this.showBefore(figures);
    if (shown === figures.length) this.report(performance.now() - begun);
  },

  report(all) {
    const [first, last] = [this.firstMs, all].map((ms) => `${Math.round(ms)} ms`);
    document.body.dataset.firstMs = Math.round(this.firstMs);
    document.body.dataset.waves = Number(document.body.dataset.waves ?? 0) + 1;
    say(`first picture after ${first}, all ${this.count} after ${last}`);
  },

  markOld() {
    const figures = [...at("pictures").children];
    figures.forEach((figure) => figure.classList.add("old"));
    return figures;
  },

  async showBefore(figures) {
    this.comparison = new AbortController();
    const { signal } = this.comparison;
    await Promise.all(figures.map((figure, i) => trying(async () => {
      const k = this.first + i;
      const key = JSON.stringify([recipe.version, this.seed, k, this.labels]);
      if (!this.before.has(key)) this.before.set(key, await picture("api/recipe/picture", this.asked(k, [], "before"), signal));
      figure.querySelector("[data-what=before]").src = this.before.get(key);
    })));
  },

  async fill(figure, what, asked, signal) {
    const address = await picture("api/recipe/picture", asked, signal);
    const image = figure.querySelector(`[data-what=${what}]`);
    if (image.src) URL.revokeObjectURL(image.src);
    image.src = address;
  },

  set(changes) {
    Object.assign(this, changes);
    at("first").value = this.first;
    at("compare").setAttribute("aria-pressed", this.compare);
    at("labels").setAttribute("aria-pressed", this.labels);
    this.arrange();
  },
};

const nextScenes = (step) => pictures.set({ first: Math.max(0, pictures.first + step * pictures.count) });

/** A picture as the dataset would have it. */
async function showWhole(k) {
  const image = element("img", { alt: `scene ${k}` });
  const dialog = element("dialog", { class: "whole", "aria-label": `scene ${k}` },
    image, element("form", { method: "dialog" }, element("span", { class: "soft" }, `scene ${k}, as in the dataset`), element("button", { class: "main" }, "Close")));
  dialog.addEventListener("close", () => { URL.revokeObjectURL(image.src); dialog.remove(); });
  document.body.append(dialog);
  dialog.showModal();
  await trying(async () => {
    const { file, edits } = recipe;
    const { seed, labels } = pictures;
    image.src = await picture("api/recipe/picture", { file, edits, seed, k, labels, slot: "whole" });
  });
}

async function showText() {
  const { file, edits } = recipe;
  // What was edited last need not be in the draft that the settings show.
  const { text } = await api("api/recipe/draft", { file, edits });
  // Another dialog was opened meanwhile.
  if (document.querySelector("dialog[open]")) return;
  const dialog = element("dialog", { class: "wide", "aria-label": "the file" },
    element("h2", {}, file, edits.length ? " as it would be saved" : ""),
    element("pre", {}, text),
    element("form", { method: "dialog" }, element("button", { class: "main" }, "Close")));
  dialog.addEventListener("close", () => dialog.remove());
  document.body.append(dialog);
  dialog.showModal();
}

// Settings.

/** How far a slider goes: about three times what is usual, within what is taken at all. */
function span(setting, path) {
  const numbers = [setting.value, recipe.draft.preset[path], own(path)].flat().filter((n) => typeof n === "number");
  const [least, most] = [Math.min(...numbers), Math.max(...numbers)];
  const [low, high] = setting.ends ?? [Math.min(0, 2 * least), Infinity];
  const room = Math.max(most - least, Math.abs(most), Math.abs(least)) || 1;
  const fit = high - low <= 4 * room;
  const from = fit ? low : Math.max(low, least >= 0 ? 0 : least - room);
  const to = fit ? high : Math.min(high, most + 2 * room);
  return { from: Math.min(from, least), to: Math.max(to, most), step: setting.takes.whole ? 1 : stepFor(to - from) };
}

/** A hundredth or so of a length, as 1, 2 or 5 times a power of ten. */
function stepFor(length) {
  const rough = length / 200;
  const power = 10 ** Math.floor(Math.log10(rough));
  return power * [1, 2, 5, 10].find((factor) => factor * power >= rough);
}

const rounded = (number, step) => Number((Math.round(number / step) * step).toPrecision(10));

function numberInput(value, change, label) {
  return element("input", { type: "number", step: "any", value, "aria-label": label, onchange: (event) => {
    if (event.target.value !== "") change(Number(event.target.value));
  } });
}

function slider(value, { from, to, step }, change, label) {
  return element("input", { type: "range", min: from, max: to, step, value, "aria-label": label,
    oninput: (event) => change(rounded(Number(event.target.value), step)) });
}

function rangeControl(setting, path, value) {
  const ends = Array.isArray(value) ? [...value] : [value, value];
  const reach = span(setting, path);
  const inputs = [0, 1].map((i) => numberInput(ends[i], (n) => move(i, n), `${path} ${i ? "to" : "from"}`));
  const sliders = [0, 1].map((i) => slider(ends[i], reach, (n) => move(i, n), `${path} slider ${i ? "to" : "from"}`));
  const bar = element("div", { class: "between" });
  const show = () => {
    [0, 1].forEach((i) => { inputs[i].value = ends[i]; sliders[i].value = ends[i]; });
    const share = (n) => 100 * (n - reach.from) / (reach.to - reach.from);
    bar.style.left = `${share(ends[0])}%`;
    bar.style.right = `${100 - share(ends[1])}%`;
  };
  const move = (i, n) => {
    ends[i] = n;
    // One end pushes the other.
    if (ends[0] > ends[1]) ends[1 - i] = n;
    show();
    edit(path, toToml(ends[0] === ends[1] ? ends[0] : ends));
  };
  show();
  return element("div", { class: "range" }, inputs[0], element("div", { class: "double" }, bar, ...sliders), inputs[1]);
}

function numberControl(setting, path, value) {
  const change = (n) => { input.value = n; thumb.value = n; edit(path, toToml(n)); };
  const input = numberInput(value, change, path);
  const thumb = slider(value, span(setting, path), change, `${path} slider`);
  return element("div", { class: "range" }, thumb, input);
}

function wordControl(setting, path, value) {
  const { words, number } = setting.takes;
  const options = words.map((word) => element("option", { selected: word === value }, word));
  const isNumber = typeof value !== "string";
  if (number) options.unshift(element("option", { value: "", selected: isNumber }, "a number"));
  const select = element("select", { "aria-label": path, onchange: () => {
    const word = select.value;
    const start = Array.isArray(setting.value) || typeof setting.value === "number" ? setting.value : setting.ends?.[0] ?? 1;
    edit(path, toToml(word === "" ? start : word));
    drafting.redraw = true;
  } }, ...options);
  if (!number || !isNumber) return select;
  const control = setting.takes.range ? rangeControl : numberControl;
  return element("div", { class: "stacked" }, select, control(setting, path, value));
}

function listControl(setting, path, value) {
  const boxes = setting.takes.lists.map((word) => element("label", { class: "check" },
    element("input", { type: "checkbox", value: word, checked: value.includes(word), onchange: change }), word));
  const made = element("div", { class: "buttons" }, ...boxes);
  function change() {
    edit(path, toToml([...made.querySelectorAll(":checked")].map((box) => box.value)));
  }
  return made;
}

function switchControl(setting, path, value) {
  return element("label", { class: "check" },
    element("input", { type: "checkbox", "aria-label": path, checked: value, onchange: (event) => edit(path, String(event.target.checked)) }), "yes");
}

function textControl(setting, path, value) {
  return element("input", { class: "toml", "aria-label": path, spellcheck: "false",
    value: value === undefined ? "" : toToml(value), placeholder: `such as ${toToml(setting.value)}`,
    onchange: (event) => edit(path, event.target.value.trim() || null) });
}

const isNumbers = (value) => typeof value === "number" || (Array.isArray(value) && value.length === 2 && value.every((n) => typeof n === "number"));

/** The control that fits what a setting takes and what it is now; text as in the file where none does. */
function control(setting, path) {
  const value = valueOf(setting, path);
  const { takes } = setting;
  const shown = value === undefined ? undefined : value;
  if (takes.switch) return switchControl(setting, path, shown);
  if (takes.lists.length && Array.isArray(shown) && shown.every((word) => takes.lists.includes(word))) return listControl(setting, path, shown);
  if (takes.words.length && (takes.words.includes(shown) || isNumbers(shown) && takes.number)) return wordControl(setting, path, shown);
  if (takes.range && isNumbers(shown)) return rangeControl(setting, path, shown);
  if (takes.number && typeof shown === "number") return numberControl(setting, path, shown);
  return textControl(setting, path, shown);
}

function reset(path) {
  edit(path, null);
  drafting.redraw = true;
}

function settingRow(setting, path) {
  const name = path.split(".").at(-1);
  const made = element("div", { class: "setting", "data-path": path },
    element("div", { class: "name" }, element("code", {}, name),
      element("button", { class: "reset", title: `back to ${toToml(fallback(setting, path) ?? "nothing")}`, onclick: () => reset(path) }, "reset")),
    control(setting, path),
    element("p", { class: "docs" }, setting.docs));
  return made;
}

function markSettings() {
  for (const row of document.querySelectorAll(".setting")) {
    const { path } = row.dataset;
    row.classList.toggle("own", own(path) !== undefined);
    row.classList.toggle("edited", toToml(own(path)) !== toToml(recipe.saved.own[path]));
  }
}

/** The groups to show: one for each light there is. */
function shownGroups() {
  return groups.flatMap((group) => {
    if (!group.table.endsWith("[0]")) return [{ ...group, at: group.table }];
    return Array.from({ length: recipe.draft.lights }, (_, i) => ({ ...group, at: group.table.replace("[0]", `[${i}]`) }));
  });
}

const title = (table) => (table === "" ? "Files" : table.replace("scene.", "").replaceAll(".", ", ").replace(/lights\[(\d+)\]/, (_, i) => `light ${Number(i) + 1}`).replaceAll("_", " "));

function groupBlock(group) {
  const rows = group.settings.map((setting) => settingRow(setting, setting.path.replace(group.table, group.at)));
  const isLight = group.table.endsWith("[0]");
  return element("details", { open: openGroups.has(group.at), "data-table": group.at, ontoggle: (event) => {
    openGroups[event.target.open ? "add" : "delete"](group.at);
  } },
    element("summary", {}, title(group.at)),
    isLight ? null : element("p", { class: "docs" }, group.docs), ...rows,
    isLight ? element("button", { onclick: () => removeLight(group.at) }, "Remove this light") : null);
}

const openGroups = new Set(["scene"]);

function addLight() {
  const i = recipe.draft.lights;
  openGroups.add(`scene.lights[${i}]`);
  // Of several lights all must be said, the first as well.
  const missing = Array.from({ length: i }, (_, j) => `scene.lights[${j}]`).filter((path) => own(path) === undefined);
  for (const path of missing) edit(path, "{}");
  edit(`scene.lights[${i}]`, "{}");
  drafting.redraw = true;
}

function removeLight(path) {
  edit(recipe.draft.lights === 1 ? "scene.lights" : path, recipe.draft.lights === 1 ? "[]" : null);
  drafting.redraw = true;
}

function showSettings() {
  const blocks = shownGroups().map(groupBlock);
  const place = blocks.findIndex((block) => block.dataset.table === "scene.environment");
  blocks.splice(place, 0, element("button", { id: "add-light", onclick: addLight }, "Add a light"));
  at("settings").replaceChildren(...blocks);
  markSettings();
  filterSettings();
}

function filterSettings() {
  const words = at("search").value.toLowerCase().split(/\s+/).filter(Boolean);
  const onlyOwn = at("own").checked;
  const isFiltered = words.length > 0 || onlyOwn;
  for (const block of at("settings").querySelectorAll("details")) {
    const rows = [...block.querySelectorAll(".setting")];
    for (const row of rows) {
      const text = `${row.dataset.path} ${row.textContent}`.toLowerCase();
      row.hidden = !words.every((word) => text.includes(word)) || (onlyOwn && !row.classList.contains("own"));
    }
    block.hidden = isFiltered && rows.every((row) => row.hidden);
    block.open = isFiltered ? !block.hidden : openGroups.has(block.dataset.table);
  }
  at("add-light").hidden = isFiltered;
}

// The page.

async function open(file) {
  const opened = await api(query("api/recipe/open", { file }));
  meanwhile = null;
  Object.assign(recipe, { file, version: opened.version, draft: opened, saved: opened, edits: [] });
  Object.assign(steps, { past: [], future: [], path: "" });
  drafting.redraw = false;
  history.replaceState(null, "", query("recipe", { file }));
  at("file").value = file;
  document.title = `${file} · petcomp studio`;
  at("save").disabled = true;
  showSettings();
  pictures.forgetBefore();
  pictures.arrange();
}

async function begin() {
  const file = prompt("Name of the new recipe", "recipe.toml");
  if (!file) return;
  await api("api/recipe/new", { file });
  await listFiles();
  await open(file);
}

async function listFiles() {
  const recipes = await api("api/recipe/files");
  at("file").replaceChildren(...recipes.map((file) => element("option", { value: file }, file)), element("option", { value: "" }, "New recipe …"));
  return recipes;
}

at("file").addEventListener("change", (event) => trying(async () => {
  if (recipe.edits.length && !confirm("Discard unsaved changes?")) event.target.value = recipe.file;
  else if (event.target.value === "") await begin();
  else await open(event.target.value);
  at("file").value = recipe.file;
}));
at("save").addEventListener("click", () => trying(save));
at("search").addEventListener("input", filterSettings);
at("own").addEventListener("change", filterSettings);
at("count").addEventListener("change", (event) => pictures.set({ count: Number(event.target.value) }));
at("first").addEventListener("change", (event) => pictures.set({ first: Math.max(0, Math.floor(Number(event.target.value))) }));
at("seed").addEventListener("change", (event) => pictures.set({ seed: Math.max(0, Math.floor(Number(event.target.value))) }));
at("next").addEventListener("click", () => nextScenes(1));
at("compare").addEventListener("click", () => pictures.set({ compare: !pictures.compare }));
at("labels").addEventListener("click", () => pictures.set({ labels: !pictures.labels }));
at("undo").addEventListener("click", undo);
at("redo").addEventListener("click", redo);
at("text").addEventListener("click", () => trying(showText));
addEventListener("beforeunload", (event) => { if (recipe.edits.length) event.preventDefault(); });

shortcuts([
  ["Ctrl+s", "save", () => trying(save)],
  ["Ctrl+z", "undo", undo],
  ["Ctrl+Shift+z", "redo", redo],
  ["n", "next scenes", () => nextScenes(1)],
  ["p", "previous scenes", () => nextScenes(-1)],
  ["b", "before and after", () => pictures.set({ compare: !pictures.compare })],
  ["l", "labels", () => pictures.set({ labels: !pictures.labels })],
  ["f", "the file", () => trying(showText)],
  ["/", "find a setting", () => at("search").focus()],
]);

await trying(async () => {
  groups = await api("api/recipe/settings");
  const files = await listFiles();
  const asked = new URLSearchParams(location.search).get("file");
  if (asked || files.length) await open(asked ?? files[0]);
  else say("no recipe in this folder: choose New recipe, or create one with `petcomp dataset init`");
});
