// Where the page gets its data: from itself, or from its server. The format is that of packing.py.

const ARRAYS = { uint8: Uint8Array, uint16: Uint16Array, uint32: Uint32Array, float32: Float32Array };

/** Undo packing.pack: the header, the columns by name, and where they end. */
function unpack(bytes) {
  const headerSize = new DataView(bytes.buffer, bytes.byteOffset).getUint32(0, true);
  const header = JSON.parse(new TextDecoder().decode(bytes.subarray(4, 4 + headerSize)));
  const columns = {};
  let at = 4 + headerSize;
  for (const { name, type, rows, width } of header.columns) {
    const size = ARRAYS[type].BYTES_PER_ELEMENT;
    columns[name] = unshuffled(bytes.subarray(at, at + rows * width * size), rows, width, ARRAYS[type]);
    at += rows * width * size;
  }
  return { header, columns, end: at };
}

function unshuffled(bytes, rows, width, ArrayType) {
  const out = new ArrayType(rows * width);
  const size = out.BYTES_PER_ELEMENT;
  const bits = new { 1: Uint8Array, 2: Uint16Array, 4: Uint32Array }[size](out.buffer);
  for (let column = 0; column < width; column++) {
    let value = 0;
    for (let row = 0; row < rows; row++) {
      for (let byte = 0; byte < size; byte++) {
        value = (value + (bytes[(column * size + byte) * rows + row] << (8 * byte))) | 0;
      }
      bits[row * width + column] = value;
    }
  }
  return out;
}

/** Data that are in the page. */
class EmbeddedSource {
  static async open(base64) {
    const packed = Uint8Array.from(atob(base64), (c) => c.charCodeAt(0));
    const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream("gzip"));
    return new EmbeddedSource(new Uint8Array(await new Response(stream).arrayBuffer()));
  }

  constructor(bytes) {
    const { header, end } = unpack(bytes);
    this.files = new Map();
    let at = end;
    for (const [name, size] of Object.entries(header.sizes)) {
      this.files.set(name, bytes.slice(at, at + size));
      at += size;
    }
  }

  has(name) {
    return this.files.has(name);
  }

  async read(name) {
    const bytes = this.files.get(name);
    if (!bytes) throw new Error(`the page has no ${name}`);
    return bytes;
  }

  async changed() {
    return null;
  }
}

/** Data that a server has, which may gain more. */
class ServedSource {
  has() {
    return true;
  }

  async read(name) {
    const answer = await fetch(`data/${name}`);
    if (!answer.ok) throw new Error(`${name}: ${answer.status}`);
    if (name === "document") this.known = answer.headers.get("ETag");
    return new Uint8Array(await answer.arrayBuffer());
  }

  /** The document, if it is another one than was read last; null otherwise. */
  async changed() {
    const answer = await fetch(`data/document?known=${this.known}`);
    if (answer.status !== 200) return null;
    this.known = answer.headers.get("ETag");
    return new Uint8Array(await answer.arrayBuffer());
  }
}

function openSource() {
  const base64 = document.getElementById("data").textContent.trim();
  return base64 ? EmbeddedSource.open(base64) : new ServedSource();
}
