use super::super::Source;
use super::*;
use crate::color::xyz::{WHITE, xyz_to_linear};
use crate::lint::{direction_at, directional_albedo};
use crate::scene_file::presets::PRESETS;
use crate::scene_file::{SceneFile, inspect_scene};

/// Wavelength in nanometres, n and k.
type Indices = &'static [[f32; 3]];

/// Source: Johnson and Christy 1972.
const GOLD: Indices = &[
    [367.9, 1.48, 1.895],
    [381.5, 1.46, 1.933],
    [397.4, 1.47, 1.952],
    [413.3, 1.46, 1.958],
    [430.5, 1.45, 1.948],
    [450.9, 1.38, 1.914],
    [471.4, 1.31, 1.849],
    [495.9, 1.04, 1.833],
    [520.9, 0.62, 2.081],
    [548.6, 0.43, 2.455],
    [582.1, 0.29, 2.863],
    [616.8, 0.21, 3.272],
    [659.5, 0.14, 3.697],
    [704.5, 0.13, 4.103],
    [756.0, 0.14, 4.542],
    [821.1, 0.16, 5.083],
];

/// Source: Johnson and Christy 1972.
const SILVER: Indices = &[
    [367.9, 0.07, 1.657],
    [381.5, 0.05, 1.864],
    [397.4, 0.05, 2.07],
    [413.3, 0.05, 2.275],
    [430.5, 0.04, 2.462],
    [450.9, 0.04, 2.657],
    [471.4, 0.05, 2.869],
    [495.9, 0.05, 3.093],
    [520.9, 0.05, 3.324],
    [548.6, 0.06, 3.586],
    [582.1, 0.05, 3.858],
    [616.8, 0.06, 4.152],
    [659.5, 0.05, 4.483],
    [704.5, 0.04, 4.838],
    [756.0, 0.03, 5.242],
    [821.1, 0.04, 5.727],
];

/// Source: Johnson and Christy 1972.
const COPPER: Indices = &[
    [367.9, 1.36, 1.975],
    [381.5, 1.33, 2.045],
    [397.4, 1.32, 2.116],
    [413.3, 1.28, 2.207],
    [430.5, 1.25, 2.305],
    [450.9, 1.24, 2.397],
    [471.4, 1.25, 2.483],
    [495.9, 1.22, 2.564],
    [520.9, 1.18, 2.608],
    [548.6, 1.02, 2.577],
    [582.1, 0.7, 2.704],
    [616.8, 0.3, 3.205],
    [659.5, 0.22, 3.747],
    [704.5, 0.21, 4.205],
    [756.0, 0.24, 4.665],
    [821.1, 0.26, 5.18],
];

/// Source: Querry 1985, 70 % copper and 30 % zinc.
const BRASS: Indices = &[
    [380.0, 1.487, 1.818],
    [400.0, 1.445, 1.805],
    [420.0, 1.35, 1.786],
    [440.0, 1.191, 1.797],
    [460.0, 0.994, 1.883],
    [480.0, 0.816, 2.046],
    [500.0, 0.686, 2.25],
    [520.0, 0.602, 2.464],
    [540.0, 0.549, 2.668],
    [560.0, 0.505, 2.86],
    [580.0, 0.468, 3.059],
    [600.0, 0.45, 3.253],
    [620.0, 0.449, 3.434],
    [640.0, 0.444, 3.609],
    [660.0, 0.445, 3.778],
    [680.0, 0.444, 3.943],
    [700.0, 0.446, 4.106],
    [720.0, 0.45, 4.266],
    [740.0, 0.455, 4.424],
    [760.0, 0.458, 4.579],
    [780.0, 0.464, 4.737],
];

