// One question: both images appear at once, one answer is taken, and it is kept here until the server has it.
// Without this script the form posts by itself; with it, a lost connection loses nothing.

import { Viewer, roomOf } from "./pair.js";
import { pictures, rest } from "./pictures.js";

const UNSENT = `subdermal:unsent:${location.pathname}`, KEYS_OFF = "subdermal:keys-off";
const RESUME = `subdermal:resume:${location.pathname.replace(/question$/, "")}`;
const FIRST_PAUSE_MS = 500, LONGEST_PAUSE_MS = 8000, PATIENCE_MS = 15000;
let viewer = null, words = {}, notice = null;

document.documentElement.classList.add("ready");
document.addEventListener("keydown", onKey);
window.addEventListener("pageshow", (event) => event.persisted && location.reload());
begin();

async function begin() {
  const page = document.querySelector("main[data-trial]");
  const form = page.querySelector("form.answer"), scale = page.querySelector("fieldset");
  words = JSON.parse(page.dataset.words);
  scale.disabled = true;
  viewer = null;
  showNotice(page, notice);
  notice = null;
  if (page.dataset.resume) store(RESUME, page.dataset.resume);

  const unsent = recall();
  if (unsent && unsent.participant === page.dataset.participant) {
    showStatus(page, words.sending);
    return advance(page, await deliver(page, form, unsent.fields));
  }
  forget();

  const soon = setTimeout(() => showStatus(page, words.loading), FIRST_PAUSE_MS);
  // an answer that waits for the network is the graver news
  pictures.onTrouble = () => page.isConnected && !recall() && showStatus(page, words.trouble);
  const shown = new Viewer(page, words);
  await shown.show();
  clearTimeout(soon);
  showStatus(page, "");
  viewer = shown;
  scale.disabled = false;
  pictures.ahead(JSON.parse(page.dataset.upcoming), viewer.options, roomOf(viewer.pair));
  offerKeys(page);

  let sending = false;
  form.addEventListener("submit", async (event) => {
    event.preventDefault();
    if (sending) return; // a double click is one answer
    sending = true;
    for (const [name, value] of Object.entries(shown.record())) form.elements[name].value = value;
    const fields = Object.fromEntries(new FormData(form));
    scale.disabled = true;
    form.querySelector("button").setAttribute("aria-disabled", "true");
    remember({ participant: page.dataset.participant, fields });
    advance(page, await deliver(page, form, fields));
  });
}

// Send until the server has acknowledged; the address of what comes next, or null where only a reload helps.
// A browser whose cookies were cleared meanwhile is let in again by the participant's code, once.
async function deliver(page, form, fields, again = true) {
  const body = new URLSearchParams({ ...fields, csrf_token: form.elements.csrf_token.value });
  const response = await insist(page, words.unsaved, form.action, {
    method: "POST", body, headers: { Accept: "application/json" },
  });
  const reply = await response.json().catch(() => ({}));
  if (response.ok || response.status === 409) {
    forget();
    notice = words[reply.outcome] ?? null; // of an answer that was not taken
    return reply.next;
  }
  if (reply.lost && again && (await letIn(page, form))) return deliver(page, form, fields, false);
  if (!reply.lost) forget();
  showStatus(page, reply.error || words.rejected);
  return null;
}

// Whether this browser has its participant again, by the code that the page holds.
async function letIn(page, form) {
  if (!page.dataset.resume) return false;
  const read = async (response) => new DOMParser().parseFromString(await response.text(), "text/html");
  const door = (await read(await insist(page, words.unsaved, page.dataset.resume, { headers: { Accept: "text/html" } }))).querySelector("form[data-resume]");
  const body = new URLSearchParams(new FormData(door));
  const response = await insist(page, words.unsaved, door.getAttribute("action"), { method: "POST", body, headers: { Accept: "text/html" } });
  const token = (await read(response)).querySelector("[name=csrf_token]");
  if (response.ok && token) form.elements.csrf_token.value = token.value;
  return Boolean(response.ok && token);
}

// Show the next question in place, so that a connection lost in between leaves a page that goes on trying.
async function advance(page, next) {
  if (next === null) return;
  const response = await insist(page, words.waiting, next, { headers: { Accept: "text/html" } });
  const arrived = new DOMParser().parseFromString(await response.text(), "text/html");
  const main = arrived.querySelector("main[data-trial]");
  if (!response.ok || !main) {
    store(RESUME, null);
    return location.replace(response.url);
  }
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
        showStatus(page, "");
        return response;
      }
    } catch { /* no connection, or too slow: the same answer sent twice is one answer */ }
    showStatus(page, message);
    await rest(pause);
  }
}

function onKey(event) {
  const form = document.querySelector("main[data-trial] form.answer");
  if (!form || !viewer || event.ctrlKey || event.altKey || event.metaKey || event.repeat && !event.key.startsWith("Arrow")) return;
  const options = [...form.querySelectorAll("input[type=radio]")], keys = !stored(KEYS_OFF);
  if (options.some((option) => option.matches(":disabled")) || event.target.matches?.("input[type=range], textarea")) return;
  if (viewer.onKey(event, keys)) return event.preventDefault();
  const elsewhere = !options.includes(event.target), chosen = options.find((option) => option.checked);
  const key = /^[1-9]$/.test(event.key) ? event.key : /^Digit([1-9])$/.exec(event.code)?.[1]; // AZERTY has them above Shift
  const middle = (options.length - 1) / 2, left = /Left|Up/.test(event.key);
  if (keys && key && options[key - 1]) choose(options[key - 1]);
  else if (event.key.startsWith("Arrow") && event.shiftKey) return;
  else if (event.key.startsWith("Arrow") && !chosen) choose(options[left ? Math.ceil(middle) - 1 : Math.floor(middle) + 1]); // to a side
  else if (event.key.startsWith("Arrow") && elsewhere) choose(chosen);
  else if (event.key === "Enter" && !event.target.closest?.("a, button, summary, input[type=checkbox]")) form.requestSubmit();
  else return;
  event.preventDefault();
}

function choose(option) {
  option.checked = true;
  option.focus({ preventScroll: true });
}

// Keys of one letter or digit can be turned off (WCAG 2.1.4).
function offerKeys(page) {
  const box = page.querySelector("[data-keys]");
  if (!box) return;
  box.checked = !stored(KEYS_OFF);
  box.addEventListener("change", () => store(KEYS_OFF, box.checked ? null : "1"));
}

function showNotice(page, message) {
  const place = page.querySelector(".notice");
  place.textContent = message ?? "";
  place.hidden = !message;
}

function showStatus(page, message) {
  const status = page.querySelector(".status");
  if (status.textContent !== message) status.textContent = message;
}

// localStorage may be forbidden; then an answer is kept only as long as the page is open.
function store(name, text) { try { text === null ? localStorage.removeItem(name) : localStorage.setItem(name, text); } catch { /* see above */ } }
function stored(name) { try { return localStorage.getItem(name); } catch { return null; } }
function remember(answer) { store(UNSENT, JSON.stringify(answer)); }
function recall() { try { return JSON.parse(stored(UNSENT)); } catch { return null; } }
function forget() { store(UNSENT, null); }
