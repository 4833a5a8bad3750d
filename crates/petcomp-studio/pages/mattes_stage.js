// The stage: photo and cut-out on either side of a line, strokes over both, zoom.

/** What strokes are drawn in, by what they say. */
export const INKS = { object: "#37c871", not_object: "#ff5a4f", see_through: "#4db5ff", opaque: "#ffc233" };

const MAX_ZOOM = 16;
/** How strongly a stroke is drawn while it is painted, and when it has done its work. */
const INK_ALPHA = { fresh: 0.55, kept: 0.22 };

export class Stage {
  /** `painted(stroke)` is called with what was painted with the tool that is set. */
  constructor(canvas, painted) {
    this.canvas = canvas;
    this.painted = painted;
    this.size = null;
    this.images = { photo: null, layer: null };
    this.strokes = [];
    this.showsStrokes = true;
    this.tool = null;
    this.radius = 8;
    this.wipe = 0;
    this.view = { zoom: 1, x: 0, y: 0 };
    this.current = null;
    this.pointer = null;
    this.held = null;
    /** The pointer that holds it. */
    this.holder = null;
    new ResizeObserver(() => this.draw()).observe(canvas);
    canvas.addEventListener("pointerdown", (event) => this.#down(event));
    canvas.addEventListener("pointermove", (event) => this.#move(event));
    for (const end of ["pointerup", "pointercancel"]) canvas.addEventListener(end, (event) => this.#up(event));
    canvas.addEventListener("pointerleave", () => { this.pointer = null; this.draw(); });
    canvas.addEventListener("wheel", (event) => this.#wheel(event), { passive: false });
  }

  /** Shows another photo of `[width, height]`, all of it. */
  open(size) {
    this.size = size;
    this.images = { photo: null, layer: null };
    this.current = null;
    this.fit();
  }

  fit() {
    this.view = { zoom: 1, x: 0, y: 0 };
    this.draw();
  }

  zoom(times) {
    this.#zoomAt(times, this.canvas.clientWidth / 2, this.canvas.clientHeight / 2);
  }

  /** Where the photo lies on the canvas, CSS pixels: its scale and its corner. */
  #place() {
    const { clientWidth: width, clientHeight: height } = this.canvas;
    const [w, h] = this.size;
    const whole = Math.min((width - 24) / w, (height - 72) / h);
    const scale = whole * this.view.zoom;
    return { scale, x: (width - w * scale) / 2 + this.view.x, y: (height - 48 - h * scale) / 2 + this.view.y };
  }

  #zoomAt(times, x, y) {
    if (!this.size) return;
    const [px, py] = this.#onPhoto(x, y);
    this.view.zoom = Math.min(Math.max(this.view.zoom * times, 1), MAX_ZOOM);
    if (this.view.zoom === 1) return this.fit();
    const { scale, x: left, y: top } = this.#place();
    this.view.x += x - (left + px * scale);
    this.view.y += y - (top + py * scale);
    this.draw();
  }

  /** The pixel of the photo at a place of the canvas. */
  #onPhoto(x, y) {
    const place = this.#place();
    return [(x - place.x) / place.scale, (y - place.y) / place.scale];
  }

  #at(event) {
    const box = this.canvas.getBoundingClientRect();
    return [event.clientX - box.x, event.clientY - box.y];
  }

  #down(event) {
    if (!this.size || event.button > 1) return;
    // One at a time: a palm or a second finger does not paint, and a pen goes first.
    if (this.held && event.pointerType !== "pen") return;
    this.holder = event.pointerId;
    this.current = null;
    this.canvas.focus({ preventScroll: true });
    this.canvas.setPointerCapture(event.pointerId);
    const paints = this.tool && event.button === 0;
    this.held = paints ? "brush" : "photo";
    if (paints) this.current = { says: this.tool, radius_px: this.radius, points_px: [this.#rounded(event)] };
    this.pointer = this.#at(event);
    this.draw();
  }

  /** To a hundredth of a pixel. */
  #rounded(event) {
    return this.#onPhoto(...this.#at(event)).map((v) => Math.round(v * 100) / 100);
  }