/// Source: McPeak et al. 2015, every 20 nm.
const ALUMINIUM: Indices = &[
    [380.0, 0.336, 4.0026],
    [400.0, 0.3752, 4.2264],
    [420.0, 0.4176, 4.4474],
    [440.0, 0.4642, 4.6691],
    [460.0, 0.5148, 4.8879],
    [480.0, 0.568, 5.1059],
    [500.0, 0.6257, 5.3205],
    [520.0, 0.6883, 5.536],
    [540.0, 0.7545, 5.7465],
    [560.0, 0.8292, 5.9582],
    [580.0, 0.9086, 6.1652],
    [600.0, 0.9925, 6.369],
    [620.0, 1.0882, 6.5666],
    [640.0, 1.1903, 6.7594],
    [660.0, 1.3044, 6.9424],
    [680.0, 1.426, 7.1163],
    [700.0, 1.5598, 7.2739],
    [720.0, 1.7068, 7.4143],
    [740.0, 1.8722, 7.5284],
    [760.0, 2.0542, 7.5995],
    [780.0, 2.2315, 7.6039],
];

/// Source: Johnson and Christy 1974.
// The table has the measured value 3.14, which is not π.
#[allow(clippy::approx_constant)]
const CHROME: Indices = &[
    [368.0, 1.87, 2.69],
    [381.0, 1.92, 2.74],
    [397.0, 2.0, 2.83],
    [413.0, 2.08, 2.93],
    [431.0, 2.19, 3.04],
    [451.0, 2.33, 3.14],
    [471.0, 2.51, 3.24],
    [496.0, 2.75, 3.3],
    [521.0, 2.94, 3.33],
    [549.0, 3.18, 3.33],
    [582.0, 3.22, 3.3],
    [617.0, 3.17, 3.3],
    [659.0, 3.09, 3.34],
    [704.0, 3.05, 3.39],
    [756.0, 3.08, 3.42],
    [821.0, 3.2, 3.48],
];

/// Source: Johnson and Christy 1974.
const IRON: Indices = &[
    [368.0, 2.02, 2.43],
    [381.0, 2.12, 2.5],
    [397.0, 2.24, 2.58],
    [413.0, 2.35, 2.65],
    [431.0, 2.48, 2.71],
    [451.0, 2.59, 2.77],
    [471.0, 2.67, 2.82],
    [496.0, 2.74, 2.88],
    [521.0, 2.86, 2.91],
    [549.0, 2.95, 2.93],
    [582.0, 2.94, 2.99],
    [617.0, 2.88, 3.05],
    [659.0, 2.92, 3.1],
    [704.0, 2.86, 3.19],
    [756.0, 2.87, 3.28],
    [821.0, 2.94, 3.39],
];

/// Source: Johnson and Christy 1974.
const TITANIUM: Indices = &[
    [368.0, 1.9, 2.9],
    [381.0, 1.99, 2.93],
    [397.0, 2.08, 2.95],
    [413.0, 2.14, 2.98],
    [431.0, 2.21, 3.01],
    [451.0, 2.27, 3.04],
    [471.0, 2.32, 3.1],
    [496.0, 2.36, 3.19],
    [521.0, 2.44, 3.3],
    [549.0, 2.54, 3.43],
    [582.0, 2.6, 3.58],
    [617.0, 2.67, 3.72],
    [659.0, 2.76, 3.84],
    [704.0, 2.86, 3.96],
    [756.0, 3.0, 4.01],
    [821.0, 3.21, 4.01],
];

/// Source: Karlsson and Ribbing 1982, austenitic steel.
const STAINLESS_STEEL: Indices = &[
    [380.0, 1.4786, 2.6681],
    [400.0, 1.5249, 2.7925],
    [420.0, 1.5762, 2.924],
    [440.0, 1.6386, 3.0555],
    [460.0, 1.7169, 3.1785],
    [480.0, 1.7921, 3.2933],
    [500.0, 1.8636, 3.401],
    [520.0, 1.9349, 3.5072],
    [540.0, 2.0072, 3.6166],
    [560.0, 2.0807, 3.7298],
    [580.0, 2.1557, 3.8451],
    [600.0, 2.2325, 3.9594],
    [620.0, 2.3122, 4.0504],
    [640.0, 2.3962, 4.1378],
    [660.0, 2.4839, 4.2261],
    [680.0, 2.5731, 4.3155],
    [700.0, 2.6617, 4.4066],
    [720.0, 2.7486, 4.5036],
    [740.0, 2.8331, 4.5851],
    [760.0, 2.9143, 4.6435],
    [780.0, 2.9915, 4.7009],
];

