//! Textures of several tiles.

use crate::support::program::*;
use crate::support::write_png;
use std::fs;
use tempfile::TempDir;

const TILE: u32 = 8;

/// Colour of a texel in the image of all tiles, counted from its upper left corner.
fn texel(x: u32, y: u32) -> [u8; 3] {
    [x * 13 + 7, y * 11 + 40, (x * y * 5) % 251].map(|code| (code % 256) as u8)
}

/// A square with texture coordinates from 0 to `end`, and its material.
fn square(end: f32, statement: &str) -> TempDir {
    let obj = format!(
        "mtllib a.mtl\nv -1 -1 0\nv 1 -1 0\nv 1 1 0\nv -1 1 0\nvt 0 0\nvt {end} 0\nvt {end} {end}\nvt 0 {end}\n\
         usemtl m\nf 1/1 2/2 3/3 4/4\n"
    );
    let mtl = format!("newmtl m\nKd 1 1 1\n{statement}\n");
    let scene = "version = 1\n[camera]\nposition = [0, 0, 4]\nlook_at = [0, 0, 0]\n[image]\nwidth = 24\nheight = 24\n\
                 [render]\nsamples = 4\n[[object]]\nobj = \"a.obj\"\n[[light]]\ntype = \"constant\"\nradiance = 1.0\n";
    folder(&[("a.obj", &obj), ("a.mtl", &mtl), ("s.toml", scene)])
}

/// Writes tiles of the image, named `before`, number and `.png`.
fn write_tiles(folder: &TempDir, before: &str, numbers: &[u32]) {
    for number in numbers {
        let (column, row) = ((number - 1001) % 10, (number - 1001) / 10);
        let first = (column * TILE, (1 - row) * TILE);
        let texels: Vec<[u8; 3]> = (0..TILE * TILE)
            .map(|i| texel(first.0 + i % TILE, first.1 + i / TILE))
            .collect();
        write_png(&folder.path().join(format!("{before}{number}.png")), TILE, &texels);
    }
}

fn render(folder: &TempDir) -> String {
    words(&done(folder.path(), &split("render s.toml -o t.exr")))
}

/// For every spelling of the tile number, four tiles equal one image of twice the width and height.
#[test]
fn tiles_are_one_picture() {
    let whole = square(2.0, "map_Kd -s 0.5 0.5 1 -clamp on big.png");
    let texels: Vec<[u8; 3]> = (0..4 * TILE * TILE)
        .map(|i| texel(i % (2 * TILE), i / (2 * TILE)))
        .collect();
    write_png(&whole.path().join("big.png"), 2 * TILE, &texels);
    render(&whole);
    for (name, before) in [
        ("skin.<UDIM>.png", "skin."),
        ("skin_%(UDIM)d.png", "skin_"),
        ("skin_1001.png", "skin_"),
        ("C:\\maps\\skin.<UDIM>.png", "skin."),
    ] {
        let tiled = square(2.0, &format!("map_Kd {name}"));
        write_tiles(&tiled, before, &[1001, 1002, 1011, 1012]);
        let said = render(&tiled);
        assert!(!said.contains("warning"), "{name}: {said}");
        let [whole, tiled] = [&whole, &tiled].map(|folder| folder.path().join("t.exr"));
        assert_same_bits(&whole, &tiled);
    }
}

#[test]
fn missing_tiles_are_named() {
    let tiled = square(2.0, "map_Kd skin.<UDIM>.png");
    write_tiles(&tiled, "skin.", &[1001, 1012]);
    // The centres of the two triangles of this square are in tiles 1002 and 1011.
    let obj = fs::read_to_string(tiled.path().join("a.obj")).unwrap();
    fs::write(
        tiled.path().join("a.obj"),
        obj.replace("f 1/1 2/2 3/3 4/4", "f 1/1 2/2 3/3\nf 1/1 3/3 4/4"),
    )
    .unwrap();
    let said = render(&tiled);
    assert!(said.contains("has no tiles 1002, 1011"), "{said}");
    assert!(said.contains("[missing-tile]"), "{said}");
    let strict = refused(tiled.path(), &split("render s.toml -o t.exr --strict"), 1);
    assert!(strict.contains("1002, 1011"), "{strict}");
    // Without any tile file, the texture is missing
    let none = square(2.0, "map_Kd skin.<UDIM>.png");
    let said = render(&none);
    assert!(said.contains("`skin.<UDIM>.png` is missing"), "{said}");
    // Tiles of different sizes are reported
    let uneven = square(2.0, "map_Kd skin.<UDIM>.png");
    write_tiles(&uneven, "skin.", &[1001]);
    write_png(&uneven.path().join("skin.1002.png"), 4, &[[9; 3]; 16]);
    let said = render(&uneven);
    assert!(said.contains("this tile has 4x4 texels"), "{said}");
}

/// A numbered file without other tiles beside it is an ordinary texture.
#[test]
fn single_numbered_pictures_repeat() {
    let [numbered, plain] = ["a_1001.png", "plain.png"].map(|name| square(2.0, &format!("map_Kd {name}")));
    write_tiles(&numbered, "a_", &[1001]);
    fs::copy(numbered.path().join("a_1001.png"), plain.path().join("plain.png")).unwrap();
    render(&numbered);
    render(&plain);
    assert_same_bits(&numbered.path().join("t.exr"), &plain.path().join("t.exr"));
}
