#![no_main]

libfuzzer_sys::fuzz_target!(init: embrasure_fuzz::init(), |bytes: &[u8]| embrasure_fuzz::check("rendering", bytes));
