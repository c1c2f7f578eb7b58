// The points of a model: where they are, which are shown, and their colors.

const LOWEST = 0.02, HIGHEST = 0.98; // quantiles at the ends of color scales

class Cloud {
  constructor(bytes) {
    const { header, columns } = unpack(bytes);
    Object.assign(this, header, columns); // spacing, origin, step; points, normals, colors, uv, confidence, ...
    this.size = this.points.length / 3;
    this.normals = decodedNormals(this.normals);
    this.paint = new Uint8Array(4 * this.size); // red, green, blue, and 255 where the point is shown
    this.numShown = this.size;
    this.version = 0; // of the paint
    this.moment = undefined; // of what bends: which shape the points have now
  }

  /** What is drawn of it: clouds that have all of their points. */
  get parts() {
    return [this];
  }

  /** What was read of it. */
  get loaded() {
    return [this];
  }

  /** All of it is there, whatever the view. */
  look() {}

  /** Call take with each part in turn. */
  async each(take) {
    take(this);
  }

  /** Put the points of what bends where they were at the frame of a place; whether that is elsewhere than now. */
  bend(place) {
    if (!this.motion) return false;
    const { moments, origin, step } = this.motion, moment = moments[Math.min(place, moments.length - 1)];
    if (moment === this.moment) return false;
    const low = Math.floor(moment), high = Math.ceil(moment), part = moment - low;
    this.points = blended(this.#shape(low), this.#shape(high), part);
    this.normals = blended(this.#shapeNormals(low), this.#shapeNormals(high), part);
    Object.assign(this, { origin, step, moment });
    return true;
  }

  #shape(k) {
    return everyNth(this.shapes, 3, this.shapes.length / this.points.length, k);
  }

  #shapeNormals(k) {
    return decodedNormals(everyNth(this.shapeNormals, 2, this.shapes.length / this.points.length, k));
  }

  position(i) {
    return [0, 1, 2].map((axis) => this.origin[axis] + this.step * this.points[3 * i + axis]);
  }

  /** A function of a row: the coordinate of the point along an axis, plus a constant. Positions make garbage. */
  along(axis, constant = 0) {
    const points = this.points, [a, b, c] = scaled(axis, this.step), d = dot(axis, this.origin) + constant;
    return (i) => a * points[3 * i] + b * points[3 * i + 1] + c * points[3 * i + 2] + d;
  }

  isShown(i) {
    return this.paint[4 * i + 3] > 0;
  }

  /** Whether the surface at a point faces an eye. */
  faces(i, eye) {
    const offset = subtract(eye, this.position(i));
    return offset.reduce((sum, value, k) => sum + value * this.normals[4 * i + k], 0) > 0;
  }

  /** What the points can be colored by. */
  get kinds() {
    const known = { texture: this.image, colour: this.colors, shading: true, normal: true, uncertainty: this.sigma };
    Object.assign(known, { age: this.lastSeen, deviation: this.deviation });
    return Object.keys(known).filter((kind) => known[kind]);
  }

  /** Show what has a standard deviation up to one, is in the box, and was seen by a frame up to a place. */
  select(maxSigma, box, place) {
    const isInside = box ? box.test(this) : () => true;
    this.numShown = 0;
    for (let i = 0; i < this.size; i++) {
      const shown =
        !(this.sigma && this.sigma[i] > maxSigma) &&
        !(this.firstSeen && this.firstSeen[i] > place) &&
        isInside(i);
      this.paint[4 * i + 3] = shown ? 255 : 0;
      this.numShown += shown;
    }
    this.version++;
  }

  /** Give the points the colors of a kind; deviations end at a length. */
  color(kind, colormap, deviationEnd) {
    if (kind === "uncertainty") this.#map(this.sigma, colormap, this.range(kind), Math.log);
    else if (kind === "age") this.#map(this.lastSeen, colormap, this.range(kind));
    else if (kind === "deviation") this.#map(this.deviation, colormap, [0, deviationEnd]);
    else {
      for (let i = 0; i < this.size; i++) {
        for (let c = 0; c < 3; c++) {
          this.paint[4 * i + c] =
            kind === "colour" || (kind === "texture" && this.colors) ? this.colors[3 * i + c]
            : kind === "normal" ? 127.5 + (c ? -1 : 1) * this.normals[4 * i + c] // green up, blue towards the camera
            : [172, 175, 178][c];
        }
      }
    }
    this.version++;
  }

  /** The values at the ends of the color scale of a kind. */
  range(kind) {
    const values = { uncertainty: this.sigma, age: this.lastSeen }[kind];
    return [quantile(values, LOWEST), quantile(values, HIGHEST)];
  }

  #map(values, colormap, [low, high], measure = (value) => value) {
    const start = measure(low), reach = measure(high) - start || 1;
    for (let i = 0; i < this.size; i++) {
      const color = mapped(colormap, (measure(values[i]) - start) / reach);
      this.paint.set(color, 4 * i);
    }
  }
}

/** The color at a place between 0 and 1, red, green and blue. */
function mapped(colormap, at) {
  const place = Math.min(Math.max(at, 0), 1) * (colormap.length - 1);
  const low = Math.min(Math.floor(place), colormap.length - 2), part = place - low;
  return colormap[low].map((value, c) => value + part * (colormap[low + 1][c] - value));
}

/** Of rows of a width every nth, from the kth on. */
function everyNth(rows, width, n, k) {
  const out = new rows.constructor(rows.length / n);
  for (let i = 0; i < out.length / width; i++) {
    for (let c = 0; c < width; c++) out[width * i + c] = rows[width * (n * i + k) + c];
  }
  return out;
}

const blended = (a, b, part) => (part ? a.map((value, i) => Math.round(value + part * (b[i] - value))) : a);

/** Unit vectors as four signed bytes, of octahedral ones (Meyer et al. 2010). */
function decodedNormals(octahedral) {
  const out = new Int8Array(2 * octahedral.length);
  for (let i = 0; i < octahedral.length / 2; i++) {
    let x = octahedral[2 * i] / 127.5 - 1, y = octahedral[2 * i + 1] / 127.5 - 1;
    const z = 1 - Math.abs(x) - Math.abs(y);
    if (z < 0) [x, y] = [Math.sign(x || 1) * (1 - Math.abs(y)), Math.sign(y || 1) * (1 - Math.abs(x))];
    out.set(scaled(unit([x, y, z]), 127).map(Math.round), 4 * i);
  }
  return out;
}