/// Relative power of the daylight D65 from 380 to 780 nm, every 10 nm (CIE 15).
const DAYLIGHT: [f32; 41] = [
    49.98, 54.65, 82.75, 91.49, 93.43, 86.68, 104.86, 117.01, 117.81, 114.86, 115.92, 108.81, 109.35, 107.80, 104.79,
    107.69, 104.41, 104.05, 100.00, 96.33, 95.79, 88.69, 90.01, 89.60, 87.70, 83.29, 83.70, 80.03, 80.21, 82.28, 78.28,
    69.72, 71.61, 74.35, 61.60, 69.89, 75.09, 63.59, 46.42, 66.81, 63.38,
];

/// CIE 1931 matching functions by the fit of Wyman, Sloan and Shirley 2013, eq. 4.
fn matching(nanometers: f32) -> [f32; 3] {
    let lobe = |height: f32, middle: f32, widths: [f32; 2]| {
        let width = widths[usize::from(nanometers >= middle)];
        height * (-0.5 * ((nanometers - middle) / width).powi(2)).exp()
    };
    [
        lobe(1.056, 599.8, [37.9, 31.0]) + lobe(0.362, 442.0, [16.0, 26.7]) + lobe(-0.065, 501.1, [20.4, 26.2]),
        lobe(0.821, 568.8, [46.9, 40.5]) + lobe(0.286, 530.9, [16.3, 31.1]),
        lobe(1.217, 437.0, [11.8, 36.0]) + lobe(0.681, 459.0, [26.0, 13.8]),
    ]
}

/// Reflectance of a metal in air along the surface normal, at a wavelength. `indices` are
/// interpolated linearly.
fn reflectance(indices: Indices, nanometers: f32) -> f32 {
    let after = indices
        .partition_point(|row| row[0] < nanometers)
        .clamp(1, indices.len() - 1);
    let [a, b] = [indices[after - 1], indices[after]];
    let t = ((nanometers - a[0]) / (b[0] - a[0])).clamp(0.0, 1.0);
    let [n, k] = [1, 2].map(|i| a[i] + t * (b[i] - a[i]));
    ((n - 1.0).powi(2) + k * k) / ((n + 1.0).powi(2) + k * k)
}

/// Linear Rec.709 colour of the metal in daylight. A surface that reflects all light has the colour
/// (1, 1, 1).
fn color_of(indices: Indices) -> [f32; 3] {
    let (mut seen, mut white) = ([0.0f32; 3], [0.0f32; 3]);
    for (band, power) in DAYLIGHT.into_iter().enumerate() {
        let nanometers = 380.0 + 10.0 * band as f32;
        let reflectance = reflectance(indices, nanometers);
        for (c, matching) in matching(nanometers).into_iter().enumerate() {
            seen[c] += power * matching * reflectance;
            white[c] += power * matching;
        }
    }
    xyz_to_linear([0, 1, 2].map(|c| WHITE[c] * seen[c] / white[c]))
}

/// Material of the preset `name`.
fn material(name: &str) -> Material {
    let section = Preset::of_name(name).unwrap().section();
    section.material(name, &Source::default()).unwrap().material
}

/// Albedo of a material along the normal, and at 60° from the normal.
fn albedos(material: &Material) -> [[f32; 3]; 2] {
    let bsdf = material.bsdf();
    [0.0, 60.0].map(|angle| directional_albedo(&bsdf, direction_at(angle)).to_array())
}

fn close(a: [f32; 3], b: [f32; 3], tolerance: f32) -> bool {
    (0..3).all(|c| (a[c] - b[c]).abs() <= tolerance)
}

