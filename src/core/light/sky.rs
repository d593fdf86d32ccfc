//! A clear daylight sky: the analytic model of Preetham, Shirley and Smits 1999, "A Practical
//! Analytic Model for Daylight", without the sun's disc.
//!
//! The paper gives the luminance in kcd/m² and the CIE chromaticity of each direction. Both depend
//! on the sun's elevation and on the turbidity, a measure of haze. Luminance is divided by
//! [`KCD_PER_UNIT`], and colours are converted to linear Rec.709. A sky of turbidity 3 then lights
//! a horizontal surface with an irradiance of about 1 to 2, so images need no exposure setting. The
//! paper's simulations have turbidities from 2 to 6 and a sun above the horizon. Turbidities from 6
//! to 10 use the same formulas, which extrapolate.
//!
//! If the sun is below the horizon, which the paper does not treat, the sky keeps the colours of
//! sunset and darkens by a factor of ten every 2.9°. This is the mean rate of civil twilight, in
//! which the illuminance falls from about 400 lx to 3.4 lx within 6°. Night begins when the sun is
//! 18° below the horizon. Directions below the horizon show a grey ground of albedo
//! [`GROUND_ALBEDO`] under this sky and a sun of [`SUN_IRRADIANCE`].

use super::LatLongImage;
use crate::color::Spectrum;
use crate::math::Vec3;
use std::f64::consts::{FRAC_PI_2, PI, TAU};

/// Luminance in kcd/m² that becomes radiance 1.
pub const KCD_PER_UNIT: f64 = 20.0;
/// Irradiance by this sky's sun on a surface that faces the sun, W·m⁻². It is two thirds of the
/// value on a clear day at a turbidity of 3.
pub const SUN_IRRADIANCE: f32 = 3.0;
/// Reflectance of the ground below the horizon.
pub const GROUND_ALBEDO: f64 = 0.2;
/// Range of turbidities.
pub const TURBIDITIES: [f32; 2] = [2.0, 10.0];
/// Default turbidity: a clear sky.
pub const DEFAULT_TURBIDITY: f32 = 3.0;
/// Columns and rows of the sky image.
pub const SKY_SIZE: [usize; 2] = [512, 256];

/// Elevation of the sun at which twilight ends, in degrees.
const NIGHT: f64 = -18.0;
/// Darkening of the sky in twilight, in powers of ten per degree of the sun below the horizon.
const TWILIGHT: f64 = 0.345;

/// The sky for an elevation of the sun and a turbidity.
#[derive(Clone, Copy, Debug)]
pub struct Sky {
    /// Unit vector to the sun in the frame of the image. The sun is above the image's middle, which
    /// is −z.
    sun: [f64; 3],
    /// Relative distributions over the sky of the luminance Y and the chromaticities x and y.
    /// `zenith` has Y, x and y at the zenith, each divided by the value of its distribution there.
    perez: [Perez; 3],
    zenith: [f64; 3],
    /// Irradiance of the ground by the sun.
    sunlight: [f64; 3],
    /// Factor of all light, below 1 in twilight.
    twilight: f64,
}

/// Coefficients A to E of the distribution of Perez et al. (Preetham et al., eq. 3).
#[derive(Clone, Copy, Debug)]
struct Perez([f64; 5]);

impl Perez {
    /// `F(θ, γ)`, with the angle θ from the zenith given as its cosine, and the angle γ to the sun
    /// in radians.
    fn at(&self, cos_theta: f64, gamma: f64) -> f64 {
        let Self([a, b, c, d, e]) = self;
        (1.0 + a * (b / cos_theta).exp()) * (1.0 + c * (d * gamma).exp() + e * gamma.cos().powi(2))
    }
}

