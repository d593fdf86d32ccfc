// Paths of a pixel: drawn over the picture, drawn in space from another angle, and listed as
// numbers.

import { $, element, number } from "./controls.js";
import { add, cross, dot, mul, project, sub, unit } from "./camera.js";

const BOUNCE = "#ffd166";
const SHADOW = "#4cc9f0";
const SHARED = "#f277b6";

// Segments of all paths, each with start, end and colour.
function segments(facts) {
  const found = [];
  for (const sample of facts.samples) {
    for (const trace of sample.traces) {
      for (const vertex of trace.vertices) {
        if (vertex.parent !== null && vertex.parent !== undefined) {
          found.push({ from: trace.vertices[vertex.parent].position, to: vertex.position, colour: BOUNCE });
        }
        for (const light of vertex.light_samples ?? []) {
          const far = light.target ?? add(vertex.position, mul(light.direction, 1e3));
          const isLit = Math.max(...(light.transmittance ?? [0])) > 0;
          found.push({ from: vertex.position, to: far, colour: SHADOW, isDashed: true, isFaint: !isLit });
        }
      }
      // Connections of reused paths: from a vertex of this pixel to the path of another pixel
      for (const { vertex, end } of trace.contributions) {
        if (end && vertex !== null) found.push({ from: trace.vertices[vertex].position, to: end, colour: SHARED });
      }
    }
  }
  return found;
}

// Label of a vertex: its number, with the number of its trace in front if there are several traces.
const label = (traces, trace, vertex) => (traces.length > 1 ? `${trace}.${vertex}` : String(vertex));

// Label of the vertex that found the light.
const vertexOf = (traces, trace, { vertex }) => (vertex === null || vertex === undefined ? "–" : label(traces, trace, vertex));

// Name of the technique that found the light, with its MIS weight.
function technique({ by, s, t, mis_weight, owner }) {
  const weight = mis_weight === undefined ? "" : `, MIS weight ${number(mis_weight)}`;
  if (s !== undefined) return `${by} s = ${s}, t = ${t}${weight}`;
  return owner ? `${by} of pixel ${owner.join(", ")}` : by;
}

// Name of a light for users. Lights have no names in the scene, only a number and possibly a group.
function nameOf(light) {
  const isGroup = light.group && light.group !== "default";
  return `${light.type} light ${light.id}${isGroup ? ` (${light.group})` : ""}`;
}

// Text of the events at a vertex, one event per line.
function events({ emission = [], light_samples = [], scattering = [], photons = [], light }) {
  const strength = (radiance) => number(Math.max(...radiance));
  const met = emission.map((e) => `meets ${nameOf(e.light)}: ${strength(e.radiance)}, MIS weight ${number(e.mis_weight)}`);
  const sampled = light_samples.map((l) => {
    const isLit = l.transmittance && Math.max(...l.transmittance) > 0;
    const end = l.transmittance ? (isLit ? strength(l.radiance) : "occluded") : "no shadow ray";
    return `samples ${nameOf(l.light)}: probability × samples ${number(l.probability)}, pdf ${number(l.pdf)}, MIS weight ${number(l.mis_weight)}; ${end}`;
  });
  const scattered = scattering.map((way) => {
    const density = way.delta ? `delta, probability ${number(way.pdf)}` : `pdf ${number(way.pdf)}`;
    // The factor compensates for terminated paths (roulette), or for branches.
    const roulette = way.roulette > 1 ? `; roulette probability ${number(1 / way.roulette)}` : way.roulette < 1 ? `; factor ${number(way.roulette)}` : "";
    return `scatters: ${way.lobe}, ${density}${roulette}`;
  });
  const found = photons.map(({ count, radius }) => `${number(count)} photon${count === 1 ? "" : "s"} within ${number(radius)}`);
  return [...(light ? [`starts at ${nameOf(light)}`] : []), ...met, ...sampled, ...scattered, ...found];
}

// Maximum number of contributions in the list. The second constant is the maximum number of
// vertices with labels.
const MAX_ADDED = 40;
const MAX_LABELS = 60;

