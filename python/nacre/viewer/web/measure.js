// Distances between pairs of points that were picked.

const SVG = "http://www.w3.org/2000/svg";

class Measure {
  constructor(app) {
    this.app = app;
    this.pairs = []; // of positions; the last pair may lack its second
    this.button = document.getElementById("measure");
    this.button.addEventListener("click", () => this.start(!this.isActive));
    document.getElementById("clear").addEventListener("click", () => {
      this.pairs = [];
      this.#changed();
    });
  }

  get isActive() {
    return this.button.getAttribute("aria-pressed") === "true";
  }

  start(active) {
    this.button.setAttribute("aria-pressed", String(active));
    this.app.canvas.classList.toggle("picking", active);
  }

  add(point) {
    const last = this.pairs.at(-1);
    if (last && last.length < 2) last.push(point);
    else this.pairs.push([point]);
    this.#changed();
  }

  get distances() {
    return this.pairs.filter((pair) => pair.length === 2).map(([a, b]) => length(subtract(a, b)));
  }

  #changed() {
    const items = this.distances.map((distance) => element("li", {}, lengthText(distance)));
    document.getElementById("distances").replaceChildren(...items);
    this.app.redraw();
  }

  /** Draw the pairs over each part of the picture. */
  overlay(toPixel) {
    return this.pairs.flatMap((pair) => {
      const ends = pair.map(toPixel).filter((at) => at);
      const drawn = ends.map(([cx, cy]) => element("circle", { cx, cy, r: 4 }, "", SVG));
      if (ends.length < 2) return drawn;
      const [[x1, y1], [x2, y2]] = ends;
      const words = lengthText(length(subtract(...pair)));
      return [
        element("line", { x1, y1, x2, y2 }, "", SVG), ...drawn,
        element("text", { x: (x1 + x2) / 2, y: (y1 + y2) / 2 - 8 }, words, SVG),
      ];
    });
  }
}

function element(name, attributes, text = "", space = "http://www.w3.org/1999/xhtml") {
  const made = document.createElementNS(space, name);
  Object.entries(attributes).forEach(([key, value]) => made.setAttribute(key, value));
  made.textContent = text;
  return made;
}
