//! Verdict on the reference of a comparison: has it converged, and does it have all light?
//!
//! A reference that is rendered consists of two halves of different seeds, whose difference is its
//! own noise. Rare bright samples may be missing in both halves. So another method, stochastic
//! progressive photon mapping, renders two small pictures too. It also finds light that reaches the
//! camera only by mirrors and glass on both sides. If both pictures are much brighter than the
//! reference in some place, the reference lacks light there. The bias of photons is a blur of a few
//! pixels, so means over blocks of pixels are compared.

use super::contenders::Contender;
use super::lessons::Lesson;
use super::renderer::{ContenderRenderer, Reference, mean_of};
use crate::cli::error::CliError;
use crate::cli::printing::{measured, percent};
use crate::color::Spectrum;
use crate::film::RgbImage;
use crate::options::{IntegratorKind, IntegratorOptions};
use crate::session::Settings;

/// Maximum relMSE of the reference's own noise, as a fraction of the smallest relMSE against it.
const MAX_NOISE: f64 = 0.25;
/// Light in a block is missing if both pictures of the other method have more than this multiple of
/// the reference's light there.
const FACTOR: f32 = 2.0;
/// Minimum difference that counts as missing light, as a fraction of the mean of the picture.
const MIN_LIGHT: f32 = 0.05;
/// Minimum fraction of the blocks in which light is missing.
const MIN_SHARE: f32 = 0.005;
/// Edge of the blocks in pixels.
const EDGE: usize = 8;
/// Minimum and maximum number of iterations of each picture of the other method.
const ITERATIONS: [u32; 2] = [16, 64];

/// A fault of a reference.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Fault {
    /// The reference has much noise: its own relMSE, and the smallest relMSE against it.
    Noise([f64; 2]),
    /// The reference lacks light in this fraction of the picture.
    MissingLight(f32),
}

impl Fault {
    /// Text for a label of few words.
    pub fn label(self) -> &'static str {
        match self {
            Self::Noise(_) => "NOT CONVERGED",
            Self::MissingLight(_) => "LACKS LIGHT",
        }
    }

    /// Sentence that describes the fault.
    pub fn text(self) -> String {
        match self {
            Self::Noise([own, smallest]) => format!(
                "The reference has not converged: its own noise has a relMSE of {}, which is {} of the smallest relMSE in the table.",
                measured(own),
                percent(own / smallest)
            ),
            Self::MissingLight(share) => format!(
                "The reference lacks light: in {} of the picture, sppm finds more than twice as much. Errors against this reference do not show which estimator is right.",
                percent(share.into())
            ),
        }
    }

    /// Sentences that describe the fault and its remedy.
    pub fn advice(self) -> String {
        format!("{} To mend this, {}.", self.text(), self.help())
    }

    /// Remedy.
    pub fn help(self) -> &'static str {
        match self {
            Self::Noise(_) => {
                "give --reference FILE with more samples, or from an integrator with less noise in this scene"
            }
            Self::MissingLight(_) => {
                "render a reference with --integrator sppm or vcm, and give it as --reference FILE; `embrasure help caustics` compares integrators"
            }
        }
    }
}

/// Verdict on a reference.
#[derive(Debug, Default)]
pub(super) struct Verdict {
    pub faults: Vec<Fault>,
    /// Picture of the other method, with its number of iterations, if it has light that the
    /// reference lacks.
    pub witness: Option<(RgbImage, u32)>,
    /// Reason why the reference was not checked for missing light, if it was not checked.
    pub unchecked: Option<String>,
}

