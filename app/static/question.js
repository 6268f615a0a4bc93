// One question: both images appear at once, one answer is taken, and it is kept here until the server has it.
// Without this script the form posts by itself; with it, a lost connection loses nothing.

import { watch } from "./pair.js";

const UNSENT = `subdermal:unsent:${location.pathname}`;
const FIRST_PAUSE_MS = 500, LONGEST_PAUSE_MS = 8000, PATIENCE_MS = 15000;
let preloaded = []; // keeps the images of the next question alive

document.documentElement.classList.add("ready");
document.addEventListener("keydown", onKey);
window.addEventListener("pageshow", (event) => event.persisted && location.reload());
begin();

async function begin() {
  const page = document.querySelector("main[data-trial]");
  const form = page.querySelector("form"), scale = page.querySelector("fieldset");
  scale.disabled = true;

  const unsent = recall();
  if (unsent && unsent.participant === page.dataset.participant) {
    say(page, "Saving the answer that was not sent yet …");
    return advance(page, await deliver(page, form, unsent.fields));
  }
  forget();

  const images = [...page.querySelectorAll(".pair img")];
  await Promise.all(images.map((image) => decoded(page, image)));
  say(page, "");
  watch(page);
  page.classList.add("shown");
  await painted();
  const since = performance.now();
  scale.disabled = false;
  preload(page.dataset.upcoming.split(" ").filter(Boolean));

  let sending = false;
  form.addEventListener("submit", async (event) => {
    event.preventDefault();
    if (sending) return; // a double click is one answer
    sending = true;
    const shown = images[0].getBoundingClientRect();
    const measured = {
      rt_ms: Math.round(performance.now() - since),
      viewport_width: window.innerWidth,
      viewport_height: window.innerHeight,
      device_pixel_ratio: window.devicePixelRatio,
      shown_width: shown.width.toFixed(2),
      shown_height: shown.height.toFixed(2),
    };
    for (const [name, value] of Object.entries(measured)) form.elements[name].value = value;
    const fields = Object.fromEntries(new FormData(form));
    scale.disabled = true;
    form.querySelector("button").setAttribute("aria-disabled", "true");
    remember({ participant: page.dataset.participant, fields });
    advance(page, await deliver(page, form, fields));
  });
}

// Send until the server has acknowledged; the address of what comes next, or null where only a reload helps.
async function deliver(page, form, fields) {
  const body = new URLSearchParams({ ...fields, csrf_token: form.elements.csrf_token.value });
  const response = await insist(page, "Not saved yet, trying again …", form.action, {
    method: "POST", body, headers: { Accept: "application/json" },
  });
  forget();
  if (response.ok || response.status === 409) return (await response.json()).next;
  const told = await response.json().catch(() => ({}));
  say(page, told.error || "The answer was not accepted. Please reload the page and answer again.");
  return null;
}

// Show the next question in place, so that a connection lost in between leaves a page that goes on trying.
async function advance(page, next) {
  if (next === null) return;
  const response = await insist(page, "Saved. Waiting for the next question …", next, { headers: { Accept: "text/html" } });
  const arrived = new DOMParser().parseFromString(await response.text(), "text/html");
  const main = arrived.querySelector("main[data-trial]");
  if (!response.ok || !main) return location.replace(response.url);
  document.title = arrived.title;
  page.replaceWith(document.adoptNode(main));
  window.scrollTo(0, 0);
  main.querySelector("h1").focus();
  begin();
}

// Fetch until the server answers with anything but a passing failure, and say so meanwhile.
async function insist(page, message, url, options) {
  for (let pause = FIRST_PAUSE_MS; ; pause = Math.min(2 * pause, LONGEST_PAUSE_MS)) {
    try {
      const response = await fetch(url, { ...options, cache: "no-store", signal: AbortSignal.timeout(PATIENCE_MS) });
      if (response.status < 500 && response.status !== 429) {
        say(page, "");
        return response;
      }
    } catch { /* no connection, or too slow: the same answer sent twice is one answer */ }
    say(page, message);
    await rest(pause);
  }
}

async function decoded(page, image) {
  for (let pause = FIRST_PAUSE_MS; ; pause = Math.min(2 * pause, LONGEST_PAUSE_MS)) {
    try {
      return await image.decode();
    } catch {
      say(page, "An image could not be loaded, trying again …");
      await rest(pause);
      image.src = image.getAttribute("src");
    }
  }
}

function preload(addresses) {
  preloaded = addresses.map((address) => {
    const image = new Image();
    image.src = address;
    image.decode().catch(() => {}); // it is tried again when it is shown
    return image;
  });
}

function onKey(event) {
  const form = document.querySelector("main[data-trial] form");
  if (!form || event.ctrlKey || event.altKey || event.metaKey || event.repeat) return;
  const options = [...form.querySelectorAll("input[type=radio]")];
  if (options.some((option) => option.matches(":disabled"))) return;
  const elsewhere = !options.includes(event.target), chosen = options.find((option) => option.checked);
  const digit = /^[1-5]$/.test(event.key) ? event.key : /^Digit([1-5])$/.exec(event.code)?.[1]; // AZERTY has them above Shift
  if (digit) choose(options[Number(digit) - 1]);
  else if (event.key.startsWith("Arrow") && !chosen) choose(options[/Left|Up/.test(event.key) ? 1 : 3]); // from the middle, to a side
  else if (event.key.startsWith("Arrow") && elsewhere) choose(chosen);
  else if (event.key === "Enter" && !event.target.closest("a, button")) form.requestSubmit();
  else return;
  event.preventDefault();
}

function choose(option) {
  option.checked = true;
  option.focus({ preventScroll: true });
}

function say(page, message) {
  const status = page.querySelector(".status");
  if (status.textContent !== message) status.textContent = message;
}

const painted = () => new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)));

// Wait, but not longer than until the connection is back.
function rest(milliseconds) {
  return new Promise((done) => {
    setTimeout(done, milliseconds);
    window.addEventListener("online", done, { once: true });
  });
}

// localStorage may be forbidden; then an answer is kept only as long as the page is open.
function remember(answer) { try { localStorage.setItem(UNSENT, JSON.stringify(answer)); } catch { /* see above */ } }
function recall() { try { return JSON.parse(localStorage.getItem(UNSENT)); } catch { return null; } }
function forget() { try { localStorage.removeItem(UNSENT); } catch { /* see above */ } }
