// Converts linear light to sRGB display codes, with the tone curves of src/core/color/tone.rs.

// Table of the values of all 16-bit floats.
export const HALVES = (() => {
  const values = new Float32Array(65536);
  for (let bits = 0; bits < 65536; bits += 1) {
    const sign = bits & 0x8000 ? -1 : 1;
    const exponent = (bits >> 10) & 31;
    const mantissa = bits & 1023;
    values[bits] =
      sign *
      (exponent === 0
        ? mantissa * 2 ** -24
        : exponent === 31
          ? mantissa ? NaN : Infinity
          : (1 + mantissa / 1024) * 2 ** (exponent - 15));
  }
  return values;
})();

// Rounds non-negative numbers to the nearest 16-bit floats. Numbers above the maximum, 65504, become the maximum.
export function toHalves(numbers) {
  const bits = new Uint32Array(numbers.buffer, numbers.byteOffset, numbers.length);
  const halves = new Uint16Array(numbers.length);
  for (let i = 0; i < halves.length; i += 1) {
    const x = numbers[i];
    if (x !== x) halves[i] = 0x7e00;
    else if (x >= 65504) halves[i] = 0x7bff;
    // Numbers below the normal range of 16-bit floats, in steps of 2^-24
    else if (x < 2 ** -14) halves[i] = Math.round(Math.max(x, 0) * 2 ** 24);
    else halves[i] = (bits[i] - 0x38000000 + 0xfff + ((bits[i] >> 13) & 1)) >> 13;
  }
  return halves;
}

const encode = (x) => (x <= 0.0031308 ? 12.92 * Math.max(x, 0) : x >= 1 ? 1 : 1.055 * x ** (1 / 2.4) - 0.055);
export const decode = (code) => (code <= 0.04045 ? code / 12.92 : ((code + 0.055) / 1.055) ** 2.4);
const luminance = (r, g, b) => 0.2126 * r + 0.7152 * g + 0.0722 * b;
const narkowicz = (x) => (x * (2.51 * x + 0.03)) / (x * (2.43 * x + 0.59) + 0.14);
const hillFit = (v) => (v * (v + 0.0245786) - 0.000090537) / (v * (0.983729 * v + 0.432951) + 0.238081);

function agxCurve(linear) {
  const pivot = 10 / 16.5;
  const share = Math.min(1, Math.max(0, (Math.log2(linear / 0.18) + 10) / 16.5));
  const [power, length] = share < pivot ? [3, pivot] : [3.25, 1 - pivot];
  const distance = share - pivot;
  const bend = (4 * length) ** power - 1;
  return 0.5 + (2 * distance) / (1 + bend * (Math.abs(distance) / length) ** power) ** (1 / power);
}

// Tone curves that treat each channel separately. They return encoded values.
const SEPARATE = {
  srgb: encode,
  "aces-narkowicz": (x) => encode(narkowicz(x)),
};

// Tone curves that mix channels. They write three encoded values to `out`.
const MIXING = {
  reinhard(r, g, b, out) {
    const scale = 1 / (1 + luminance(r, g, b));
    out[0] = encode(r * scale);
    out[1] = encode(g * scale);
    out[2] = encode(b * scale);
  },
  "aces-hill"(r, g, b, out) {
    const x = hillFit(0.59719 * r + 0.35458 * g + 0.04823 * b);
    const y = hillFit(0.076 * r + 0.90834 * g + 0.01566 * b);
    const z = hillFit(0.0284 * r + 0.13383 * g + 0.83777 * b);
    out[0] = encode(1.60475 * x - 0.53108 * y - 0.07367 * z);
    out[1] = encode(-0.10208 * x + 1.10813 * y - 0.00605 * z);
    out[2] = encode(-0.00327 * x - 0.07276 * y + 1.07602 * z);
  },
  agx(r, g, b, out) {
    const to = 0.21200536 * r + 0.3921825 * g + 0.39581214 * b;
    const x = agxCurve(r + 0.2 * (to - r));
    const y = agxCurve(g + 0.2 * (to - g));
    const z = agxCurve(b + 0.2 * (to - b));
    const from = 0.21200536 * x + 0.3921825 * y + 0.39581214 * z;
    const clamp = (v) => Math.min(1, Math.max(0, v));
    out[0] = clamp((x - 0.2 * from) / 0.8);
    out[1] = clamp((y - 0.2 * from) / 0.8);
    out[2] = clamp((z - 0.2 * from) / 0.8);
  },
};

export const CURVES = ["srgb", "reinhard", "aces-narkowicz", "aces-hill", "agx"];

// False colour of `x` from 0 to 1: blue, green, yellow, red.
function falseColour(x, out) {
  out[0] = Math.min(1, Math.max(0, 4 * x - 2, 0));
  out[1] = Math.min(1, Math.max(0, 2 - Math.abs(4 * x - 2)));
  out[2] = Math.min(1, Math.max(0, 2 - 4 * x));
}

// Id of an object: its low eleven bits are in red, its high bits in green.
export const idOf = ([low, high]) => low + 2048 * high;

// Colours of channels that are not light.
const CHANNELS = {
  // The hues of neighbouring ids differ strongly. The background is black.
  id: (r, g, b, out) => {
    const id = idOf([r, g]);
    const hue = (id * 0.61803398875) % 1;
    const value = id === 0 ? 0 : [1, 0.75, 0.55][id % 3];
    for (let c = 0; c < 3; c += 1) {
      const share = Math.abs(((6 * hue + 2 * (3 - c)) % 6) - 3) - 1;
      out[c] = value * (0.3 + 0.7 * Math.min(1, Math.max(0, share)));
    }
  },
  N: (r, g, b, out) => {
    out[0] = 0.5 + 0.5 * r;
    out[1] = 0.5 + 0.5 * g;
    out[2] = 0.5 + 0.5 * b;
  },
};

