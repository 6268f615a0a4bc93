// Keeps the changing part of the dashboard fresh. The server renders it; this only asks and puts it in its place.

const PERIOD_MS = 3000;
const live = document.getElementById("live"), state = document.getElementById("live-state");
let version = live.dataset.version;
refresh();

async function refresh() {
  await new Promise((done) => setTimeout(done, PERIOD_MS));
  if (document.hidden) await new Promise((done) => document.addEventListener("visibilitychange", done, { once: true }));
  try {
    const response = await fetch(`${live.dataset.url}?version=${version}`, { headers: { Accept: "application/json" }, cache: "no-store" });
    if (response.status === 401) return location.reload();
    if (!response.ok) throw new Error(response.statusText);
    if (response.status !== 204) {
      const fresh = await response.json();
      live.innerHTML = fresh.html;
      version = fresh.version;
    }
    say("updates by itself");
  } catch {
    say("connection lost, trying again");
  }
  refresh();
}

function say(message) {
  if (state.textContent !== message) state.textContent = message;
}
