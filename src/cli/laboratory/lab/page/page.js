"use strict";
// The page of a comparison. `data` has the estimators with their snapshots (pictures after some
// samples). All pictures have the same size.
const data = JSON.parse(document.getElementById("data").textContent);
const byId = (id) => document.getElementById(id);
const make = (name, properties, ...children) => {
  const element = Object.assign(document.createElement(name), properties);
  element.append(...children);
  return element;
};
const number = (value, digits) => Number(value).toPrecision(digits);
const samples = (count) => `${count} sample${count === 1 ? "" : "s"}`;
const seconds = (value) => (value < 10 ? value.toFixed(2) : value.toFixed(1)) + " s";

const rendered = data.estimators.filter((estimator) => estimator.points.length > 0);
const state = { view: "picture", measure: data.measure, at: 0, zoom: 1, left: 0, top: 0 };

// Figures

/** Adds a figure with the picture and the error map of `estimator`. All figures zoom and pan together. */
function figure(estimator, index) {
  const view = make("div", { className: "view", tabIndex: 0 });
  view.setAttribute("role", "img");
  view.style.aspectRatio = data.size.join(" / ");
  const missing = make("p", { hidden: true });
  view.append(missing);
  const name = make("strong", {}, estimator.name);
  if (estimator.color) name.prepend(Object.assign(make("span", { className: "key" }), { style: "background:" + estimator.color }));
  const figures = make("p", { className: "figures" });
  const caption = make("figcaption", {}, name, figures);
  if (estimator.sentence) caption.append(make("p", {}, estimator.sentence));
  if (estimator.slope) caption.append(make("p", { className: "figures" }, estimator.slope + "."));
  if (estimator.paper) {
    const link = make("a", { href: "https://doi.org/" + estimator.paper.doi }, "doi:" + estimator.paper.doi);
    const { authors, title } = estimator.paper;
    caption.append(make("p", { className: "paper" }, `${authors}, `, make("cite", {}, title), ", ", link));
  }
  const element = make("figure", {}, view, caption);
  const choose = (chosen) => () => mark(chosen ? index : -1);
  element.addEventListener("pointerenter", choose(true));
  element.addEventListener("pointerleave", choose(false));
  move(view);
  byId("gallery").append(element);
  return { estimator, view, missing, figures, images: new Map() };
}

/** Shows the picture or the error map `key` of a figure. The image element of the picture or map is made at the first call. */
function show(shown, key, source, label, isMap) {
  for (const [other, image] of shown.images) image.hidden = other !== key;
  if (source && !shown.images.has(key)) {
    const image = make("img", { src: "data:image/png;base64," + source, alt: "", draggable: false, className: isMap ? "map" : "" });
    shown.images.set(key, image);
    shown.view.prepend(image);
  }
  shown.view.setAttribute("aria-label", label);
}

const all = rendered.map(figure);
const refused = data.estimators.filter((estimator) => estimator.refused);
refused.forEach((estimator) => {
  const shown = figure(estimator, -1);
  shown.missing.hidden = false;
  shown.missing.textContent = "not rendered: " + estimator.refused;
});
if (data.reference) {
  const { name, samples: count, picture } = data.reference;
  const shown = figure({ name: "reference: " + name, points: [] }, -1);
  shown.figures.textContent = count ? samples(count) : "";
  show(shown, "picture", picture, "reference", false);
}
if (data.witness) {
  const { samples: count, picture } = data.witness;
  const shown = figure({ name: "check of the reference: sppm", points: [] }, -1);
  shown.figures.textContent = `${count} iterations; it has light that the reference lacks`;
  show(shown, "picture", picture, "check of the reference", false);
}
byId("warnings").hidden = data.warnings.length === 0;
byId("warnings").append(...data.warnings.map((warning) => make("li", {}, warning)));

/** Factor within which samples or times count as equal. Times differ by up to a tenth, because a render can end only after a whole sample or a whole pass. */
const TOLERANCE = { samples: 1, seconds: 1.1 };

/** The last snapshot of an estimator within the selected number of samples or seconds. */
const snapshot = (estimator) => estimator.points.filter((point) => point[state.measure] <= state.at * TOLERANCE[state.measure]).pop();

