//! Every arrow points down: which room of the library may use which, written down in one place.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::Path;

/// The rooms of `src`, floor by floor from the ground up. A room uses those on floors below its
/// own.
const FLOORS: &[&[&str]] = &[
    &[
        "diagnostic",
        "error",
        "geom",
        "lru",
        "pixel",
        "quality",
        "quantile",
        "stopwatch",
        "work",
    ],
    &["image"],
    &[
        "allowance",
        "bounds",
        "color",
        "deep",
        "draw",
        "filter",
        "names",
        "plot",
    ],
    &["diff", "io"],
    &["camera", "matte"],
    &["capture"],
    &["asset"],
    &["scene"],
    &["label", "light", "settle"],
    &["eval", "render"],
    &["composite"],
    &["dataset"],
    &["train"],
    &["fuzzing"],
];

/// A module by its path below the crate: `["camera", "solve"]`.
type Module = Vec<String>;

#[test]
fn every_room_uses_rooms_on_lower_floors_alone() {
    let floor = |room: &str| FLOORS.iter().position(|rooms| rooms.contains(&room));
    let mut upward = BTreeSet::new();
    for (module, used) in arrows() {
        let here = floor(&module[0]).unwrap_or_else(|| panic!("no floor has {}", module[0]));
        let bad = used.iter().filter(|other| other[0] != module[0]);
        upward.extend(
            bad.filter(|other| floor(&other[0]).is_some_and(|there| there >= here))
                .map(|other| format!("{} uses {}", module.join("::"), other[0])),
        );
    }
    assert_eq!(upward, BTreeSet::new());
}

#[test]
fn no_two_files_import_each_other() {
    let arrows = arrows();
    let circles: Vec<_> = arrows
        .keys()
        .filter(|module| reachable(&arrows, module).contains(*module))
        .map(|module| module.join("::"))
        .collect();
    assert_eq!(circles, Vec::<String>::new(), "are in a circle");
}

/// Every module that can be reached from one, by one arrow or more.
fn reachable(arrows: &BTreeMap<Module, BTreeSet<Module>>, from: &Module) -> BTreeSet<Module> {
    let mut found = BTreeSet::new();
    let mut open = vec![from];
    while let Some(module) = open.pop() {
        for next in arrows.get(module).into_iter().flatten() {
            if found.insert(next.clone()) {
                open.push(next);
            }
        }
    }
    found
}

/// Which modules each module imports; what lies above and below it in its own folder is left out.
fn arrows() -> BTreeMap<Module, BTreeSet<Module>> {
    let source = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let mut files = BTreeMap::new();
    collect(&source, &Vec::new(), &mut files);
    let known: BTreeSet<Module> = files.keys().cloned().collect();
    let imports = files.iter().map(|(module, code)| {
        let used = paths(code)
            .into_iter()
            .filter_map(|path| resolved(&path, module, &known))
            .filter(|other| !other.starts_with(module) && !module.starts_with(other));
        (module.clone(), used.collect())
    });
    imports.collect()
}

/// The code of every module below a folder, without its tests.
fn collect(folder: &Path, at: &Module, files: &mut BTreeMap<Module, String>) {
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        let name = path.file_stem().unwrap().to_string_lossy().into_owned();
        let inner = [at.as_slice(), std::slice::from_ref(&name)].concat();
        if path.is_dir() && name != "tests" {
            collect(&path, &inner, files);
        } else if path.extension().is_some_and(|e| e == "rs")
            && !["lib", "tests"].contains(&name.as_str())
        {
            let module = if name == "mod" { at.clone() } else { inner };
            let text = fs::read_to_string(&path).unwrap();
            files.insert(module, code_of(&text));
        }
    }
}

/// What is compiled into the library, without comments.
fn code_of(text: &str) -> String {
    let code = text.split("#[cfg(test)]\nmod ").next().unwrap_or_default();
    let lines = code
        .lines()
        .map(|line| line.split("//").next().unwrap_or_default());
    lines.collect::<Vec<_>>().join("\n")
}

/// Every path in the code that begins with `crate` or `super`; of a group, each of its members.
fn paths(code: &str) -> Vec<Module> {
    let mut found = Vec::new();
    for start in ["crate::", "super::"] {
        for (at, _) in code.match_indices(start) {
            let before = code[..at].chars().next_back();
            if !before.is_some_and(|c| c.is_alphanumeric() || c == '_' || c == ':') {
                members(&code[at..], &mut Vec::new(), &mut found);
            }
        }
    }
    found
}

/// Reads one path, or a group of them, and gives the code behind it.
fn members<'a>(code: &'a str, before: &mut Module, found: &mut Vec<Module>) -> &'a str {
    let code = code.trim_start();
    if let Some(mut rest) = code.strip_prefix('{') {
        loop {
            rest = members(rest, &mut before.clone(), found).trim_start();
            match rest.strip_prefix(',') {
                Some(more) => rest = more,
                None => return rest.strip_prefix('}').unwrap_or(rest),
            }
        }
    }
    let end = code
        .find(|c: char| !(c.is_alphanumeric() || c == '_'))
        .unwrap_or(code.len());
    before.push(code[..end].to_owned());
    match code[end..].strip_prefix("::") {
        Some(rest) => members(rest, before, found),
        None => {
            found.push(before.clone());
            code[end..].trim_start_matches(|c: char| c.is_alphanumeric() || c == ' ' || c == '_')
        }
    }
}

/// The module that a path leads into, seen from a module.
fn resolved(path: &Module, from: &Module, known: &BTreeSet<Module>) -> Option<Module> {
    let mut at = match path[0].as_str() {
        "crate" => Vec::new(),
        _ => from.clone(),
    };
    for name in path.iter().filter(|name| *name != "crate") {
        if name == "super" {
            at.pop();
            continue;
        }
        let inner = [at.as_slice(), std::slice::from_ref(name)].concat();
        if !known.contains(&inner) {
            break;
        }
        at = inner;
    }
    (!at.is_empty()).then_some(at)
}