#[test]
fn metals_have_their_measured_colors() {
    let metals: [(&str, Indices); 10] = [
        ("gold", GOLD),
        ("silver", SILVER),
        ("copper", COPPER),
        ("brass", BRASS),
        ("aluminium", ALUMINIUM),
        ("chrome", CHROME),
        ("iron", IRON),
        ("titanium", TITANIUM),
        ("stainless-steel", STAINLESS_STEEL),
        ("brushed-steel", STAINLESS_STEEL),
    ];
    for (name, indices) in metals {
        let expected = color_of(indices).map(|c| c.clamp(0.0, 1.0));
        let material = material(name);
        let base = material.diffuse.to_array();
        assert!(close(base, expected, 6e-4), "{name}: {base:?}, measured {expected:?}");
        // The albedo is above the reflectance along the normal, because microfacets are tilted, and
        // metals reflect more at other angles. Multiple scattering makes the colour more saturated.
        let [albedo, _] = albedos(&material);
        assert!(
            close(albedo, expected, 0.04),
            "{name}: {albedo:?}, measured {expected:?}"
        );
    }
    let is_metal = |preset: &&Preset| preset.keys.contains("metallic = 1\n");
    assert_eq!(
        PRESETS.iter().filter(is_metal).count(),
        metals.len(),
        "a metal is not tested"
    );
}

#[test]
fn pigments_have_their_measured_colors() {
    // Colours of A. Palmqvist's database "Physically Based", measured with a Nix Spectro 2 under
    // D65 or D50, without the specular reflection. The colour of foliage is sRGB 87 108 67.
    let foliage = Spectrum::of_text("#576c43").unwrap().to_array();
    for (name, measured) in [
        ("rubber", [0.023, 0.023, 0.023]),
        ("ceramic", [0.745, 0.745, 0.723]),
        ("terracotta", [0.555, 0.212, 0.110]),
        ("paper", [0.794, 0.834, 0.884]),
        ("cardboard", [0.351, 0.208, 0.110]),
        ("leaf", foliage),
    ] {
        let material = material(name);
        let base = material.diffuse.to_array();
        assert!(close(base, measured, 1e-6), "{name}: {base:?}");
        let [albedo, _] = albedos(&material);
        match material.gloss {
            // A coat reflects R = ((n − 1) / (n + 1))² along the normal. On the way to the base,
            // and on the way back, the coat reduces the light by the factor 1 − R. Interreflection
            // below the coat returns a part of the lost light.
            Gloss::Metallic(_) => {
                let coat = ((material.ior - 1.0) / (material.ior + 1.0)).powi(2);
                let bounds = [0.9, 1.0].map(|kept| measured.map(|c| coat + kept * (1.0 - coat) * c));
                let is_between = (0..3).all(|c| (bounds[0][c] - 0.01..=bounds[1][c] + 0.02).contains(&albedo[c]));
                assert!(is_between, "{name}: {albedo:?}, between {bounds:?}");
            }
            _ => assert!(close(albedo, measured, 1e-3), "{name}: {albedo:?}"),
        }
    }
}

#[test]
fn transparent_presets_have_their_indices() {
    for (name, index) in [
        ("glass", 1.5168),
        ("frosted-glass", 1.5168),
        ("water", 1.333),
        ("plastic", 1.4906),
    ] {
        assert_eq!(material(name).ior, index, "{name}");
    }
    // Glass and water absorb no light: reflection and transmission sum to 1.
    for name in ["glass", "frosted-glass", "water"] {
        for albedo in albedos(&material(name)) {
            assert!(close(albedo, [1.0; 3], 0.01), "{name}: {albedo:?}");
        }
    }
}

/// Every preset is valid and conserves energy.
#[test]
fn presets_are_materials() {
    for preset in PRESETS {
        let section: Result<MaterialSection, _> = toml::from_str(preset.keys);
        let section = section.unwrap_or_else(|error| panic!("{}: {error}", preset.name));
        assert!(
            section.material(preset.name, &Source::default()).is_ok(),
            "{}",
            preset.name
        );
        let material = material(preset.name);
        assert!(material.scattered() <= 1.0, "{}", preset.name);
        for albedo in albedos(&material) {
            assert!(
                albedo.iter().all(|&a| a > 0.0 && a <= 1.004),
                "{}: {albedo:?}",
                preset.name
            );
        }
        assert!(!preset.about.is_empty() && !preset.source.is_empty());
    }
    let mut names: Vec<&str> = PRESETS.iter().map(|preset| preset.name).collect();
    names.sort_unstable();
    names.dedup();
    assert_eq!(names.len(), PRESETS.len());
    assert!(names.len() >= 20);
}

