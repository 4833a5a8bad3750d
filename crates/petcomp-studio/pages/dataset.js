import { api, at, element, frame, query, say, shortcuts, trying } from "./studio.js";

frame("dataset");

/** Size of a tile of the grid, pixels: picture, caption, gap. */
const TILE = { width: 236, picture: 177, caption: 40, gap: 12 };
/** Longer side of a small picture, pixels. */
const SIDE_PX = 320;
/** Rows of tiles that are made ready above and below what is seen. */
const AHEAD = 2;
/** While records are read in the background, how often is asked for more, milliseconds. */
const PAUSE_MS = 700;
/** Colours of classes, far enough from each other for eight. */
const HUES = [210, 25, 130, 285, 50, 170, 340, 90];

/** The folder, which of its listings its rows are of, and what was found there. */
const set = { folder: "", listing: null, count: 0, classes: [], rows: [], why: [] };
const shows = { boxes: true, masks: false, ids: true, covers: false };

const color = (number, alpha = 1) => `hsl(${HUES[number % HUES.length]} 90% 60% / ${alpha})`;

const list = (folder) => api(query("api/dataset/open", { folder }));

const address = ({ folder, listing }, row, side) => query("api/dataset/picture", { folder, listing, row, side });

// Which pictures.

const numberOf = (id) => (at(id).value === "" ? null : Number(at(id).value));

function range(low, high, factor, most) {
  const [a, b] = [numberOf(low), numberOf(high)];
  return a === null && b === null ? null : [(a ?? 0) * factor, b === null ? most : b * factor];
}

function filter() {
  const chosen = {
    part: at("part").value || null,
    class: numberOf("class"),
    labelled: at("labelled").value === "" ? null : at("labelled").value === "true",
    visible: range("least-seen", "most-seen", 0.01, 1),
    objects: range("fewest", "most", 1, 1e9),
    background: at("background").value || null,
    flag: at("flag").value || null,
  };
  return Object.fromEntries(Object.entries(chosen).filter(([, value]) => value !== null));
}

let search = new AbortController();

/** Asks for the pictures that are wanted, again and again until all records that decide it are read. */
async function find() {
  search.abort();
  search = new AbortController();
  const { signal } = search;
  const { folder, listing } = set;
  const wanted = { folder, listing, filter: filter(), order: at("order").value };
  for (let isFirst = true; ; isFirst = false) {
    const found = await api("api/dataset/find", wanted, signal);
    if (signal.aborted) return;
    Object.assign(set, { rows: found.rows, why: found.why });
    showBackgrounds(found.backgrounds);
    showCount(found);
    grid.show(isFirst);
    if (found.read >= found.of) return;
    await new Promise((resolve) => setTimeout(resolve, PAUSE_MS));
    if (signal.aborted) return;
  }
}

function showCount({ rows, read, of }) {
  const all = rows.length === set.count ? "" : ` of ${set.count.toLocaleString("en")}`;
  const far = read < of ? `, ${read.toLocaleString("en")} of ${of.toLocaleString("en")} records read` : "";
  at("found").textContent = `${rows.length.toLocaleString("en")}${all} pictures${far}`;
  at("found").dataset.done = read >= of;
}

function showBackgrounds(names) {
  const { value } = at("background");
  const options = ["", ...names].map((name) => element("option", { value: name, selected: name === value }, name || "any"));
  at("background").replaceChildren(...options);
}

async function open(folder) {
  const opened = await list(folder);
  Object.assign(set, { ...opened, folder, rows: [], why: [] });
  known.clear();
  at("folder").value = folder;
  at("class").replaceChildren(element("option", { value: "" }, "any or none"),
    ...opened.classes.map((name, i) => element("option", { value: i }, name)));
  history.replaceState(null, "", query("dataset", { folder }));
  document.title = `${folder || "."} · petcomp studio`;
  closeViewer();
  await find();
}

// The grid: only what is seen is there.

const known = new Map();
let asking;

