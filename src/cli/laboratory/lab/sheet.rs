//! Contact sheet with the pictures of a comparison.

use super::Comparison;
use super::contenders::Contender;
use super::runs::Snapshot;
use crate::cli::printing::{count, measured};
use crate::color::{Tone, srgb};
use crate::film::RgbImage;
use crate::io::Panel;

/// Number of pictures in a row if there is one budget.
const COLUMNS: usize = 4;

impl Comparison {
    /// Panels of the sheet, and their number per row. With several budgets each estimator has a
    /// row, and the reference has the last row, beside the picture that shows its missing light.
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
            let faults = self.verdict.labels().collect();
            panels.push(Panel {
                label: [vec!["reference".into()], reference.lines(), faults].concat(),
                image: shown(&reference.image, &self.tone),
            });
        }
        if let Some((image, iterations)) = &self.verdict.witness {
            panels.push(Panel {
                label: vec![
                    format!("check: sppm, {iterations} iterations"),
                    "has light that the reference lacks".into(),
                ],
                image: shown(image, &self.tone),
            });
        }
        (panels, columns)
    }

    fn panel(&self, contender: &Contender, snapshot: &Snapshot) -> Panel {
        let samples = count(u64::from(snapshot.samples), "sample");
        let spent = format!("{samples}, {:.2} s", snapshot.seconds);
        let error = snapshot.rel_mse.map(|error| format!("relMSE {}", measured(error)));
        let blocks = snapshot
            .block_rel_mse
            .map(|error| format!("of blocks {}", measured(error)));
        Panel {
            label: [contender.name.clone(), spent]
                .into_iter()
                .chain(error)
                .chain(blocks)
                .collect(),
            image: shown(&snapshot.image, &self.tone),
        }
    }

    /// Panel for a picture that was not rendered.
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

/// `image` with `tone`, decoded to linear light of a display. The default tone returns `image`
/// unchanged, because only values above 1 would change, and the display clips these values.
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
