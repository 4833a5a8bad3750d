//! Names of runs: after their predictions, and unique.

use std::path::{Component, Path, PathBuf};

/// The name of the file or folder; for one called `labels`, as YOLO programs save their detections,
/// that of its parent folder.
pub fn run_name(path: &Path) -> String {
    let run = path.parent().and_then(Path::file_name);
    match (run, path.file_stem()) {
        (Some(run), _) if path.ends_with("labels") => run.to_string_lossy().into_owned(),
        (_, Some(stem)) => stem.to_string_lossy().into_owned(),
        _ => path.display().to_string(),
    }
}

/// Unique names of the runs, with as many parent folders as necessary; numbered if folders do not
/// distinguish them.
pub fn run_names(paths: &[PathBuf]) -> Vec<String> {
    let runs: Vec<Vec<String>> = paths.iter().map(|path| run_steps(path)).collect();
    let names = (1..).zip(&runs);
    names
        .map(|(i, steps)| match own_ending(steps, &runs) {
            Some(name) => name,
            None => format!("{}-{i}", run_name(&paths[i - 1])),
        })
        .collect()
}

/// The parent folders of a run, and its name.
fn run_steps(path: &Path) -> Vec<String> {
    let run = if path.ends_with("labels") {
        path.parent()
    } else {
        Some(path)
    };
    let above = run.and_then(Path::parent).unwrap_or(Path::new(""));
    let above = above.components();
    let above = above.filter(|c| matches!(c, Component::Normal(_) | Component::ParentDir));
    let above = above.map(|folder| folder.as_os_str().to_string_lossy().into_owned());
    above.chain([run_name(path)]).collect()
}

/// The shortest suffix of a path that no other run's path has, or all of it if it is a suffix of
/// another's; none if another has the same steps.
fn own_ending(steps: &[String], runs: &[Vec<String>]) -> Option<String> {
    let twins = runs.iter().filter(|run| run.as_slice() == steps);
    if twins.count() > 1 {
        return None;
    }
    let count = |ending: &[String]| runs.iter().filter(|run| run.ends_with(ending)).count();
    let mut endings = (0..steps.len()).rev().map(|first| &steps[first..]);
    let own = endings.find(|ending| count(ending) == 1);
    Some(own.unwrap_or(steps).join("/"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_run_is_called_as_its_file_or_the_folder_around_its_labels() {
        let name = |path: &str| run_name(Path::new(path));
        assert_eq!(name("runs/r1/labels"), "r1");
        assert_eq!(name("runs/r1.v2/labels/"), "r1.v2");
        assert_eq!(name("labels"), "labels");
        assert_eq!(name("found/coco.json"), "coco");
    }

    #[test]
    fn runs_of_one_name_are_told_apart_by_their_folders_or_numbers() {
        let names = |paths: &[&str]| run_names(&Vec::from_iter(paths.iter().map(PathBuf::from)));
        assert_eq!(
            names(&["exp1/p.json", "exp2/p.json", "exp2/q.json"]),
            ["exp1/p", "exp2/p", "q"]
        );
        assert_eq!(names(&["a/r/labels", "b/r/labels/"]), ["a/r", "b/r"]);
        assert_eq!(names(&["p.json", "exp/p.json"]), ["p", "exp/p"]);
        assert_eq!(names(&["p.json", "./p.json"]), ["p-1", "p-2"]);
    }
}
