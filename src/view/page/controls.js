// Controls beside the picture: tabs and helper functions for controls.

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

export function tabs(onChoose = () => {}) {
  const buttons = [...document.querySelectorAll('[role="tab"]')];
  let now = null;
  const choose = (chosen) => {
    if (chosen === now) return;
    now = chosen;
    for (const button of buttons) {
      const isChosen = button === chosen;
      button.setAttribute("aria-selected", String(isChosen));
      button.tabIndex = isChosen ? 0 : -1;
      const panel = $(`tab-${button.dataset.tab}`);
      button.setAttribute("aria-controls", panel.id);
      panel.hidden = !isChosen;
    }
    // Draw the canvases of the panel, which has become visible.
    window.dispatchEvent(new Event("resize"));
    onChoose(chosen.dataset.tab);
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

// `x` in short form for users, with `digits` significant digits.
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

// Copies `text`. If the clipboard is unavailable, the text in `area` is selected, so that the user
// can copy it.
export async function copy(area, text) {
  area.value = text;
  area.select();
  try {
    await navigator.clipboard.writeText(text);
  } catch {
    document.execCommand("copy");
  }
}

