// The pair viewer: both images in whole device pixels, resampled by nobody here, side by side or in one place, with one
// zoom and one place for both. What is asked of a canvas is a whole number of pixels copied to whole pixels.

import { FIT, HANDLE, heightOf, place, scales } from "./geometry.js";
import { pictures } from "./pictures.js";

const PAN_KEYS = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] };
const IN_PLACE = ["flicker", "wipe"], REFERENCE = 1; // its place in a triplet
const PAN_SHARE = 0.15, WHEEL_STEP = 40, PINCH_STEP = 1.3, SOON_MS = 250;

export class Viewer {
  constructor(page, words) {
    this.words = words;
    this.page = page;
    this.pair = page.querySelector(".pair");
    this.options = JSON.parse(page.dataset.viewer);
    this.figures = [...this.pair.querySelectorAll("figure")];
    this.labels = this.figures.map((figure) => figure.querySelector("figcaption").textContent);
    this.sides = JSON.parse(page.dataset.images);
    if (page.dataset.reference) this.sides.splice(REFERENCE, 0, JSON.parse(page.dataset.reference));
    this.whole = JSON.parse(page.dataset.whole); // of the image that the region is cut from
    this.divider = this.pair.querySelector(".divider");
    this.mode = this.options.modes[0];
    this.step = 0;
    this.split = 0.5;
    this.swapped = false;
    this.flips = 0;
    this.pointers = new Map();
    this.spent = { beside: 0, flicker: 0, wipe: 0, triplet: 0, boosted: 0, away: 0 };
  }

  // Load and draw both; resolves when they are on the screen, from when time counts.
  async show() {
    this.canvases = this.figures.map((figure) => {
      const canvas = document.createElement("canvas");
      canvas.setAttribute("role", "img");
      figure.querySelector("img").replaceWith(canvas);
      return canvas;
    });
    const box = this.sides[0];
    this.centre = { x: box.width / 2, y: box.height / 2 };
    this.pair.classList.add("scripted");
    await this.lay();
    this.page.classList.add("shown");
    await painted();
    this.first = { scale: this.now.scale, share: this.share() };
    this.largest = this.now.scale;
    this.since = performance.now();
    this.listen();
    // somebody who asked for less motion starts it by themselves
    if (this.options.boost?.flicker_hz) this.flicker(!matchMedia("(prefers-reduced-motion: reduce)").matches);
  }

  // Let both take turns with the reference, so many times a second, or let them be.
  flicker(on) {
    this.flickering = on;
    this.page.querySelector("[data-flicker]").setAttribute("aria-pressed", on);
    const began = performance.now(), half = 500 / this.options.boost.flicker_hz, token = (this.turns = Symbol());
    const turn = (now) => {
      if (token !== this.turns || !this.pair.isConnected) return;
      this.swapTo(on && Math.floor((now - began) / half) % 2 === 1);
      if (on) requestAnimationFrame(turn);
    };
    turn(began);
  }

  // Where everything stands now; pictures of another size are waited for, and what is shown meanwhile stays.
  async lay() {
    const wanted = this.geometry();
    const token = (this.token = Symbol());
    const soon = setTimeout(() => this.pair.classList.add("loading"), this.bitmaps ? SOON_MS : 0);
    const same = this.now?.picture === wanted.picture;
    const bitmaps = same ? this.bitmaps : await Promise.all(this.sides.map((side) => pictures.bitmap(side, wanted.picture)));
    clearTimeout(soon);
    if (token !== this.token || !this.pair.isConnected) return;
    this.pair.classList.remove("loading");
    this.tick();
    if (!same) this.bitmaps?.forEach((bitmap) => bitmap.close());
    this.bitmaps = bitmaps;
    this.now = { ...wanted, mode: this.mode };
    this.largest = Math.max(this.largest ?? 0, wanted.scale);
    this.settle();
    this.draw();
  }

  geometry() {
    const room = roomOf(this.pair), [box] = this.sides;
    const fitted = this.options.display === FIT ? place(this.mode, FIT, room, box).scale : 1;
    this.scales = scales(this.options, fitted);
    this.step = Math.min(this.step, this.scales.length - 1);
    const placed = place(this.mode, this.scales[this.step], room, box, this.scales[0]);
    return { ...placed, fits: this.scales[this.step] === FIT, room };
  }

