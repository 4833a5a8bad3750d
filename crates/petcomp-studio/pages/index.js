import { api, element, frame, query, trying } from "./studio.js";

frame("");

const count = (list, one, many = `${one}s`) => `${list.length} ${list.length === 1 ? one : many}`;

/** What each page is for, and how far this folder is. */
const CARDS = [
  ["corners", "Corners", "Click the four corners of a surface and see the camera at once.",
    (found) => `${count(found.photos, "photo")}, ${count(found.labels, "label")}, ${count(found.cameras, "camera")}`],
  ["scale", "Scale", "Click the two ends of a ruler, or the corners of the screen, to get pixels per metre.",
    (found) => count(found.photos, "photo")],
  ["capture", "Capture", "Photograph objects on a display that shows black, white and stripes.",
    () => "measures what they let through"],
  ["mattes", "Mattes", "Check every cut-out and correct it with a few strokes.",
    (found) => count(found.assets, "folder of assets", "folders of assets")],
  ["recipe", "Recipe", "Move a slider and see how the pictures change.",
    (found) => count(found.recipes, "recipe")],
  ["dataset", "Dataset", "Pictures with their labels, outliers first.",
    (found) => count(found.datasets, "dataset")],
];

/** A few photos that a page is about. */
const SAMPLES = {
  corners: (found) => found.labels.map((label) => label.replace(/\.label\.json$/, ".")),
  scale: (found) => found.photo_lists.map((list) => list.replace(/photos\.[^/]*$/, "")),
};
const MOST_SAMPLES = 3;

function strip(page, found) {
  const beginnings = SAMPLES[page]?.(found) ?? [];
  const photos = found.photos.filter((photo) => beginnings.some((beginning) => photo.startsWith(beginning)));
  const shown = photos.slice(0, MOST_SAMPLES);
  return shown.length > 0 && element("div", { class: "strip" },
    ...shown.map((file) => element("img", { alt: "", src: query("api/photo", { file, side: 240 }) })));
}

function card([page, title, what, state], found) {
  return element("a", { class: "card", href: page },
    element("h2", {}, title), element("p", {}, what), element("p", { class: "soft" }, state(found)), strip(page, found));
}

await trying(async () => {
  const found = await api("api/overview");
  document.title = `${found.folder} · petcomp studio`;
  document.querySelector("main").replaceChildren(
    element("h1", {}, found.folder),
    element("nav", { class: "cards" }, ...CARDS.map((each) => card(each, found))));
});
