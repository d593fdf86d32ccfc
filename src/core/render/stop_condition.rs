/// Condition that ends a render: all samples are taken, or the estimated error is small enough.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StopCondition {
    /// Index of the last sample of a pixel (or of the last iteration), plus one.
    pub end: u32,
    /// Estimated relative error at which the render may end before `end`. `None`: the render takes
    /// all samples.
    pub noise: Option<f64>,
}

impl StopCondition {
    /// Condition without an error level: the render ends before the sample or iteration with index
    /// `end`.
    pub fn at(end: u32) -> Self {
        Self { end, noise: None }
    }
}
