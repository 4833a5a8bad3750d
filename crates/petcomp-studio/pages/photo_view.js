// A photo on a stage: zoom, shift, points that are clicked, dragged and nudged, and a magnifier.

import { picture, query } from "./studio.js";

const MAX_ZOOM = 32;
/** How near to a point a press takes it, and how far a press may move and still be a click: CSS pixels. */
const GRAB = 14;
const SLACK = 4;
/** The magnifier shows the brightest of what it shows so bright, by so much at most. */
const BRIGHT = 225;
const MAX_GAIN = 3;
const MAGNIFIER = { size: 176, zoom: 8, margin: 12 };

/** The colours of what is drawn over photos: on any photo, in light and dark. */
export const INK = {
  point: "#ff2d78", chosen: "#ffd60a", rectangle: "#2ee65c", grid: "rgb(255 255 255 / .55)", walls: "#ff8c1a",
  horizon: "#40c8ff", marker: "#c58bff", shade: "rgb(0 0 0 / .65)", text: "#ffffff",
};

/** A photo for `PhotoView.show`, ready to be drawn, as its file is now: an image takes what the page has shown before, unasked. */
export async function loaded(file) {
  const photo = new Image();
  photo.src = await picture(query("api/photo", { file }));
  try {
    await photo.decode();
  } finally {
    URL.revokeObjectURL(photo.src);
  }
  return photo;
}

/** A canvas over all of `stage`. `events`: click(px), move(points), moved(points), choose(i), draw(view). Positions are pixels of the photo. */
export class PhotoView {
  constructor(stage, events = {}) {
    this.events = events;
    this.canvas = document.createElement("canvas");
    this.canvas.tabIndex = 0;
    this.canvas.setAttribute("aria-label", "photo");
    stage.append(this.canvas);
    this.context = this.canvas.getContext("2d");
    this.photo = null;
    this.points = [];
    this.chosen = -1;
    this.zoom = 1;
    /** How much brighter than it is the photo is shown. */
    this.light = 1;
    this.left = 0;
    this.top = 0;
    this.pointers = new Map();
    this.pointer = null;
    this.listen();
    new ResizeObserver(() => this.resized()).observe(stage);
  }

  listen() {
    const on = (name, act) => this.canvas.addEventListener(name, act.bind(this));
    on("pointerdown", this.pressed);
    on("pointermove", this.moved);
    on("pointerup", this.released);
    on("pointercancel", this.released);
    on("pointerleave", () => { this.pointer = null; this.draw(); });
    this.canvas.addEventListener("wheel", (event) => {
      event.preventDefault();
      this.zoomAt(this.place(event), Math.exp(-event.deltaY / 300));
    }, { passive: false });
  }

  /** Shows another photo, all of it, or none. */
  show(photo) {
    this.photo = photo;
    this.fit();
  }

  get size() { return this.photo ? [this.photo.naturalWidth, this.photo.naturalHeight] : [1, 1]; }

  fit() {
    const [width, height] = this.size;
    const { clientWidth, clientHeight } = this.canvas;
    this.zoom = 0.94 * Math.min(clientWidth / width, clientHeight / height) || 1;
    this.left = (clientWidth - width * this.zoom) / 2;
    this.top = (clientHeight - height * this.zoom) / 2;
    this.fitted = true;
    this.draw();
  }

  resized() {
    if (this.fitted) this.fit();
    else this.draw();
  }

  /** From pixels of the photo to CSS pixels of the stage, and back. */
  onStage([x, y]) { return [this.left + x * this.zoom, this.top + y * this.zoom]; }
  onPhoto([x, y]) { return [(x - this.left) / this.zoom, (y - this.top) / this.zoom]; }

  zoomAt([x, y], factor) {
    const zoom = Math.min(Math.max(this.zoom * factor, 0.02), MAX_ZOOM);
    this.left = x - (x - this.left) * zoom / this.zoom;
    this.top = y - (y - this.top) * zoom / this.zoom;
    this.zoom = zoom;
    this.fitted = false;
    this.draw();
  }