// Channels of light. Exposure and tone curve apply only to these.
const LIGHT = ["picture", "denoised", "lights", "compared"];

// Writes the encoded light `rgb` of a pixel over its background to `out`, and returns alpha, like
// `display_bytes` of src/core/io/png.rs. `a` is the coverage per channel. `backing` is
// "transparent", or a linear colour that the tone curve does not change.
function over(backing, rgb, a, shown, out) {
  if (a[0] === 1 && a[1] === 1 && a[2] === 1) {
    shown(...rgb.map((x) => Math.max(x, 0)), out);
    return 1;
  }
  const isColour = backing !== "transparent";
  const mean = (a[0] + a[1] + a[2]) / 3;
  const behind = [0, 1, 2].map((c) => (isColour ? backing[c] * (1 - a[c]) : 0));
  if (mean > 0) {
    shown(...[0, 1, 2].map((c) => Math.max(rgb[c] - behind[c], 0) / mean), out);
    for (let c = 0; c < 3; c += 1) out[c] = encode(behind[c] + mean * decode(out[c]));
  } else for (let c = 0; c < 3; c += 1) out[c] = encode(behind[c]);
  if (isColour) return 1;
  // Browsers blend encoded values. This alpha approximates a blend of linear light, over black and
  // over white.
  const alphas = [0, 1, 2].map((c) => 1 + out[c] - encode(decode(out[c]) + 1 - mean));
  const alpha = (Math.min(1, ...alphas) + Math.max(...alphas)) / 2;
  for (let c = 0; c < 3; c += 1) out[c] = alpha > 0 ? Math.min(1, out[c] / alpha) : 0;
  return alpha;
}

// Converts `frame` to RGBA bytes. A pixel without samples is transparent.
export function shade(frame, { exposure, tone, falseColour: isFalse, channel }) {
  const { halves, backing } = frame;
  const count = frame.width * frame.height;
  const pixels = new Uint8ClampedArray(4 * count);
  const isLight = LIGHT.includes(channel);
  const isPlain = ["Z", "variance", "samples"].includes(channel);
  const gain = 2 ** Math.min(64, Math.max(-64, exposure));
  const light = (bits) => Math.max(HALVES[bits] * gain, 0);
  const curve = MIXING[tone] ?? ((r, g, b, out) => [r, g, b].forEach((x, c) => (out[c] = SEPARATE[tone](x))));
  // Exposure and tone curve of the light, without the background.
  const exposed = (r, g, b, out) => curve(r * gain, g * gain, b * gain, out);
  const isCovered = isLight && !isFalse && backing !== undefined;
  if (isLight && !isFalse && !isCovered && SEPARATE[tone]) {
    // Use a table of all 16-bit floats per channel
    const table = new Uint8ClampedArray(65536);
    for (let bits = 0; bits < 65536; bits += 1) table[bits] = Math.round(255 * (SEPARATE[tone](light(bits)) || 0));
    for (let i = 0, j = 0; i < 3 * count; i += 3, j += 4) {
      pixels[j] = table[halves[i]];
      pixels[j + 1] = table[halves[i + 1]];
      pixels[j + 2] = table[halves[i + 2]];
      pixels[j + 3] = isNaN(HALVES[halves[i]]) ? 0 : 255;
    }
    return pixels;
  }
  const [low, high] = isPlain ? range(halves) : [0, 1];
  const out = [0, 0, 0];
  for (let i = 0, j = 0; i < 3 * count; i += 3, j += 4) {
    const [r, g, b] = [HALVES[halves[i]], HALVES[halves[i + 1]], HALVES[halves[i + 2]]];
    let alpha = 1;
    if (isPlain) {
      const value = channel === "variance" ? Math.sqrt(luminance(r, g, b)) : r;
      const share = value >= 65504 ? 1 : (value - low) / (high - low || 1);
      if (isFalse || channel !== "Z") falseColour(share, out);
      else out.fill(1 - share);
    } else if (CHANNELS[channel]) {
      CHANNELS[channel](r, g, b, out);
    } else if (isFalse) {
      // Show a range of ten stops around mid-grey
      falseColour((Math.log2((luminance(r, g, b) * gain) / 0.18) + 5) / 10 || 0, out);
    } else if (isCovered) {
      const at = 3 * count + i;
      const covered = [0, 1, 2].map((c) => HALVES[halves[at + c]]);
      alpha = over(backing, [r || 0, g || 0, b || 0], covered, exposed, out);
    } else if (isLight) {
      curve(light(halves[i]) || 0, light(halves[i + 1]) || 0, light(halves[i + 2]) || 0, out);
    } else {
      for (let c = 0; c < 3; c += 1) out[c] = encode(light(halves[i + c]) || 0);
    }
    for (let c = 0; c < 3; c += 1) pixels[j + c] = Math.round(255 * out[c]);
    pixels[j + 3] = isNaN(r) ? 0 : Math.round(255 * alpha);
  }
  return pixels;
}

// Minimum and maximum of the finite values.
function range(halves) {
  let [low, high] = [Infinity, -Infinity];
  for (let i = 0; i < halves.length; i += 3) {
    const value = HALVES[halves[i]];
    if (value < 65504) [low, high] = [Math.min(low, value), Math.max(high, value)];
  }
  return low < high ? [low, high] : [0, Math.max(high, 1)];
}