  // Put frames, captions and buttons where they belong.
  settle() {
    const { width, height, origins, room, fits, scale, mode } = this.now, [box] = this.sides;
    const css = (value) => `${Math.ceil((64 * value) / room.ratio - 1e-6) / 64}px`; // browsers cut down to 1/64 px
    this.figures.forEach((figure, k) => {
      figure.hidden = k >= origins.length;
      if (figure.hidden) return;
      const x = room.x - room.left + origins[k].x, y = room.y - room.top + origins[k].y;
      Object.assign(figure.style, { width: css(width), left: css(x), top: css(y) });
      figure.querySelector("figcaption").style.height = css(room.caption);
      Object.assign(this.canvases[k].style, { width: css(width), height: css(height) });
      Object.assign(this.canvases[k], { width, height });
    });
    this.divider.hidden = mode !== "wipe";
    if (mode === "wipe") {
      const thumb = this.divider.offsetHeight, [at] = origins; // as wide as it is high: its middle is the divider
      const left = (room.x - room.left + at.x) / room.ratio - thumb / 2, top = (room.y - room.top + at.y + room.caption + height) / room.ratio;
      Object.assign(this.divider.style, { left: `${left}px`, top: `${top}px`, width: `${width / room.ratio + thumb}px` });
    }
    this.see(!fits && (box.width * scale > width || box.height * scale > height));
    const badge = this.page.querySelector(".badge");
    badge.textContent = Number.isInteger(scale) ? `${scale}:1` : this.words.resampled.replace("{percent}", Math.round(100 * scale));
    for (const button of this.page.querySelectorAll("[data-mode]")) button.setAttribute("aria-pressed", button.dataset.mode === mode);
    for (const button of this.page.querySelectorAll("[data-zoom]")) {
      const next = this.step + Number(button.dataset.zoom);
      button.setAttribute("aria-disabled", next < 0 || next >= this.scales.length);
    }
    const swap = this.page.querySelector("[data-swap]");
    if (swap) swap.hidden = mode !== "flicker";
  }

  see(movable) {
    this.pair.classList.toggle("movable", movable);
    this.pair.classList.toggle("held", IN_PLACE.includes(this.mode) || movable || this.scales.length > 1);
  }

  draw() {
    const { width, height, fits, scale, mode } = this.now, [box] = this.sides;
    if (!fits) {
      this.centre.x = clamp(this.centre.x, width / scale / 2, box.width - width / scale / 2);
      this.centre.y = clamp(this.centre.y, height / scale / 2, box.height - height / scale / 2);
    }
    const at = fits ? { x: 0, y: 0 } : { x: Math.round(this.centre.x * scale - width / 2), y: Math.round(this.centre.y * scale - height / 2) };
    const size = fits ? { width, height: heightOf(box, width) } : { width: box.width * scale, height: box.height * scale };
    const paint = (canvas, bitmap, from = 0) => {
      const context = canvas.getContext("2d", { alpha: false });
      context.imageSmoothingEnabled = false;
      context.save();
      context.beginPath();
      context.rect(from, 0, width - from, height);
      context.clip();
      context.drawImage(bitmap, -at.x, -at.y, size.width, size.height);
      context.restore();
    };
    const label = (k, text, name) => {
      this.figures[k].querySelector("figcaption").replaceChildren(...text.map((part) => Object.assign(document.createElement("span"), { textContent: part })));
      this.canvases[k].setAttribute("aria-label", `${this.words.image} ${name}`);
    };
    if (!IN_PLACE.includes(mode)) return this.canvases.forEach((canvas, k) => {
      paint(canvas, this.bitmaps[this.swapped ? REFERENCE : k]);
      label(k, [this.labels[k]], this.labels[k]);
    });
    const front = mode === "flicker" && this.swapped ? 1 : 0;
    paint(this.canvases[0], this.bitmaps[front]); // at once over what was there: no frame is blank
    if (mode === "flicker") label(0, [this.labels[front]], this.labels[front]);
    else {
      paint(this.canvases[0], this.bitmaps[1], Math.round(this.split * width));
      label(0, this.labels, this.labels.join(", "));
      this.divider.value = Math.round(100 * this.split);
    }
    const swap = this.page.querySelector("[data-swap]");
    if (swap) swap.setAttribute("aria-pressed", this.swapped);
  }

  setMode(mode) {
    if (mode === this.mode || !this.options.modes.includes(mode)) return;
    this.mode = mode;
    this.swapped = false;
    this.lay();
  }

