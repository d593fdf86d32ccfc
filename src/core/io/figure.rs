use super::{FileError, png};
use crate::files::Output;

/// A false-colour picture with a legend.
#[derive(Clone, Debug, PartialEq)]
pub struct Figure {
    /// Number of columns and rows.
    pub size: [u32; 2],
    /// 8-bit sRGB of each pixel, row by row from the top.
    pub pixels: Vec<[u8; 3]>,
    /// Meaning of the colours.
    pub legend: String,
}

impl Figure {
    /// Writes the figure as a PNG, with the legend in a text chunk.
    pub fn write(&self, output: &Output) -> Result<(), FileError> {
        let texts = [("Description", self.legend.clone())];
        output.write(|writer| png::encode(writer, self.size, self.pixels.as_flattened(), &texts))
    }
}
