// The frames of a run, one after the other, and what is known of each.

const SECONDS = 8; // that the growth takes

class Player {
  constructor(app) {
    this.app = app;
    this.slider = document.getElementById("frame");
    this.button = document.getElementById("play");
    this.isFollowing = true; // the newest frame
    this.slider.addEventListener("input", () => this.go(+this.slider.value));
    this.button.addEventListener("click", () => (this.timer ? this.stop() : this.play()));
  }

  get place() {
    return +this.slider.value;
  }

  get last() {
    return this.app.document.runs[0].frames.length - 1;
  }

  /** Take frames that were added. */
  update() {
    this.slider.max = Math.max(this.last, 0);
    if (this.isFollowing) this.slider.value = this.last;
    this.#drawStrip();
    this.show();
  }

  go(place) {
    this.#choose(place);
    return this.app.load();
  }

  /** Choose the frame that the page's address names, if it names one: view.html#frame=40. */
  goToAddress() {
    const index = new URLSearchParams(location.hash.slice(1)).get("frame");
    const place = this.app.document.runs[0].frames.findIndex((frame) => String(frame.index) === index);
    if (place >= 0) this.#choose(place);
  }

  #choose(place) {
    this.slider.value = place;
    this.isFollowing = place >= this.last;
    this.show();
  }

  play() {
    this.button.textContent = "Stop";
    const start = performance.now(), from = this.place >= this.last ? 0 : this.place;
    const step = async () => {
      const part = (performance.now() - start) / (1000 * SECONDS);
      const place = Math.min(from + Math.round(part * (this.last + 1)), this.last);
      if (place !== this.place) await this.go(place);
      if (this.timer && place < this.last) this.timer = setTimeout(step, 40);
      else this.stop();
    };
    this.timer = setTimeout(step, 0);
  }

  stop() {
    clearTimeout(this.timer);
    this.timer = null;
    this.button.textContent = "Play";
  }

  /** Say what is known of the chosen frame. */
  show() {
    const run = this.app.document.runs[0], frame = run.frames[this.place];
    if (!frame) return;
    const reason = frame.reason ? `: ${frame.reason}` : "";
    document.getElementById("frame-status").textContent = `frame ${frame.index}, ${frame.status}${reason}`;
    const details = document.getElementById("frame-details");
    details.textContent = frame.details === frame.reason ? "" : frame.details;
    const rows = Object.entries(frame.figures).map(([name, value]) => {
      const row = element("tr", {});
      row.append(element("td", {}, name), element("td", {}, value));
      return row;
    });
    document.getElementById("figures").replaceChildren(...rows);
    const depth = document.getElementById("depth"), isSeenLive = this.app.document.isLive && this.isFollowing;
    const hasDepth = run.hasDepth && this.app.source instanceof ServedSource && !isSeenLive;
    if (hasDepth) depth.src = `data/depth/${this.place}`;
    depth.hidden = !hasDepth;
    document.getElementById("depth-legend").hidden = !hasDepth;
  }

  /** All frames in the colors of their statuses. */
  #drawStrip() {
    const strip = document.getElementById("strip"), context = strip.getContext("2d");
    const { runs, statusColors } = this.app.document, frames = runs[0].frames;
    strip.width = strip.clientWidth || 270;
    frames.forEach((frame, i) => {
      context.fillStyle = `rgb(${statusColors[frame.status]})`;
      const x = Math.floor((i * strip.width) / frames.length);
      context.fillRect(x, 0, Math.ceil(((i + 1) * strip.width) / frames.length) - x, strip.height);
    });
  }
}