/** Asks for what is in the pictures that are seen, all at once. */
function askRows() {
  clearTimeout(asking);
  asking = setTimeout(() => trying(async () => {
    const rows = [...grid.tiles.keys()].map((place) => set.rows[place]).filter((row) => row !== undefined && !known.has(row));
    if (!rows.length) return;
    const { folder, listing } = set;
    const told = await api("api/dataset/rows", { folder, listing, rows });
    if (listing !== set.listing) return;
    for (const row of told) known.set(row.row, row);
    grid.fill();
  }), 60);
}

const grid = {
  tiles: new Map(),
  columns: 1,

  measure() {
    const { width, gap, picture, caption } = TILE;
    this.columns = Math.max(1, Math.floor((at("grid").clientWidth - gap) / (width + gap)));
    this.rowHeight = picture + caption + gap;
    this.left = Math.max(gap, (at("grid").clientWidth - this.columns * (width + gap) + gap) / 2);
  },

  show(toTop) {
    this.measure();
    at("room").style.height = `${Math.ceil(set.rows.length / this.columns) * this.rowHeight + TILE.gap}px`;
    if (toTop) at("grid").scrollTop = 0;
    for (const tile of this.tiles.values()) tile.remove();
    this.tiles.clear();
    this.scroll();
  },

  scroll() {
    const { scrollTop, clientHeight } = at("grid");
    const first = Math.max(0, Math.floor(scrollTop / this.rowHeight) - AHEAD) * this.columns;
    const last = Math.min(set.rows.length, (Math.ceil((scrollTop + clientHeight) / this.rowHeight) + AHEAD) * this.columns);
    for (const [place, tile] of this.tiles) {
      if (place >= first && place < last) continue;
      // A picture that nobody sees any more need not come.
      tile.querySelector("img").removeAttribute("src");
      tile.remove();
      this.tiles.delete(place);
    }
    for (let place = first; place < last; place += 1) if (!this.tiles.has(place)) this.add(place);
    askRows();
  },

  add(place) {
    const row = set.rows[place];
    const image = element("img", { alt: "", src: address(set, row, SIDE_PX), decoding: "async" });
    const tile = element("button", { class: "tile", type: "button", "data-row": row, onclick: () => view(place) },
      element("span", { class: "picture" }, image, element("canvas")),
      element("span", { class: "caption" }));
    tile.style.left = `${this.left + (place % this.columns) * (TILE.width + TILE.gap)}px`;
    tile.style.top = `${TILE.gap + Math.floor(place / this.columns) * this.rowHeight}px`;
    image.addEventListener("load", () => this.fillTile(place));
    this.tiles.set(place, tile);
    at("room").append(tile);
    this.fillTile(place);
  },

  fill() {
    for (const place of this.tiles.keys()) this.fillTile(place);
  },

  fillTile(place) {
    const tile = this.tiles.get(place);
    const told = known.get(set.rows[place]);
    if (!tile || !told) return;
    const labels = told.objects.filter((object) => object.labelled).length;
    const flags = told.flags.map((flag) => element("span", { class: "mark warn" }, flag));
    tile.querySelector(".caption").replaceChildren(
      element("span", {}, element("b", {}, told.name), told.part ? ` ${told.part}` : "", ` · ${labels} of ${told.objects.length} labelled `, ...flags),
      element("span", { class: "why" }, set.why[place] ?? told.background));
    drawBoxes(tile, told.objects);
  },

  /** Scrolls until a place is seen. */
  reveal(place) {
    const top = Math.floor(place / this.columns) * this.rowHeight;
    const room = at("grid");
    if (top < room.scrollTop || top + this.rowHeight > room.scrollTop + room.clientHeight) room.scrollTop = top - this.rowHeight;
  },
};

