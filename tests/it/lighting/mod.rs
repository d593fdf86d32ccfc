//! Lights, light sampling, light groups, and backgrounds.

mod background;
mod emission;
mod ground;
mod light_flags;
mod light_groups;
mod lights;
mod shaped_lights;
mod small_lamps;
mod two_sided_lamps;
mod visibility;
