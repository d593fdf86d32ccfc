//! Presets: materials that users select by name, with `preset` in a scene file or `--material
//! NAME=PRESET`.
//!
//! Colours of metals are reflectances along the normal in daylight (D65), computed from measured n
//! and k, and clipped to Rec.709. `docs/guide/reference/materials.md` lists all presets. The tests
//! compute each colour from the measured values of its source.

/// A material that users select by name.
pub struct Preset {
    /// Name of the preset in scene files and flags.
    pub name: &'static str,
    /// Short description of the material.
    pub about: &'static str,
    /// Source of the preset's values.
    pub source: &'static str,
    /// Keys of `[material.NAME]`, as TOML.
    pub keys: &'static str,
}

const NOBLE: &str = "n, k: Johnson and Christy 1972";
const TRANSITION: &str = "n, k: Johnson and Christy 1974";
const STAINLESS: &str = "n, k of austenitic steel: Karlsson and Ribbing 1982";
const MEASURED: &str = "colour: Palmqvist, Physically Based database, spectrophotometer";
const CHOSEN: &str = "colour chosen";

/// A preset with these fields.
const fn preset(name: &'static str, about: &'static str, source: &'static str, keys: &'static str) -> Preset {
    Preset {
        name,
        about,
        source,
        keys,
    }
}

/// All presets, metals first.
pub const PRESETS: &[Preset] = &[
    preset(
        "gold",
        "polished gold",
        NOBLE,
        "metallic = 1\ndiffuse = [1.0, 0.730, 0.364]\nroughness = 0.1",
    ),
    preset(
        "silver",
        "polished silver",
        NOBLE,
        "metallic = 1\ndiffuse = [0.989, 0.984, 0.978]\nroughness = 0.1",
    ),
    preset(
        "copper",
        "polished copper",
        NOBLE,
        "metallic = 1\ndiffuse = [0.929, 0.624, 0.522]\nroughness = 0.15",
    ),
    preset(
        "brass",
        "polished brass of 70 % copper",
        "n, k: Querry 1985",
        "metallic = 1\ndiffuse = [0.908, 0.779, 0.424]\nroughness = 0.15",
    ),
    preset(
        "aluminium",
        "satin aluminium",
        "n, k: McPeak et al. 2015",
        "metallic = 1\ndiffuse = [0.906, 0.916, 0.923]\nroughness = 0.35",
    ),
    preset(
        "chrome",
        "a mirror of chromium",
        TRANSITION,
        "metallic = 1\ndiffuse = [0.550, 0.556, 0.554]\nroughness = 0.0",
    ),
    preset(
        "iron",
        "cast iron",
        TRANSITION,
        "metallic = 1\ndiffuse = [0.529, 0.513, 0.494]\nroughness = 0.5",
    ),
    preset(
        "titanium",
        "satin titanium",
        TRANSITION,
        "metallic = 1\ndiffuse = [0.618, 0.580, 0.542]\nroughness = 0.4",
    ),
    preset(
        "stainless-steel",
        "polished stainless steel",
        STAINLESS,
        "metallic = 1\ndiffuse = [0.669, 0.639, 0.598]\nroughness = 0.2",
    ),
    preset(
        "brushed-steel",
        "brushed stainless steel; the brush lines run along u, so highlights are stretched at right angles to u",
        STAINLESS,
        "metallic = 1\ndiffuse = [0.669, 0.639, 0.598]\nroughness = 0.4\nanisotropy = 0.8\nanisotropy_rotation = 90",
    ),
    preset(
        "glass",
        "clear glass, a closed body",
        "index: Schott N-BK7, 1.5168 at 587.6 nm",
        "transmission = 1\nior = 1.5168",
    ),
    preset(
        "frosted-glass",
        "rough glass, a closed body",
        "index: Schott N-BK7, 1.5168 at 587.6 nm",
        "transmission = 1\nior = 1.5168\nroughness = 0.5",
    ),
    preset(
        "water",
        "clear water",
        "index: Hale and Querry 1973, 1.333 at 575 nm",
        "transmission = 1\nior = 1.333",
    ),
    preset(
        "plastic",
        "glossy blue plastic",
        "index: acrylic, Sultanova et al. 2009, 1.4906 at 587.6 nm; colour chosen",
        "diffuse = '#2f6fb4'\nmetallic = 0\nior = 1.4906\nroughness = 0.3",
    ),
    preset(
        "rubber",
        "black rubber of a tyre",
        MEASURED,
        "diffuse = 0.023\nmetallic = 0\nior = 1.52\nroughness = 0.7",
    ),
    preset(
        "ceramic",
        "glazed white porcelain",
        MEASURED,
        "diffuse = [0.745, 0.745, 0.723]\nmetallic = 0\nior = 1.5\nroughness = 0.0",
    ),
    preset(
        "terracotta",
        "unglazed clay",
        MEASURED,
        "diffuse = [0.555, 0.212, 0.110]",
    ),
    preset(
        "varnished-wood",
        "brown wood below clear varnish; a diffuse texture gives the grain",
        CHOSEN,
        "diffuse = '#8a5a32'\nclearcoat = 1\nclearcoat_roughness = 0.1",
    ),
    preset(
        "car-paint",
        "red paint with flakes of metal below clear varnish",
        CHOSEN,
        "diffuse = '#b01217'\nmetallic = 0.5\nroughness = 0.5\nclearcoat = 1",
    ),
    preset(
        "velvet",
        "dark red velvet: fibres over a matte ground",
        CHOSEN,
        "diffuse = '#4a0c18'\nsheen = [0.6, 0.3, 0.35]",
    ),
    preset(
        "paper",
        "white office paper, opaque",
        MEASURED,
        "diffuse = [0.794, 0.834, 0.884]",
    ),
    preset(
        "cardboard",
        "brown cardboard",
        MEASURED,
        "diffuse = [0.351, 0.208, 0.110]",
    ),
    preset(
        "leaf",
        "green leaf, opaque: no light passes it",
        "colour: foliage patch of the ColorChecker, McCamy et al. 1976",
        "diffuse = '#576c43'\nmetallic = 0\nior = 1.4\nroughness = 0.6",
    ),
];

impl Preset {
    /// The preset called `name`.
    pub fn of_name(name: &str) -> Option<&'static Self> {
        PRESETS.iter().find(|preset| preset.name == name)
    }
}
