// Keeps the changing part of the dashboard fresh. The server renders it; this only asks and puts it in its place.

const PERIOD_MS = 3000;
const live = document.getElementById("live"), state = document.getElementById("live-state");
let shown;
refresh();

async function refresh() {
  await new Promise((done) => setTimeout(done, PERIOD_MS));
  try {
    const response = await fetch(live.dataset.url, { headers: { Accept: "application/json" }, cache: "no-store" });
    if (response.status === 401) return location.reload();
    if (!response.ok) throw new Error(response.statusText);
    const { html } = await response.json();
    if (html !== shown) live.innerHTML = shown = html;
    say("updates by itself");
  } catch {
    say("connection lost, trying again");
  }
  refresh();
}

function say(message) {
  if (state.textContent !== message) state.textContent = message;
}
