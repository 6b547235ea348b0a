//! The translation files are read when the crate is compiled; a changed sentence must compile it again.

fn main() {
    println!("cargo::rerun-if-changed=../assets/locales");
}
