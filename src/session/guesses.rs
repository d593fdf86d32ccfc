/// Guesses that a session makes besides the camera's. By default it makes none: commands that measure, and programs over the library, render the scene as its
/// files give it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub struct Guesses {
    /// Light, where nothing in the scene emits.
    pub light: bool,
    /// A ground that catches shadows, with guessed light or an environment that flags give.
    pub ground: bool,
    /// The background, with guessed light.
    pub background: bool,
    /// The exposure, with guessed light.
    pub exposure: bool,
}
