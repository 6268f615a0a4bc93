// Where the images of a pair stand and how large, in whole device pixels; nothing here touches the page.
// A scale is screen pixels an image pixel: a whole number, or FIT, which is as large as the room allows.

export const FIT = "fit";
export const HANDLE = 28; // CSS pixels below an image for the divider's handle
const STEP = 16, LARGEST = 8192; // as app/renditions.py makes them

// Height of a box at a width, as the server rounds it.
export const heightOf = (box, width) => Math.max(1, Math.floor((2 * width * box.height + box.width) / (2 * box.width)));

// How many images stand beside each other in a mode; in others one stands in the place of all.
const ABREAST = { beside: 2, triplet: 3, boosted: 3 };

// The scales that a study allows, the first to begin with.
export function scales(viewer, fitted) {
  if (viewer.boost) return [viewer.boost.zoom];
  const whole = Array.from({ length: viewer.zoom }, (_, k) => k + 1);
  if (viewer.display !== FIT) return whole;
  return [FIT, ...whole.filter((scale) => viewer.zoom > 1 && scale > fitted + 0.01)];
}

// The frames of a mode: their size, where they begin in the room, and how wide the picture in them is.
// base: the scale that decides between side by side and one above the other, so that zooming does not move the images.
// room: across, down, caption, gap, below (taken by the divider's handle), device pixels; box: width, height, image pixels.
export function place(mode, scale, room, box, base = scale) {
  const down = room.down - room.caption;
  const count = ABREAST[mode];
  if (!count) return alone(scale, room, box, down - (mode === "wipe" ? room.below : 0));
  const beside = (at) => frame(at, box, Math.floor((room.across - (count - 1) * room.gap) / count), down);
  const above = (at) => frame(at, box, room.across, Math.floor(room.down / count) - room.caption);
  const area = ({ width, height }) => width * height, sideways = area(beside(base)) >= area(above(base));
  const chosen = (sideways ? beside : above)(scale);
  const { width, height } = chosen, step = sideways ? { x: width + room.gap, y: 0 } : { x: 0, y: height + room.caption };
  const last = { x: (count - 1) * step.x, y: (count - 1) * step.y };
  const x = Math.floor((room.across - width - last.x) / 2), y = Math.max(0, Math.floor((down - height - last.y) / 2));
  return { ...chosen, origins: Array.from({ length: count }, (_, k) => ({ x: x + k * step.x, y: y + k * step.y })) };
}

function alone(scale, room, box, down) {
  const one = frame(scale, box, room.across, down);
  const x = Math.floor((room.across - one.width) / 2), y = Math.max(0, Math.floor((down - one.height) / 2));
  return { ...one, origins: [{ x, y }] };
}

function frame(scale, box, across, down) {
  if (scale !== FIT) {
    const width = Math.max(STEP, Math.min(box.width * scale, across)), height = Math.max(STEP, Math.min(box.height * scale, down));
    return { width, height, picture: box.width, scale };
  }
  let width = STEP * Math.floor(Math.min(across, (down * box.width) / box.height, 4 * box.width, LARGEST) / STEP);
  while (width > STEP && heightOf(box, width) > Math.min(down, LARGEST)) width -= STEP;
  width = Math.max(STEP, width);
  return { width, height: heightOf(box, width), picture: width, scale: width / box.width };
}
