// How large the disks of points are where nodes of several levels are drawn: the more points, the smaller.

const OCTAVES = 8; // by which a disk may become smaller
const LEVEL_BITS = 10; // of the Morton order of a node's points
const CELL_POINTS = 200; // among which the points of each level are counted
const OVERLAP = 1.5; // what no longer follows each point's neighbours needs more

class DiskSizes {
  /** Fit the disks of the nodes that are drawn; those below which the same ones are drawn as before are left. */
  fit(root, drawn) {
    this.drawn = drawn;
    this.shapes = new Map();
    this.#visit(root, [], false);
  }

  /** Visit a node that is drawn, or is empty; chain: the drawn nodes above it, and which of their points are in it. */
  #visit(node, chain, isNew) {
    const shape = this.#shape(node), kept = node.cloud ?? node;
    isNew ||= kept.shape === undefined;
    if (!isNew && shape === kept.shape) return;
    kept.shape = shape;
    const inside = node.cloud ? [...chain, { cloud: node.cloud, depth: 0, low: 0, high: node.cloud.size }] : chain;
    for (let octant = 0; octant < 8; octant++) {
      const parts = inside.map((part) => octantOf(part, octant));
      const child = node.children[octant];
      if (this.#shape(child)) this.#visit(child, parts, isNew);
      else {
        if (child) (child.cloud ?? child).shape = undefined; // the points above it are fitted without it
        shrinkCells(parts);
      }
    }
  }

  /** A name of what is drawn of a node and below it; "" where nothing is. */
  #shape(node) {
    if (!node) return "";
    if (!this.shapes.has(node)) {
      const isEmpty = !this.drawn.has(node);
      const below = isEmpty && node.count ? [] : node.children.map((child) => this.#shape(child));
      this.shapes.set(node, isEmpty && !below.some((shape) => shape) ? "" : `(${below.join(",")})`);
    }
    return this.shapes.get(node);
  }
}

/** The points of a part of a node that lie in one of the eight parts of that part. */
function octantOf({ cloud, depth, low, high }, octant) {
  if (depth >= LEVEL_BITS) return { cloud, depth: depth + 1, low, high: octant ? low : high };
  const begin = firstFrom(cloud, depth, octant, low, high);
  return { cloud, depth: depth + 1, low: begin, high: firstFrom(cloud, depth, octant + 1, begin, high) };
}

/** The first of the points from low to high whose octant, so deep below their node, is one or a later one. */
function firstFrom({ points }, depth, octant, low, high) {
  const shift = 23 - depth;
  while (low < high) {
    const i = (low + high) >> 1;
    const [x, y, z] = [0, 1, 2].map((axis) => (points[3 * i + axis] >> shift) & 1);
    if ((x | (y << 1) | (z << 2)) < octant) low = i + 1;
    else high = i;
  }
  return low;
}

/** Make disks smaller cell by cell. */
function shrinkCells(parts) {
  const left = parts.filter(({ low, high }) => low < high);
  const total = left.reduce((sum, { low, high }) => sum + high - low, 0);
  if (left.length < 2 || total <= CELL_POINTS || left.every(({ depth }) => depth >= LEVEL_BITS)) shrink(left, total);
  else for (let octant = 0; octant < 8; octant++) shrinkCells(left.map((part) => octantOf(part, octant)));
}

/** Make disks smaller as all points of a cell together need: on a surface, by the root of their number. */
function shrink(parts, total) {
  for (const { cloud, low, high } of parts) {
    const factor = Math.min(OVERLAP * Math.sqrt((high - low) / total), 1);
    const shift = 18 * (OCTAVES + Math.log2(factor));
    for (let i = low; i < high; i++) cloud.sizes[i] = Math.max(Math.min(cloud.ownSizes[i] + shift, 255), 0);
    cloud.sizesVersion++;
  }
}
