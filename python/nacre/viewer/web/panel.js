// The words of the panel.

const LEGENDS = {
  texture: "as the images that are painted on the mesh saw it",
  colour: "as the camera saw it",
  shading: "by how the surface lies to the light",
  normal: "red: to the right, green: up, blue: towards the first camera",
  uncertainty: "expected standard deviation of each point across the surface",
  age: "the last frame that saw each point",
  deviation: "distance to the surface of the other run",
};
/** What stands at the ends of a color scale. */
const SCALES = { uncertainty: (sigma) => lengthText(sigma), age: (frame) => `frame ${Math.round(frame)}` };

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
  document.getElementById("summary").textContent = frames.length ? `${countText(frames.length)} frames: ${parts.join(", ")}` : "";
  document.querySelectorAll(".of-frames").forEach((part) => (part.hidden = !frames.length));
  document.getElementById("path-row").hidden = !runs.some((run) => run.hasPath);
}

/** Offer what the points can be colored by; at first the differences of two runs, or colors where they have any. */
function showKinds({ clouds }) {
  const select = document.getElementById("kind"), before = select.value;
  const hadTexture = [...select.options].some(({ value }) => value === "texture");
  const kinds = clouds[0].kinds.filter((kind) => clouds.every((cloud) => cloud.kinds.includes(kind)));
  select.replaceChildren(...kinds.map((value) => element("option", { value }, value)));
  const first = kinds.includes("deviation") ? "deviation" : kinds[0];
  const isNew = kinds[0] === "texture" && !hadTexture;
  select.value = kinds.includes(before) && !isNew ? before : first;
  document.getElementById("uncertainty-row").hidden = !clouds[0].sigma;
}

function showLegend({ kind, clouds, document: { colormap } }) {
  const legend = document.getElementById("legend");
  const gradient = `linear-gradient(90deg, ${colormap.map((color) => `rgb(${color})`)})`;
  legend.textContent = LEGENDS[kind];
  if (SCALES[kind]) {
    const [low, high] = clouds[0].range(kind).map(SCALES[kind]);
    const bar = element("div", { class: "bar" });
    bar.append(element("span", {}, low), element("i", {}), element("span", {}, high));
    legend.append(bar);
  }
  document.querySelectorAll(".bar i").forEach((bar) => (bar.style.background = gradient));
}

/** The standard deviation that points may have, by the slider: that which its share of the points is within. */
function showUncertainty({ clouds: [cloud] }) {
  const share = document.getElementById("uncertainty").value / 100;
  const most = cloud?.sigma && share < 1 ? quantile(cloud.sigma, share) : Infinity;
  document.getElementById("uncertainty-value").textContent = most < Infinity ? lengthText(most) : "any";
  return most;
}

function showCount({ clouds, parts }) {
  const texts = parts.map(({ run }) => {
    const { numShown, size, total, failed } = clouds[run];
    const all = countText(total ?? size), isWhole = numShown === (total ?? size);
    const lost = failed ? `; ${failed} part${failed > 1 ? "s" : ""} cannot be read` : "";
    return (isWhole ? `${all} points` : `${countText(numShown)} of ${all} points`) + lost;
  });
  document.getElementById("count").textContent = texts.join(" and ");
}
