// Where the two images stand, in whole device pixels: the same file on both sides is drawn alike, byte for byte.
// What is shown of an image is its region of interest; side by side or one above the other, whichever shows more.

const GAP = 8; // CSS pixels between the images

// Lay out the pair of a page now, and whenever its window, zoom or screen changes.
export function watch(page) {
  const pair = page.querySelector(".pair");
  const [left, top, right, bottom] = page.dataset.region.split(" ").map(Number);
  const lay = () => pair.isConnected && layOut(pair, { left, top, width: right - left, height: bottom - top });
  new ResizeObserver(lay).observe(pair);
  const ratioChanged = () => {
    if (!pair.isConnected) return;
    lay();
    matchMedia(`(resolution: ${devicePixelRatio}dppx)`).addEventListener("change", ratioChanged, { once: true });
  };
  ratioChanged();
}

function layOut(pair, region) {
  const ratio = devicePixelRatio, box = pair.getBoundingClientRect();
  const figures = [...pair.querySelectorAll("figure")], image = figures[0].querySelector("img");
  const caption = Math.ceil(figures[0].querySelector("figcaption").offsetHeight * ratio), gap = Math.round(GAP * ratio);
  // the room for images, from the first whole device pixel to the last
  const x0 = Math.ceil(box.left * ratio), y0 = Math.ceil(box.top * ratio);
  const across = Math.floor(box.right * ratio) - x0, down = Math.floor(box.bottom * ratio) - y0;
  const source = { width: Number(image.getAttribute("width")), height: Number(image.getAttribute("height")) };
  const seen = { width: source.width * region.width, height: source.height * region.height };

  const beside = Math.min((across - gap) / 2 / seen.width, (down - caption) / seen.height);
  const above = Math.min(across / seen.width, (down / 2 - caption) / seen.height);
  const scale = Math.max(beside, above, 16 / seen.width);
  const width = Math.floor(seen.width * scale), height = Math.round((width * seen.height) / seen.width);
  const whole = { width: Math.round(width / region.width), height: Math.round(height / region.height) };
  const cut = { left: -Math.round(region.left * whole.width), top: -Math.round(region.top * whole.height) };

  const step = beside >= above ? { x: width + gap, y: 0 } : { x: 0, y: height + caption };
  const x = x0 + Math.floor((across - width - step.x) / 2), y = y0 + Math.max(0, Math.floor((down - caption - height - step.y) / 2));
  // browsers cut lengths down to 1/64 px: up to the next one, so that a whole device pixel never becomes the one before
  const css = (value) => `${Math.ceil((64 * value) / ratio - 1e-6) / 64}px`;
  figures.forEach((figure, k) => {
    const img = figure.querySelector("img"), frame = figure.querySelector(".region");
    Object.assign(figure.style, { position: "absolute", width: css(width), left: css(x + k * step.x - box.left * ratio), top: css(y + k * step.y - box.top * ratio) });
    Object.assign(figure.querySelector("figcaption").style, { height: css(caption) });
    Object.assign(frame.style, { width: css(width), height: css(height), aspectRatio: "auto" });
    Object.assign(img.style, { left: css(cut.left), top: css(cut.top), width: css(whole.width), height: css(whole.height) });
    draw(frame, img, [source.width * region.left, source.height * region.top, seen.width, seen.height], width, height, css);
  });
  const times = whole.width / source.width;
  const badge = pair.closest("main").querySelector(".badge");
  badge.textContent = Number.isInteger(times) ? `${times}:1` : `resampled, ${Math.round(100 * times)} %`;
}

// Resample once, into a canvas that is as many pixels as the screen shows of it: a browser's own scaling of an <img>
// depends on where it stands.
function draw(frame, img, from, width, height, css) {
  const old = frame.querySelector("canvas"), canvas = old ?? document.createElement("canvas");
  Object.assign(canvas.style, { width: css(width), height: css(height) });
  if (old && old.width === width && old.height === height) return; // it only moved
  Object.assign(canvas, { width, height });
  canvas.setAttribute("aria-hidden", "true"); // the image beneath has the words
  const context = canvas.getContext("2d", { alpha: false });
  context.imageSmoothingQuality = "high";
  context.drawImage(img, ...from, 0, 0, width, height);
  frame.append(canvas);
}
