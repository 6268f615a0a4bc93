// Keeps the changing part of the dashboard fresh. The server renders it; this only asks and puts it in its place, and
// leaves alone what somebody folded, where a table was scrolled to and what has the keys.

const PERIOD_MS = 3000, FOLDS = "subdermal.folds";
const live = document.getElementById("live"), state = document.getElementById("live-state");
const small = matchMedia("(max-width: 46rem)");
const folds = JSON.parse(sessionStorage.getItem(FOLDS) ?? "{}");
let version = live.dataset.version;
fold(document);
small.addEventListener("change", () => fold(document));
document.addEventListener("click", (event) => { // a key on a summary is a click too
  const one = event.target.closest?.("summary")?.parentElement;
  if (!one?.id) return;
  folds[one.id] = !one.open;
  sessionStorage.setItem(FOLDS, JSON.stringify(folds));
});
refresh();

// As it was chosen; else a small screen begins with the numbers that matter most, a large one with all.
function fold(within) {
  for (const one of within.querySelectorAll("details.fold")) {
    one.dataset.open ??= one.open;
    one.open = folds[one.id] ?? (one.dataset.open === "true" && (!small.matches || "first" in one.dataset));
  }
}

async function refresh() {
  await new Promise((done) => setTimeout(done, PERIOD_MS));
  if (document.hidden) await new Promise((done) => document.addEventListener("visibilitychange", done, { once: true }));
  try {
    const response = await fetch(`${live.dataset.url}?version=${version}`, { headers: { Accept: "application/json" }, cache: "no-store" });
    if (response.status === 401) return location.reload();
    if (!response.ok) throw new Error(response.statusText);
    if (response.status !== 204) {
      const fresh = await response.json();
      put(fresh.html);
      version = fresh.version;
    }
    say("updates by itself");
  } catch {
    say("connection lost, trying again");
  }
  refresh();
}

function put(html) {
  const scrolled = [...live.querySelectorAll(".scroll")].map((box) => box.scrollLeft);
  const has = live.contains(document.activeElement) ? document.activeElement : null;
  const same = has?.matches("summary") ? `#${has.parentElement.id} > summary` : has?.matches("a") ? `a[href="${has.getAttribute("href")}"]` : null;
  live.innerHTML = html;
  fold(live);
  live.querySelectorAll(".scroll").forEach((box, k) => { box.scrollLeft = scrolled[k] ?? 0; });
  if (same) live.querySelector(same)?.focus({ preventScroll: true });
}

function say(message) {
  if (state.textContent !== message) state.textContent = message;
}