  zoomBy(factor) {
    const center = this.points[this.chosen];
    const at = center ? this.onStage(center) : [this.canvas.clientWidth / 2, this.canvas.clientHeight / 2];
    this.zoomAt(at, factor);
  }

  brighten() {
    this.light = this.light >= 4 ? 1 : 2 * this.light;
    this.draw();
  }

  setPoints(points, chosen = this.chosen) {
    this.points = points;
    this.chosen = Math.min(chosen, points.length - 1);
    this.draw();
  }

  choose(i) {
    this.chosen = i < this.points.length ? i : -1;
    this.events.choose?.(this.chosen);
    this.draw();
  }

  /** Moves the chosen point by pixels of the photo. */
  nudge(dx, dy) {
    const point = this.points[this.chosen];
    if (!point) return;
    this.pointer = null;
    this.points[this.chosen] = [point[0] + dx, point[1] + dy];
    this.events.move?.(this.points);
    this.events.moved?.(this.points);
    this.draw();
  }

  place(event) {
    const box = this.canvas.getBoundingClientRect();
    return [event.clientX - box.left, event.clientY - box.top];
  }

  near(at) {
    const distances = this.points.map((point) => {
      const [x, y] = this.onStage(point);
      return Math.hypot(x - at[0], y - at[1]);
    });
    const nearest = distances.indexOf(Math.min(...distances));
    return nearest >= 0 && distances[nearest] < GRAB ? nearest : -1;
  }

  pressed(event) {
    // The others open menus, which swallow the release.
    if (event.button !== 0 || event.ctrlKey) return;
    const at = this.place(event);
    this.canvas.focus({ preventScroll: true });
    this.canvas.setPointerCapture(event.pointerId);
    this.pointers.set(event.pointerId, at);
    const pinches = this.pointers.size > 1;
    this.press = { at, last: at, point: pinches ? -1 : this.near(at), moved: pinches };
    if (this.press.point >= 0) this.choose(this.press.point);
  }

  moved(event) {
    const at = this.place(event);
    this.pointer = at;
    const before = this.pointers.get(event.pointerId);
    if (before && this.press) this.dragged(event, before, at);
    if (before) this.pointers.set(event.pointerId, at);
    this.draw();
  }

  dragged(event, before, at) {
    const { press } = this;
    press.moved ||= Math.hypot(at[0] - press.at[0], at[1] - press.at[1]) > SLACK;
    if (!press.moved) return;
    const [dx, dy] = [at[0] - before[0], at[1] - before[1]];
    if (this.pointers.size > 1) this.pinched(event.pointerId, before, at);
    else if (press.point >= 0) this.dragPoint(press.point, dx, dy, event.shiftKey);
    else this.shift(dx, dy);
  }

  /** With Shift ten times as fine. */
  dragPoint(i, dx, dy, fine) {
    const scale = (fine ? 0.1 : 1) / this.zoom;
    const [x, y] = this.points[i];
    this.points[i] = [x + dx * scale, y + dy * scale];
    this.events.move?.(this.points);
  }

  shift(dx, dy) {
    this.left += dx;
    this.top += dy;
    this.fitted = false;
  }

  pinched(id, before, at) {
    const other = [...this.pointers].find(([key]) => key !== id)?.[1];
    if (!other) return;
    const spread = (p) => Math.hypot(p[0] - other[0], p[1] - other[1]) || 1;
    this.shift((at[0] - before[0]) / 2, (at[1] - before[1]) / 2);
    this.zoomAt([(at[0] + other[0]) / 2, (at[1] + other[1]) / 2], spread(at) / spread(before));
  }

  released(event) {
    const { press } = this;
    this.pointers.delete(event.pointerId);
    if (!press || this.pointers.size > 0) return;
    this.press = null;
    if (!press.moved && press.point < 0 && event.type === "pointerup") this.events.click?.(this.onPhoto(press.at));
    else if (press.moved && press.point >= 0) this.events.moved?.(this.points);
    if (event.pointerType === "touch") this.pointer = null;
    this.draw();
  }

