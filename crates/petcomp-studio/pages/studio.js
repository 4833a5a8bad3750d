// What all pages share: the server, the frame, news, keys.

/** Which tab this is: where only its newest request matters, its older ones are given up. */
const TAB = crypto.randomUUID();

const PAGES = [
  ["", "Overview"],
  ["corners", "Corners"],
  ["scale", "Scale"],
  ["capture", "Capture"],
  ["mattes", "Mattes"],
  ["recipe", "Recipe"],
  ["dataset", "Dataset"],
];

/** A request that was refused: `message` says why, `status` is 409 for a stale save, 410 where a newer request took its place. */
class Refused extends Error {
  constructor(status, message) {
    super(message);
    this.status = status;
  }
  get stale() { return this.status === 409; }
  get superseded() { return this.status === 410; }
}

async function request(path, body, signal) {
  const headers = { "x-tab": TAB };
  const options = { headers, signal };
  if (body !== undefined) {
    headers["content-type"] = "application/json";
    options.method = "POST";
    options.body = JSON.stringify(body);
  }
  let response;
  try {
    response = await fetch(path, options);
  } catch (error) {
    if (error.name === "AbortError") throw error;
    throw new Refused(0, "the studio does not answer: is `petcomp studio` still running?");
  }
  if (!response.ok) throw new Refused(response.status, await reason(response));
  return response;
}

async function reason(response) {
  const text = await response.text();
  try {
    return JSON.parse(text).error;
  } catch {
    return text || `status ${response.status}`;
  }
}

/** Asks the server: `api("api/overview")` gets, `api("api/corners/solve", label)` posts JSON. Returns what the JSON says. */
export async function api(path, body, signal) {
  return (await request(path, body, signal)).json();
}

/** Asks for a picture, and returns an address for `img.src`; revoke it when it is not needed any more. */
export async function picture(path, body, signal) {
  return URL.createObjectURL(await (await request(path, body, signal)).blob());
}

/** `a?file=x` of `query("a", {file: "x"})`; values that are undefined or null are left out. */
export function query(path, values) {
  const given = Object.entries(values).filter(([, value]) => value !== undefined && value !== null);
  return `${path}?${new URLSearchParams(given)}`;
}

/**
 * An element: `element("button", { class: "main", onclick: save }, "Save")`. Text is never markup, whatever is in it.
 * Attributes that begin with `on` are listeners, `true` is an attribute without a value, `false`, `null` and `undefined` are left out.
 */
export function element(name, attributes = {}, ...children) {
  const made = document.createElement(name);
  for (const [key, value] of Object.entries(attributes)) {
    if (key.startsWith("on")) made.addEventListener(key.slice(2), value);
    else if (value === true) made.setAttribute(key, "");
    else if (value !== false && value !== null && value !== undefined) made.setAttribute(key, value);
  }
  made.append(...children.flat().filter((child) => child !== null && child !== undefined && child !== false));
  return made;
}

/** The element with an id. */
export const at = (id) => document.getElementById(id);

/** Says one line at the foot of the page: what was done ("good"), what could not be ("bad"). */
export function say(line, kind = "") {
  const news = document.querySelector("body > footer");
  news.className = kind;
  news.textContent = line;
  news.title = line;
}

/** Runs something, and says so where it fails; undefined then. Requests that newer ones replaced fail in silence. */
export async function trying(act) {
  try {
    return await act();
  } catch (error) {
    if (error.superseded || error.name === "AbortError") return undefined;
    say(error.message, "bad");
    if (!(error instanceof Refused)) console.error(error);
    return undefined;
  }
}

const keys = [];

/**
 * Keys of the page: `shortcuts([["s", "save", save], ["Shift+ArrowUp", "a pixel up", up]])`. Names are those of KeyboardEvent.key,
 * behind Ctrl+, Alt+ and Shift+. While one types all but Ctrl+S rest: the others are the field's. A description of "" is not shown.
 */
export function shortcuts(list) {
  keys.push(...list);
}

function keyName(event) {
  const held = [event.ctrlKey || event.metaKey ? "Ctrl+" : "", event.altKey ? "Alt+" : ""];
  const key = event.key.length === 1 ? event.key.toLowerCase() : event.key;
  // Shift is part of a sign like "?", and a modifier of letters and named keys.
  const shift = event.shiftKey && (key.length > 1 || /[a-z]/.test(key)) ? "Shift+" : "";
  return held.join("") + shift + key;
}

function isTyping(target) {
  return target instanceof Element && target.matches("input:not([type=range]):not([type=checkbox]):not([type=radio]), select, textarea");
}

/** What a key presses that has the focus: it goes first. */
function isPressed(target, key) {
  return (key === "Enter" || key === " ") && target instanceof Element && target.matches("button, a, summary");
}

/** Keys that go on while they are held; the others act once for each press. */
const HELD = /Arrow|^(Ctrl\+(Shift\+)?z|[-+=[\].,])$/i;

