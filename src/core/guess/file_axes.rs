use crate::math::Vec3;

/// Axes of a file according to its comments.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[non_exhaustive]
pub struct FileAxes {
    /// Axes that the file declares.
    pub declared: Option<DeclaredAxes>,
    /// Axis that is up in most files of the program that wrote this file.
    pub usual_up: Option<Vec3>,
    /// True if users of the program that wrote this file rarely change [`FileAxes::usual_up`].
    pub keeps_usual_up: bool,
    /// Axis that is up in all files of the program that wrote this file.
    pub only_up: Option<Vec3>,
    /// True if the file has the name of a building, of rooms or of land, which are wider than high.
    pub is_of_land: bool,
    /// True if the file has the name of letters or of a logo, which are read upright.
    pub is_of_letters: bool,
    /// Side that is the front in most files of the program that wrote this file.
    pub usual_front: Option<Vec3>,
}

/// Axes that a file declares: unit vectors along its coordinates, at a right angle.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct DeclaredAxes {
    /// Up.
    pub up: Vec3,
    /// Side that faces the viewer.
    pub front: Vec3,
}

impl DeclaredAxes {
    /// Axes along `up` and `front`; `None` if they are not at a right angle.
    pub fn new(up: Vec3, front: Vec3) -> Option<Self> {
        (up.dot(front) == 0.0).then_some(Self { up, front })
    }
}
