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
    /// Kind of the thing that the name of the file names.
    pub thing: Option<NamedThing>,
    /// Side that is the front in most files of the program that wrote this file.
    pub usual_front: Option<Vec3>,
}

/// Kind of the thing that a file name names. It is evidence for the upright axis of the scene, and
/// for the view from inside.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum NamedThing {
    /// Rooms, which are seen from inside and are wider than high.
    Rooms,
    /// A building or land, which is wider than high.
    Land,
    /// Letters or a logo, which are read upright.
    Letters,
    /// A thing that is higher than wide, such as a door, a person or a bottle.
    Tall,
    /// A thing that does not lie on its wide side, such as a chair or a bookcase.
    Standing,
    /// Several tall or standing things, which are not an interior.
    Several,
    /// A thing that does not stand on its end, such as a car, an animal or a sofa.
    Long,
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
