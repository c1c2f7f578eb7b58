// The words of the panel.

const LEGENDS = {
  colour: "as the camera saw it",
  shading: "by how the surface lies to the light",
  normal: "red: to the right, green: up, blue: towards the first camera",
};
const LEVELS = 100; // of the confidence slider

/** Show what belongs to the whole of a document. */
function showDocument({ title, runs, depthLegend }) {
  document.title = title;
  document.getElementById("title").textContent = title;
  document.getElementById("compare").hidden = runs.length < 2;
  const other = runs[1];
  document.getElementById("placement").textContent = other?.placement ? `${other.title}: ${other.placement}` : "";
  document.getElementById("depth-legend").innerHTML = depthLegend;
  const { frames } = runs[0], counts = new Map();
  frames.forEach(({ status }) => counts.set(status, (counts.get(status) ?? 0) + 1));
  const parts = [...counts].map(([status, count]) => `${count} ${status.toLowerCase()}`);
  document.getElementById("summary").textContent = frames.length ? `${frames.length} frames: ${parts.join(", ")}` : "";
  document.querySelectorAll(".of-frames").forEach((part) => (part.hidden = !frames.length));
}

/** Offer what the points can be colored by; at first the differences of two runs, or colors where they have any. */
function showKinds({ clouds }) {
  const select = document.getElementById("kind"), before = select.value;
  const kinds = clouds[0].kinds.filter((kind) => clouds.every((cloud) => cloud.kinds.includes(kind)));
  select.replaceChildren(...kinds.map((value) => element("option", { value }, value)));
  const first = kinds.includes("deviation") ? "deviation" : kinds[0];
  select.value = kinds.includes(before) ? before : first;
  document.getElementById("confidence-row").hidden = !clouds[0].confidence;
}

function showLegend({ kind, clouds, document: { colormap } }) {
  const legend = document.getElementById("legend");
  const gradient = `linear-gradient(90deg, ${colormap.map((color) => `rgb(${color})`)})`;
  if (kind === "confidence" || kind === "age") {
    const [low, high] = clouds[0].range(kind).map((value) => Number(value.toPrecision(2)).toLocaleString("en"));
    const [before, after] = kind === "age" ? ["last seen in frame ", ""] : ["", " observations"];
    const bar = element("div", { class: "bar" });
    bar.append(element("span", {}, before + low), element("i", {}), element("span", {}, high + after));
    legend.replaceChildren(bar);
  } else legend.textContent = LEGENDS[kind] ?? "distance to the surface of the other run";
  document.querySelectorAll(".bar i").forEach((bar) => (bar.style.background = gradient));
}

/** The confidence that points must have, by the slider: none at its start, then evenly in the logarithm. */
function showConfidence({ clouds }) {
  const level = +document.getElementById("confidence").value, cloud = clouds[0];
  const output = document.getElementById("confidence-value");
  output.textContent = "any";
  if (!cloud?.confidence || level === 0) return -Infinity;
  cloud.confidenceRange ??= [quantile(cloud.confidence, 0.001), quantile(cloud.confidence, 0.999)];
  const [low, high] = cloud.confidenceRange.map((value) => Math.log(Math.max(value, 1e-3)));
  const least = Math.exp(low + ((high - low) * level) / LEVELS);
  output.textContent = Number(least.toPrecision(3)).toLocaleString("en");
  return least;
}

function showCount({ clouds, parts }) {
  const texts = parts.map(({ run }) => {
    const { numShown, size } = clouds[run];
    const all = size.toLocaleString("en");
    return numShown === size ? `${all} points` : `${numShown.toLocaleString("en")} of ${all} points`;
  });
  document.getElementById("count").textContent = texts.join(" and ");
}
