// The page: what is chosen, what is loaded for it, and the picture of it.

const POLL = 1000; // [ms]
const PATIENCE = 300; // [ms]: an octree that takes longer has a few points stand for it meanwhile
const IS_NARROW = matchMedia("(max-width: 600px)"); // as in style.css: the panel lies below the model

class App {
  constructor() {
    this.canvas = document.getElementById("scene");
    try {
      this.renderer = new Renderer(this.canvas);
    } catch (error) {
      this.cannotDraw = error.message; // the rest goes on: a camera's buttons, figures, files
    }
    this.orbit = new Orbit(
      this.canvas, () => this.redraw(), (x, y) => this.#click(x, y), (x, y) => this.#turnAbout(x, y),
    );
    this.clouds = []; // what is drawn of each run
    this.cache = new Map(); // clouds that were read, by name
    this.framesAtReset = 0; // a model that grows is looked at anew each time its frames have doubled
    this.measure = new Measure(this);
    this.crop = new Crop(this);
    this.deviation = new Deviation(this);
    this.holes = new Holes(this);
    this.player = new Player(this);
    this.live = new Live(this);
    this.#listen();
  }

  async start() {
    this.source = await openSource();
    await this.#take(await this.source.read("document"));
    if (this.document.isLive) this.live.poll();
    this.#poll();
  }

