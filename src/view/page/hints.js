// Mouse and keys, shown over the picture until the first action, once for each browser.

import { $ } from "./controls.js";

const SEEN = "embrasure.hints-seen";

// The browser may keep nothing.
const stored = (key) => {
  try {
    return localStorage.getItem(key);
  } catch {
    return null;
  }
};
export function store(key, value) {
  try {
    localStorage.setItem(key, value);
  } catch {
    // It is asked again then.
  }
}
export { stored };

export class Hints {
  constructor(view) {
    for (const action of ["pointerdown", "wheel", "keydown"]) view.addEventListener(action, () => this.dismiss(), { passive: true });
    $("help").addEventListener("click", () => this.show($("hints").hidden));
  }

  // Shows them if they were not seen before.
  begin() {
    if (stored(SEEN) === null) this.show(true);
  }

  show(isShown) {
    $("hints").hidden = !isShown;
    $("help").setAttribute("aria-pressed", String(isShown));
  }

  dismiss() {
    if ($("hints").hidden) return;
    store(SEEN, "1");
    this.show(false);
  }
}
