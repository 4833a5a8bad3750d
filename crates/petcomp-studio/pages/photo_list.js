// The list of photos beside a stage.

import { element, query, say } from "./studio.js";

const folderOf = (photo) => (photo.includes("/") ? photo.slice(0, photo.lastIndexOf("/")) : "");
const nameOf = (photo) => photo.split("/").pop();

/** Fills `place` with photos: `show(photo)` opens one, `mark(entry)` is what stands below its name, [text, kind]. */
export function photoList(place, show, mark) {
  const entries = [];
  let current = null;

  function row(entry) {
    return element("li", { "data-photo": entry.photo },
      element("button", { type: "button", title: entry.photo, onclick: () => show(entry.photo) },
        element("img", { loading: "lazy", alt: "", src: query("api/photo", { file: entry.photo, side: 112 }) }),
        element("span", { class: "name" }, nameOf(entry.photo), element("span", { class: "mark" }, ""))));
  }

  function rows() {
    let folder = "";
    return entries.flatMap((entry) => {
      const heading = folderOf(entry.photo) !== folder && (folder = folderOf(entry.photo));
      return heading ? [element("li", { class: "folder" }, heading), row(entry)] : [row(entry)];
    });
  }

  const entryOf = (photo) => entries.find((entry) => entry.photo === photo);

  /** Shows anew how far photos are; their pictures stay. */
  function showMarks() {
    for (const item of place.querySelectorAll("[data-photo]")) {
      const [text, kind] = mark(entryOf(item.dataset.photo));
      const shown = item.querySelector(".mark");
      shown.className = `mark ${kind}`;
      shown.textContent = text;
      item.querySelector("button").toggleAttribute("aria-current", item.dataset.photo === current);
    }
  }

  return {
    entries,
    entryOf,
    showMarks,
    /** Shows photos, and opens that of the address, or the first that `wanted` takes. */
    async fill(found, wanted) {
      entries.push(...found);
      place.replaceChildren(...rows());
      showMarks();
      const asked = new URLSearchParams(location.search).get("photo");
      const first = entryOf(asked) ?? entries.find(wanted) ?? entries[0];
      if (first) await show(first.photo);
      else say("no photo in this folder: add some and reload this page");
    },
    choose(photo) {
      current = photo;
      showMarks();
      place.querySelector("[aria-current]")?.scrollIntoView({ block: "nearest", inline: "nearest" });
    },
    /** Opens the photo after this one, or before it. */
    step(way) {
      const next = entries[entries.indexOf(entryOf(current)) + way];
      if (next) show(next.photo);
    },
    /** Opens the next photo that `wanted` takes, if there is one. */
    next(wanted) {
      const here = entries.indexOf(entryOf(current));
      const next = [...entries.slice(here + 1), ...entries.slice(0, here)].find(wanted);
      if (next) show(next.photo);
    },
  };
}
