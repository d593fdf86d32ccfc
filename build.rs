//! Tells the linker where the Embree library will be found at run time; `embree4-sys` has found it already.

fn main() {
    println!("cargo::rerun-if-changed=build.rs");
    // Empty where the library lies in a system folder, unset where the feature is off.
    match std::env::var("DEP_EMBREE4_RPATH") {
        Ok(folder) if !folder.is_empty() => println!("cargo::rustc-link-arg=-Wl,-rpath,{folder}"),
        _ => {}
    }
}
