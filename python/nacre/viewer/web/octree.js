// Points in an octree on the server, of which the page reads the nodes that the view needs, coarse ones first.

const PIXELS = 2; // between neighbouring points on the screen: closer ones are not asked for
const MAX_DRAWN = 3_000_000; // points
const MAX_HELD = 5_000_000; // points in memory; more, and nodes that were not needed for the longest time are dropped
const MAX_REQUESTS = 4; // at once

/** A node: where it is, and its points once they were read. */
class Node {
  constructor(parent, [level, x, y, z, count], { origin, side, spacing }) {
    Object.assign(this, { parent, count, name: [level, x, y, z].join("-"), children: new Array(8).fill(null) });
    this.side = side / 2 ** level;
    this.spacing = spacing / 2 ** level;
    this.middle = [x, y, z].map((at, axis) => origin[axis] + this.side * (at + 0.5));
    this.lastUsed = 0;
    if (parent) parent.children[(x & 1) | ((y & 1) << 1) | ((z & 1) << 2)] = this;
  }

  /** Whether its children can be looked at: it has its points, or none. */
  get isReady() {
    return Boolean(this.cloud) || !this.count;
  }
}

class OctreeCloud {
  constructor(name, bytes, source, onChange) {
    const { header, columns } = unpack(bytes);
    Object.assign(this, { name, source, onChange, spacing: header.spacing });
    this.root = plantedTree(columns.nodes, header);
    this.held = new Set(); // nodes with points
    this.drawn = [];
    this.missing = [];
    this.requests = 0;
    this.failed = 0;
    this.time = 0;
    this.version = 0;
    this.disks = new DiskSizes();
    this.selection = [Infinity, null, Infinity];
    this.coloring = null;
  }

  /** Read the coarsest points, by which colors are scaled. */
  async begin() {
    let node = this.root;
    while (node && !node.count) node = node.children.find((child) => child);
    if (node) await this.#read(node);
    this.first = node?.cloud;
    return this;
  }

  get parts() {
    return this.drawn.map((node) => node.cloud);
  }

  /** All that was read. */
  get loaded() {
    return [...this.held].map((node) => node.cloud);
  }

  get size() {
    return this.loaded.reduce((sum, cloud) => sum + cloud.size, 0);
  }

  get numShown() {
    return this.loaded.reduce((sum, cloud) => sum + cloud.numShown, 0);
  }

  get kinds() {
    return this.first?.kinds ?? ["shading"];
  }

  get sigma() {
    return this.first?.sigma;
  }

  range(kind) {
    return this.first.range(kind);
  }

  bend() {
    return false;
  }

  select(...selection) {
    this.selection = selection;
    this.loaded.forEach((cloud) => cloud.select(...selection));
    this.version++;
  }

  color(...coloring) {
    this.coloring = coloring;
    this.loaded.forEach((cloud) => cloud.color(...coloring));
    this.version++;
  }

  /** Choose what is drawn, of what is there, and ask for what is missing. */
  look({ view, clip }, height, aspect) {
    const frustum = new Frustum(view, clip, aspect), perUnit = 0.5 * height * clip[5];
    const pixelsOf = ({ middle, side, spacing }) => {
      const distance = frustum.distance(middle, side);
      return distance === null ? null : (perUnit * spacing) / distance;
    };
    const queue = [{ node: this.root, pixels: pixelsOf(this.root) ?? 0 }], missing = []; // the root is always there
    let numPoints = 0;
    this.time++;
    this.drawn = [];
    while (queue.length && numPoints < MAX_DRAWN) {
      const { node, pixels } = popLargest(queue);
      node.lastUsed = this.time;
      if (node.cloud) {
        numPoints += node.count;
        this.drawn.push(node);
      } else if (node.count && !node.isDamaged) missing.push(node);
      if (!node.isReady || pixels < PIXELS) continue;
      for (const child of node.children) {
        const pixels = child && pixelsOf(child);
        if (pixels !== null) queue.push({ node: child, pixels });
      }
    }
    this.disks.fit(this.root, new Set(this.drawn));
    this.missing = missing;
    this.#ask();
  }

