// Fetches pictures, several ahead, and holds them until they are shown. A picture is {address, width, height}: its
// address without the width at which it is asked for, and the size of its region of interest in image pixels.

import { FIT, place } from "./geometry.js";

const FIRST_PAUSE_MS = 500, LONGEST_PAUSE_MS = 8000, AT_ONCE = 2, HELD = 24;

class Pictures {
  waiting = [];
  running = 0;
  held = new Map(); // address with width -> promise of a decoded image
  onTrouble = () => {};

  // The decoded pixels of a picture at a width, tried until they are there.
  async bitmap(picture, width) {
    return createImageBitmap(await this.image(picture.address + width));
  }

  image(address) {
    const held = this.held.get(address) ?? fetched(address, () => this.onTrouble());
    this.held.delete(address);
    this.held.set(address, held); // the newest last
    if (this.held.size > HELD) this.held.delete(this.held.keys().next().value);
    return held;
  }

  // Fetch pictures that will be shown, in this order, at the size that this window will show them.
  ahead(list, viewer, room) {
    const widthOf = (picture) => (viewer.display === FIT ? place(viewer.modes[0], FIT, room, picture).picture : picture.width);
    const wanted = list.map((picture) => picture.address + widthOf(picture));
    this.waiting = wanted.filter((address) => !this.held.has(address));
    this.go();
  }

  async go() {
    while (this.running < AT_ONCE && this.waiting.length) {
      this.running += 1;
      this.image(this.waiting.shift()).finally(() => {
        this.running -= 1;
        this.go();
      });
    }
  }
}

async function fetched(address, trouble) {
  for (let pause = FIRST_PAUSE_MS; ; pause = Math.min(2 * pause, LONGEST_PAUSE_MS)) {
    const image = new Image();
    image.src = address;
    try {
      await image.decode();
      return image;
    } catch {
      trouble();
      await rest(pause);
    }
  }
}

// Wait, but not longer than until the connection is back.
export function rest(milliseconds) {
  return new Promise((done) => {
    setTimeout(done, milliseconds);
    window.addEventListener("online", done, { once: true });
  });
}

export const pictures = new Pictures();
