// A control for each parameter of the render.

import { element } from "./controls.js";
import { nameWithKey, sliderAndNumber } from "./fields.js";
import { endsOf, rangeOf } from "./keys.js";
import { nameOf } from "./names.js";

// Parameters whose control is elsewhere on the page.
const ELSEWHERE = ["denoise"];

// Makes the controls of all parameters that the render lists.
export class Parameters {
  controls = new Map();

  constructor(place, link) {
    Object.assign(this, { place, link });
  }

  build(tables) {
    this.tables = tables;
    this.controls.clear();
    const open = new Set([...this.place.querySelectorAll("details[open]")].map((d) => d.dataset.title));
    const groups = tables.groups.map(({ title, parameters }, i) => {
      const inside = element("div");
      for (const parameter of parameters) if (!ELSEWHERE.includes(parameter.key)) inside.append(this.control(parameter));
      const details = element("details", { "data-title": title }, element("summary", {}, title), inside);
      details.open = open.size ? open.has(title) : i < 2;
      return details;
    });
    this.place.replaceChildren(...groups);
  }

  control(parameter) {
    const { key, help, names, default: usual, range, schema } = parameter;
    const send = (text) => this.link.set(key, text.trim() === "" ? null : text.trim());
    const id = `parameter-${key}`;
    const holds = [schema, ...(schema.anyOf ?? [])].find(({ type }) => ["number", "integer"].includes(type));
    const ofSlider = holds && rangeOf(key, holds);
    let input;
    let parts;
    let show = (value) => (input.value = value);
    if (ofSlider) {
      const made = sliderAndNumber({ key, words: nameOf(key), range: ofSlider, isInteger: holds.type === "integer", isText: Boolean(schema.anyOf), ends: endsOf(holds), send, attributes: { id } });
      [input, parts] = [made.number, made.parts];
      // Reset the parameter to its default if the field is emptied.
      input.addEventListener("change", () => input.value === "" && send(""));
      show = (value) => {
        input.value = value;
        made.show(value);
      };
    } else if (key === "integrator" || (names.length > 0 && !schema.anyOf)) {
      const named = key === "integrator" ? this.tables.integrators.map(({ name }) => name) : names;
      input = element("select", { id }, ...named.map((name) => element("option", { value: name }, name)));
    } else {
      input = element("input", { id, type: "text", placeholder: usual });
      if (names.length > 0) {
        // Use a text field with suggestions, because numbers and names are both valid.
        const list = element("datalist", { id: `names-${key}` }, ...names.map((name) => element("option", { value: name })));
        input.setAttribute("list", list.id);
        document.getElementById(list.id)?.remove();
        this.place.parentElement.append(list);
      } else input.inputMode = "decimal";
    }
    if (!ofSlider) {
      parts = [input];
      input.addEventListener("change", () => send(input.value));
    }
    input.setAttribute("aria-label", nameOf(key));
    const title = `${help}${range ? `, ${range}` : ""} [default: ${usual}]`;
    const label = element("div", { class: "field", title }, nameWithKey(key), ...parts);
    this.controls.set(key, { input, label, show });
    return label;
  }

  // Shows `values` in the controls, and hides parameters that the integrator does not use.
  update(values) {
    const integrator = this.tables?.integrators.find(({ name }) => name === values.integrator);
    const ofMethods = new Set(this.tables.integrators.flatMap(({ reads }) => reads));
    for (const [key, { input, label, show }] of this.controls) {
      if (document.activeElement !== input || input.tagName === "SELECT") show(values[key] ?? "");
      label.hidden = ofMethods.has(key) && key !== "integrator" && !integrator?.reads.includes(key);
    }
    const kind = this.controls.get("integrator");
    if (kind && integrator) kind.label.title = integrator.help;
  }
}
