//! Plans and elevations: parallel views along the axes of a scene.

use super::FileAxes;
use crate::math::{Vec3, nearest_axis};

/// Side of a scene that a drawing shows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Elevation {
    /// From the front.
    Front,
    /// From behind.
    Back,
    /// From the left side, as seen from the front.
    Left,
    /// From the right side.
    Right,
    /// From above, with the front below.
    Plan,
}

/// Axes of a drawing: unit vectors.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DrawingAxes {
    /// To the right in the image.
    pub right: Vec3,
    /// Up in the image.
    pub up: Vec3,
    /// To the viewer.
    pub back: Vec3,
}

impl Elevation {
    /// Names that users type.
    pub const NAMES: &[(&str, Self)] = &[
        ("front", Self::Front),
        ("back", Self::Back),
        ("left", Self::Left),
        ("right", Self::Right),
        ("plan", Self::Plan),
    ];

    /// Axes of the drawing of a scene with the upright axis `up` and the front direction `front`.
    pub fn axes(self, [up, front]: [Vec3; 2]) -> DrawingAxes {
        let across = up.cross(front);
        let (up, back) = match self {
            Self::Front => (up, front),
            Self::Back => (up, -front),
            Self::Left => (up, -across),
            Self::Right => (up, across),
            Self::Plan => (-front, up),
        };
        DrawingAxes {
            right: up.cross(back),
            up,
            back,
        }
    }
}

/// Upright axis of drawings, and direction of the front of the scene, without a guess. The upright
/// axis is the axis nearest to `up`, or else the axis of the file, or else +y.
pub fn drawing_axes(up: Option<Vec3>, axes: &FileAxes) -> [Vec3; 2] {
    let given = up.and_then(nearest_axis);
    let of_file = axes
        .declared
        .map(|declared| declared.up)
        .or(axes.usual_up)
        .and_then(nearest_axis);
    let up = given.or(of_file).unwrap_or(Vec3::Y);
    let declared = axes.declared.map(|declared| declared.front).or(axes.usual_front);
    let front = declared.and_then(nearest_axis).filter(|front| front.dot(up) == 0.0);
    let usual = if up.z == 0.0 { Vec3::Z } else { Vec3::NEG_Y };
    [up, front.unwrap_or(usual)]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn axes_of_drawings_match_their_sides() {
        let none = FileAxes::default();
        let upright = drawing_axes(None, &none);
        assert_eq!(upright, [Vec3::Y, Vec3::Z]);
        for (side, right, back) in [
            (Elevation::Front, Vec3::X, Vec3::Z),
            (Elevation::Back, Vec3::NEG_X, Vec3::NEG_Z),
            (Elevation::Right, Vec3::NEG_Z, Vec3::X),
            (Elevation::Left, Vec3::Z, Vec3::NEG_X),
        ] {
            let axes = side.axes(upright);
            assert_eq!((axes.right, axes.up, axes.back), (right, Vec3::Y, back), "{side:?}");
        }
        let plan = Elevation::Plan.axes(upright);
        assert_eq!((plan.right, plan.up, plan.back), (Vec3::X, Vec3::NEG_Z, Vec3::Y));
        // z is up: the front faces -y, and a plan has x to the right and y upwards.
        let upright = drawing_axes(Some(Vec3::new(0.1, 0.0, 0.9)), &none);
        assert_eq!(upright, [Vec3::Z, Vec3::NEG_Y]);
        let plan = Elevation::Plan.axes(upright);
        assert_eq!((plan.right, plan.up, plan.back), (Vec3::X, Vec3::Y, Vec3::Z));
        assert_eq!(Elevation::Right.axes(upright).back, Vec3::X);
    }
}