  /** Ask for what is missing, the first first; the answers draw the picture again, which tells what else is. */
  #ask() {
    for (const node of this.missing) {
      if (this.requests >= MAX_REQUESTS) return;
      if (node.isAsked || node.cloud || node.isDamaged) continue;
      this.#read(node).then(() => {
        this.#ask();
        this.onChange();
      });
    }
  }

  async #read(node) {
    node.isAsked = true;
    this.requests++;
    try {
      node.cloud = new NodeCloud(await this.source.read(`node/${this.name}/${node.name}`), this);
      if (this.coloring) node.cloud.color(...this.coloring);
      node.cloud.select(...this.selection);
      this.held.add(node);
      this.drop();
    } catch {
      node.isDamaged = true; // what is above it is shown
      this.failed++;
    }
    node.isAsked = false;
    this.requests--;
  }

  /** Leave the nodes that were not needed for the longest time, until there are no more points than that. */
  drop(most = MAX_HELD) {
    let numPoints = this.size;
    if (numPoints <= most) return;
    for (const node of [...this.held].sort((a, b) => a.lastUsed - b.lastUsed)) {
      if (numPoints <= most || node.lastUsed >= this.time) return;
      if (node.cloud === this.first) continue;
      numPoints -= node.count;
      this.held.delete(node);
      node.cloud = null;
    }
  }

  /** Every point that is shown when all are read, in pieces, for each of which take(cloud) is called. */
  async each(take) {
    const box = this.selection[1], stack = [this.root];
    while (stack.length) {
      const node = stack.pop();
      if (box && !box.touches(node.middle, node.side)) continue;
      stack.push(...node.children.filter((child) => child));
      if (!node.count) continue;
      let { cloud } = node;
      if (!cloud) {
        cloud = new NodeCloud(await this.source.read(`node/${this.name}/${node.name}`), this);
        cloud.select(...this.selection);
      }
      take(cloud);
    }
  }
}

/** The points of a node, whose disks become smaller where nodes below it are drawn. */
class NodeCloud extends Cloud {
  constructor(bytes, whole) {
    super(bytes);
    this.whole = whole;
    this.ownSizes = this.sizes;
    this.sizes = this.ownSizes.map((size) => Math.min(size + 18 * OCTAVES, 255));
    this.sizeUnit = this.spacing / 2 ** OCTAVES;
    this.sizesVersion = 0;
    if (whole.sigma) this.sigma ??= new Float32Array(this.size).fill(quantile(whole.sigma, 1)); // as not known
  }

  /** Of all nodes the same. */
  range(kind) {
    return this.whole.first && this.whole.first !== this ? this.whole.range(kind) : super.range(kind);
  }
}

/** The root of the nodes, of which rows tell level, x, y, z and number of points, coarse ones first. */
function plantedTree(rows, header) {
  const nodes = new Map();
  for (let i = 0; i < rows.length; i += 5) {
    const row = rows.subarray(i, i + 5), [level, x, y, z] = row;
    const above = level ? nodes.get(placeName(level - 1, x >> 1, y >> 1, z >> 1)) : null;
    if (level && !above) continue; // no way leads there
    nodes.set(placeName(level, x, y, z), new Node(above, row, header));
  }
  return nodes.get("0-0-0-0") ?? new Node(null, [0, 0, 0, 0, 0], header);
}

const placeName = (...key) => key.join("-");

function popLargest(queue) {
  let best = 0;
  for (let i = 1; i < queue.length; i++) if (queue[i].pixels > queue[best].pixels) best = i;
  const found = queue[best];
  queue[best] = queue.at(-1);
  queue.pop();
  return found;
}
