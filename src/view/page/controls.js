// The controls beside the picture: tabs, and a control for each parameter that the render knows.

export const $ = (id) => document.getElementById(id);

export function element(name, attributes = {}, ...children) {
  const made = document.createElement(name);
  for (const [key, value] of Object.entries(attributes)) {
    if (key in made && typeof value !== "string") made[key] = value;
    else made.setAttribute(key, value);
  }
  made.append(...children);
  return made;
}

export function tabs() {
  const buttons = [...document.querySelectorAll('[role="tab"]')];
  const choose = (chosen) => {
    for (const button of buttons) {
      const isChosen = button === chosen;
      button.setAttribute("aria-selected", String(isChosen));
      button.tabIndex = isChosen ? 0 : -1;
      const panel = $(`tab-${button.dataset.tab}`);
      button.setAttribute("aria-controls", panel.id);
      panel.hidden = !isChosen;
    }
    // Canvases of panels are drawn when they are seen.
    window.dispatchEvent(new Event("resize"));
  };
  for (const [i, button] of buttons.entries()) {
    button.addEventListener("click", () => choose(button));
    button.addEventListener("keydown", ({ key }) => {
      const by = { ArrowRight: 1, ArrowLeft: -1 }[key];
      if (!by) return;
      const next = buttons[(i + by + buttons.length) % buttons.length];
      choose(next);
      next.focus();
    });
  }
  choose(buttons[0]);
  return (name) => choose(buttons.find((button) => button.dataset.tab === name));
}

// Numbers as people write them.
export function number(x, digits = 3) {
  if (x === null || x === undefined) return "–";
  if (Math.abs(x) >= 1e6) return `${(x / 1e6).toPrecision(digits)} million`;
  if (Math.abs(x) >= 1e4) return `${Math.round(x / 1000)} k`;
  return String(Number(x.toPrecision(digits)));
}

export function duration(seconds) {
  if (seconds < 60) return `${seconds.toFixed(1)} s`;
  const minutes = Math.floor(seconds / 60);
  return minutes < 60 ? `${minutes} min ${Math.round(seconds % 60)} s` : `${Math.floor(minutes / 60)} h ${minutes % 60} min`;
}

// Copies text, also where the page may not use the clipboard: it is selected then.
export async function copy(area, text) {
  area.value = text;
  area.select();
  try {
    await navigator.clipboard.writeText(text);
  } catch {
    document.execCommand("copy");
  }
}

// Makes the controls of all parameters; the render defines them.
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
      for (const parameter of parameters) inside.append(this.control(parameter));
      const details = element("details", { "data-title": title }, element("summary", {}, title), inside);
      details.open = open.size ? open.has(title) : i < 2;
      return details;
    });
    this.place.replaceChildren(...groups);
  }

  control(parameter) {
    const { key, help, names, default: usual, range, schema } = parameter;
    let input;
    if (key === "integrator" || names.length > 0) {
      const named = key === "integrator" ? this.tables.integrators.map(({ name }) => name) : names;
      input = element("select", {}, ...named.map((name) => element("option", { value: name }, name)));
      if (schema.anyOf) {
        // Numbers are as good as names: it is a text with proposals.
        const list = element("datalist", { id: `names-${key}` }, ...named.map((name) => element("option", { value: name })));
        input = element("input", { type: "text", list: list.id });
        this.place.parentElement.append(list);
      }
    } else {
      input = element("input", { type: "text", inputmode: "decimal", placeholder: usual });
    }
    input.id = `parameter-${key}`;
    input.addEventListener("change", () => this.link.set(key, input.value.trim() === "" ? null : input.value.trim()));
    const title = `${help}${range ? `, ${range}` : ""} [default: ${usual}]`;
    const label = element("label", { title, for: input.id }, key.replaceAll("_", " "), input);
    this.controls.set(key, { input, label });
    return label;
  }

  // Shows values, and the parameters that the integrator reads.
  update(values) {
    const integrator = this.tables?.integrators.find(({ name }) => name === values.integrator);
    const ofMethods = new Set(this.tables.integrators.flatMap(({ reads }) => reads));
    for (const [key, { input, label }] of this.controls) {
      if (document.activeElement !== input || input.tagName === "SELECT") input.value = values[key] ?? "";
      label.hidden = ofMethods.has(key) && key !== "integrator" && !integrator?.reads.includes(key);
    }
    const kind = this.controls.get("integrator");
    if (kind && integrator) kind.label.title = integrator.help;
  }
}
