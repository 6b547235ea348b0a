//! The house rules that a compiler does not check: who may depend on what, and what stays out of the source.

use std::collections::BTreeSet;
use std::path::PathBuf;
use std::process::Command;
use vasos_tests::{root, sources};

/// Windows and what draws in them.
const WINDOW: [&str; 11] = [
    "egui",
    "eframe",
    "epaint",
    "winit",
    "glutin",
    "glow",
    "wgpu",
    "rfd",
    "arboard",
    "accesskit",
    "rust-i18n",
];
/// File formats and recorders.
const FORMATS: [&str; 16] = [
    "rerun",
    "re_",
    "toml",
    "csv",
    "serde_json",
    "serde-saphyr",
    "parquet",
    "arrow",
    "quick-xml",
    "zip",
    "image",
    "encoding_rs",
    "bincode",
    "postcard",
    "hdf5",
    "matfile",
];
/// Other colours of [`eframe::egui::Color32`] say nothing of their own.
const COLOURLESS: [&str; 2] = ["TRANSPARENT", "PLACEHOLDER"];
const MOST_LINES: usize = 600;

/// Names of all crates that a package is built from.
fn tree(package: &str) -> BTreeSet<String> {
    let output = Command::new(env!("CARGO"))
        .args([
            "tree",
            "--package",
            package,
            "--edges",
            "normal,build",
            "--prefix",
            "none",
            "--format",
            "{p}",
        ])
        .args(["--offline", "--locked"])
        .current_dir(root())
        .output()
        .expect("cargo runs");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let names = String::from_utf8(output.stdout).expect("text");
    let names = names.lines().filter_map(|line| line.split(' ').next());
    names.filter(|name| !name.is_empty()).map(str::to_owned).collect()
}

/// Those of a tree that are a forbidden crate or one of its family.
fn of_families<'a>(tree: &'a BTreeSet<String>, families: &[&str]) -> Vec<&'a str> {
    let belongs = |name: &str, family: &str| {
        name.strip_prefix(family)
            .is_some_and(|rest| rest.is_empty() || rest.starts_with(['-', '_']) || family.ends_with('_'))
    };
    let names = tree.iter().map(String::as_str);
    names.filter(|name| families.iter().any(|family| belongs(name, family))).collect()
}

fn all_sources() -> Vec<(PathBuf, String)> {
    let all: Vec<_> = ["app", "engine", "io", "tests"].into_iter().flat_map(sources).collect();
    assert!(all.len() > 50, "only {} source files found", all.len());
    all
}

/// Lines without those that are comments, numbered from 1.
fn code(text: &str) -> impl Iterator<Item = (usize, &str)> {
    text.lines().enumerate().map(|(i, l)| (i + 1, l)).filter(|(_, l)| !l.trim_start().starts_with("//"))
}

#[test]
fn the_engine_knows_no_window_no_file_format_and_no_layer_above() {
    let tree = tree("vasos-engine");
    assert!(tree.contains("nalgebra"), "the tree was read: {tree:?}");
    for families in [&WINDOW[..], &FORMATS[..], &["vasos-io", "vasos-app"]] {
        let found = of_families(&tree, families);
        assert!(found.is_empty(), "vasos-engine is built from {found:?}");
    }
}

/// Rerun brings `ecolor` and `emath` for its values; they draw nothing.
#[test]
fn files_and_recordings_know_no_window() {
    let tree = tree("vasos-io");
    assert!(tree.contains("rerun"), "the tree was read: {tree:?}");
    for families in [&WINDOW[..], &["vasos-app"]] {
        let found = of_families(&tree, families);
        assert!(found.is_empty(), "vasos-io is built from {found:?}");
    }
}

#[test]
fn colours_live_in_the_theme_file() {
    let words = |line: &str, after: &str| -> Vec<String> {
        let word = |rest: &str| rest.chars().take_while(|c| c.is_alphanumeric() || *c == '_').collect();
        line.split(after).skip(1).map(word).collect()
    };
    let is_colour = |name: &String| {
        name.starts_with("from_")
            || name.chars().all(|c| c.is_ascii_uppercase() || c == '_')
                && !COLOURLESS.contains(&name.as_str())
    };
    let mut found = Vec::new();
    for (path, text) in sources("app").iter().filter(|(path, _)| !path.ends_with("theme.rs")) {
        for (number, line) in code(text) {
            let named = ["Color32::", "Rgba::"].iter().flat_map(|after| words(line, after));
            if named.filter(is_colour).count() > 0 || line.contains("hex_color!") || line.contains("Hsva::") {
                found.push(format!("{}:{number}: {}", path.display(), line.trim()));
            }
        }
    }
    assert!(found.is_empty(), "colours outside theme.rs:\n{}", found.join("\n"));
}

#[test]
fn no_file_is_two() {
    let lengths = all_sources().into_iter().map(|(path, text)| (text.lines().count(), path));
    let long: Vec<_> = lengths.filter(|(lines, _)| *lines > MOST_LINES).collect();
    assert!(long.is_empty(), "files over {MOST_LINES} lines: {long:?}");
}

#[test]
fn no_code_steps_outside_the_compilers_checks() {
    let word = concat!("un", "safe");
    let alone = |c: Option<char>| !c.is_some_and(|c| c.is_alphanumeric() || c == '_');
    for (path, text) in all_sources() {
        for (number, line) in code(&text) {
            for (at, _) in line.match_indices(word) {
                let (before, after) = (line[..at].chars().last(), line[at + word.len()..].chars().next());
                // The policy of a page has a word of its own that begins so.
                let of_a_page = line[at + word.len()..].starts_with("-inline'");
                assert!(of_a_page || !(alone(before) && alone(after)), "{}:{number}: {line}", path.display());
            }
        }
    }
}