function drawBoxes(tile, objects) {
  const image = tile.querySelector("img");
  const canvas = tile.querySelector("canvas");
  if (!image.naturalWidth) return;
  const [width, height] = [canvas.width, canvas.height] = [image.naturalWidth, image.naturalHeight];
  const pen = canvas.getContext("2d");
  for (const { bbox: [x, y, w, h], class: number, labelled } of objects) {
    pen.strokeStyle = labelled ? color(number) : "rgb(220 220 220 / .55)";
    pen.lineWidth = labelled ? 2 : 1;
    pen.strokeRect((x - w / 2) * width, (y - h / 2) * height, w * width, h * height);
  }
}

// One picture, or two beside each other.

/** A picture at its full size with what is drawn over it, and others of its folder before and behind it. */
class Pane {
  constructor({ folder, listing }, rows, place) {
    Object.assign(this, { folder, listing, rows, place, sample: null, names: set.classes, marked: null });
    this.image = element("img", { alt: "" });
    this.canvas = element("canvas");
    this.title = element("span", { class: "name" });
    this.folders = element("select", { "aria-label": "folder", onchange: () => trying(() => this.change(this.folders.value)) },
      ...folders.map((name) => element("option", { value: name, selected: name === folder }, name || ".")));
    this.root = element("figure", { class: "pane", onpointerdown: () => activate(this) },
      element("figcaption", {}, this.title, this.folders,
        element("button", { type: "button", title: "previous", onclick: () => this.move(-1) }, "‹"),
        element("button", { type: "button", title: "next", onclick: () => this.move(1) }, "›")),
      element("div", { class: "picture" }, this.image, this.canvas));
    this.canvas.addEventListener("pointermove", (event) => this.mark(this.objectAt(event)));
    this.canvas.addEventListener("pointerleave", () => this.mark(null));
  }

  async change(folder) {
    // What is shown beside it is used, too, and stays listed.
    for (const { folder, listing } of [set, ...viewer.panes.filter((pane) => pane !== this)]) {
      await api("api/dataset/rows", { folder, listing, rows: [] });
    }
    const { listing, classes } = await list(folder);
    const { rows } = await api("api/dataset/find", { folder, listing, filter: {}, order: "listed" });
    Object.assign(this, { folder, listing, rows, place: 0, names: classes });
    await this.show();
  }

  move(step) {
    const place = this.place + step;
    if (place < 0 || place >= this.rows.length) return;
    this.place = place;
    trying(() => this.show());
  }

  async show() {
    const { folder, listing } = this;
    const row = this.rows[this.place];
    const isShown = () => listing === this.listing && row === this.rows[this.place];
    this.image.src = address(this, row);
    try {
      const sample = await api(query("api/dataset/sample", { folder, listing, row }));
      if (!isShown()) return;
      this.folders.value = folder;
      this.tell(sample);
    } catch (error) {
      if (isShown()) this.tell(null);
      throw error;
    }
  }

  /** Tells what is known of its picture; null where that cannot be read: nothing of another one. */
  tell(sample) {
    Object.assign(this, { sample, marked: null, layers: null });
    this.title.textContent = `${sample ? `${sample.name} · ` : ""}${this.place + 1} of ${this.rows.length}`;
    this.draw();
    if (viewer.active === this) showDetails(this);
  }

  objectAt(event) {
    if (!this.sample) return null;
    const box = this.canvas.getBoundingClientRect();
    const [width, height] = this.sample.image;
    const scale = Math.min(box.width / width, box.height / height);
    const x = (event.clientX - box.x - (box.width - width * scale) / 2) / scale;
    const y = (event.clientY - box.y - (box.height - height * scale) / 2) / scale;
    const inside = this.sample.objects.filter(({ bbox: [x0, y0, x1, y1] }) => x >= x0 && x <= x1 && y >= y0 && y <= y1);
    const area = ({ bbox: [x0, y0, x1, y1] }) => (x1 - x0) * (y1 - y0);
    return inside.sort((a, b) => area(a) - area(b))[0]?.id ?? null;
  }