  #move(event) {
    if (this.held && event.pointerId !== this.holder) return;
    const here = this.#at(event);
    if (this.held === "brush") this.#extend(this.#rounded(event));
    if (this.held === "photo") {
      this.view.x += here[0] - this.pointer[0];
      this.view.y += here[1] - this.pointer[1];
    }
    this.pointer = here;
    this.draw();
  }

  #extend(point) {
    const points = this.current.points_px;
    const [x, y] = points.at(-1);
    // A quarter of the brush apart, the line is as round as it was painted.
    if (Math.hypot(point[0] - x, point[1] - y) >= this.radius / 4) points.push(point);
  }

  #up(event) {
    if (event.pointerId !== this.holder) return;
    const stroke = this.current;
    this.held = null;
    this.current = null;
    if (stroke && event.type === "pointerup") this.painted(stroke);
    this.draw();
  }

  #wheel(event) {
    event.preventDefault();
    this.#zoomAt(Math.exp(-event.deltaY / 300), ...this.#at(event));
  }

  /** Draws everything anew, once for each frame. */
  draw() {
    this.waiting ??= requestAnimationFrame(() => {
      this.waiting = undefined;
      this.#drawNow();
    });
  }

  #drawNow() {
    const { canvas } = this;
    const ratio = devicePixelRatio || 1;
    const [width, height] = [canvas.clientWidth, canvas.clientHeight].map((side) => Math.round(side * ratio));
    if (canvas.width !== width || canvas.height !== height) Object.assign(canvas, { width, height });
    const context = canvas.getContext("2d");
    context.setTransform(1, 0, 0, 1, 0, 0);
    context.clearRect(0, 0, width, height);
    if (!this.size) return;
    const { scale, x, y } = this.#place();
    canvas.dataset.place = `${scale} ${x} ${y}`;
    context.setTransform(ratio * scale, 0, 0, ratio * scale, ratio * x, ratio * y);
    context.imageSmoothingEnabled = scale < 3;
    this.#drawImages(context);
    if (this.showsStrokes) for (const stroke of this.strokes) drawStroke(context, stroke, INK_ALPHA.kept);
    if (this.current) drawStroke(context, this.current, INK_ALPHA.fresh);
    this.#drawLine(context, scale);
    this.#drawBrush(context, scale);
  }

  #drawImages(context) {
    const [w, h] = this.size;
    const { photo, layer } = this.images;
    if (photo) context.drawImage(photo, 0, 0, w, h);
    if (!layer) return;
    context.save();
    context.beginPath();
    context.rect(this.wipe * w, 0, (1 - this.wipe) * w, h);
    context.clip();
    context.drawImage(layer, 0, 0, w, h);
    context.restore();
  }

  /** The line between photo and cut-out. */
  #drawLine(context, scale) {
    const [w, h] = this.size;
    if (this.wipe <= 0 || this.wipe >= 1) return;
    context.fillStyle = "#fff";
    context.fillRect(this.wipe * w - 0.75 / scale, 0, 1.5 / scale, h);
  }

  #drawBrush(context, scale) {
    if (!this.tool || !this.pointer || this.held === "photo") return;
    const [x, y] = this.#onPhoto(...this.pointer);
    context.beginPath();
    context.arc(x, y, this.radius, 0, 2 * Math.PI);
    context.lineWidth = 1.5 / scale;
    context.strokeStyle = INKS[this.tool];
    context.stroke();
  }
}

function drawStroke(context, { says, radius_px, points_px }, alpha) {
  const [first, ...rest] = points_px;
  context.save();
  context.globalAlpha = alpha;
  context.lineCap = "round";
  context.lineJoin = "round";
  context.lineWidth = 2 * radius_px;
  context.strokeStyle = INKS[says];
  context.beginPath();
  context.moveTo(...first);
  for (const point of rest.length ? rest : [first]) context.lineTo(...point);
  context.stroke();
  context.restore();
}