  /** Ask again and again whether there is more; seldom where that takes long. */
  #poll(delay = POLL) {
    if (this.source instanceof EmbeddedSource) return;
    setTimeout(async () => {
      const start = performance.now();
      try {
        const bytes = await this.source.changed();
        if (bytes) await this.#take(bytes);
        this.#poll(Math.max(POLL, 5 * (performance.now() - start)));
      } catch {
        this.#say("");
        document.getElementById("summary").textContent += "; no more is coming";
      }
    }, delay);
  }

  async #take(bytes) {
    const isFirst = !this.document;
    this.document = JSON.parse(new TextDecoder().decode(bytes));
    showDocument(this.document);
    const { isLive, view, runs } = this.document;
    if (isFirst) {
      this.#fold(IS_NARROW.matches && !isLive); // a camera's buttons stay in sight
      document.getElementById("holes").checked = isLive;
      document.getElementById("reverse").checked = !isLive && !runs[0].frames.length;
      if (runs[0].isMesh) document.getElementById("surface").value = "mesh";
    }
    document.querySelector("#surface [value=painted]").hidden = !this.#hasPainted(runs[0]);
    this.player.update();
    if (isFirst) this.player.goToAddress();
    this.#forget();
    if (view && !this.orbit.touched && runs[0].frames.length >= 2 * this.framesAtReset) this.reset();
    await this.load();
  }

  /** Give back states that the document has no more. */
  #forget() {
    const { runs } = this.document, painted = runs.map((run) => run.painted);
    const named = new Set([...painted, ...runs.flatMap((run) => run.states.map((state) => state.name))]);
    for (const name of this.cache.keys()) if (!named.has(name.replace("tree/", ""))) this.cache.delete(name);
  }

  /** Read the states of the models that belong to the chosen frame, and draw them. */
  async load() {
    const states = this.document.runs.map((run, i) => {
      if (this.showsPainted && this.#hasPainted(run)) return { name: run.painted };
      const place = i === 0 ? this.player.place : Infinity;
      return run.states.findLast((state) => state.place <= place) ?? run.states[0];
    });
    if (states.some((state) => !state)) return this.#say(this.document.isLive ? "The model appears here" : "There is no model yet");
    const request = (this.request = (this.request ?? 0) + 1);
    let clouds;
    try {
      clouds = await Promise.all(states.map((state) => this.#cloud(state)));
    } catch (error) {
      if (!this.clouds.length) this.#say(String(error));
      return; // a state that is gone meanwhile: the next document has another one
    }
    if (request !== this.request) return; // another frame was chosen meanwhile
    const isOther = clouds.some((cloud, i) => cloud !== this.clouds[i]);
    this.clouds = clouds;
    const isBent = clouds[0].bend(this.player.place);
    this.#say("");
    if (isOther) {
      this.#release();
      showKinds(this);
    }
    await this.#loadTriangles();
    if (isOther || (isBent && this.kind === "normal")) this.color();
    this.select();
    this.holes.load();
  }

  async #cloud({ name, total, isStreamed }) {
    const isNewest = this.player.place >= this.player.last; // before, points appear with frames
    if (isStreamed && isNewest && !this.showsMesh && this.source.has(`tree/${name}`)) {
      return Object.assign(await this.#octree(name), { name, total });
    }
    if (!this.cache.has(name)) this.cache.set(name, new Cloud(await this.source.read(`points/${name}`)));
    const cloud = Object.assign(this.cache.get(name), { name, total });
    if (cloud.uv && this.source.has(`image/${name}`)) cloud.image ??= await this.#image(name);
    return cloud;
  }

  /** All points of a state, from coarse to fine; a few of them while the server is not so far. */
  async #octree(name) {
    const known = this.cache.get(`tree/${name}`);
    if (known) return known;
    this.coming ??= this.#readOctree(name).finally(() => (this.coming = null));
    const octree = await Promise.race([this.coming, new Promise((resolve) => setTimeout(resolve, PATIENCE))]);
    if (octree) return octree;
    this.coming?.then(() => this.load(), () => {});
    return new Cloud(await this.source.read(`coarse/${name}`));
  }

  async #readOctree(name) {
    const octree = new OctreeCloud(name, await this.source.read(`tree/${name}`), this.source, () => this.#refine());
    this.cache.set(`tree/${name}`, await octree.begin());
    return octree;
  }

  /** Draw points that came, and leave those that were dropped. */
  #refine() {
    if (this.clouds.length) showCount(this);
    this.#release();
    this.redraw();
  }

  #release() {
    this.renderer?.keepOnly(this.clouds.flatMap((cloud) => cloud.loaded));
  }

  /** The image that is painted on a mesh, as large as can be drawn. */
  async #image(name) {
    const image = await createImageBitmap(new Blob([await this.source.read(`image/${name}`)]));
    const most = this.renderer?.maxImageSize ?? Infinity, larger = Math.max(image.width, image.height);
    if (larger <= most) return image;
    const [resizeWidth, resizeHeight] = [image.width, image.height].map((n) => Math.max(Math.floor((n * most) / larger), 1));
    return createImageBitmap(image, { resizeWidth, resizeHeight, resizeQuality: "high" });
  }

  async #loadTriangles() {
    if (!this.showsMesh) return;
    for (const cloud of this.clouds) {
      if (cloud.triangles || !this.source.has(`triangles/${cloud.name}`)) continue;
      this.#say("Joining the points");
      cloud.triangles = unpack(await this.source.read(`triangles/${cloud.name}`)).columns.triangles;
    }
    this.#say("");
  }

  /** Whether there is a mesh of a run that an image is painted on. */
  #hasPainted(run) {
    return Boolean(run.painted) && this.source.has(`points/${run.painted}`);
  }

  get showsMesh() {
    return document.getElementById("surface").value !== "points";
  }

  get showsPainted() {
    return document.getElementById("surface").value === "painted";
  }

  get kind() {
    return document.getElementById("kind").value;
  }

  /** Which run is drawn; of two the first. */
  get activeRun() {
    const layout = document.getElementById("layout").value;
    return this.document.runs.length > 1 && layout !== "both" ? +layout : 0;
  }

  /** Which run is drawn where, as parts of the canvas. */
  get parts() {
    const layout = document.getElementById("layout").value;
    if (this.document.runs.length < 2 || layout !== "both") return [{ run: this.activeRun, left: 0, width: 1 }];
    return [{ run: 0, left: 0, width: 0.5 }, { run: 1, left: 0.5, width: 0.5 }];
  }

  /** Go to the first view. */
  reset() {
    this.framesAtReset = this.document.runs[0].frames.length;
    this.orbit.look(this.document.view, this.#aspect(this.parts[0]));
  }

  /** Fit an untouched first view to what there is room for now. */
  #refit() {
    if (this.document?.view && !this.orbit.touched) this.reset();
    else this.redraw();
  }

  #fold(isFolded) {
    document.body.classList.toggle("is-folded", isFolded);
    document.getElementById("fold").setAttribute("aria-expanded", String(!isFolded));
  }

  /** Show the points that the tools leave. */
  select() {
    const maxSigma = showUncertainty(this);
    this.clouds.forEach((cloud, run) => {
      cloud.select(maxSigma, this.crop.active, run === 0 ? this.player.place : Infinity);
    });
    showCount(this);
    if (this.clouds.length === 2) this.deviation.show();
    this.redraw();
  }

  /** Give the points their colors. */
  color() {
    const end = this.clouds.length === 2 ? this.deviation.end : 0;
    this.clouds.forEach((cloud) => cloud.color(this.kind, this.document.colormap, end));
    if (this.clouds.length === 2) this.deviation.show();
    showLegend(this);
    this.redraw();
  }

  redraw() {
    this.pending ??= requestAnimationFrame(() => {
      this.pending = null;
      this.draw();
    });
  }

  draw() {
    if (!this.renderer) return;
    this.renderer.resize();
    this.renderer.clear();
    const overlay = this.clouds.length ? this.parts.flatMap((part) => this.#drawPart(part)) : [];
    document.getElementById("overlay").replaceChildren(...overlay);
  }

  #drawPart(part) {
    const cloud = this.clouds[part.run], run = this.document.runs[part.run], matrices = this.matrices(part);
    const asMesh = this.showsMesh && Boolean(cloud.triangles);
    const pointSize = +document.getElementById("size").value;
    const isPainted = this.kind === "texture" && Boolean(cloud.image);
    const ambient = { shading: 0.25, colour: 0.5, texture: 0.8 }[this.kind] ?? 0.6; // photographs have light of their own
    const showReverse = isChecked("reverse");
    cloud.look(matrices, this.canvas.clientHeight, this.#aspect(part));
    for (const drawn of cloud.parts) {
      this.renderer.drawCloud(drawn, matrices, part, { asMesh, isPainted, showReverse, pointSize, ambient });
    }
    const chosen = { path: isChecked("path"), cameras: isChecked("cameras") };
    const place = part.run === 0 ? this.player.place : run.frames.length;
    const size = 0.06 * (this.document.view?.radius ?? 1);
    const lines = cameraLines(run, place, this.document.statusColors, size, chosen);
    this.crop.active?.edges.forEach(([a, b]) => lines.add(a, b, [255, 255, 255], 150));
    this.renderer.drawLines(lines.positions, lines.colors, matrices, part);
    const holes = this.holes.lines(part.run);
    if (holes) this.renderer.drawLines(holes.positions, holes.colors, matrices, part, HOLE_WIDTH);
    return this.#overlay(part, matrices);
  }

  #overlay(part, matrices) {
    const drawn = this.measure.overlay((point) => project(point, matrices, part, this.canvas));
    if (this.parts.length < 2) return drawn;
    const width = this.canvas.clientWidth, x = part.left * width;
    drawn.push(element("text", { class: "run", x: x + 0.25 * width, y: 20 }, this.document.runs[part.run].title, SVG));
    if (x) drawn.push(element("line", { class: "divider", x1: x, y1: 0, x2: x, y2: 10000 }, "", SVG));
    return drawn;
  }

  matrices(part) {
    return this.orbit.matrices(this.#aspect(part));
  }

  #aspect(part) {
    return (part.width * this.canvas.clientWidth) / Math.max(this.canvas.clientHeight, 1);
  }

  /** The position of the point under a pixel; null where there is none. */
  pointAt(x, y) {
    const across = x / this.canvas.clientWidth;
    const part = this.parts.find(({ left, width }) => across >= left && across <= left + width);
    const cloud = part && this.clouds[part.run];
    if (!cloud) return null;
    const eye = isChecked("reverse") ? null : this.orbit.eye;
    const found = pick(cloud, this.matrices(part), part, this.canvas, x, y, eye);
    return found && found.cloud.position(found.i);
  }

  #click(x, y) {
    if (!this.measure.isActive) return;
    const point = this.pointAt(x, y);
    if (point) this.measure.add(point);
  }

  #turnAbout(x, y) {
    const point = this.measure.isActive ? null : this.pointAt(x, y);
    if (point) this.orbit.turnAbout(point);
  }

  #listen() {
    const on = (id, event, action) => document.getElementById(id).addEventListener(event, action);
    on("kind", "change", () => this.color());
    on("surface", "change", () => this.load());
    on("size", "input", () => this.redraw());
    on("uncertainty", "input", () => this.select());
    for (const id of ["reverse", "path", "cameras"]) on(id, "change", () => this.redraw());
    on("reset", "click", () => this.reset());
    on("layout", "change", () => {
      this.#refit();
      this.select();
      this.holes.load();
    });
    on("fold", "click", () => this.#fold(!document.body.classList.contains("is-folded")));
    new ResizeObserver(() => this.#refit()).observe(this.canvas);
  }

  #say(words) {
    document.getElementById("message").textContent = this.cannotDraw ?? words;
  }
}

const isChecked = (id) => document.getElementById(id).checked;

window.page = new App();
window.page.start().catch((error) => (document.getElementById("message").textContent = String(error)));
