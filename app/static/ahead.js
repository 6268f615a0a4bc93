// Fetches the first images while people read the pages before the questions, at the size that a question will show.

import { FIT } from "./geometry.js";
import { roomOf } from "./pair.js";
import { pictures } from "./pictures.js";

const ahead = document.getElementById("ahead"), viewer = JSON.parse(ahead.dataset.viewer);
// after everything that this page itself needs
const loaded = new Promise((done) => (document.readyState === "complete" ? done() : addEventListener("load", done)));
loaded.then(() => pictures.ahead(JSON.parse(ahead.dataset.upcoming), viewer, viewer.display === FIT ? roomOfQuestion() : null));

// Somebody who was in the middle and whose cookies were cleared finds the way back.
const back = document.getElementById("back"), code = back && stored(`subdermal:resume:${location.pathname}`);
if (code) {
  back.querySelector("a").href = code;
  back.hidden = false;
}

function stored(name) { try { return localStorage.getItem(name); } catch { return null; } }

// Lay out an empty question in the place of this page, measure it, and take it away before anything is painted.
function roomOfQuestion() {
  const others = [...document.body.children].filter((one) => one.matches("main") && !one.hidden), { className } = document.body;
  const question = ahead.querySelector("template").content.firstElementChild.cloneNode(true);
  for (const one of others) one.hidden = true;
  document.body.className = "asking";
  document.body.append(question);
  const room = roomOf(question.querySelector(".pair"));
  question.remove();
  document.body.className = className;
  for (const one of others) one.hidden = false;
  return room;
}
