//! The header that is committed is the one that the crate makes.
use std::{fs, path::Path};

#[test]
fn the_header_is_made_of_this_crate() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR"));
    let config = cbindgen::Config::from_file(folder.join("cbindgen.toml")).unwrap();
    let made = cbindgen::Builder::new().with_crate(folder).with_config(config).generate().unwrap();
    let mut text = Vec::new();
    made.write(&mut text);
    let (made, committed) = (String::from_utf8(text).unwrap(), folder.join("include/monorange_core.h"));
    if std::env::var_os("MONORANGE_WRITE_HEADER").is_some() {
        fs::write(&committed, &made).unwrap();
    }
    let there = fs::read_to_string(committed).unwrap_or_default();
    assert!(made == there, "write it anew: MONORANGE_WRITE_HEADER=1 cargo test -p monorange-c --test header");
}