  nextMode() {
    const { modes } = this.options;
    this.setMode(modes[(modes.indexOf(this.mode) + 1) % modes.length]);
  }

  // By steps, keeping what is under a point of the canvas (device pixels from its middle) where it is.
  zoom(steps, point = { x: 0, y: 0 }) {
    const before = this.now.scale, next = clamp(this.step + steps, 0, this.scales.length - 1);
    if (next === this.step) return;
    this.step = next;
    const after = this.scales[next] === FIT ? before : this.scales[next];
    this.centre.x += point.x / before - point.x / after;
    this.centre.y += point.y / before - point.y / after;
    this.lay();
  }

  // By device pixels.
  pan(x, y) {
    if (this.now.fits) return;
    this.centre.x += x / this.now.scale;
    this.centre.y += y / this.now.scale;
    this.draw();
  }

  swap(on) {
    if (this.mode === "flicker") this.swapTo(on);
  }

  swapTo(on) {
    if (on === this.swapped) return;
    this.swapped = on;
    this.flips += 1;
    this.draw();
  }

  // Whether a key was for the viewer.
  onKey(event, keys) {
    const key = event.key.toLowerCase(), pan = PAN_KEYS[event.key];
    if (pan && (event.shiftKey || event.target === this.pair)) {
      this.pan(pan[0] * PAN_SHARE * this.now.width, pan[1] * PAN_SHARE * this.now.height);
      return true;
    }
    if (!keys) return false;
    if (key === "v") this.nextMode();
    else if (key === "f" && this.options.boost?.flicker_hz) this.flicker(!this.flickering);
    else if (key === "f") this.swap(true);
    else if (key === "+" || key === "=") this.zoom(1);
    else if (key === "-") this.zoom(-1);
    else if (key === "0") this.zoom(-this.step);
    else return false;
    return true;
  }

  listen() {
    const { pair, page } = this, lay = () => pair.isConnected && this.lay();
    new ResizeObserver(lay).observe(pair);
    const ratioChanged = () => {
      lay();
      if (pair.isConnected) matchMedia(`(resolution: ${devicePixelRatio}dppx)`).addEventListener("change", ratioChanged, { once: true });
    };
    ratioChanged();
    page.addEventListener("click", (event) => {
      const button = event.target.closest("[data-mode], [data-zoom], [data-swap], [data-flicker]");
      if (!button) return;
      if (button.hasAttribute("data-flicker")) return this.flicker(!this.flickering);
      if (button.dataset.mode) this.setMode(button.dataset.mode);
      else if (button.dataset.zoom) this.zoom(Number(button.dataset.zoom));
      else this.swap(!this.swapped);
    });
    this.divider.addEventListener("input", () => {
      this.split = this.divider.value / 100;
      this.draw();
    });
    let wheel = 0;
    pair.addEventListener("wheel", (event) => {
      if (this.scales.length < 2) return;
      event.preventDefault();
      wheel += event.ctrlKey ? 8 * event.deltaY : event.deltaY * (event.deltaMode ? WHEEL_STEP : 1);
      if (Math.abs(wheel) < WHEEL_STEP) return;
      this.zoom(wheel > 0 ? -1 : 1, this.from(event));
      wheel = 0;
    }, { passive: false });
    pair.addEventListener("contextmenu", (event) => event.preventDefault()); // of a long press
    pair.addEventListener("pointerdown", (event) => this.press(event));
    pair.addEventListener("pointermove", (event) => this.move(event));
    for (const end of ["pointerup", "pointercancel"]) pair.addEventListener(end, (event) => this.release(event));
    const gone = new AbortController();
    const when = (target, kind, act) => target.addEventListener(kind, () => (pair.isConnected ? act() : gone.abort()), { signal: gone.signal });
    when(document, "visibilitychange", () => this.tick());
    when(window, "focus", () => this.tick());
    when(window, "blur", () => (this.tick(), this.swap(false)));
    document.addEventListener("keyup", (event) => event.key.toLowerCase() === "f" && this.swap(false), { signal: gone.signal });
  }