  draw() {
    if (this.waiting) return;
    this.waiting = requestAnimationFrame(() => {
      this.waiting = 0;
      this.drawNow();
    });
  }

  drawNow() {
    const { context, canvas } = this;
    // Each time: a window that goes to another screen has other pixels and the same size.
    const ratio = devicePixelRatio;
    const [wide, high] = [canvas.clientWidth, canvas.clientHeight].map((side) => Math.round(side * ratio));
    if (canvas.width !== wide || canvas.height !== high) Object.assign(canvas, { width: wide, height: high });
    context.setTransform(1, 0, 0, 1, 0, 0);
    context.clearRect(0, 0, canvas.width, canvas.height);
    if (!this.photo) return;
    context.setTransform(ratio, 0, 0, ratio, 0, 0);
    const [width, height] = this.size;
    context.imageSmoothingEnabled = this.zoom < 3;
    context.imageSmoothingQuality = "high";
    context.filter = this.light > 1 ? `brightness(${this.light})` : "none";
    context.drawImage(this.photo, this.left, this.top, width * this.zoom, height * this.zoom);
    context.filter = "none";
    this.events.draw?.(this);
    this.points.forEach((point, i) => this.drawPoint(point, i));
    this.drawMagnifier();
  }

  /** A line through positions of the photo, with a dark edge so that it is seen on everything. */
  line(positions, colour, width = 1.5, dash = []) {
    const { context } = this;
    context.beginPath();
    positions.forEach((at, i) => context[i ? "lineTo" : "moveTo"](...this.onStage(at)));
    context.setLineDash(dash);
    context.lineJoin = "round";
    context.strokeStyle = colour;
    context.lineWidth = width;
    context.stroke();
    context.setLineDash([]);
  }

  /** A word at a position of the photo. */
  word(text, at, colour = INK.text) {
    const { context } = this;
    const [x, y] = this.onStage(at);
    context.font = "600 12px system-ui, sans-serif";
    context.textAlign = "center";
    context.textBaseline = "middle";
    const width = context.measureText(text).width + 10;
    context.fillStyle = INK.shade;
    context.beginPath();
    context.roundRect(x - width / 2, y - 9, width, 18, 4);
    context.fill();
    context.fillStyle = colour;
    context.fillText(text, x, y + 0.5);
  }

  drawPoint(point, i) {
    const { context } = this;
    const [x, y] = this.onStage(point);
    const colour = i === this.chosen ? INK.chosen : INK.point;
    for (const [stroke, width] of [[INK.shade, 4], [colour, 1.6]]) {
      context.strokeStyle = stroke;
      context.lineWidth = width;
      context.beginPath();
      context.arc(x, y, 7, 0, 2 * Math.PI);
      for (const [dx, dy] of [[1, 0], [-1, 0], [0, 1], [0, -1]]) {
        context.moveTo(x + 3 * dx, y + 3 * dy);
        context.lineTo(x + 12 * dx, y + 12 * dy);
      }
      context.stroke();
    }
  }

  /** What the magnifier shows: the point that is moved or was nudged, or else what is under the pointer. */
  magnified() {
    if (this.pointer && !(this.press?.point >= 0)) return this.onPhoto(this.pointer);
    return this.points[this.chosen] ?? null;
  }

  /** How much brighter the magnifier is, so that what is dark around a position is seen. */
  gainAt([x, y], side) {
    const count = Math.ceil(side);
    this.sampler ??= new OffscreenCanvas(count, count).getContext("2d", { willReadFrequently: true });
    const { canvas } = this.sampler;
    this.sampler.clearRect(0, 0, canvas.width, canvas.height);
    this.sampler.drawImage(this.photo, x - side / 2, y - side / 2, side, side, 0, 0, canvas.width, canvas.height);
    const bytes = this.sampler.getImageData(0, 0, canvas.width, canvas.height).data;
    const brightest = bytes.reduce((most, byte, i) => (i % 4 < 3 && byte > most ? byte : most), 1);
    return Math.min(Math.max(BRIGHT / brightest, 1), MAX_GAIN);
  }

