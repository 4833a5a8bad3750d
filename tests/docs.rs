//! What the documentation says is what the code has.

#![cfg(feature = "pipeline")]

use petcomp::Code;
use std::fs;
use std::path::Path;

/// Set, the pages are written instead of compared.
const UPDATE: &str = "PETCOMP_UPDATE_DOCS";

#[test]
fn every_code_is_in_the_table_of_diagnostics() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/diagnostics.md");
    let page = diagnostics();
    if std::env::var_os(UPDATE).is_some() {
        fs::write(&path, &page).unwrap();
    }
    let written = fs::read_to_string(&path).unwrap();
    assert_eq!(written, page, "set {UPDATE}=1 to write it");
}

fn diagnostics() -> String {
    let rows: String = Code::ALL
        .iter()
        .map(|code| format!("| `{code}` | {} |\n", code.meaning()))
        .collect();
    format!(
        "# Diagnostics\n\n\
         Every diagnostic has a code, a severity and a message. Codes are stable; messages may change. The severities are `note`\n\
         (for information; `dataset check --strict` fails), `warning` (the result may be wrong, so review it;\n\
         `asset check --strict` fails) and `error` (the result cannot be used). Diagnostics appear on standard error, in\n\
         `assets.toml`, in `NAME.camera.json` and in the output of the `check` commands.\n\n\
         | code | meaning |\n| --- | --- |\n{rows}"
    )
}

#[test]
fn every_page_of_the_book_is_in_its_summary() {
    let docs = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs");
    let summary = fs::read_to_string(docs.join("SUMMARY.md")).unwrap();
    for entry in fs::read_dir(&docs).unwrap() {
        let name = entry.unwrap().file_name().into_string().unwrap();
        let listed = summary.contains(&format!("({name})"));
        assert!(
            !name.ends_with(".md") || name == "SUMMARY.md" || listed,
            "{name}"
        );
    }
}

#[test]
fn the_readme_is_short() {
    let readme = include_str!("../README.md");
    assert!(readme.split_whitespace().count() < 900);
}