// Vertices of the first sample with their labels, except vertices at the camera.
function numbered(facts) {
  const { traces } = facts.samples[0];
  const all = traces.flatMap((trace, t) => trace.vertices.map((vertex, i) => ({ ...vertex, label: label(traces, t, i) })));
  return all.filter(({ on }) => on !== "camera");
}

export class Inspector {
  facts = null;
  angle = [0.6, 0.4];

  constructor({ link, picture, camera }) {
    Object.assign(this, { link, picture, camera });
    $("inspect").addEventListener("click", () => this.ask([Number($("pixel-x").value), Number($("pixel-y").value)]));
    $("find-brightest").addEventListener("click", () => {
      link.send({ do: "brightest", x: Number($("pixel-x").value), y: Number($("pixel-y").value) });
    });
    $("clear-paths").addEventListener("click", () => this.clear());
    const space = $("space");
    let last = null;
    space.addEventListener("pointerdown", (event) => {
      space.setPointerCapture(event.pointerId);
      last = [event.clientX, event.clientY];
    });
    space.addEventListener("pointermove", (event) => {
      if (!last) return;
      this.angle[0] += (event.clientX - last[0]) * 0.01;
      this.angle[1] = Math.max(-1.5, Math.min(1.5, this.angle[1] + (event.clientY - last[1]) * 0.01));
      last = [event.clientX, event.clientY];
      this.drawSpace();
    });
    space.addEventListener("pointerup", () => (last = null));
    window.addEventListener("resize", () => this.drawSpace());
    camera.addEventListener("change", () => this.drawOver());
  }

  ask([x, y]) {
    [$("pixel-x").value, $("pixel-y").value] = [Math.floor(x), Math.floor(y)];
    this.link.send({ do: "inspect", x: Math.floor(x), y: Math.floor(y), sample: Number($("pixel-sample").value) });
  }

  show(facts, bounds) {
    this.facts = facts;
    this.bounds = bounds ?? this.bounds;
    this.describe();
    this.drawOver();
    this.drawSpace();
  }

  // Shows the samples that contribute most light to a pixel. Each sample has a button that shows
  // the paths of the sample.
  showBrightest({ pixel, searched, of, samples }) {
    const rows = samples.map(({ sample, radiance, share }) => {
      const button = element("button", { "aria-label": `Paths of sample ${sample}` }, String(sample));
      button.addEventListener("click", () => {
        $("pixel-sample").value = sample;
        this.ask(pixel);
      });
      const bar = element("div", { class: "bar" });
      bar.style.width = `${Math.round(90 * share)}px`;
      return element("tr", {}, element("td", {}, button), element("td", {}, radiance.map((x) => number(x)).join(", ")),
        element("td", {}, `${(100 * share).toPrecision(3)} %`, bar));
    });
    const heads = element("tr", {}, ...["Sample", "Light", "Share"].map((head) => element("th", { scope: "col" }, head)));
    const words = searched < of ? `the first ${searched} of ${of} samples` : `all ${of} samples`;
    $("brightest").replaceChildren(
      element("p", { class: "hint" }, `Pixel ${pixel.join(", ")}: the brightest of ${words}`),
      ...(rows.length ? [element("table", {}, heads, ...rows)] : []),
    );
  }

  // Removes the paths from the picture, and the text about the paths.
  clear() {
    this.facts = null;
    $("paths-section").hidden = true;
    $("brightest").replaceChildren();
    $("found").replaceChildren();
    $("vertices").replaceChildren();
    this.drawOver();
    this.drawSpace();
  }

  // First surface on the path of the pixel.
  get first() {
    return this.facts?.samples[0].traces[0]?.vertices.find((vertex) => vertex.on === "surface");
  }