  mark(id) {
    if (this.marked === id) return;
    this.marked = id;
    this.draw();
    for (const row of document.querySelectorAll("#details tr[data-id]")) row.classList.toggle("marked", Number(row.dataset.id) === id);
  }

  draw() {
    const [width, height] = this.sample?.image ?? [0, 0];
    Object.assign(this.canvas, { width, height });
    if (!this.sample) return;
    const pen = this.canvas.getContext("2d");
    const { objects } = this.sample;
    const line = Math.max(1, width / 500);
    if (shows.masks) pen.drawImage(this.masks(), 0, 0);
    for (const object of objects) drawObject(pen, object, line, object.id === this.marked);
    if (shows.covers || this.marked !== null) drawCovers(pen, objects, line, shows.covers ? null : this.marked);
    if (shows.ids) for (const object of objects) drawId(pen, object, line);
  }

  /** Masks as one picture, made once. */
  masks() {
    if (this.layers) return this.layers;
    const [width, height] = this.sample.image;
    const data = new ImageData(width, height);
    for (const { mask, class: number } of this.sample.objects) paint(data, mask, HUES[number % HUES.length]);
    this.layers = Object.assign(document.createElement("canvas"), { width, height });
    this.layers.getContext("2d").putImageData(data, 0, 0);
    return this.layers;
  }
}

/** Paints the runs of a mask, which go down the columns; the first is outside. */
function paint({ data, width, height }, runs, hue) {
  const rgb = [0, 8, 4].map((n) => {
    const k = (n + hue / 30) % 12;
    return Math.round(255 * (0.6 - 0.36 * Math.max(-1, Math.min(k - 3, 9 - k, 1))));
  });
  let pixel = 0;
  runs.forEach((run, i) => {
    if (i % 2) {
      for (let p = pixel; p < pixel + run; p += 1) data.set([...rgb, 150], 4 * ((p % height) * width + Math.floor(p / height)));
    }
    pixel += run;
  });
}

function drawObject(pen, object, line, isMarked) {
  const { bbox: [x0, y0, x1, y1], unlabelled, class: number } = object;
  pen.lineWidth = isMarked ? 2.5 * line : line;
  pen.setLineDash(unlabelled ? [4 * line, 3 * line] : []);
  pen.strokeStyle = unlabelled ? "rgb(235 235 235 / .8)" : color(number);
  if (shows.boxes) pen.strokeRect(x0, y0, x1 - x0, y1 - y0);
  if (!isMarked && shows.boxes) return;
  for (const ring of object.outline) {
    pen.beginPath();
    ring.forEach(([x, y]) => pen.lineTo(x, y));
    pen.closePath();
    pen.stroke();
  }
}

const middle = ({ bbox: [x0, y0, x1, y1] }) => [(x0 + x1) / 2, (y0 + y1) / 2];

/** An arrow from each object to what it lies over. */
function drawCovers(pen, objects, line, only) {
  const byId = new Map(objects.map((object) => [object.id, object]));
  pen.setLineDash([]);
  pen.lineWidth = 1.6 * line;
  for (const below of objects) {
    for (const id of below.covered_by) {
      const above = byId.get(id);
      if (!above || (only !== null && only !== id && only !== below.id)) continue;
      arrow(pen, middle(above), middle(below), 7 * line, color(above.class));
    }
  }
}

function arrow(pen, [x0, y0], [x1, y1], head, style) {
  const angle = Math.atan2(y1 - y0, x1 - x0);
  pen.strokeStyle = pen.fillStyle = style;
  pen.beginPath();
  pen.moveTo(x0, y0);
  pen.lineTo(x1 - head * Math.cos(angle), y1 - head * Math.sin(angle));
  pen.stroke();
  pen.beginPath();
  pen.moveTo(x1, y1);
  for (const turn of [-0.4, 0.4]) pen.lineTo(x1 - 1.6 * head * Math.cos(angle + turn), y1 - 1.6 * head * Math.sin(angle + turn));
  pen.fill();
}

