// Fields of panels: names with keys, sliders with number fields, and buttons that explain why they
// are disabled.

import { $, element } from "./controls.js";
import { nameOf, unitOf } from "./names.js";

// Name of a field, with its key in small type.
export function nameWithKey(key, name = nameOf(key)) {
  return element("span", { class: "name" }, name, element("code", {}, key));
}

// Colours the track of a slider up to its value.
export function fill(slider) {
  const [min, max, value] = [slider.min, slider.max, slider.value].map(Number);
  slider.style.setProperty("--share", `${max > min ? (100 * (value - min)) / (max - min) : 0}%`);
}

// Update the coloured track while a user drags a slider.
document.addEventListener("input", ({ target }) => target.type === "range" && fill(target));

// Sets the value of a slider.
export function setSlider(slider, value) {
  slider.value = value;
  fill(slider);
}

// Rounds `x` to the five digits that a field can show.
export const decimals = (x) => Number(x.toPrecision(5));

// A slider and a number field for one value. The slider goes from `min` to `max`, in equal factors
// if `isLogarithmic`. The number field allows values outside `range`, up to the limits `ends`. With
// `isText` the number field also allows names. `send` is called at the end of a drag.
export function sliderAndNumber({ key, words, value, range: [min, max, isLogarithmic], isInteger = false, isText = false, ends = {}, send, attributes = {} }) {
  const isSet = value !== undefined && value !== "" && Number.isFinite(Number(value));
  const start = isLogarithmic ? Math.max(min, 1e-6) : min;
  // A logarithmic slider moves by equal factors.
  const toPlace = (x) => (isLogarithmic ? Math.log(Math.max(x, start) / start) / Math.log(max / start) : (x - min) / (max - min));
  const toValue = (place) => {
    const x = isLogarithmic ? start * (max / start) ** place : min + place * (max - min);
    return isInteger ? Math.round(x) : decimals(x);
  };
  const slider = element("input", { type: "range", min: "0", max: "1", step: "0.002", "aria-label": `${words}, slider` });
  const number = element("input", { ...(isText ? { type: "text" } : { type: "number", step: "any", ...ends }), placeholder: "–", value: isSet ? String(decimals(Number(value))) : "", ...attributes, "aria-label": words });
  const show = (x) => {
    const isThere = x !== "" && Number.isFinite(Number(x));
    slider.classList.toggle("unset", !isThere);
    setSlider(slider, isThere ? Math.min(1, Math.max(0, toPlace(Number(x)))) : 0);
  };
  show(isSet ? value : "");
  slider.addEventListener("input", () => {
    slider.classList.remove("unset");
    number.value = toValue(Number(slider.value));
  });
  slider.addEventListener("change", () => send(String(toValue(Number(slider.value)))));
  number.addEventListener("input", () => show(number.value));
  number.addEventListener("change", () => number.value !== "" && send(number.value));
  const unit = unitOf(key);
  const box = unit ? element("span", { class: "unit" }, number, unit) : number;
  return { parts: [slider, box], number, show };
}

// Enables the button `id` if `reason` is empty, else disables it and shows the reason.
export function allow(id, reason) {
  const button = $(id);
  button.dataset.title ??= button.title;
  button.disabled = Boolean(reason);
  button.title = reason ? `${button.dataset.title}: ${reason}` : button.dataset.title;
  const why = button.querySelector(".why");
  if (!reason) why?.remove();
  else if (why) why.textContent = reason;
  else button.append(element("span", { class: "why" }, reason));
}