  describe() {
    const { facts, first } = this;
    $("paths-section").hidden = false;
    const colour = (c) => c.map((x) => number(x)).join(", ");
    const rows = [["Pixel", `${facts.pixel.join(", ")}, sample ${facts.samples[0].sample}`]];
    if (first) {
      rows.push(
        ["Object", first.object ?? "–"], ["Material", first.material],
        ["Distance", number(first.distance, 6)], ["Position", first.position.map((x) => number(x, 5)).join(", ")],
        ["Lobes", first.lobes?.join(", ") || "none"], ["Albedo", colour(first.albedo)],
        ...(first.uv ? [["Texture coordinates", colour(first.uv)]] : []),
        ...Object.entries(first.texels ?? {}).map(([key, texel]) => [key.replaceAll("_", " "), colour(texel)]),
        ["Normal", first.normal.map((x) => number(x)).join(", ")],
        ["Mesh, triangle", `${first.mesh}, ${first.triangle}`],
      );
    } else rows.push(["Surface", "none: the ray leaves the scene"]);
    rows.push(["Light of the sample", colour(facts.samples[0].radiance)]);
    $("found").replaceChildren(element("dl", {}, ...rows.flatMap(([a, b]) => [element("dt", {}, a), element("dd", {}, b)])));

    const { traces } = facts.samples[0];
    const line = (words) => element("div", {}, words);
    const lines = traces.flatMap((trace, t) =>
      trace.vertices.map((vertex, i) =>
        element(
          "tr", {},
          element("td", {}, label(traces, t, i)),
          element("td", {}, vertex.on === "surface" ? vertex.material : vertex.on),
          element("td", {}, ...events(vertex).map(line)),
          element("td", {}, number(Math.max(...vertex.beta))),
        ),
      ),
    );
    const head = (...names) => element("tr", {}, ...names.map((name) => element("th", { scope: "col" }, name)));
    const table = element("table", {}, head("Vertex", "On", "What happens there", "β"), ...lines);
    const added = traces.flatMap((trace, t) => trace.contributions.map((contribution) => ({ ...contribution, at: vertexOf(traces, t, contribution) })));
    const brightness = ({ radiance }) => Math.max(...radiance);
    added.sort((a, b) => brightness(b) - brightness(a));
    const list = element("table", {}, head("Vertex", "Added by", "Light"),
      ...added.slice(0, MAX_ADDED).map((c) => element("tr", {}, element("td", {}, c.at), element("td", {}, technique(c)), element("td", {}, colour(c.radiance)))));
    const rest = added.length > MAX_ADDED ? [element("p", { class: "hint" }, `and ${added.length - MAX_ADDED} smaller`)] : [];
    $("vertices").replaceChildren(table, list, ...rest);
  }

  drawOver() {
    const overlay = $("overlay");
    overlay.replaceChildren();
    if (!this.facts || !this.camera.now) return;
    const { size, box } = this.picture;
    const svg = (name, attributes, words = "") => {
      const made = document.createElementNS("http://www.w3.org/2000/svg", name);
      for (const [key, value] of Object.entries(attributes)) made.setAttribute(key, value);
      made.textContent = words;
      overlay.append(made);
    };
    const width = 1.6 / box.scale;
    const forward = unit(sub(this.camera.now.look_at, this.camera.now.position));
    for (const { from, to, colour, isDashed, isFaint } of segments(this.facts)) {
      // Clip the segment in front of the camera.
      const near = 1e-3 * this.camera.distance;
      const depth = (p) => dot(sub(p, this.camera.now.position), forward) - near;
      let [a, b] = [from, to];
      if (depth(a) <= 0 && depth(b) <= 0) continue;
      const cut = (p, q) => add(p, mul(sub(q, p), depth(p) / (depth(p) - depth(q)) + 1e-6));
      if (depth(a) <= 0) a = cut(a, b);
      else if (depth(b) <= 0) b = cut(b, a);
      const [p, q] = [project(this.camera.now, size, a), project(this.camera.now, size, b)];
      if (!p || !q) continue;
      const dash = isDashed ? { "stroke-dasharray": `${4 * width} ${3 * width}` } : {};
      svg("line", { x1: p[0], y1: p[1], x2: q[0], y2: q[1], stroke: colour, "stroke-width": width, opacity: isFaint ? 0.35 : 1, ...dash });
    }
    const vertices = numbered(this.facts);
    for (const vertex of vertices) {
      const p = project(this.camera.now, size, vertex.position);
      if (!p) continue;
      svg("circle", { cx: p[0], cy: p[1], r: 3 / box.scale, fill: vertex.on === "light" ? SHADOW : BOUNCE, stroke: "#000", "stroke-width": width / 2 });
      if (vertices.length > MAX_LABELS) continue;
      const text = { x: p[0] + 5 / box.scale, y: p[1] - 5 / box.scale, fill: "#fff", stroke: "#000", "stroke-width": 2 * width, "paint-order": "stroke", "font-size": 12 / box.scale };
      svg("text", text, vertex.label);
    }
    const [x, y] = this.facts.pixel;
    svg("rect", { x, y, width: 1, height: 1, fill: "none", stroke: "#fff", "stroke-width": width / 2 });
  }