function drawId(pen, object, line) {
  const [x, y] = middle(object);
  const size = 11 * line;
  pen.font = `600 ${size}px system-ui, sans-serif`;
  const { width } = pen.measureText(object.id);
  pen.fillStyle = object.unlabelled ? "rgb(60 60 60 / .85)" : color(object.class, 0.9);
  pen.beginPath();
  pen.roundRect(x - width / 2 - 0.35 * size, y - 0.7 * size, width + 0.7 * size, 1.4 * size, 0.4 * size);
  pen.fill();
  pen.fillStyle = object.unlabelled ? "#ddd" : "#111";
  pen.textAlign = "center";
  pen.textBaseline = "middle";
  pen.fillText(object.id, x, y);
}

const viewer = { panes: [], active: null };

function view(place) {
  grid.place = place;
  const pane = new Pane(set, set.rows, place);
  viewer.panes = [pane];
  at("grid").hidden = true;
  at("viewer").hidden = at("details").hidden = false;
  document.querySelector("main").classList.add("viewing");
  showPanes(pane);
  trying(() => pane.show());
}

function showPanes(active) {
  at("panes").replaceChildren(...viewer.panes.map((pane) => pane.root));
  at("beside").setAttribute("aria-pressed", viewer.panes.length > 1);
  activate(active);
}

function activate(pane) {
  viewer.active = pane;
  for (const other of viewer.panes) other.root.classList.toggle("active", viewer.panes.length > 1 && other === pane);
  showDetails(pane);
}

function closeViewer() {
  if (at("viewer").hidden) return;
  const [first] = viewer.panes;
  viewer.panes = [];
  at("viewer").hidden = at("details").hidden = true;
  at("grid").hidden = false;
  document.querySelector("main").classList.remove("viewing");
  grid.show(false);
  if (first?.listing === set.listing) {
    grid.reveal(first.place);
    grid.scroll();
    grid.tiles.get(first.place)?.focus();
  }
}

/** A second picture beside the first: the next one, until another folder is chosen for it. */
function beside() {
  if (!viewer.panes.length) return;
  const [first, second] = viewer.panes;
  if (second) {
    viewer.panes = [first];
    showPanes(first);
    return;
  }
  const pane = new Pane(first, first.rows, Math.min(first.place + 1, first.rows.length - 1));
  pane.names = first.names;
  viewer.panes = [first, pane];
  showPanes(pane);
  trying(() => pane.show());
}

function toggle(what) {
  shows[what] = !shows[what];
  at(what).setAttribute("aria-pressed", shows[what]);
  for (const pane of viewer.panes) pane.draw();
}

const percent = (share) => (share === null ? "" : `${Math.round(100 * share)} %`);

function showDetails(pane) {
  const { sample } = pane;
  if (!sample) return at("details").replaceChildren();
  const facts = [["File", sample.file], ["Size", sample.image.join(" × ")], ["Background", sample.background || "not known"],
    ["Objects", sample.objects.length], ["Labels", sample.objects.filter((object) => !object.unlabelled).length]];
  if (sample.distractors.length) facts.push(["Distractors", sample.distractors.length]);
  at("details").replaceChildren(
    element("h2", {}, sample.name),
    element("dl", { class: "facts" }, ...facts.flatMap(([name, value]) => [element("dt", {}, name), element("dd", {}, String(value))])),
    ...advice(sample), objectTable(pane), ...drawTable(sample));
  return undefined;
}

function advice(sample) {
  const lines = sample.rejected.map((why) => `a scene was rejected: ${why}`);
  if (sample.knotted.length) lines.push(`objects ${sample.knotted.join(", ")} overlap in a cycle`);
  return lines.length ? [element("ul", { class: "advice" }, ...lines.map((line) => element("li", { class: "warn" }, line)))] : [];
}