impl Sky {
    /// The sky with the sun at `elevation`, degrees above the horizon, and a `turbidity` in
    /// [`TURBIDITIES`].
    pub fn new(elevation: f32, turbidity: f32) -> Self {
        let (elevation, t) = (f64::from(elevation), f64::from(turbidity));
        let theta_sun = (FRAC_PI_2 - elevation.to_radians()).clamp(0.0, FRAC_PI_2);
        let perez = distributions(t);
        let mut zenith = zenith(theta_sun, t);
        for (value, perez) in zenith.iter_mut().zip(&perez) {
            *value /= perez.at(1.0, theta_sun);
        }
        Self {
            sun: [0.0, theta_sun.cos(), -theta_sun.sin()],
            perez,
            zenith,
            sunlight: sun_color(elevation as f32, turbidity)
                .to_array()
                .map(|c| f64::from(SUN_IRRADIANCE * c) * elevation.to_radians().sin().max(0.0)),
            twilight: 10f64.powf(TWILIGHT * elevation.clamp(NIGHT, 0.0)),
        }
    }

    /// Luminance in kcd/m² and chromaticity x, y, from the unit direction `w` above the horizon. In
    /// the frame of `w`, +y is up and the sun is above −z.
    fn luminance(&self, w: [f64; 3]) -> [f64; 3] {
        let cos_gamma: f64 = w.iter().zip(self.sun).map(|(a, b)| a * b).sum();
        let gamma = cos_gamma.clamp(-1.0, 1.0).acos();
        let mut values = [0.0; 3];
        for (value, (perez, zenith)) in values.iter_mut().zip(self.perez.iter().zip(self.zenith)) {
            *value = zenith * perez.at(w[1].max(0.0), gamma);
        }
        values[0] *= self.twilight;
        values
    }

    /// Radiance from the unit direction `w`, in a frame with +y up and the sun above −z; `None`
    /// below the horizon.
    pub fn radiance(&self, w: Vec3) -> Option<Spectrum> {
        let w = w.to_array().map(f64::from);
        (w[1] >= 0.0).then(|| Spectrum::from(self.rgb(w).map(|v| v as f32)))
    }

    fn rgb(&self, w: [f64; 3]) -> [f64; 3] {
        let [luminance, x, y] = self.luminance(w);
        rgb_of_xyz([luminance * x / y, luminance, luminance * (1.0 - x - y) / y]).map(|v| v / KCD_PER_UNIT)
    }

    /// Sky and ground as a latitude-longitude image whose top is up; the sun is above the middle of
    /// the image.
    pub fn image(&self) -> LatLongImage {
        let [width, height] = SKY_SIZE;
        let mut texels = Vec::with_capacity(width * height);
        let mut irradiance = self.sunlight;
        for row in 0..height / 2 {
            let theta = PI * (row as f64 + 0.5) / height as f64;
            let (sin, cos) = theta.sin_cos();
            let weight = cos * sin * (PI / height as f64) * (TAU / width as f64);
            for column in 0..width {
                let (sin_phi, cos_phi) = (TAU * ((column as f64 + 0.5) / width as f64 - 0.5)).sin_cos();
                let rgb = self.rgb([sin * sin_phi, cos, -sin * cos_phi]);
                irradiance.iter_mut().zip(rgb).for_each(|(sum, v)| *sum += v * weight);
                texels.push(Spectrum::from(rgb.map(|v| v as f32)));
            }
        }
        // Below the horizon: a grey Lambertian plane, lit by the sun and the summed sky
        let ground = Spectrum::from(irradiance.map(|e| (GROUND_ALBEDO * e / PI) as f32));
        texels.resize(width * height, ground);
        LatLongImage { width, height, texels }
    }
}

/// Distributions of Y, x and y at the turbidity `t` (Preetham et al., appendix A.2).
fn distributions(t: f64) -> [Perez; 3] {
    let linear = |coefficients: [[f64; 2]; 5]| Perez(coefficients.map(|[slope, offset]| slope * t + offset));
    [
        linear([
            [0.1787, -1.4630],
            [-0.3554, 0.4275],
            [-0.0227, 5.3251],
            [0.1206, -2.5771],
            [-0.0670, 0.3703],
        ]),
        linear([
            [-0.0193, -0.2592],
            [-0.0665, 0.0008],
            [-0.0004, 0.2125],
            [-0.0641, -0.8989],
            [-0.0033, 0.0452],
        ]),
        linear([
            [-0.0167, -0.2608],
            [-0.0950, 0.0092],
            [-0.0079, 0.2102],
            [-0.0441, -1.6537],
            [-0.0109, 0.0529],
        ]),
    ]
}