function pressed(event) {
  const name = keyName(event);
  if (event.repeat && event.key === "Enter") event.preventDefault();
  if (isPressed(event.target, event.key)) return;
  if (document.querySelector("dialog[open]") || (isTyping(event.target) && name !== "Ctrl+s")) return;
  const found = keys.find(([key]) => key.toLowerCase() === name.toLowerCase());
  if (!found) return;
  event.preventDefault();
  if (!event.repeat || HELD.test(name)) found[2](event);
}

const SIGNS = { ArrowUp: "↑", ArrowDown: "↓", ArrowLeft: "←", ArrowRight: "→", " ": "Space", Escape: "Esc" };

function keyCaps(name) {
  const parts = name === "+" ? ["+"] : name.split("+").map((part) => part || "+");
  return parts.map((part) => element("kbd", {}, SIGNS[part] ?? (part.length === 1 ? part.toUpperCase() : part)));
}

/** Shows every key of the page. */
function showKeys() {
  const rows = keys
    .filter(([, what]) => what)
    .flatMap(([key, what]) => [element("dt", {}, ...keyCaps(key)), element("dd", {}, what)]);
  const dialog = element("dialog", { "aria-label": "keys" },
    element("h2", {}, "Keys"),
    element("dl", { class: "keys" }, ...rows),
    element("form", { method: "dialog" }, element("button", { class: "main" }, "Close")));
  dialog.addEventListener("close", () => dialog.remove());
  document.body.append(dialog);
  dialog.showModal();
}

/** Lengths in the unit that `select` shows, which every page remembers; `changed` when it is another one. */
export function lengths(select, changed) {
  const key = "petcomp unit";
  select.value = localStorage.getItem(key) ?? "1";
  select.addEventListener("change", () => {
    localStorage.setItem(key, select.value);
    changed();
  });
  const unit = () => Number(select.value);
  const shown = (metres) =>
    (metres === undefined || metres === null ? "" : String(Number((metres / unit()).toPrecision(6))));
  return {
    /** A length as a field shows it. */
    shown,
    /** Shows a length in a field, in place of whatever was typed there. */
    show(field, metres) {
      field.value = shown(metres);
      field.setCustomValidity("");
    },
    /** What a field says, in metres; null for nothing, undefined for what is no length: the field then says so. */
    read(field) {
      const text = field.value.trim().replace(",", ".");
      const value = text === "" ? null : Number((Number(text) * unit()).toPrecision(9));
      const wrong = value !== null && !(value >= 0);
      field.setCustomValidity(wrong ? "expected a length (a number)" : "");
      return wrong ? undefined : value;
    },
  };
}

/** Asks a person to choose one of some buttons; null where they would not. `what` is a text or an element. */
export function choice(title, what, options) {
  return new Promise((resolve) => {
    const buttons = options.map((option, i) => element("button", { class: i === options.length - 1 ? "main" : null, value: option }, option));
    const dialog = element("dialog", { "aria-label": title },
      element("h2", {}, title),
      element("form", { method: "dialog", class: "choice" }, element("div", {}, what), element("div", { class: "buttons" }, ...buttons)));
    // A key that is still held answers nothing.
    dialog.addEventListener("keydown", (event) => event.repeat && event.preventDefault());
    dialog.addEventListener("close", () => {
      dialog.remove();
      resolve(dialog.returnValue || null);
    });
    document.body.append(dialog);
    dialog.showModal();
  });
}

/**
 * Saves a file of which the page has read a version, and returns what `save(version)` does. Where the file has changed since, a person says
 * whose it shall be, or nothing yet: `load()` takes theirs, and null is returned; mine is saved over the version that `now()` finds.
 */
export async function saveOrAsk(version, { save, now, load }) {
  try {
    return await save(version);
  } catch (error) {
    if (!error.stale) throw error;
    const whose = await choice("Which version do you want to keep?", error.message, ["Decide later", "Load theirs", "Save mine"]);
    if (whose === "Save mine") return save(await now());
    if (whose !== "Load theirs") throw error;
    await load();
    return null;
  }
}

/** Fills the frame: navigation, and the keys that every page has. */
export function frame(current) {
  const links = PAGES.map(([path, title]) =>
    element("a", {
      href: path === "" ? "./" : path,
      class: path === "" ? "brand" : null,
      "aria-current": path === current ? "page" : null,
    }, path === "" ? "petcomp studio" : title));
  document.querySelector("body > header").replaceChildren(
    ...links,
    element("span", { class: "grow" }),
    element("button", { onclick: showKeys, title: "keyboard shortcuts" }, "Keys ", element("kbd", {}, "?")));
  shortcuts([
    ["?", "show these keys", showKeys],
    ...PAGES.map(([path, title], i) => [`Alt+${i + 1}`, i ? `go to ${title.toLowerCase()}` : "go to the overview", () => location.assign(path || "./")]),
  ]);
  addEventListener("keydown", pressed);
  // A button that the mouse has pressed does not take the next Enter.
  addEventListener("click", (event) => event.detail > 0 && event.target.closest("button")?.blur());
}