function objectTable(pane) {
  const rows = pane.sample.objects.map((object) => element("tr", {
    "data-id": object.id, title: object.unlabelled ? `no label: ${object.unlabelled}` : "has a label",
    onpointerenter: () => pane.mark(object.id), onpointerleave: () => pane.mark(null),
  },
    element("td", {}, String(object.id)),
    element("td", {}, element("span", { class: `swatch ${object.unlabelled ? "none" : ""}`, "data-class": object.class % HUES.length }), pane.names[object.class] ?? `class ${object.class}`),
    element("td", { class: "number" }, percent(object.visible)),
    element("td", {}, object.covered_by.length ? `under ${object.covered_by.join(", ")}` : object.unlabelled ? object.unlabelled : "")));
  return element("table", { class: "objects" },
    element("thead", {}, element("tr", {}, ...["Id", "Class", "Seen", ""].map((name) => element("th", {}, name)))),
    element("tbody", {}, ...rows));
}

function drawTable(sample) {
  const draws = Object.entries(sample.draws);
  if (!draws.length) return [];
  const list = element("dl", { class: "facts draws" });
  const show = (words) => list.replaceChildren(...draws
    .filter(([name]) => name.includes(words))
    .flatMap(([name, value]) => [element("dt", {}, name), element("dd", {}, String(Number(value.toPrecision(6))))]));
  show("");
  const search = element("input", { type: "search", placeholder: "objects[0], yaw, lights …", "aria-label": "find a drawn value", oninput: () => show(search.value.trim()) });
  return [element("h2", {}, `Draws (${draws.length})`), search, list];
}

// The page.

let folders = [];

at("folder").addEventListener("change", () => trying(() => open(at("folder").value)));
at("filter").addEventListener("change", (event) => {
  if (event.target !== at("folder")) trying(() => { closeViewer(); return find(); });
});
at("filter").addEventListener("submit", (event) => event.preventDefault());
at("filter").addEventListener("reset", () => setTimeout(() => { at("folder").value = set.folder; trying(find); }));
at("grid").addEventListener("scroll", () => grid.scroll(), { passive: true });
new ResizeObserver(() => { if (!at("grid").hidden && set.rows.length) grid.show(false); }).observe(at("grid"));
at("back").addEventListener("click", closeViewer);
at("beside").addEventListener("click", beside);
for (const what of Object.keys(shows)) at(what).addEventListener("click", () => toggle(what));

/** Moves to another picture: in the grid from tile to tile, in the viewer to the next one. */
function step(by) {
  if (!at("viewer").hidden) return viewer.active.move(Math.sign(by));
  const here = [...grid.tiles].find(([, tile]) => tile === document.activeElement)?.[0];
  const place = here === undefined ? 0 : Math.min(set.rows.length - 1, Math.max(0, here + by));
  grid.reveal(place);
  grid.scroll();
  grid.tiles.get(place)?.focus();
  return undefined;
}

shortcuts([
  ["ArrowRight", "next picture", () => step(1)],
  ["ArrowLeft", "previous picture", () => step(-1)],
  ["ArrowDown", "", () => step(grid.columns)],
  ["ArrowUp", "", () => step(-grid.columns)],
  ["Escape", "back to all pictures", closeViewer],
  ["b", "boxes", () => toggle("boxes")],
  ["m", "masks", () => toggle("masks")],
  ["i", "ids", () => toggle("ids")],
  ["c", "what covers what", () => toggle("covers")],
  ["2", "compare with another picture", beside],
  ["x", "switch between two pictures", () => viewer.panes.length > 1 && activate(viewer.panes.find((pane) => pane !== viewer.active))],
  ["o", "outliers first", () => { at("order").value = "unlike"; closeViewer(); trying(find); }],
]);

await trying(async () => {
  folders = await api("api/dataset/folders");
  at("folder").replaceChildren(...folders.map((name) => element("option", { value: name }, name || ".")));
  const asked = new URLSearchParams(location.search).get("folder");
  if (asked !== null || folders.length) await open(asked ?? folders[0]);
  else say("no dataset or picture in this folder");
});
