//! Search for Embree 4. All machine-dependent inputs are in [`Places`], so that tests can pass
//! their own folders.

use std::fmt;
use std::fs;
use std::path::{Path, PathBuf};

/// Locations to search, in this order.
pub struct Places {
    /// Value of `EMBREE_DIR`: a prefix.
    pub embree_dir: Option<PathBuf>,
    /// Value of `EMBREE_INCLUDE_DIR`, with `lib_dir`: separate folders instead of a prefix.
    pub include_dir: Option<PathBuf>,
    /// Value of `EMBREE_LIB_DIR`: the folder of the library.
    pub lib_dir: Option<PathBuf>,
    /// Prefix of the Embree in the project's folder.
    pub deps: PathBuf,
    /// Prefixes of installations in the system.
    pub system: Vec<PathBuf>,
    /// Debian's name for the target, such as `x86_64-linux-gnu`: a folder below `lib`.
    pub multiarch: String,
}

/// An Embree installation with headers and library.
#[derive(Debug)]
pub struct Embree {
    /// Parent folder of `embree4/rtcore.h`.
    pub include_dir: PathBuf,
    pub lib_dir: PathBuf,
    /// File name of the library in `lib_dir`.
    pub library: &'static str,
    /// Version of the headers.
    pub version: Version,
}

/// Version number: major, minor, patch.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Version(pub u32, pub u32, pub u32);

impl fmt::Display for Version {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}.{}.{}", self.0, self.1, self.2)
    }
}

/// File names of the library: first the names that linkers use, then the names in an installation
/// without development files.
const LIBRARIES: [&str; 4] = [
    "libembree4.so",
    "libembree4.dylib",
    "libembree4.so.4",
    "libembree4.4.dylib",
];

const HOW_TO_GET_IT: &str = "\
How to get it:
  make setup                        fetches it into .deps/embree
  apt-get install libembree-dev     on Debian 13, Ubuntu 24.04 and later
  EMBREE_DIR=/prefix                names one of your own: /prefix/include/embree4, /prefix/lib
To build without it:
  cargo build --no-default-features --features cli";

/// Finds the first usable Embree. If the user sets a location that has no usable Embree, this is an
/// error, and other locations are not searched.
///
/// The error is for the user: several lines with the searched locations, their contents, and a
/// remedy.
pub fn discover(places: &Places) -> Result<Embree, String> {
    let named = |what: String, found: Result<Embree, String>| {
        found.map_err(|why| format!("{what} does not lead to Embree 4.\nFound: {why}\n{HOW_TO_GET_IT}"))
    };

    if let Some(prefix) = &places.embree_dir {
        let found = absolute(prefix).and_then(|()| in_prefix(prefix, &places.multiarch));
        return named(format!("EMBREE_DIR={}", prefix.display()), found);
    }

    match (&places.include_dir, &places.lib_dir) {
        (Some(include), Some(lib)) => {
            let what = format!(
                "EMBREE_INCLUDE_DIR={} with EMBREE_LIB_DIR={}",
                include.display(),
                lib.display()
            );
            let found = absolute(include)
                .and_then(|()| absolute(lib))
                .and_then(|()| in_folders(include, std::slice::from_ref(lib)));
            return named(what, found);
        }
        (Some(_), None) => {
            return Err("EMBREE_INCLUDE_DIR is set, so EMBREE_LIB_DIR is needed too.".into());
        }
        (None, Some(_)) => {
            return Err("EMBREE_LIB_DIR is set, so EMBREE_INCLUDE_DIR is needed too.".into());
        }
        (None, None) => {}
    }

    let mut report = String::from("Embree 4 was not found.\nLooked in:\n");
    for prefix in std::iter::once(&places.deps).chain(&places.system) {
        match in_prefix(prefix, &places.multiarch) {
            Ok(embree) => return Ok(embree),
            Err(why) => report += &format!("  {}: {why}\n", prefix.display()),
        }
    }
    Err(report + HOW_TO_GET_IT)
}

