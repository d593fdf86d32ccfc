// Lights of the scene file as controls.

import { $, copy, element } from "./controls.js";
import { keyControls } from "./keys.js";

export class Lights {
  // Lights with visible controls, and lights with all keys.
  #shown = null;
  #open = new Set();

  constructor(link) {
    this.link = link;
    for (const [button, area] of [["copy-lights", "light-edits"], ["copy-light-sections", "light-sections"]]) {
      $(button).addEventListener("click", () => copy($(area), $(area).value));
    }
  }

  // Makes controls for the lights of the scene file. `keys` are the valid keys of each type.
  build(lights, keys) {
    this.#shown ??= new Set(lights.length < 4 ? lights.map(({ index }) => index) : []);
    const made = lights.map(({ index, keys: values }) => {
      const send = (key, value) => this.link.send({ do: "light", index, key, value });
      const more = { isOpen: this.#open.has(index), onToggle: (isOpen) => (isOpen ? this.#open.add(index) : this.#open.delete(index)) };
      const controls = keyControls(keys[values.type] ?? [], values, send, { "data-light": String(index) }, more);
      const title = `${index + 1}: ${values.type}${values.image ? ` ${values.image}` : ""}${values.group ? ` (${values.group})` : ""}`;
      const details = element("details", { "data-title": title }, element("summary", {}, title), element("div", {}, ...controls));
      details.open = this.#shown.has(index);
      details.addEventListener("toggle", () => (details.open ? this.#shown.add(index) : this.#shown.delete(index)));
      return details;
    });
    const none = element("p", { class: "hint" }, "The scene file has none. Materials that emit have their emission among the materials.");
    $("scene-lights").replaceChildren(...(made.length ? made : [none]));
  }

  // Shows changes as flags and as sections of a scene file.
  showEdits(edits, sections) {
    $("light-edits").value = edits.map((edit) => `--set '${edit}'`).join(" \\\n");
    $("light-sections").value = sections;
  }
}
