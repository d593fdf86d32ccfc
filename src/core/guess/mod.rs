//! Guesses of the upright axis, the camera and the light of a scene, if its file does not have
//! them.
//!
//! A bare OBJ has no camera. The view depends on the kind of scene, object or interior (`survey`).
//! An object is seen from its front and above, at the angle with the most information (`object`).
//! An interior is seen at eye height, from the place and in the direction with the most information
//! (`interior`). All decisions use rays of the scene's own backend at fixed places. The kind of
//! scene also decides on the light (`light`).
//!
//! Scores are compared with a margin, and results are rounded, so that two backends, which differ
//! by rounding, agree. The number of threads changes nothing.

mod barrel;
mod camera;
mod elevation;
mod emitters;
mod exporter;
mod facing;
mod far_ground;
mod file_axes;
mod floors;
mod framing;
mod groups;
mod interior;
mod lathe;
mod light;
mod named_sides;
mod object;
mod open_house;
mod open_side;
mod parts;
mod plan;
mod region;
mod rooms;
mod scale;
mod scene_tracer;
mod side_points;
mod spread;
mod stand;
mod surfaces;
mod survey;
mod triangles;
mod up;
mod views;

pub use camera::{CameraFinder, CameraGuess, CameraRequest, position_text};
pub use elevation::{DrawingAxes, Elevation, drawing_axes};
pub use file_axes::{DeclaredAxes, FileAxes, NamedThing};
pub use light::LightGuess;
pub use plan::{Plan, PlanCamera};
pub use scale::near_distance;
pub use stand::Stand;
pub use survey::Survey;
pub use up::{SiblingFiles, UpScores};
pub use views::{NamedView, Orbit};