impl Verdict {
    /// Judges `reference`. `base` are the settings of all estimators, `samples` is the largest
    /// number of samples per pixel of an estimator, and `smallest` the smallest relMSE against the
    /// reference.
    pub fn new(
        renderer: &mut ContenderRenderer,
        base: &Settings,
        reference: &Reference,
        (samples, smallest): (u32, Option<f64>),
    ) -> Result<Self, CliError> {
        let mut verdict = Self::default();
        if let (Some(own), Some(smallest)) = (reference.rel_mse, smallest) {
            if own > MAX_NOISE * smallest {
                verdict.faults.push(Fault::Noise([own, smallest]));
            }
        }
        let mut other = witness(base);
        let session = renderer.session_for(&other)?;
        other.judge(&session);
        renderer.session = Some(session);
        let refusal = other.settings.check().err().map(|error| error.to_string());
        if let Some(reason) = refusal.as_deref().or(other.refusal()) {
            verdict.unchecked = reason.lines().next().map(String::from);
            return Ok(verdict);
        }
        let [min, max] = ITERATIONS;
        let iterations = samples.clamp(min, max);
        let first = renderer.picture(&other.with_seed(3), iterations)?;
        let second = renderer.picture(&other.with_seed(4), iterations)?;
        if let (Some(first), Some(second)) = (first, second) {
            let share = missing_light(&reference.image, [&first, &second]);
            if share >= MIN_SHARE {
                verdict.faults.push(Fault::MissingLight(share));
                verdict.witness = Some((mean_of(&first, &second), 2 * iterations));
            }
        }
        Ok(verdict)
    }

    /// Labels of all faults.
    pub fn labels(&self) -> impl Iterator<Item = String> + '_ {
        self.faults.iter().map(|fault| fault.label().into())
    }
}

/// The method that checks a reference.
fn witness(base: &Settings) -> Contender {
    let settings = Settings {
        integrator: IntegratorOptions {
            integrator: Some(IntegratorKind::ProgressivePhotons),
            max_depth: base.integrator.max_depth,
            ..IntegratorOptions::default()
        },
        ..base.clone()
    };
    Contender::new("sppm", Lesson::default(), settings)
}

/// Fraction of the blocks in which `reference` lacks light that both `others` have.
fn missing_light(reference: &RgbImage, others: [&RgbImage; 2]) -> f32 {
    let edge = EDGE.min(reference.width).min(reference.height).max(1);
    let luminances = |image: &RgbImage| -> Vec<f32> {
        let blocks = image.averaged(edge, |v| v).pixels;
        blocks.into_iter().map(|rgb| Spectrum::from(rgb).luminance()).collect()
    };
    let reference = luminances(reference);
    let [first, second] = others.map(luminances);
    let blocks = reference.len().max(1) as f32;
    let both: Vec<f32> = first.iter().zip(&second).map(|(a, b)| a.min(*b)).collect();
    let mean = both.iter().sum::<f32>() / blocks;
    let is_missing = |(other, known): &(&f32, &f32)| **other > FACTOR * **known && *other - *known > MIN_LIGHT * mean;
    both.iter().zip(&reference).filter(is_missing).count() as f32 / blocks
}

#[cfg(test)]
mod tests {
    use super::*;

    fn picture(value: impl Fn(usize, usize) -> f32) -> RgbImage {
        RgbImage {
            width: 32,
            height: 16,
            pixels: (0..32 * 16).map(|i| [value(i % 32, i / 32); 3]).collect(),
        }
    }

    /// Light counts as missing only if both pictures have it: a bright sample in one picture does
    /// not count.
    #[test]
    fn light_is_missing_if_both_pictures_have_it() {
        let plain = picture(|_, _| 1.0);
        let caustic = picture(|x, y| if x < 8 && y < 8 { 5.0 } else { 1.1 });
        let spike = picture(|x, y| if (x, y) == (20, 4) { 1e4 } else { 0.9 });
        assert_eq!(missing_light(&plain, [&caustic, &caustic]), 1.0 / 8.0);
        assert_eq!(missing_light(&plain, [&caustic, &spike]), 0.0);
        assert_eq!(missing_light(&caustic, [&plain, &plain]), 0.0);
        assert_eq!(missing_light(&picture(|_, _| 0.0), [&plain, &plain]), 1.0);
        let tiny = |v: f32| RgbImage {
            width: 1,
            height: 1,
            pixels: vec![[v; 3]],
        };
        assert_eq!(missing_light(&tiny(1.0), [&tiny(3.0), &tiny(4.0)]), 1.0);
    }

    #[test]
    fn faults_are_sentences_with_remedies() {
        let text = Fault::Noise([0.002, 0.004]).text();
        assert!(
            text.contains("relMSE of 0.002, which is 50 % of the smallest"),
            "{text}"
        );
        let text = Fault::MissingLight(0.125).text();
        assert!(text.contains("in 12.5 % of the picture"), "{text}");
    }
}