/// Luminance of the zenith, kcd/m², and its chromaticity x, y, at the turbidity `t` with the sun
/// `theta` radians from the zenith (Preetham et al., appendix A.2).
fn zenith(theta: f64, t: f64) -> [f64; 3] {
    let chi = (4.0 / 9.0 - t / 120.0) * (PI - 2.0 * theta);
    let luminance = (4.0453 * t - 4.9710) * chi.tan() - 0.2155 * t + 2.4192;
    // Cubics in the sun's angle, one for each power of the turbidity
    let chromaticity = |rows: [[f64; 4]; 3]| {
        let cubic = |[a, b, c, d]: [f64; 4]| ((a * theta + b) * theta + c) * theta + d;
        let [square, linear, constant] = rows.map(cubic);
        (square * t + linear) * t + constant
    };
    let x = chromaticity([
        [0.00166, -0.00375, 0.00209, 0.0],
        [-0.02903, 0.06377, -0.03202, 0.00394],
        [0.11693, -0.21196, 0.06052, 0.25886],
    ]);
    let y = chromaticity([
        [0.00275, -0.00610, 0.00317, 0.0],
        [-0.04214, 0.08970, -0.04153, 0.00516],
        [0.15346, -0.26756, 0.06670, 0.26688],
    ]);
    [luminance, x, y]
}

/// CIE XYZ to linear Rec.709; negative values of colours out of gamut become 0.
fn rgb_of_xyz([x, y, z]: [f64; 3]) -> [f64; 3] {
    [
        3.240_454_2 * x - 1.537_138_5 * y - 0.498_531_4 * z,
        -0.969_266_0 * x + 1.876_010_8 * y + 0.041_556_0 * z,
        0.055_643_4 * x - 0.204_025_9 * y + 1.057_225_2 * z,
    ]
    .map(|v| v.max(0.0))
}

/// Colour of the sun at `elevation` degrees, with luminance 1: a black body of 5778 K through air
/// of the turbidity `turbidity`.
///
/// Transmittances of air and haze follow Preetham et al., appendix A.1 (Rayleigh, and Ångström's
/// formula with β = 0.04608 T − 0.04586, α = 1.3). Ozone, gases and water, which colour the light
/// little, are left out. The optical mass is Kasten's (1966), as in the paper. Matching functions
/// of the eye are the fit of Wyman, Sloan and Shirley 2013, "Simple Analytic Approximations to the
/// CIE XYZ Color Matching Functions".
pub fn sun_color(elevation: f32, turbidity: f32) -> Spectrum {
    let degrees = f64::from(elevation).clamp(0.0, 90.0);
    let mass = 1.0 / (degrees.to_radians().sin() + 0.15 * (degrees + 3.885).powf(-1.253));
    let beta = 0.04608 * f64::from(turbidity) - 0.04586;
    let mut xyz = [0.0; 3];
    // `nm` is in nanometres; the formulas use micrometres.
    for nm in (380..=780).step_by(5) {
        let nm = f64::from(nm);
        let um = 1e-3 * nm;
        let rayleigh = 0.008735 * um.powf(-4.08);
        let aerosol = beta * um.powf(-1.3);
        // Planck's law without its constant: hc / kB is 14388 µm K.
        let emitted = um.powi(-5) / ((14_388.0 / (um * 5778.0)).exp() - 1.0);
        let arriving = emitted * (-mass * (rayleigh + aerosol)).exp();
        xyz.iter_mut()
            .zip(matching(nm))
            .for_each(|(sum, m)| *sum += arriving * m);
    }
    let rgb = rgb_of_xyz(xyz);
    let luminance = 0.2126 * rgb[0] + 0.7152 * rgb[1] + 0.0722 * rgb[2];
    Spectrum::from(rgb.map(|v| (v / luminance) as f32))
}