  // A pointer's place from the middle of the canvas it is over, device pixels.
  from(event) {
    const boxes = this.canvases.filter((canvas) => canvas.offsetParent).map((canvas) => canvas.getBoundingClientRect());
    const over = boxes.find((box) => event.clientX >= box.left && event.clientX <= box.right && event.clientY >= box.top && event.clientY <= box.bottom) ?? boxes[0];
    return { x: (event.clientX - (over.left + over.right) / 2) * devicePixelRatio, y: (event.clientY - (over.top + over.bottom) / 2) * devicePixelRatio };
  }

  press(event) {
    if (!event.target.closest("canvas") || event.button > 0) return;
    this.pointers.set(event.pointerId, { x: event.clientX, y: event.clientY });
    event.target.setPointerCapture(event.pointerId);
    if (this.pointers.size === 2) {
      this.apart = distance(this.pointers);
      return this.swap(false);
    }
    if (this.mode === "flicker" && !event.shiftKey) this.swap(true);
    if (this.mode === "wipe" && !event.shiftKey) this.splitAt(event);
  }

  move(event) {
    const last = this.pointers.get(event.pointerId);
    if (!last) return;
    const x = (last.x - event.clientX) * devicePixelRatio, y = (last.y - event.clientY) * devicePixelRatio;
    this.pointers.set(event.pointerId, { x: event.clientX, y: event.clientY });
    if (this.pointers.size === 2) {
      const apart = distance(this.pointers), ratio = apart / this.apart;
      if (ratio > PINCH_STEP || ratio < 1 / PINCH_STEP) {
        this.zoom(ratio > 1 ? 1 : -1, this.from(event));
        this.apart = apart;
      }
      this.pan(x / 2, y / 2);
    } else if (!IN_PLACE.includes(this.mode) || event.shiftKey) this.pan(x, y);
    else if (this.mode === "wipe") this.splitAt(event);
  }

  release(event) {
    if (this.pointers.delete(event.pointerId)) this.swap(false);
  }

  splitAt(event) {
    const box = this.canvases[0].getBoundingClientRect();
    this.split = clamp((event.clientX - box.left) / box.width, 0, 1);
    this.draw();
  }

  // The part of the region that is seen at once, 0 to 1.
  share() {
    const { width, height, fits, scale } = this.now, [box] = this.sides;
    return fits ? 1 : (width * height) / (box.width * box.height * scale * scale);
  }

  // Count the time since the last call to what was shown, or to being away.
  tick() {
    const now = performance.now();
    if (this.since !== undefined) this.spent[this.away ? "away" : this.now.mode] += now - this.since;
    this.since = this.since === undefined ? undefined : now;
    this.away = document.hidden || !document.hasFocus();
  }

  // What is sent with an answer.
  record() {
    this.tick();
    const { scale, room } = this.now, whole = this.whole;
    return {
      rt_ms: Math.round(Object.values(this.spent).reduce((sum, one) => sum + one)),
      viewport_width: window.innerWidth,
      viewport_height: window.innerHeight,
      device_pixel_ratio: window.devicePixelRatio,
      shown_width: ((whole.width * scale) / room.ratio).toFixed(2),
      shown_height: ((whole.height * scale) / room.ratio).toFixed(2),
      view: this.now.mode,
      ...Object.fromEntries(Object.entries(this.spent).map(([name, spent]) => [`${name}_ms`, Math.round(spent)])),
      flips: this.flips,
      pixel_scale: this.first.scale.toFixed(4),
      pixel_scale_largest: this.largest.toFixed(4),
      seen_share: this.first.share.toFixed(4),
    };
  }
}

// The room for images in a box of the page, from its first whole device pixel to its last.
export function roomOf(pair) {
  const ratio = devicePixelRatio, { left, top, right, bottom } = pair.getBoundingClientRect();
  const x = Math.ceil(left * ratio), y = Math.ceil(top * ratio);
  const caption = Math.ceil(pair.querySelector("figcaption").offsetHeight * ratio);
  return { ratio, x, y, left: left * ratio, top: top * ratio, across: Math.floor(right * ratio) - x, down: Math.floor(bottom * ratio) - y,
    caption, below: Math.ceil(HANDLE * ratio), gap: Math.round(Number(pair.dataset.gap) * ratio) };
}

const clamp = (value, low, high) => (high < low ? (low + high) / 2 : Math.max(low, Math.min(high, value)));
const distance = (pointers) => { const [a, b] = [...pointers.values()]; return Math.max(1, Math.hypot(a.x - b.x, a.y - b.y)); };
const painted = () => new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)));
