// Where the surface ends although a camera looked there: holes, and the rim, as lines.

const HOLE = [255, 70, 200, 255], RIM = [255, 70, 200, 110];
const HOLE_WIDTH = 3; // [pixels]
const HOLES_REST = 3; // times what finding them took: until they are looked for again, in a model that grows

class Holes {
  constructor(app) {
    this.app = app;
    this.runs = []; // of each run its lines, and the sizes of its holes
    this.input = document.getElementById("holes");
    this.input.addEventListener("change", () => this.load().then(() => app.redraw()));
  }

  /** Find the holes of what is shown, unless that is being done, or was done a moment ago. */
  async load() {
    const { clouds } = this.app;
    document.getElementById("holes-row").hidden = !clouds.some(({ name }, run) => this.#canFind(name, run));
    if (!this.input.checked || this.isBusy || performance.now() < this.next) return this.#showCount();
    this.isBusy = true;
    const start = performance.now();
    try {
      await Promise.all(clouds.map((cloud, run) => this.#read(cloud.name, run)));
    } catch {
      // a state that is gone meanwhile: the next one comes
    }
    this.isBusy = false;
    if (this.app.document.isLive) this.#again(HOLES_REST * (performance.now() - start));
    this.#showCount();
    this.app.redraw();
  }

  lines(run) {
    return this.input.checked ? this.runs[run] : undefined;
  }

  /** Rest, and then look whether there is a newer state. */
  #again(rest) {
    this.next = performance.now() + rest;
    setTimeout(() => this.app.clouds.some(({ name }, run) => name !== this.runs[run]?.name) && this.load(), rest + 1);
  }

  /** A mesh of a file is as it is: holes are those of points that were joined here, and that do not move. */
  #canFind(name, run) {
    const { isMesh, painted } = this.app.document.runs[run];
    return !isMesh && !this.app.clouds[run].motion && name !== painted && this.app.source.has(`holes/${name}`);
  }

  async #read(name, run) {
    if (this.runs[run]?.name === name || !this.#canFind(name, run)) return;
    const { header, columns } = unpack(await this.app.source.read(`holes/${name}`));
    const colors = [...columns.isHole].flatMap((isHole) => [...(isHole ? HOLE : RIM), ...(isHole ? HOLE : RIM)]);
    this.runs[run] = { name, positions: columns.segments, colors, sizes: header.sizes };
  }

  #showCount() {
    const known = this.app.parts.map(({ run }) => this.lines(run)?.sizes).filter((sizes) => sizes);
    const texts = known.map((sizes) => {
      if (!sizes.length) return "no holes";
      return `${sizes.length} hole${sizes.length > 1 ? "s" : ""}, the largest ${lengthText(sizes[0])}`;
    });
    document.getElementById("holes-count").textContent = texts.join(" and ");
  }
}
