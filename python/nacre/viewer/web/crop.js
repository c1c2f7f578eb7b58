// A box that leaves out what is not in it, and what is shown as a PLY file.

const MOST_SAVED = 20_000_000; // points
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

  /** Whether a point of a cube may be inside. */
  touches(middle, side) {
    const radius = (Math.sqrt(3) / 2) * side;
    return this.axes.every((axis, k) => {
      const at = dot(axis, middle), [low, high] = this.limits[k], [least, most] = this.reach[k];
      return (low <= least || at + radius >= low) && (high >= most || at - radius <= high);
    });
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
    this.button = document.getElementById("save");
    this.button.addEventListener("click", () => this.save());
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

  /** Save what is shown when all is read, not only what the view needs. */
  async save() {
    const cloud = this.app.clouds[this.app.activeRun];
    if (!cloud) return;
    const { title, origin } = this.app.document.runs[this.app.activeRun];
    const link = element("a", { download: `${title.replace(/(\.\w+)?$/, "").replace(/[^\w-]+/g, "-")}.ply` });
    this.button.disabled = true;
    try {
      link.href = URL.createObjectURL(await plyFile(cloud, this.app.document.comment, origin));
    } catch (error) {
      return this.say(error.message);
    } finally {
      this.button.disabled = false;
    }
    this.say("");
    link.click();
    setTimeout(() => URL.revokeObjectURL(link.href), 10000);
  }

  say(words) {
    document.getElementById("save-message").textContent = words;
  }
}

/** The shown points of a cloud as a binary PLY file, in the coordinates that its points had. */
async function plyFile(cloud, comment, origin) {
  const blocks = [];
  let numPoints = 0, format = null;
  await cloud.each((part) => {
    format ??= new PlyRows(part, origin);
    if (part.numShown) blocks.push(format.bytes(part));
    numPoints += part.numShown;
    if (numPoints > MOST_SAVED) throw new Error(`More than ${countText(MOST_SAVED)} points: crop first`);
  });
  return new Blob([format.header(comment, numPoints), ...blocks]);
}

/** How the points are written; all parts of a cloud have the same columns. */
class PlyRows {
  constructor(part, origin) {
    this.origin = origin;
    this.isFar = origin.some((value) => value); // float32 has too few digits
    this.hasColors = Boolean(part.colors);
    this.attributes = ["confidence", "sigma"].filter((name) => part[name]);
  }

  header(comment, numPoints) {
    const colors = this.hasColors ? ["red", "green", "blue"] : [], type = this.isFar ? "double" : "float";
    return [
      "ply", "format binary_little_endian 1.0", `comment ${comment}`, `element vertex ${numPoints}`,
      ...["x", "y", "z"].map((name) => `property ${type} ${name}`),
      ...["nx", "ny", "nz"].map((name) => `property float ${name}`), ...colors.map((name) => `property uchar ${name}`),
      ...this.attributes.map((name) => `property float ${name}`), "end_header\n",
    ].join("\n");
  }

  bytes(part) {
    const start = this.isFar ? 36 : 24, colorBytes = this.hasColors ? 3 : 0;
    const rowSize = start + colorBytes + 4 * this.attributes.length;
    const view = new DataView(new ArrayBuffer(rowSize * part.numShown));
    let at = 0;
    for (let i = 0; i < part.size; i++) {
      if (!part.isShown(i)) continue;
      add(this.origin, part.position(i)).forEach((value, k) => {
        if (this.isFar) view.setFloat64(at + 8 * k, value, true);
        else view.setFloat32(at + 4 * k, value, true);
      });
      const normal = unit([0, 1, 2].map((k) => part.normals[4 * i + k]));
      normal.forEach((value, k) => view.setFloat32(at + start - 12 + 4 * k, value, true));
      for (let k = 0; k < colorBytes; k++) view.setUint8(at + start + k, part.colors[3 * i + k]);
      this.attributes.forEach((name, k) => view.setFloat32(at + start + colorBytes + 4 * k, part[name][i], true));
      at += rowSize;
    }
    return view.buffer;
  }
}
