/// Linear red, green and blue of each pixel, row by row from the top.
#[derive(Clone, Debug, PartialEq)]
pub struct RgbImage {
    /// Number of columns.
    pub width: usize,
    /// Number of rows.
    pub height: usize,
    /// `width · height` pixels.
    pub pixels: Vec<[f32; 3]>,
}

impl RgbImage {
    /// Picture whose pixels are means over `factor` × `factor` pixels. The function `seen` converts
    /// each value before the mean is taken. If the size is no multiple of `factor`, the remaining
    /// pixels at the right and at the bottom are left out.
    pub fn averaged(&self, factor: usize, seen: impl Fn(f32) -> f32) -> Self {
        let (width, height) = (self.width / factor, self.height / factor);
        let pixel = |i: usize| {
            let (x, y) = (i % width * factor, i / width * factor);
            let square = (y..y + factor).flat_map(|row| &self.pixels[row * self.width + x..][..factor]);
            let sum = square.fold([0.0f32; 3], |sum, pixel| [0, 1, 2].map(|c| sum[c] + seen(pixel[c])));
            sum.map(|sum| sum / (factor * factor) as f32)
        };
        Self {
            width,
            height,
            pixels: (0..width * height).map(pixel).collect(),
        }
    }
}
