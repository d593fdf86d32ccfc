// Two renders side by side: settings, difference, and errors over time.

import { $, duration, element, number } from "./controls.js";
import { allow } from "./fields.js";

const FIRST = "#f0a030";
const SECOND = "#3fa7d6";

export class Compare {
  points = [];

  constructor(link, onChange) {
    this.link = link;
    $("compare").addEventListener("click", () => this.start($("compare-with").value.trim()));
    $("compare-with").addEventListener("keydown", ({ key }) => key === "Enter" && $("compare").click());
    $("compare-off").addEventListener("click", () => this.start(""));
    this.onChange = onChange;
    window.addEventListener("resize", () => this.draw());
  }

  start(text) {
    this.link.send({ do: "compare", with: text || null });
  }

  build(integrators) {
    $("integrator-names").replaceChildren(...integrators.map(({ name }) => element("option", { value: name })));
  }

  // Shows the text of the comparison that the render reports.
  update(text) {
    if (document.activeElement !== $("compare-with")) $("compare-with").value = text ?? "";
    allow("compare-off", text ? "" : "nothing is compared");
    if (text !== this.text) {
      this.text = text;
      this.clear();
      this.onChange(Boolean(text));
    }
  }

  clear() {
    this.points = [];
    $("errors").replaceChildren();
    this.draw();
  }

  show({ first, second, between }) {
    const last = this.points.at(-1);
    // If the time has gone back, the camera has moved or a setting has changed, so start new
    // curves.
    if (last && first.seconds < last.first.seconds) this.points = [];
    this.points.push({ first, second, between });
    if (this.points.length > 2000) this.points = this.points.filter((_, i) => i % 2);
    // Set the style by script, because the page's security policy forbids style attributes.
    const dot = (colour) => {
      const made = element("span", { class: "dot" });
      made.style.background = colour;
      return made;
    };
    const row = (colour, side) =>
      element(
        "tr", {},
        element("td", {}, dot(colour), side.settings),
        element("td", {}, number(side.samples, 4)), element("td", {}, duration(side.seconds)),
        element("td", {}, side.error === null ? "–" : side.error.toPrecision(3)),
      );
    const heads = ["Settings", "Samples", "Time", "relMSE"];
    const rows = [row(FIRST, first), ...(second ? [row(SECOND, second)] : [])];
    const table = element("table", {}, element("tr", {}, ...heads.map((head) => element("th", { scope: "col" }, head))), ...rows);
    const words = between === null || between === undefined ? [] : [element("p", { class: "hint" }, `relMSE of one picture against the other: ${between.toPrecision(3)}`)];
    $("errors").replaceChildren(table, ...words);
    this.draw();
  }

  // Draws errors against time in seconds, with two logarithmic axes. Without a reference, draws the
  // difference between the renders.
  draw() {
    const canvas = $("error-chart");
    const { points } = this;
    const hasReference = points.some(({ first }) => first.error !== null);
    const curves = hasReference
      ? [[FIRST, points.map(({ first }) => [first.seconds, first.error])], [SECOND, points.filter(({ second }) => second).map(({ second }) => [second.seconds, second.error])]]
      : [[FIRST, points.filter(({ between }) => between).map(({ first, between }) => [first.seconds, between])]];
    const all = curves.flatMap(([, curve]) => curve).filter(([x, y]) => x > 0 && y > 0);
    canvas.hidden = all.length < 2;
    if (canvas.hidden) return;
    const ratio = window.devicePixelRatio || 1;
    const [w, h] = [canvas.clientWidth, 150];
    if (w === 0) return;
    [canvas.width, canvas.height] = [w * ratio, h * ratio];
    canvas.style.height = `${h}px`;
    const context = canvas.getContext("2d");
    context.scale(ratio, ratio);
    const style = getComputedStyle(document.documentElement);
    const soft = style.getPropertyValue("--soft");
    const limits = (axis) => {
      const logs = all.map((point) => Math.log10(point[axis]));
      return [Math.floor(Math.min(...logs) * 2) / 2, Math.ceil(Math.max(...logs) * 2 + 1e-9) / 2];
    };
    const [xs, ys] = [limits(0), limits(1)];
    const [left, bottom] = [46, 18];
    const at = ([x, y]) => [
      left + ((Math.log10(x) - xs[0]) / (xs[1] - xs[0] || 1)) * (w - left - 6),
      h - bottom - ((Math.log10(y) - ys[0]) / (ys[1] - ys[0] || 1)) * (h - bottom - 8),
    ];
    context.font = "11px system-ui, sans-serif";
    context.fillStyle = soft;
    context.strokeStyle = style.getPropertyValue("--line");
    const marks = ([low, high]) => Array.from({ length: Math.floor(high - Math.ceil(low)) + 1 }, (_, i) => Math.ceil(low) + i);
    const ends = (range) => (marks(range).length ? marks(range) : range);
    context.beginPath();
    for (const y of ends(ys)) {
      const [, row] = at([10 ** xs[0], 10 ** y]);
      context.moveTo(left, row);
      context.lineTo(w - 6, row);
      context.fillText(Number((10 ** y).toPrecision(2)).toString(), 2, row + 4);
    }
    for (const x of ends(xs)) {
      const [column] = at([10 ** x, 10 ** ys[0]]);
      context.moveTo(column, 8);
      context.lineTo(column, h - bottom);
      context.fillText(`${Number((10 ** x).toPrecision(2))} s`, Math.min(column + 2, w - 30), h - 5);
    }
    context.stroke();
    context.lineWidth = 1.6;
    for (const [colour, curve] of curves) {
      context.strokeStyle = colour;
      context.beginPath();
      for (const point of curve.filter(([x, y]) => x > 0 && y > 0)) context.lineTo(...at(point));
      context.stroke();
    }
  }
}