/// Usual prefixes of installations, below the root of the file system.
pub fn system_prefixes(root: &Path) -> Vec<PathBuf> {
    // Libraries installed by hand come before the distribution's, as for compilers and loaders.
    let mut prefixes = vec![root.join("usr/local")];

    // Embree's own archives unpack to a folder that ends in the version. In reverse order, the
    // latest version is likely first.
    let opt = fs::read_dir(root.join("opt")).into_iter().flatten().flatten();
    let mut unpacked: Vec<_> = opt
        .map(|entry| entry.path())
        .filter(|path| named_embree(path))
        .collect();
    unpacked.sort();
    prefixes.extend(unpacked.into_iter().rev());

    prefixes.extend(["opt/homebrew", "opt/local", "usr"].map(|prefix| root.join(prefix)));
    prefixes
}

fn named_embree(path: &Path) -> bool {
    path.file_name()
        .is_some_and(|name| name.to_string_lossy().starts_with("embree"))
}

/// Returns true if the dynamic loader does not search this folder by default.
pub fn needs_rpath(lib_dir: &Path, multiarch: &str) -> bool {
    let real = |path: &Path| fs::canonicalize(path).unwrap_or_else(|_| path.into());
    let searched = ["/lib", "/usr/lib", "/lib64", "/usr/lib64"].map(Path::new);
    !searched
        .iter()
        .any(|dir| [real(dir), real(&dir.join(multiarch))].contains(&real(lib_dir)))
}

/// Returns an error if `path` is relative. Cargo runs build scripts in the package's folder, so a
/// relative path would start there, and not in the user's folder.
fn absolute(path: &Path) -> Result<(), String> {
    if path.is_absolute() {
        Ok(())
    } else {
        Err(format!("{} is a relative path", path.display()))
    }
}

/// Embree in `prefix`. The error is one line about the contents of `prefix`.
fn in_prefix(prefix: &Path, multiarch: &str) -> Result<Embree, String> {
    // Most specific first: a plain `lib` may hold the libraries of another architecture.
    let libs = [format!("lib/{multiarch}"), "lib64".into(), "lib".into()].map(|lib| prefix.join(lib));
    in_folders(&prefix.join("include"), &libs)
}

fn in_folders(include: &Path, libs: &[PathBuf]) -> Result<Embree, String> {
    let headers = include.join("embree4");
    if !headers.join("rtcore.h").is_file() {
        let old = include.join("embree3");
        return Err(match header_version(&old) {
            Ok(version) => format!("Embree {version} headers in {}: too old", old.display()),
            Err(_) => format!("no {}", headers.join("rtcore.h").display()),
        });
    }

    let version = header_version(&headers)?;
    if version.0 != 4 {
        return Err(format!(
            "Embree {version} headers in {}: version 4 is needed",
            headers.display()
        ));
    }

    let files = libs.iter().flat_map(|dir| LIBRARIES.map(|library| (dir, library)));
    match files.into_iter().find(|(dir, library)| dir.join(library).is_file()) {
        Some((dir, library)) => Ok(Embree {
            include_dir: include.into(),
            lib_dir: dir.clone(),
            library,
            version,
        }),
        None => {
            let searched: Vec<_> = libs.iter().map(|dir| dir.display().to_string()).collect();
            Err(format!(
                "Embree {version} headers in {}, but no libembree4 in {}",
                headers.display(),
                searched.join(", ")
            ))
        }
    }
}

/// Reads numbers such as `#define RTC_VERSION_MAJOR 4` from `rtcore_config.h`.
fn header_version(headers: &Path) -> Result<Version, String> {
    let config = headers.join("rtcore_config.h");
    let text = fs::read_to_string(&config).map_err(|error| format!("cannot read {}: {error}", config.display()))?;
    let number = |name: &str| {
        text.lines()
            .map(|line| line.split_whitespace().collect::<Vec<_>>())
            .find_map(|words| match words[..] {
                ["#define", defined, value] if defined == name => value.parse().ok(),
                _ => None,
            })
            .ok_or_else(|| format!("no {name} in {}", config.display()))
    };
    Ok(Version(
        number("RTC_VERSION_MAJOR")?,
        number("RTC_VERSION_MINOR")?,
        number("RTC_VERSION_PATCH")?,
    ))
}
