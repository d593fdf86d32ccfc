//! Programs that are recognised by the names of the parts that they write. Their files have no
//! comments.

use crate::math::Vec3;
use crate::scene::Scene;

/// Up axis of a program that always writes the same axis, if the names of the scene's parts show
/// the program; `None` otherwise.
///
/// Google Blocks writes `o group123` and `g mesh123`, with the same number, and always +y up.
pub(super) fn only_up(scene: &Scene) -> Option<Vec3> {
    let names = scene.part_names();
    let is_of_blocks = |part: u32| is_of_blocks(names.object(part), names.groups(part));
    (!names.is_empty() && names.parts().all(is_of_blocks)).then_some(Vec3::Y)
}

/// Returns true if Google Blocks writes these names of an object and of its group.
fn is_of_blocks(object: &str, groups: &str) -> bool {
    let numbers = object.strip_prefix("group").zip(groups.strip_prefix("mesh"));
    let is_number = |text: &str| !text.is_empty() && text.bytes().all(|c| c.is_ascii_digit());
    numbers.is_some_and(|(of_object, of_groups)| of_object == of_groups && is_number(of_object))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_of_blocks_have_the_same_number() {
        assert!(is_of_blocks("group134438707", "mesh134438707"));
        for (object, groups) in [
            ("group1", "mesh2"),
            ("group", "mesh"),
            ("group1", ""),
            ("", "mesh1"),
            ("groupA", "meshA"),
        ] {
            assert!(!is_of_blocks(object, groups), "{object} {groups}");
        }
    }
}
