// A box that leaves out what is not in it, and what is shown as a PLY file.

const SIDES = [["left", "right"], ["bottom", "top"], ["back", "front"]];

/** An upright box, turned as the first view: its axes lead right, up, and towards the eye. */
class Box {
  constructor({ target, direction, up, radius }) {
    this.axes = axesOf(unit(subtract(direction, scaled(up, dot(direction, up)))), up);
    // About the main thing, so that the sliders are fine there; at their ends they leave nothing out.
    this.reach = this.axes.map((axis) => [dot(axis, target) - 2 * radius, dot(axis, target) + 2 * radius]);
    this.limits = this.reach.map((range) => [...range]);
  }

  /** A function of a row of a cloud: whether the point is inside. */
  test(cloud) {
    const [x, y, z] = this.axes.map((axis) => cloud.along(axis));
    const [[left, right], [bottom, top], [back, front]] = this.limits.map(([low, high], k) => {
      const [least, most] = this.reach[k];
      return [low <= least ? -Infinity : low, high >= most ? Infinity : high];
    });
    return (i) => {
      const [a, b, c] = [x(i), y(i), z(i)];
      return a >= left && a <= right && b >= bottom && b <= top && c >= back && c <= front;
    };
  }

  /** The twelve edges, two corners each. */
  get edges() {
    const corner = (bits) =>
      this.axes.reduce((sum, axis, k) => add(sum, scaled(axis, this.limits[k][(bits >> k) & 1])), [0, 0, 0]);
    const edges = [];
    for (let bits = 0; bits < 8; bits++) {
      for (let k = 0; k < 3; k++) if (!((bits >> k) & 1)) edges.push([corner(bits), corner(bits | (1 << k))]);
    }
    return edges;
  }
}

class Crop {
  constructor(app) {
    this.app = app;
    this.box = null;
    this.toggle = document.getElementById("crop");
    this.panel = document.getElementById("box");
    this.toggle.addEventListener("change", () => this.#switch());
    document.getElementById("save").addEventListener("click", () => this.save());
  }

  /** The box, where it is on. */
  get active() {
    return this.toggle.checked ? this.box : null;
  }

  #switch() {
    if (!this.box && this.app.document.view) {
      this.box = new Box(this.app.document.view);
      this.panel.replaceChildren(...SIDES.flatMap((names, k) => this.#row(names, k)));
    }
    this.panel.hidden = !this.toggle.checked;
    this.app.select();
  }

  #row(names, k) {
    const [min, max] = this.box.reach[k];
    const inputs = names.map((name, end) => {
      const value = [min, max][end];
      const input = element("input", { type: "range", min, max, step: (max - min) / 1000, "aria-label": name });
      input.id = `box-${name}`;
      input.value = value;
      input.addEventListener("input", () => {
        const limits = this.box.limits[k];
        limits[end] = end ? Math.max(+input.value, limits[0]) : Math.min(+input.value, limits[1]);
        this.app.select();
      });
      return input;
    });
    return [element("span", {}, names.join(", ")), ...inputs];
  }

  save() {
    const cloud = this.app.clouds[this.app.activeRun];
    if (!cloud) return;
    const { title } = this.app.document.runs[this.app.activeRun];
    const link = element("a", { download: `${title.replace(/(\.\w+)?$/, "").replace(/[^\w-]+/g, "-")}.ply` });
    link.href = URL.createObjectURL(new Blob([plyBytes(cloud, this.app.document.comment)]));
    link.click();
    setTimeout(() => URL.revokeObjectURL(link.href), 10000);
  }
}

/** The shown points of a cloud as a binary PLY file. */
function plyBytes(cloud, comment) {
  const attributes = ["confidence", "sigma"].filter((name) => cloud[name]);
  const floats = ["x", "y", "z", "nx", "ny", "nz"], colors = cloud.colors ? ["red", "green", "blue"] : [];
  const header = [
    "ply", "format binary_little_endian 1.0", `comment ${comment}`, `element vertex ${cloud.numShown}`,
    ...floats.map((name) => `property float ${name}`), ...colors.map((name) => `property uchar ${name}`),
    ...attributes.map((name) => `property float ${name}`), "end_header\n",
  ].join("\n");
  const rowSize = 24 + colors.length + 4 * attributes.length;
  const start = new TextEncoder().encode(header);
  const bytes = new Uint8Array(start.length + rowSize * cloud.numShown);
  bytes.set(start);
  const view = new DataView(bytes.buffer);
  let at = start.length;
  for (let i = 0; i < cloud.size; i++) {
    if (!cloud.isShown(i)) continue;
    const normal = unit([0, 1, 2].map((k) => cloud.normals[4 * i + k]));
    [...cloud.position(i), ...normal].forEach((value, k) => view.setFloat32(at + 4 * k, value, true));
    colors.forEach((_, k) => view.setUint8(at + 24 + k, cloud.colors[3 * i + k]));
    attributes.forEach((name, k) => view.setFloat32(at + 24 + colors.length + 4 * k, cloud[name][i], true));
    at += rowSize;
  }
  return bytes;
}