function update() {
  const isMap = state.view !== "picture";
  document.body.className = state.view;
  for (const shown of all) {
    const point = snapshot(shown.estimator);
    shown.missing.hidden = Boolean(point);
    if (!point) {
      const first = shown.estimator.points[0];
      shown.missing.textContent = `first picture after ${seconds(first.seconds)}`;
      shown.figures.textContent = "";
      show(shown, null, null, shown.estimator.name + ": no picture yet", false);
      continue;
    }
    const error = point.relmse === null ? "" : `, relMSE ${number(point.relmse, 3)}`;
    shown.figures.textContent = `${samples(point.samples)}, ${seconds(point.seconds)}${error}`;
    const what = { picture: "picture", signed: "signed error", magnitude: "size of the error" }[state.view];
    const source = isMap ? point.error : point.picture;
    show(shown, `${isMap} ${point.samples}`, source, `${shown.estimator.name}, ${what} at ${samples(point.samples)}`, isMap);
  }
  scale();
  cursors();
}

// Slider: numbers of samples of the snapshots, or seconds on a logarithmic scale

const counts = [...new Set(rendered.flatMap((estimator) => estimator.points.map((point) => point.samples)))].sort((a, b) => a - b);
const times = rendered.flatMap((estimator) => estimator.points.map((point) => point.seconds));
const [shortest, longest] = [Math.min(...times), Math.max(...times)];
// Longest time for which every estimator has a picture
const common = Math.min(...rendered.map((estimator) => estimator.points[estimator.points.length - 1].seconds));
const STEPS = 400;

function measure(name) {
  state.measure = name;
  const slider = byId("slider");
  slider.min = 0;
  slider.max = name === "samples" ? counts.length - 1 : STEPS;
  slider.step = 1;
  const share = data.measure === "seconds" ? 1 : Math.log(common / shortest) / Math.log(longest / shortest);
  slider.value = name === "samples" || !(share >= 0) ? slider.max : Math.round(share * STEPS);
  byId("slider-name").textContent = name === "samples" ? "Samples" : "Seconds";
  slide();
}

function slide() {
  const at = Number(byId("slider").value);
  state.at = state.measure === "samples" ? counts[at] : shortest * (longest / shortest) ** (at / STEPS);
  const words = state.measure === "samples" ? samples(state.at) : seconds(state.at);
  byId("slider-value").textContent = words;
  byId("slider").setAttribute("aria-valuetext", words);
  update();
}

// Zoom and pan, which are equal in all views

function place() {
  state.zoom = Math.min(Math.max(state.zoom, 1), 32);
  const room = 1 - 1 / state.zoom;
  state.left = Math.min(Math.max(state.left, 0), room);
  state.top = Math.min(Math.max(state.top, 0), room);
  const style = document.documentElement.style;
  style.setProperty("--zoom", state.zoom);
  style.setProperty("--x", -100 * state.left * state.zoom + "%");
  style.setProperty("--y", -100 * state.top * state.zoom + "%");
  byId("zoom-value").textContent = `${Math.round(10 * state.zoom) / 10} ×`;
}

/** Zooms by `factor` around the point `x`, `y` of the view, in fractions of the view's width and height. */
function zoom(factor, x = 0.5, y = 0.5) {
  const before = state.zoom;
  state.zoom = Math.min(Math.max(before * factor, 1), 32);
  state.left += x / before - x / state.zoom;
  state.top += y / before - y / state.zoom;
  place();
}

function move(view) {
  const share = (event) => {
    const box = view.getBoundingClientRect();
    return [(event.clientX - box.left) / box.width, (event.clientY - box.top) / box.height];
  };
  let last = null;
  view.addEventListener("pointerdown", (event) => {
    last = share(event);
    view.setPointerCapture(event.pointerId);
  });
  view.addEventListener("pointermove", (event) => {
    if (!last) return;
    const now = share(event);
    state.left -= (now[0] - last[0]) / state.zoom;
    state.top -= (now[1] - last[1]) / state.zoom;
    last = now;
    place();
  });
  for (const end of ["pointerup", "pointercancel"]) view.addEventListener(end, () => (last = null));
  view.addEventListener("dblclick", (event) => zoom(2, ...share(event)));
  // The wheel scrolls the page, unless the view is selected or Ctrl is held.
  const wheel = (event) => {
    if (!event.ctrlKey && document.activeElement !== view) return;
    event.preventDefault();
    zoom(event.deltaY < 0 ? 1.25 : 0.8, ...share(event));
  };
  view.addEventListener("wheel", wheel, { passive: false });
  view.addEventListener("keydown", (event) => {
    const step = 0.1 / state.zoom;
    const keys = {
      ArrowLeft: () => (state.left -= step),
      ArrowRight: () => (state.left += step),
      ArrowUp: () => (state.top -= step),
      ArrowDown: () => (state.top += step),
      "+": () => zoom(1.5),
      "-": () => zoom(1 / 1.5),
      0: () => (state.zoom = 1),
    };
    if (!keys[event.key] || event.ctrlKey || event.altKey || event.metaKey) return;
    event.preventDefault();
    keys[event.key]();
    place();
  });
}

