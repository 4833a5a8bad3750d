"use strict";
const body = document.body, frames = [...document.querySelectorAll(".frame")];
const width = Number(body.dataset.width), height = Number(body.dataset.height);
let at = -1, timer = 0;

function show(number) {
  at = Math.max(-1, Math.min(frames.length - 1, number));
  frames.forEach((frame, i) => frame.classList.toggle("shown", i === at));
  body.classList.toggle("showing", at >= 0);
}

function step(by) {
  // Behind the last frame is this page again.
  show(at + by < frames.length ? at + by : -1);
  if (at < 0) stop();
}

function stop() {
  clearInterval(timer);
  timer = 0;
}

function run() {
  if (timer) return stop();
  const seconds = Math.max(1, Number(document.getElementById("seconds").value) || 4);
  step(1);
  timer = setInterval(() => step(1), 1000 * seconds);
}

// How wide a frame is on this display, and whether its pixels are the display's own.
function measure() {
  const scale = Math.min(innerWidth / width, innerHeight / height);
  document.getElementById("ruler").style.width = scale * width + "px";
  const shown = [innerWidth, innerHeight].map(side => Math.round(side * devicePixelRatio));
  const fits = shown[0] === width && shown[1] === height;
  const text = document.getElementById("fit");
  text.classList.toggle("warning", !fits);
  text.textContent = fits
    ? `The frames fit this display: ${width} x ${height} pixels.`
    : `This window has ${shown.join(" x ")} pixels, the frames ${width} x ${height}: go full screen (F), or write frames with --size ${shown.join("x")}.`;
}

function fullscreen() {
  if (document.fullscreenElement) document.exitFullscreen();
  else document.documentElement.requestFullscreen().then(stay_awake);
}

function stay_awake() {
  if (navigator.wakeLock) navigator.wakeLock.request("screen").catch(() => {});
}

const keys = {
  ArrowRight: () => step(1), " ": () => step(1), PageDown: () => step(1), Enter: () => step(1),
  ArrowLeft: () => step(-1), PageUp: () => step(-1), Backspace: () => step(-1),
  Home: () => show(0), Escape: () => { stop(); show(-1); }, f: fullscreen, F: fullscreen, t: run, T: run,
};
addEventListener("keydown", event => {
  if (event.target.id === "seconds" || !keys[event.key]) return;
  event.preventDefault();
  keys[event.key]();
});
addEventListener("click", event => { if (event.target.id !== "seconds") step(1); });
addEventListener("resize", measure);
measure();
stay_awake();
