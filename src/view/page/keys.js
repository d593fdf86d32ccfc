// Controls for keys of materials and lights, made from the JSON Schema of scene files.

import { element } from "./controls.js";
import { decimals, nameWithKey, sliderAndNumber } from "./fields.js";
import { nameOf, usualRange } from "./names.js";

const toCode = (x) => Math.round(255 * (x <= 0.0031308 ? 12.92 * x : Math.min(1, 1.055 * x ** (1 / 2.4) - 0.055)));
const toLinear = (code) => {
  const x = code / 255;
  return x <= 0.04045 ? x / 12.92 : ((x + 0.055) / 1.055) ** 2.4;
};
const hex = (colour) => `#${colour.map((x) => toCode(Math.max(0, x)).toString(16).padStart(2, "0")).join("")}`;
// Converts `#rrggbb` to linear red, green and blue.
export const ofHex = (text) => [1, 3, 5].map((i) => Number(toLinear(Number.parseInt(text.slice(i, i + 2), 16)).toPrecision(4)));

// A key is a colour if its schema allows a non-negative number or three non-negative numbers.
// Optical constants have the same schema, but are not colours.
const OPTICAL = ["eta", "k"];
const low = ({ minimum, exclusiveMinimum }) => minimum ?? exclusiveMinimum;
const isColour = (key, { anyOf }) => anyOf?.length >= 2 && low(anyOf[0]) !== undefined && anyOf[1].type === "array" && !OPTICAL.includes(key);
// Schema of a single number, if the key allows it.
const numeric = (holds) => (["number", "integer"].includes(holds.type) ? holds : holds.anyOf?.some(({ type }) => type === "array") ? null : holds.anyOf?.find(({ type }) => type === "number"));
const short = (x) => (typeof x === "number" ? decimals(x) : x);
// A list of numbers, or a single number, as TOML.
const list = (text) => (text.includes(",") ? `[${text}]` : text.trim());

// A colour as text with three digits per channel, or as a single number if it is grey.
const digits = (colour) => [...new Set(colour.map((x) => Number(x.toPrecision(3))))].length === 1 ? String(Number(colour[0].toPrecision(3))) : colour.map((x) => Number(x.toPrecision(3))).join(", ");

// Range of a slider: limits of the schema, or the usual range of the key. null if there is neither.
export function rangeOf(key, holds) {
  const [from, to] = [low(holds), holds.maximum];
  if (from !== undefined && to !== undefined && to <= 1000 && !usualRange(key)) return [from, to];
  return usualRange(key) ?? null;
}

// Limits of the number field, from the schema.
export const endsOf = (holds) =>
  Object.fromEntries([["min", low(holds)], ["max", holds.maximum]].filter(([, end]) => end !== undefined).map(([name, end]) => [name, String(end)]));

// Controls for a key. They call `send` with the new value as TOML. If `value` is undefined, the
// controls are empty.
function inputs({ key, holds }, value, send, attributes) {
  const words = nameOf(key);
  const isSet = value !== undefined;
  const placeholder = "not set";
  if (isColour(key, holds)) {
    const colour = !isSet ? [0, 0, 0] : Array.isArray(value) ? value : [value, value, value];
    // A colour picker has a maximum of 1, so a brighter colour is divided by `strength`.
    const strength = Math.max(1, ...colour);
    const picker = element("input", { type: "color", value: hex(colour.map((x) => x / strength)), ...attributes, "aria-label": `${words}, colour` });
    const text = element("input", { type: "text", value: isSet ? digits(colour) : "", placeholder, "aria-label": `${words}, linear` });
    picker.addEventListener("change", () => send(`[${ofHex(picker.value).map((x) => Number((x * strength).toPrecision(5))).join(", ")}]`));
    text.addEventListener("change", () => text.value.trim() && send(list(text.value)));
    return [element("span", { class: "colour wide" }, picker, text)];
  }
  if (holds.enum) {
    const none = isSet ? [] : [element("option", { value: "" }, placeholder)];
    const choice = element("select", { ...attributes, "aria-label": words }, ...none, ...holds.enum.map((name) => element("option", { value: name }, name)));
    choice.value = isSet ? value : "";
    choice.addEventListener("change", () => choice.value && send(choice.value));
    return [choice];
  }
  if (holds.type === "boolean") {
    const box = element("input", { type: "checkbox", ...attributes, "aria-label": words });
    box.checked = value === true;
    box.addEventListener("change", () => send(String(box.checked)));
    return [box];
  }
  const number = numeric(holds);
  const range = number && rangeOf(key, number);
  if (range) return sliderAndNumber({ key, words, value, range, isInteger: number.type === "integer", ends: endsOf(number), send, attributes }).parts;
  if (number) {
    const text = element("input", { type: "number", step: "any", ...endsOf(number), value: isSet ? String(value) : "", placeholder, ...attributes, "aria-label": words });
    text.addEventListener("change", () => text.value !== "" && send(text.value));
    return [text];
  }
  const text = element("input", { type: "text", value: isSet ? [value].flat().map(short).join(", ") : "", placeholder, ...attributes, "aria-label": words });
  text.addEventListener("change", () => text.value.trim() && send(list(text.value)));
  return [text];
}

function control(entry, value, send, attributes) {
  const { key, holds } = entry;
  const number = numeric(holds);
  const range = number && low(number) !== undefined && number.maximum !== undefined ? ` (${low(number)} to ${number.maximum})` : "";
  const made = inputs(entry, value, (text) => send(key, text), { ...attributes, "data-key": key });
  return element("div", { class: "field", title: `${holds.description}${range}` }, nameWithKey(key), ...made);
}

// Controls for all `keys`. The keys in `values` come first. The other keys are under "More", which
// is open if `isOpen`.
export function keyControls(keys, values, send, attributes, { isOpen = false, onToggle = () => {} } = {}) {
  const of = (entry) => control(entry, values[entry.key], send, attributes);
  const set = keys.filter(({ key }) => key in values).map(of);
  const others = keys.filter(({ key, alone }) => alone && !(key in values)).map(of);
  if (!others.length) return set;
  const more = element("details", {}, element("summary", {}, "More properties"), element("div", {}, ...others));
  more.open = isOpen;
  more.addEventListener("toggle", () => onToggle(more.open));
  return [...set, more];
}