/// CIE 1931 matching functions at a wavelength in nanometres (Wyman et al. 2013, sums of lobes).
fn matching(nm: f64) -> [f64; 3] {
    let lobe = |height: f64, middle: f64, below: f64, above: f64| {
        let t = (nm - middle) * if nm < middle { below } else { above };
        height * (-0.5 * t * t).exp()
    };
    [
        lobe(0.362, 442.0, 0.0624, 0.0374) + lobe(1.056, 599.8, 0.0264, 0.0323) + lobe(-0.065, 501.1, 0.0490, 0.0382),
        lobe(0.821, 568.8, 0.0213, 0.0247) + lobe(0.286, 530.9, 0.0613, 0.0322),
        lobe(1.217, 437.0, 0.0845, 0.0278) + lobe(0.681, 459.0, 0.0385, 0.0725),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(zenith_angle: f64, from_sun: f64) -> [f64; 3] {
        let (sin, cos) = zenith_angle.to_radians().sin_cos();
        let (sin_phi, cos_phi) = from_sun.to_radians().sin_cos();
        [sin * sin_phi, cos, -sin * cos_phi]
    }

    fn assert_close(what: &str, values: [f64; 3], expected: [f64; 3]) {
        for (value, expected) in values.into_iter().zip(expected) {
            assert!(
                (value - expected).abs() < 1e-4 * expected,
                "{what}: {value}, not {expected}"
            );
        }
    }

    /// Luminance in kcd/m² and chromaticity at the zenith, and at 60° from the zenith: opposite to
    /// the sun, and on the side of the sun. Reference values are the paper's formulas, evaluated
    /// outside of this code.
    #[test]
    fn values_match_the_formulas_of_the_paper() {
        for (turbidity, elevation, zenith, opposite, near) in [
            (
                2.0,
                90.0,
                [15.50067, 0.26674, 0.2772],
                [8.04152, 0.2409, 0.2477],
                [8.04152, 0.2409, 0.2477],
            ),
            (
                2.0,
                45.0,
                [4.46964, 0.24095, 0.24372],
                [5.53184, 0.23365, 0.24358],
                [20.75238, 0.27045, 0.27787],
            ),
            (
                2.0,
                10.0,
                [2.45752, 0.258, 0.27088],
                [5.23684, 0.26627, 0.2863],
                [16.05556, 0.30266, 0.31778],
            ),
            (
                3.0,
                45.0,
                [7.32036, 0.24568, 0.25148],
                [5.8367, 0.24322, 0.25803],
                [21.72236, 0.28114, 0.2906],
            ),
            (
                3.0,
                0.0,
                [1.7727, 0.28373, 0.30531],
                [2.53235, 0.30185, 0.32985],
                [6.14886, 0.33301, 0.35304],
            ),
            (
                6.0,
                90.0,
                [57.17979, 0.2825, 0.29784],
                [17.14039, 0.26946, 0.29315],
                [17.14039, 0.26946, 0.29315],
            ),
            (
                6.0,
                10.0,
                [3.80059, 0.28016, 0.30086],
                [3.01592, 0.30761, 0.32887],
                [10.7247, 0.34745, 0.35472],
            ),
        ] {
            let sky = Sky::new(elevation, turbidity);
            let what = format!("T {turbidity}, sun {elevation}");
            assert_close(&what, sky.luminance(at(0.0, 0.0)), zenith);
            assert_close(&what, sky.luminance(at(60.0, 180.0)), opposite);
            assert_close(&what, sky.luminance(at(60.0, 0.0)), near);
        }
    }

    /// Converting luminance and chromaticity to linear Rec.709 keeps the luminance, and D65 becomes
    /// grey.
    #[test]
    fn colours_keep_their_luminance() {
        let white = rgb_of_xyz([0.95047, 1.0, 1.08883]);
        assert_close("D65", white, [1.0; 3]);
        let sky = Sky::new(30.0, 4.0);
        for w in [at(0.0, 0.0), at(50.0, 70.0), at(89.0, 10.0)] {
            let radiance = sky.radiance(Vec3::from(w.map(|x| x as f32))).unwrap();
            let expected = sky.luminance(w)[0] / KCD_PER_UNIT;
            assert!((f64::from(radiance.luminance()) / expected - 1.0).abs() < 2e-3);
        }
        // Clear skies are blue.
        let [r, _, b] = sky.radiance(Vec3::Y).unwrap().to_array();
        assert!(b > 1.5 * r);
    }

    /// Irradiance of a horizontal surface, compared to an integral of the paper's formulas computed
    /// outside of this code.
    #[test]
    fn image_has_the_irradiance_of_the_sky() {
        for (turbidity, elevation, kilolux) in [(2.0, 20.0, 22.15), (3.0, 45.0, 28.91), (6.0, 70.0, 60.67)] {
            let image = Sky::new(elevation, turbidity).image();
            let [width, height] = SKY_SIZE;
            let mut sum = 0.0;
            for (i, texel) in image.texels[..width * height / 2].iter().enumerate() {
                let theta = PI * ((i / width) as f64 + 0.5) / height as f64;
                sum += f64::from(texel.luminance()) * theta.cos() * theta.sin();
            }
            let irradiance = sum * PI / height as f64 * TAU / width as f64;
            let expected = kilolux / KCD_PER_UNIT;
            assert!((irradiance / expected - 1.0).abs() < 5e-3, "{irradiance} {expected}");
            // The ground is grey under the sky and the sun.
            let ground = f64::from(image.texels[width * height - 1].luminance());
            let sun = f64::from(SUN_IRRADIANCE) * f64::from(elevation).to_radians().sin();
            assert!((ground / (GROUND_ALBEDO * (irradiance + sun) / PI) - 1.0).abs() < 1e-4);
            assert_eq!(image.texels[width * height / 2], image.texels[width * height - 1]);
            // The brightest texel in the row of the sun is in the middle of the image.
            let row = ((90.0 - elevation) / 180.0 * height as f32) as usize;
            let texels = &image.texels[row * width..(row + 1) * width];
            let brightest = (0..width).max_by(|&a, &b| texels[a].luminance().total_cmp(&texels[b].luminance()));
            assert!((width / 2 - 1..=width / 2).contains(&brightest.unwrap()));
        }
    }

    #[test]
    fn skies_are_finite_and_darken_after_sunset() {
        let mut before = f32::INFINITY;
        for elevation in [5.0, 0.0, -3.0, -6.0, -12.0, -18.0] {
            let zenith = Sky::new(elevation, 3.0).radiance(Vec3::Y).unwrap().luminance();
            assert!(zenith > 0.0 && zenith < before, "{elevation}: {zenith}");
            before = zenith;
        }
        let night = |elevation| Sky::new(elevation, 3.0).radiance(Vec3::Y).unwrap();
        assert_eq!(night(-18.0), night(-90.0));
        // In civil twilight, the illuminance falls from about 400 lx to 3.4 lx.
        let ratio = night(0.0).luminance() / night(-6.0).luminance();
        assert!((ratio / (400.0 / 3.4) - 1.0).abs() < 0.02, "{ratio}");
        for turbidity in [2.0, 2.5, 4.0, 7.0, 10.0] {
            for elevation in [-90.0, -10.0, 0.0, 0.1, 20.0, 60.0, 90.0] {
                let image = Sky::new(elevation, turbidity).image();
                assert!(
                    image.texels.iter().all(|t| t.is_valid() && !t.is_black()),
                    "{turbidity} {elevation}"
                );
            }
        }
    }

    #[test]
    fn low_suns_are_red() {
        let high = sun_color(60.0, 3.0).to_array();
        let low = sun_color(3.0, 3.0).to_array();
        assert!((sun_color(60.0, 3.0).luminance() - 1.0).abs() < 1e-5);
        assert!(high[0] > high[2] && high[2] > 0.5, "{high:?}");
        assert!(low[0] > 1.5 * low[1] && low[1] > 3.0 * low[2], "{low:?}");
        // Haze reddens the sun.
        assert!(sun_color(20.0, 6.0).to_array()[2] < sun_color(20.0, 2.0).to_array()[2]);
        assert!(sun_color(-10.0, 3.0).is_valid());
    }

    /// The fit of Wyman et al. has its maxima at the wavelengths of the CIE functions' maxima.
    #[test]
    fn matching_functions_have_the_maxima_of_cie() {
        let peak = |c: usize| {
            let values = (380..780).map(|nm| (nm, matching(f64::from(nm))[c]));
            values.max_by(|a, b| a.1.total_cmp(&b.1)).unwrap().0
        };
        for (c, expected) in [(0, 599), (1, 555), (2, 446i32)] {
            assert!((peak(c) - expected).abs() <= 4, "{c}: {}", peak(c));
        }
        assert!((matching(555.0)[1] - 1.0).abs() < 0.02);
    }
}
