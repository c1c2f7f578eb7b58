// A camera that runs: what it sees, how its frames are registered, and the buttons.

const LIVE_POLL = 250; // [ms]
const STATES = {
  ready: "Ready", recording: "Recording", paused: "Paused", stopped: "Finishing: lost frames are tried again",
  finished: "Finished",
};
const ADVICE = {
  LOST: "Go back to where it was tracked.",
  WEAK: "Show more shape: the surface in view leaves the pose open.",
};

class Live {
  constructor(app) {
    this.app = app;
    for (const button of ["start", "pause", "stop"]) {
      document.getElementById(button).addEventListener("click", () => this.#press(button));
    }
    document.getElementById("picture").addEventListener("change", () => this.#showPictures(true));
  }

  /** Ask again and again what is new; at the end once. */
  async poll() {
    document.getElementById("live").hidden = false;
    try {
      this.now = await (await fetch("data/live")).json();
      this.#show(this.now);
    } catch {
      this.#say("The run has ended");
      this.#enable({});
      return;
    }
    if (this.now.state !== "finished") setTimeout(() => this.poll(), LIVE_POLL);
  }

  async #press(button) {
    await fetch(`press/${button}`, { method: "POST" });
    this.now = await (await fetch("data/live")).json();
    this.#show(this.now);
  }

  #show({ state, message, rate, numSeen, status, reason }) {
    this.#say(STATES[state] + (state === "ready" || state === "recording" ? this.#rate(rate) : ""));
    document.getElementById("live-message").textContent = message;
    document.body.classList.toggle("is-ready", state === "ready"); // the picture is large, as there is no model
    const isRunning = state === "recording" || state === "paused";
    this.#enable({ start: state === "ready" || state === "paused", pause: state === "recording",
      stop: isRunning || state === "ready" });
    const badge = document.getElementById("badge");
    badge.hidden = !(status && isRunning);
    if (status) {
      badge.replaceChildren(element("b", {}, status), ` ${status === "TRACKED" ? "" : (ADVICE[status] ?? reason)}`);
      badge.style.borderColor = `rgb(${this.app.document.statusColors[status]})`;
    }
    if (numSeen !== this.numSeen && state !== "finished") this.#showPictures();
    this.numSeen = numSeen;
  }

  #rate(rate) {
    return rate ? `, ${rate.toFixed(0)} frames/s` : "";
  }

  /** Load the pictures that are chosen, when those before are there; a camera without color has the depth image. */
  #showPictures(isOther = false) {
    const chosen = document.getElementById("picture").value;
    for (const kind of ["color", "depth"]) {
      const image = document.getElementById(`picture-${kind}`), hasIt = kind === "depth" || this.now?.hasColor;
      const isShown = hasIt && (chosen === kind || chosen === "both" || (kind === "depth" && !this.now?.hasColor));
      if (isShown && (isOther || image.complete)) image.src = `data/picture/${kind}?${this.now.numSeen}`;
      image.hidden = !isShown;
    }
    document.getElementById("picture-row").hidden = !this.now?.hasColor;
  }

  #enable(usable) {
    for (const button of ["start", "pause", "stop"]) document.getElementById(button).disabled = !usable[button];
  }

  #say(words) {
    document.getElementById("live-state").textContent = words;
  }
}
