use super::{FileError, png};
use crate::files::Output;

/// A picture of colours that stand for something, with a word on what.
#[derive(Clone, Debug, PartialEq)]
pub struct Figure {
    /// Columns and rows.
    pub size: [u32; 2],
    /// 8-bit sRGB of each pixel, row by row from the top.
    pub pixels: Vec<[u8; 3]>,
    /// What the colours mean.
    pub legend: String,
}

impl Figure {
    /// Writes it as a PNG; the legend goes into its text.
    pub fn write(&self, output: &Output) -> Result<(), FileError> {
        let texts = [("Description", self.legend.clone())];
        output.write(|writer| png::encode(writer, self.size, self.pixels.as_flattened(), &texts))
    }
}
