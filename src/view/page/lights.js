// Controls for the lights of the scene file.

import { $, copy, element } from "./controls.js";
import { keyControls } from "./keys.js";

export class Lights {
  // Lights whose controls are visible. The second set has the lights that show all keys.
  #shown = null;
  #open = new Set();

  constructor(link) {
    this.link = link;
    for (const [button, area] of [["copy-lights", "light-edits"], ["copy-light-sections", "light-sections"]]) {
      $(button).addEventListener("click", () => copy($(area), $(area).value));
    }
  }

  // Makes controls for `lights` of the scene file. `keys` has the valid keys for each type of
  // light.
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
    const none = element("p", { class: "hint" }, "The scene file has no lights. To change a material that emits light, open Materials.");
    $("scene-lights").replaceChildren(...(made.length ? made : [none]));
  }

  // Shows the changes as flags of the command line and as sections of a scene file.
  showEdits(edits, sections) {
    $("light-edits").value = edits.map((edit) => `--set '${edit}'`).join(" \\\n");
    $("light-sections").value = sections;
  }
}