  drawMagnifier() {
    const center = this.magnified();
    const { size, margin } = MAGNIFIER;
    if (!center || this.canvas.clientWidth < 2.2 * size) return;
    const { context } = this;
    const zoom = Math.max(MAGNIFIER.zoom, 2 * this.zoom);
    const pointer = this.pointer ?? this.onStage(center);
    const atLeft = pointer[0] > this.canvas.clientWidth / 2;
    const left = atLeft ? margin : this.canvas.clientWidth - size - margin;
    const top = margin;
    const shown = size / zoom;
    context.save();
    context.beginPath();
    context.roundRect(left, top, size, size, 10);
    context.fillStyle = "#000";
    context.fill();
    context.clip();
    context.imageSmoothingEnabled = false;
    // Only what is inside the photo: browsers scale the rest away.
    context.translate(left + size / 2, top + size / 2);
    context.scale(zoom, zoom);
    context.translate(-center[0], -center[1]);
    const [x, y] = [Math.max(Math.floor(center[0] - shown), 0), Math.max(Math.floor(center[1] - shown), 0)];
    const [width, height] = [2 * shown + 2, 2 * shown + 2].map(Math.ceil);
    context.filter = `brightness(${this.gainAt(center, shown)})`;
    context.drawImage(this.photo, x, y, width, height, x, y, width, height);
    context.restore();
    context.save();
    context.beginPath();
    context.roundRect(left, top, size, size, 10);
    context.strokeStyle = "#fff";
    context.lineWidth = 1.5;
    context.stroke();
    context.clip();
    context.strokeStyle = INK.chosen;
    context.lineWidth = 1;
    context.beginPath();
    const [cx, cy] = [left + size / 2, top + size / 2];
    for (const [dx, dy] of [[1, 0], [-1, 0], [0, 1], [0, -1]]) {
      context.moveTo(cx + 5 * dx, cy + 5 * dy);
      context.lineTo(cx + size * dx, cy + size * dy);
    }
    context.stroke();
    context.fillStyle = INK.shade;
    context.fillRect(left, top + size - 20, size, 20);
    context.fillStyle = INK.text;
    context.font = "12px ui-monospace, monospace";
    context.textAlign = "center";
    context.textBaseline = "middle";
    context.fillText(`${center[0].toFixed(1)}, ${center[1].toFixed(1)}`, cx, top + size - 10);
    context.restore();
  }
}

/** The keys by which every photo is looked at and its points are moved. */
export function viewKeys(view) {
  const move = (dx, dy) => () => view.nudge(dx, dy);
  const step = (way) => () => view.points.length && view.choose((view.chosen + way + view.points.length) % view.points.length);
  const arrows = (modifier, by, shown) => [["ArrowUp", 0, -by], ["ArrowDown", 0, by], ["ArrowLeft", -by, 0], ["ArrowRight", by, 0]]
    .map(([key, dx, dy], i) => [modifier + key, i ? "" : shown, move(dx, dy)]);
  return [
    [".", "next point", step(1)],
    [",", "previous point", step(-1)],
    ...arrows("", 0.1, "move the point by 0.1 pixel (all four arrows)"),
    ...arrows("Shift+", 1, "by 1 pixel"),
    ...arrows("Ctrl+", 10, "by 10 pixels"),
    ["b", "brighten the photo to see dark corners", () => view.brighten()],
    ["f", "fit the photo", () => view.fit()],
    ["+", "zoom in (or the wheel)", () => view.zoomBy(1.5)],
    ["=", "", () => view.zoomBy(1.5)],
    ["-", "zoom out", () => view.zoomBy(1 / 1.5)],
  ];
}
