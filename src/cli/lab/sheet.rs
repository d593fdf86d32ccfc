//! The pictures of a comparison as a contact sheet.

use super::Comparison;
use super::contenders::Contender;
use super::runs::Snapshot;
use crate::cli::words::{count, measured};
use crate::color::{Tone, srgb};
use crate::film::RgbImage;
use crate::io::Panel;

/// Pictures in a row where there is one budget.
const COLUMNS: usize = 4;

impl Comparison {
    /// The panels of the sheet, and how many of them are in a row: with several budgets an estimator is a row, and the reference is the last one.
    pub fn panels(&self) -> (Vec<Panel>, usize) {
        let columns = match self.budgets.len() {
            1 => COLUMNS,
            budgets => budgets,
        };
        let mut panels = Vec::new();
        for (contender, run) in &self.runs {
            let cells = (0..self.budgets.len()).map(|index| match run.at(index) {
                Some(snapshot) => self.panel(contender, snapshot),
                None => self.empty(contender),
            });
            panels.extend(cells);
        }
        if let Some(reference) = &self.reference {
            panels.push(Panel {
                label: [vec!["reference".into()], reference.lines()].concat(),
                image: shown(&reference.image, &self.tone),
            });
        }
        (panels, columns)
    }

    fn panel(&self, contender: &Contender, snapshot: &Snapshot) -> Panel {
        let samples = count(u64::from(snapshot.samples), "sample");
        let spent = format!("{samples}, {:.2} s", snapshot.seconds);
        let error = snapshot.rel_mse.map(|error| format!("relMSE {}", measured(error)));
        Panel {
            label: [contender.name.clone(), spent].into_iter().chain(error).collect(),
            image: shown(&snapshot.image, &self.tone),
        }
    }

    /// The place of a picture that was not rendered.
    fn empty(&self, contender: &Contender) -> Panel {
        let why = match contender.refused {
            Some(_) => "cannot find this light",
            None => "interrupted",
        };
        let [width, height] = self.size;
        Panel {
            label: vec![contender.name.clone(), why.into()],
            image: RgbImage {
                width,
                height,
                pixels: vec![[0.0; 3]; width * height],
            },
        }
    }
}

/// `image` as `tone` shows it, in linear light of the display. The tone that clips leaves that to the display.
pub(super) fn shown(image: &RgbImage, tone: &Tone) -> RgbImage {
    if *tone == Tone::default() {
        return image.clone();
    }
    let pixel = |rgb: &[f32; 3]| tone.encode_u8(*rgb).map(|code| srgb::decode(f32::from(code) / 255.0));
    RgbImage {
        pixels: image.pixels.iter().map(pixel).collect(),
        ..*image
    }
}