/// Material of a section `[material.x]` with the keys `keys`.
fn of_keys(keys: &str) -> Result<Material, String> {
    let section: MaterialSection = toml::from_str(keys).unwrap();
    let found = section.material("x", &Source::default());
    found.map(|found| found.material).map_err(|error| error.to_string())
}

#[test]
fn keys_beside_a_preset_win() {
    let gold = of_keys("preset = 'gold'").unwrap();
    assert_eq!((gold.name.as_str(), gold.diffuse), ("x", material("gold").diffuse));
    // The order of the keys does not matter
    for keys in ["preset = 'gold'\nroughness = 0.6", "roughness = 0.6\npreset = 'gold'"] {
        let rough = of_keys(keys).unwrap();
        assert_eq!(
            (rough.roughness, rough.diffuse, rough.gloss),
            (0.6, gold.diffuse, Gloss::Metallic(1.0))
        );
    }
    let red = of_keys("preset = 'car-paint'\ndiffuse = '#00ff00'").unwrap();
    assert_eq!((red.diffuse.to_array(), red.clearcoat), ([0.0, 1.0, 0.0], 1.0));
    let error = of_keys("preset = 'steel'").unwrap_err();
    assert!(error.contains("there is no preset `steel`"), "{error}");
}

/// A preset of a flag keeps the opacity of the old material, but not its lobes. It keeps the
/// diffuse texture if the preset has a diffuse reflection.
#[test]
fn preset_replaces_lobes_and_keeps_opacity() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    std::fs::write(
        at("a.mtl"),
        "newmtl ring.001\nKd 0.2 0.4 0.6\nKs 0.3 0.3 0.3\nKe 1 1 1\nd 0.5\nmap_Kd a.png\n",
    )
    .unwrap();
    std::fs::write(
        at("a.obj"),
        "mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nusemtl ring.001\nf 1/1 2/1 3/1\n",
    )
    .unwrap();
    let found = |patches: &[&str]| {
        let mut file = SceneFile::of_obj(at("a.obj"));
        let patches: Vec<String> = patches.iter().map(ToString::to_string).collect();
        file.patch_materials(&patches).unwrap();
        let inspection = inspect_scene(&file, crate::scene::SceneBuilder::new());
        let error = inspection
            .findings
            .first_error()
            .map(|error| format!("{error} {}", error.help.clone().unwrap_or_default()));
        let mut materials = inspection.materials;
        error.map_or_else(|| Ok(materials.remove(0).found), Err)
    };
    for patch in ["ring.001=gold", "ring*=gold", "'ring.001'=gold", "ring.001.preset=gold"] {
        let gold = found(&[patch]).unwrap();
        assert_eq!(gold.material.diffuse, material("gold").diffuse, "{patch}");
        assert_eq!((gold.material.opacity, gold.maps.len()), (0.5, 0), "{patch}");
        assert!(gold.material.emission.is_black());
    }
    let paper = found(&["ring*=paper"]).unwrap();
    assert_eq!(
        (paper.material.diffuse.to_array(), paper.maps.len()),
        ([0.2, 0.4, 0.6], 1)
    );
    assert!(paper.material.specular.is_black());
    let rough = found(&["ring*.roughness=0.7", "ring*=gold"]).unwrap();
    assert_eq!(
        (rough.material.roughness, rough.material.diffuse),
        (0.7, material("gold").diffuse)
    );
    let error = found(&["ring*=golf"]).unwrap_err();
    assert!(
        error.contains("did you mean gold?") && error.contains("frosted-glass"),
        "{error}"
    );
}
