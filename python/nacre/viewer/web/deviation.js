// How far the points of each run are from the surface of the other: figures, and a histogram in their colors.

const BINS = 40;
const LEAST_END = 0.1; // spacings: where the color scale ends by itself; runs that are nearly equal differ by rounding

class Deviation {
  constructor(app) {
    this.app = app;
    this.input = document.getElementById("scale");
    this.input.addEventListener("input", () => app.color());
  }

  /** The length at which the color scale ends [m]: from 0.1 to 10 of its usual one, by the slider. */
  get end() {
    const usual = this.app.clouds.flatMap(({ deviation, spacing }) => {
      const most = 1.25 * quantile(deviation, 0.95), ofOverlap = 10 * quantile(deviation, 0.5);
      return [Math.min(most, ofOverlap), LEAST_END * spacing]; // parts that one run lacks are far
    });
    return Math.max(...usual) * 100 ** (this.input.value / 100 - 0.5);
  }

  /** Of the points of a run that are shown: the median, what 95 % are below, and how many are in each bin. */
  figures(cloud) {
    const shown = cloud.deviation.filter((_, i) => cloud.isShown(i));
    const end = this.end, counts = new Array(BINS).fill(0);
    shown.forEach((value) => (counts[Math.min(Math.floor((value / end) * BINS), BINS - 1)] += 1));
    return { median: quantile(shown, 0.5), most: quantile(shown, 0.95), counts };
  }

  show() {
    const end = this.end;
    document.getElementById("scale-value").textContent = lengthText(end);
    const parts = this.app.clouds.flatMap((cloud, run) => {
      const { median, most, counts } = this.figures(cloud);
      const words = `median ${lengthText(median)}, 95 % below ${lengthText(most)}`;
      return [element("div", {}, `${this.app.document.runs[run].title}: ${words}`), this.#histogram(counts)];
    });
    const ends = element("div", { class: "bar" });
    ends.append(element("span", {}, "0"), element("i", {}), element("span", {}, `${lengthText(end)} and more`));
    document.getElementById("deviation").replaceChildren(...parts, ends);
  }

  #histogram(counts) {
    const canvas = element("canvas", { width: 4 * BINS, height: 60 });
    const context = canvas.getContext("2d"), highest = Math.max(...counts, 1);
    counts.forEach((count, i) => {
      const color = mapped(this.app.document.colormap, (i + 0.5) / BINS).map(Math.round);
      context.fillStyle = `rgb(${color})`;
      const height = count && Math.max((58 * count) / highest, 2); // a few points are seen, too
      context.fillRect(4 * i, 60 - height, 3, height);
    });
    return canvas;
  }
}
