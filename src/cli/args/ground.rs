use crate::scene_file::SceneFile;

/// Flags of the ground.
#[derive(Clone, Copy, Debug, Default, clap::Args)]
pub(in crate::cli) struct GroundArgs {
    /// Add a ground that shows only shadows; `[ground]` of the scene file places it
    #[arg(long, conflicts_with = "no_ground")]
    pub ground: bool,

    /// Remove the ground of the scene file or of a bare OBJ
    #[arg(long)]
    pub no_ground: bool,
}

impl GroundArgs {
    /// Adds the ground to `scene`, or removes it, if a flag says so.
    pub fn apply(self, scene: &mut SceneFile) {
        if self.no_ground {
            scene.ground = None;
        } else if self.ground {
            scene.ground.get_or_insert_default();
        }
    }
}
