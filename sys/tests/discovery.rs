//! Tests of the build script's search for Embree, on generated folders.

use std::fs;
use std::path::{Path, PathBuf};

#[path = "../build/discover.rs"]
mod discover;

use discover::{Places, Version, discover, needs_rpath, system_prefixes};

const MULTIARCH: &str = "x86_64-linux-gnu";

/// An empty folder for each test.
fn sandbox(test: &str) -> PathBuf {
    let root = Path::new(env!("CARGO_TARGET_TMPDIR")).join("discovery").join(test);
    if root.exists() {
        fs::remove_dir_all(&root).unwrap();
    }
    fs::create_dir_all(&root).unwrap();
    root
}

fn write(file: &Path, text: &str) {
    fs::create_dir_all(file.parent().unwrap()).unwrap();
    fs::write(file, text).unwrap();
}

/// Creates headers of a version in `include`, in the subfolder of the major version.
fn headers(include: &Path, Version(major, minor, patch): Version) {
    let folder = include.join(format!("embree{major}"));
    write(&folder.join("rtcore.h"), "#include \"rtcore_config.h\"\n");
    write(
        &folder.join("rtcore_config.h"),
        &format!(
            "#define RTC_VERSION_MAJOR {major}\n\
             #define RTC_VERSION_MINOR {minor}\n\
             #define RTC_VERSION_PATCH {patch}\n\
             #define RTC_VERSION_STRING \"{major}.{minor}.{patch}\"\n"
        ),
    );
}

/// Creates a complete Embree 4 with its library at `library`, relative to the prefix.
fn install(prefix: &Path, version: Version, library: &str) {
    headers(&prefix.join("include"), version);
    write(&prefix.join(library), "");
}

/// Places to search below `root`, without installations at first.
fn places(root: &Path) -> Places {
    Places {
        embree_dir: None,
        include_dir: None,
        lib_dir: None,
        deps: root.join("deps"),
        system: vec![root.join("usr/local"), root.join("usr")],
        multiarch: MULTIARCH.into(),
    }
}

fn assert_mentions(message: &str, all: &[&str]) {
    for part in all {
        assert!(message.contains(part), "no {part:?} in:\n{message}");
    }
}

#[test]
fn none_at_all_says_where_it_looked_and_what_to_do() {
    let root = sandbox("none");
    let message = discover(&places(&root)).unwrap_err();
    let usr = format!(
        "{}: no {}",
        root.join("usr").display(),
        root.join("usr/include/embree4/rtcore.h").display()
    );
    let deps = root.join("deps").display().to_string();
    assert_mentions(&message, &["Embree 4 was not found", &deps, &usr]);
    assert_mentions(
        &message,
        &[
            "make setup",
            "apt-get install libembree-dev",
            "EMBREE_DIR",
            "--no-default-features",
        ],
    );
}

#[test]
fn embree_3_is_too_old() {
    let root = sandbox("embree3");
    headers(&root.join("usr/include"), Version(3, 13, 5));
    let old = format!(
        "Embree 3.13.5 headers in {}: too old",
        root.join("usr/include/embree3").display()
    );
    assert_mentions(&discover(&places(&root)).unwrap_err(), &[&old, "make setup"]);
}

#[test]
fn embree_4_is_found_beside_embree_3() {
    let root = sandbox("both");
    headers(&root.join("usr/include"), Version(3, 13, 5));
    install(
        &root.join("usr"),
        Version(4, 3, 3),
        "lib/x86_64-linux-gnu/libembree4.so",
    );

    let embree = discover(&places(&root)).unwrap();
    assert_eq!(embree.version, Version(4, 3, 3));
    assert_eq!(embree.version.to_string(), "4.3.3");
    assert_eq!(embree.include_dir, root.join("usr/include"));
    assert_eq!(embree.lib_dir, root.join("usr/lib/x86_64-linux-gnu"));
    assert_eq!(embree.library, "libembree4.so");
}

#[test]
fn headers_without_a_library_are_not_enough() {
    let root = sandbox("no_library");
    headers(&root.join("usr/include"), Version(4, 3, 0));
    let lib64 = root.join("usr/lib64").display().to_string();
    assert_mentions(
        &discover(&places(&root)).unwrap_err(),
        &["Embree 4.3.0 headers in", "no libembree4 in", &lib64],
    );
}

#[test]
fn headers_that_do_not_say_their_version_are_not_used() {
    let root = sandbox("no_version");
    install(&root.join("usr"), Version(4, 3, 0), "lib/libembree4.so");
    let config = root.join("usr/include/embree4/rtcore_config.h");

    write(&config, "#define RTC_VERSION_MAJOR four\n");
    assert_mentions(&discover(&places(&root)).unwrap_err(), &["no RTC_VERSION_MAJOR in"]);

    fs::remove_file(&config).unwrap();
    assert_mentions(
        &discover(&places(&root)).unwrap_err(),
        &["cannot read", "rtcore_config.h"],
    );

    write(
        &config,
        "#define RTC_VERSION_MAJOR 5\n#define RTC_VERSION_MINOR 0\n#define RTC_VERSION_PATCH 1\n",
    );
    assert_mentions(
        &discover(&places(&root)).unwrap_err(),
        &["Embree 5.0.1", "version 4 is needed"],
    );
}