  // Draws the scene's bounding box, the camera and the paths in a parallel projection.
  drawSpace() {
    const canvas = $("space");
    const ratio = window.devicePixelRatio || 1;
    const [w, h] = [canvas.clientWidth, 260];
    if (w === 0) return;
    [canvas.width, canvas.height] = [w * ratio, h * ratio];
    canvas.style.height = `${h}px`;
    const context = canvas.getContext("2d");
    context.scale(ratio, ratio);
    if (!this.bounds || !this.camera.now) return;
    const [low, high] = this.bounds;
    const eye = this.camera.now.position;
    const all = [low, high, eye];
    const min = [0, 1, 2].map((i) => Math.min(...all.map((p) => p[i])));
    const max = [0, 1, 2].map((i) => Math.max(...all.map((p) => p[i])));
    const middle = mul(add(min, max), 0.5);
    const scale = (0.45 * Math.min(w, h)) / (Math.hypot(...sub(max, min)) / 2 || 1);
    const up = unit(this.camera.now.up);
    const side = unit(cross(up, Math.abs(up[0]) < 0.9 ? [1, 0, 0] : [0, 0, 1]));
    const front = cross(side, up);
    const [c, s] = [Math.cos(this.angle[0]), Math.sin(this.angle[0])];
    const x = add(mul(side, c), mul(front, s));
    const z = sub(mul(front, c), mul(side, s));
    const y = add(mul(up, Math.cos(this.angle[1])), mul(z, -Math.sin(this.angle[1])));
    const at = (p) => [w / 2 + dot(sub(p, middle), x) * scale, h / 2 - dot(sub(p, middle), y) * scale];
    const line = (a, b, colour, width = 1, dash = []) => {
      context.strokeStyle = colour;
      context.lineWidth = width;
      context.setLineDash(dash);
      context.beginPath();
      context.moveTo(...at(a));
      context.lineTo(...at(b));
      context.stroke();
    };
    const corner = (i) => [0, 1, 2].map((axis) => ((i >> axis) & 1 ? high : low)[axis]);
    const soft = getComputedStyle(document.documentElement).getPropertyValue("--soft");
    for (let i = 0; i < 8; i += 1) {
      for (const bit of [1, 2, 4]) if (!(i & bit)) line(corner(i), corner(i | bit), soft, 0.7);
    }
    context.fillStyle = SHARED;
    context.beginPath();
    context.arc(...at(eye), 4, 0, 2 * Math.PI);
    context.fill();
    for (const { from, to, colour, isDashed, isFaint } of this.facts ? segments(this.facts) : []) {
      context.globalAlpha = isFaint ? 0.35 : 1;
      line(from, to, colour, 1.4, isDashed ? [4, 3] : []);
    }
    context.globalAlpha = 1;
    const vertices = this.facts ? numbered(this.facts) : [];
    if (vertices.length > MAX_LABELS) return;
    context.font = "11px system-ui, sans-serif";
    context.fillStyle = getComputedStyle(document.documentElement).getPropertyValue("--text");
    for (const { position, label: words } of vertices) {
      const [column, row] = at(position);
      context.fillText(words, column + 4, row - 4);
    }
  }
}