// Error maps are grey pictures. An SVG filter replaces each grey value by a colour.

function filters() {
  const svg = (name, attributes) => {
    const element = document.createElementNS("http://www.w3.org/2000/svg", name);
    Object.entries(attributes).forEach(([key, value]) => element.setAttribute(key, value));
    return element;
  };
  for (const [name, colors] of Object.entries(data.palettes)) {
    const transfer = svg("feComponentTransfer", {});
    ["R", "G", "B"].forEach((channel, at) => {
      const values = colors.map((color) => color[at] / 255).join(" ");
      transfer.append(svg("feFunc" + channel, { type: "table", tableValues: values }));
    });
    const filter = svg("filter", { id: name, "color-interpolation-filters": "sRGB", x: 0, y: 0, width: 1, height: 1 });
    filter.append(transfer);
    byId("filters").append(filter);
  }
}

/** Shows the colour scale of the error map that is visible. */
function scale() {
  const element = byId("scale");
  element.hidden = state.view === "picture";
  if (element.hidden) return;
  const colors = data.palettes[state.view];
  const half = state.view === "signed" ? colors : colors.slice(colors.length >> 1);
  const bar = make("span", { className: "bar" });
  bar.style.background = `linear-gradient(to right, ${half.map((color) => `rgb(${color})`).join(", ")})`;
  const [low, high] = state.view === "signed" ? ["−100 %", "+100 %"] : ["0", "100 %"];
  const words = "relative error of luminance, (Y − Yref) / (Yref² + 0.01)^½; the colours follow its square root: half way from 0 to the end is 25 %";
  element.replaceChildren(low, bar, high, make("span", {}, words));
}

// Curves and table

function cursors() {
  for (const plot of document.querySelectorAll("#curves .plot")) {
    const { measure: name, from, to, start, end } = plot.dataset;
    const share = (Math.log10(state.at) - from) / (to - from);
    const x = Number(start) + share * (end - start);
    const isShown = name === state.measure && share >= 0 && share <= 1;
    plot.querySelector(".cursor").setAttribute("d", isShown ? `M${x} 28V300` : "");
  }
}

function mark(index) {
  byId("curves").classList.toggle("active", index >= 0);
  for (const curve of document.querySelectorAll(".curve")) curve.classList.toggle("chosen", Number(curve.dataset.index) === index);
  for (const row of document.querySelectorAll("#figures tbody tr")) row.classList.toggle("chosen", Number(row.dataset.index) === index);
}

function table() {
  const body = document.querySelector("#figures tbody");
  const text = (value, digits) => (value === null ? "" : number(value, digits));
  rendered.forEach((estimator, index) => {
    for (const point of estimator.points.filter((point) => point.is_budget)) {
      const cells = [point.samples, point.seconds.toFixed(2), text(point.relmse, 4), text(point.block_relmse, 4), text(point.efficiency, 3)];
      const row = make("tr", {}, make("th", { scope: "row" }, estimator.name), ...cells.map((cell) => make("td", {}, String(cell))));
      row.dataset.index = index;
      row.addEventListener("pointerenter", () => mark(index));
      row.addEventListener("pointerleave", () => mark(-1));
      body.append(row);
    }
  });
}

function begin() {
  byId("summary").textContent = data.summary;
  filters();
  table();
  for (const input of document.querySelectorAll("[name=view]")) {
    input.disabled = input.value !== "picture" && !data.reference;
    input.addEventListener("change", () => {
      state.view = input.value;
      update();
    });
  }
  for (const input of document.querySelectorAll("[name=measure]")) {
    input.checked = input.value === state.measure;
    input.addEventListener("change", () => measure(input.value));
  }
  byId("slider").addEventListener("input", slide);
  byId("controls").addEventListener("submit", (event) => event.preventDefault());
  byId("zoom-in").addEventListener("click", () => zoom(2));
  byId("zoom-out").addEventListener("click", () => zoom(0.5));
  byId("zoom-fit").addEventListener("click", () => zoom(0));
  measure(state.measure);
  place();
}

begin();
const images = [...document.images];
Promise.all(images.map((image) => image.decode())).then(() => (document.body.dataset.pictures = images.length));
