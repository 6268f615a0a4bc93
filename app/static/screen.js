// Measures window and screen, and draws what people compare: all in whole screen pixels.

const CARD_RATIO = 85.6 / 53.98; // ISO/IEC 7810 ID-1
const SIDE = 200, STEPS = [4, 8, 12, 16]; // CSS pixels; levels away from black and from white
const form = document.querySelector("form[data-screen]"), field = (name) => form.elements[name];

const narrow = form.clientWidth < 560;
if (narrow && field("card_width")) field("card_width").value = 540;

const measures = () => ({
  window_width: innerWidth, window_height: innerHeight, device_pixel_ratio: devicePixelRatio,
  screen_width: screen.width, screen_height: screen.height, zoom: visualViewport?.scale ?? 1,
});

function look() {
  const measured = measures();
  for (const [name, value] of Object.entries(measured)) field(name).value = value;
  const pixels = [measured.window_width, measured.window_height].map((side) => Math.round(side * measured.device_pixel_ratio));
  const said = form.querySelector("[data-window]");
  said.textContent = said.dataset.window.replace("{width}", pixels[0]).replace("{height}", pixels[1]);
  const card = form.querySelector(".bank-card"), stripes = form.querySelector("[data-grey]"), steps = form.querySelector("[data-steps]");
  if (card) {
    const long = Number(field("card_width").value), sides = [long, long / CARD_RATIO];
    if (narrow) sides.reverse(); // a phone is narrower than a card is long: it is held upright
    Object.assign(card.style, { width: `${sides[0]}px`, height: `${sides[1]}px` });
  }
  if (stripes) drawStripes(stripes, Number(field("grey").value));
  if (steps) drawSteps(steps);
}

function canvasOf(canvas, width, height) {
  Object.assign(canvas, { width: Math.round(width * devicePixelRatio), height: Math.round(height * devicePixelRatio) });
  Object.assign(canvas.style, { width: `${canvas.width / devicePixelRatio}px`, height: `${canvas.height / devicePixelRatio}px` });
  return canvas.getContext("2d", { alpha: false });
}

// Lines of one screen pixel, black and white in turn: half of white's light, whatever the screen's gamma.
function drawStripes(canvas, grey) {
  const context = canvasOf(canvas, SIDE, SIDE), { width, height } = canvas;
  for (let y = 0; y < height; y += 1) {
    context.fillStyle = y % 2 ? "#fff" : "#000";
    context.fillRect(0, y, width, 1);
  }
  context.fillStyle = `rgb(${grey} ${grey} ${grey})`;
  context.fillRect(Math.round(width / 4), Math.round(height / 4), Math.round(width / 2), Math.round(height / 2));
}

function drawSteps(canvas) {
  const context = canvasOf(canvas, Math.min(2 * SIDE, form.clientWidth), SIDE / 2), { width, height } = canvas, side = Math.round(height / 3);
  [0, 255].forEach((ground, field) => {
    context.fillStyle = `rgb(${ground} ${ground} ${ground})`;
    context.fillRect((field * width) / 2, 0, width / 2, height);
    STEPS.forEach((step, k) => {
      const level = Math.abs(ground - step);
      context.fillStyle = `rgb(${level} ${level} ${level})`;
      context.fillRect(Math.round((field * width) / 2 + ((k + 0.5) * width) / 8 - side / 2), side, side, side);
    });
  });
}

form.addEventListener("input", look);
form.addEventListener("submit", look);
addEventListener("resize", look);
look();
