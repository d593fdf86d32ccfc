/// What a session guesses where nothing says it. A library's caller, and commands that measure, guess nothing but the camera.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Guesses {
    /// Light, where nothing in the scene emits.
    pub light: bool,
    /// A ground that catches shadows, with guessed light.
    pub ground: bool,
    /// The background, with guessed light.
    pub background: bool,
}
