/// Guesses of a session except the camera. By default there are none: commands that measure, and
/// programs that use the library, render the scene of the files without changes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub struct Guesses {
    /// True to guess light if nothing in the scene emits.
    pub light: bool,
    /// True to guess a ground that catches shadows, under guessed light or under an environment of
    /// flags.
    pub ground: bool,
    /// True to guess the background, with guessed light.
    pub background: bool,
    /// True to guess the exposure, with guessed light.
    pub exposure: bool,
}
