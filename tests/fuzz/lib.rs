//! Shared code of the fuzz targets: one thread, and a folder for files.

mod checks;

use checks::FILE_KINDS;
use std::sync::OnceLock;
use tempfile::TempDir;

static FOLDER: OnceLock<TempDir> = OnceLock::new();

/// Makes this thread the only worker, so that no thread waits for another.
pub fn init() {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).use_current_thread();
    pool.build_global().expect("the first pool");
    // libFuzzer's panic hook ends the process at any panic. Panics that the reader catches are not
    // faults.
    let fatal = std::panic::take_hook();
    std::panic::set_hook(Box::new(move |panic| {
        if !embrasure::files::is_guarded() {
            fatal(panic);
        }
    }));
}

/// Reads `bytes` as a file of the kind `name`.
pub fn check(name: &str, bytes: &[u8]) {
    let kind = FILE_KINDS
        .iter()
        .find(|kind| kind.name == name)
        .expect("a kind of file of this name");
    let folder = FOLDER.get_or_init(|| {
        let folder = tempfile::tempdir().expect("a folder");
        (kind.furnish)(folder.path());
        folder
    });
    (kind.check)(folder.path(), bytes);
}