#[test]
fn the_projects_own_comes_before_the_system() {
    let root = sandbox("deps_first");
    install(&root.join("usr"), Version(4, 3, 3), "lib/libembree4.so");
    assert_eq!(discover(&places(&root)).unwrap().version, Version(4, 3, 3));
    install(&root.join("deps"), Version(4, 4, 0), "lib/libembree4.so");
    assert_eq!(discover(&places(&root)).unwrap().version, Version(4, 4, 0));
}

#[test]
fn embree_dir_comes_before_all() {
    let root = sandbox("embree_dir");
    install(&root.join("deps"), Version(4, 4, 0), "lib/libembree4.so");
    for library in [
        "lib/libembree4.so",
        "lib64/libembree4.so.4",
        "lib/x86_64-linux-gnu/libembree4.so",
    ] {
        let prefix = root.join(library.replace('/', "_"));
        install(&prefix, Version(4, 1, 0), library);
        // `EMBREE_LIB_DIR` is ignored.
        let lib_dir = Some(root.join("nowhere"));
        let embree = discover(&Places {
            embree_dir: Some(prefix.clone()),
            lib_dir,
            ..places(&root)
        })
        .unwrap();
        assert_eq!(embree.version, Version(4, 1, 0));
        assert_eq!(embree.lib_dir.join(embree.library), prefix.join(library));
    }
}

#[test]
fn a_wrong_embree_dir_is_an_error_even_where_another_would_do() {
    let root = sandbox("embree_dir_wrong");
    install(&root.join("usr"), Version(4, 3, 3), "lib/libembree4.so");
    let set = |dir: &Path| {
        discover(&Places {
            embree_dir: Some(dir.into()),
            ..places(&root)
        })
        .unwrap_err()
    };

    let nowhere = root.join("nowhere");
    assert_mentions(
        &set(&nowhere),
        &[&format!("EMBREE_DIR={} does not lead", nowhere.display()), "Found: no "],
    );

    let old = root.join("old");
    headers(&old.join("include"), Version(3, 12, 2));
    assert_mentions(&set(&old), &["EMBREE_DIR=", "Embree 3.12.2", "too old"]);

    assert_mentions(
        &set(Path::new("relative")),
        &["EMBREE_DIR=relative", "is a relative path"],
    );
}

#[test]
fn the_pair_of_folders_works_and_only_as_a_pair() {
    let root = sandbox("pair");
    install(&root.join("usr"), Version(4, 3, 3), "lib/libembree4.so");
    headers(&root.join("headers"), Version(4, 4, 0));
    write(&root.join("libraries/libembree4.so"), "");
    let (include, lib) = (Some(root.join("headers")), Some(root.join("libraries")));

    let pair = |include_dir: &Option<PathBuf>, lib_dir: &Option<PathBuf>| {
        discover(&Places {
            include_dir: include_dir.clone(),
            lib_dir: lib_dir.clone(),
            ..places(&root)
        })
    };
    let embree = pair(&include, &lib).unwrap();
    assert_eq!(
        (embree.version, embree.lib_dir),
        (Version(4, 4, 0), root.join("libraries"))
    );

    assert_mentions(&pair(&include, &None).unwrap_err(), &["EMBREE_LIB_DIR is needed"]);
    assert_mentions(&pair(&None, &lib).unwrap_err(), &["EMBREE_INCLUDE_DIR is needed"]);
    assert_mentions(
        &pair(&lib, &include).unwrap_err(),
        &["EMBREE_INCLUDE_DIR=", "EMBREE_LIB_DIR=", "Found: no "],
    );
}

#[test]
fn system_prefixes_are_the_usual_ones_and_unpacked_archives() {
    let root = sandbox("system");
    for folder in ["embree-4.3.3.x86_64.linux", "embree-4.4.0.x86_64.linux", "other"] {
        fs::create_dir_all(root.join("opt").join(folder)).unwrap();
    }
    let relative: Vec<_> = system_prefixes(&root)
        .iter()
        .map(|prefix| prefix.strip_prefix(&root).unwrap().to_path_buf())
        .collect();
    let expected = [
        "usr/local",
        "opt/embree-4.4.0.x86_64.linux",
        "opt/embree-4.3.3.x86_64.linux",
        "opt/homebrew",
        "opt/local",
        "usr",
    ];
    assert_eq!(relative, expected.map(PathBuf::from));
}

#[test]
fn only_folders_that_the_loader_does_not_search_need_an_rpath() {
    let root = sandbox("rpath");
    for searched in ["/usr/lib", "/usr/lib64", "/usr/lib/x86_64-linux-gnu"] {
        assert!(!needs_rpath(Path::new(searched), MULTIARCH), "{searched}");
    }
    for unsearched in ["/usr/local/lib", "/opt/embree/lib", "/usr/lib/embree"] {
        assert!(needs_rpath(Path::new(unsearched), MULTIARCH), "{unsearched}");
    }
    assert!(needs_rpath(&root, MULTIARCH));
}
