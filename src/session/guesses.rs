/// Requested guesses for a session, except the guess of the camera. By default there are none, so
/// that commands that measure, and programs that use the library, render the scene of the files
/// unchanged.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub struct Guesses {
    /// True to guess light if nothing in the scene emits, or if only surfaces emit and they do not
    /// light the view (such as the screen of a phone).
    pub light: bool,
    /// True to guess a ground that catches shadows, if the light is guessed or an environment is
    /// set by flags.
    pub ground: bool,
    /// True to guess the background, if the light is guessed.
    pub background: bool,
    /// True to guess the exposure, if the light is guessed.
    pub exposure: bool,
}
