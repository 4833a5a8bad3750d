//! `data.yaml`: the part of YAML that describes a YOLO dataset, written and read.

use crate::dataset::Part;
use std::path::{Path, PathBuf};

/// What a `data.yaml` says.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(crate) struct DataYaml {
    path: Option<String>,
    train: Option<String>,
    val: Option<String>,
    nc: Option<usize>,
    names: Vec<String>,
}

/// A fault and its line.
type Fault = (Option<usize>, String);

impl DataYaml {
    /// The folder of a part's images, below the dataset's.
    pub(crate) fn folder(&self, part: Part) -> Option<&str> {
        match part {
            Part::Train => self.train.as_deref(),
            Part::Val => self.val.as_deref(),
        }
    }

    /// Where the folders of the parts are, for a file in `folder`.
    pub(crate) fn root(&self, folder: &Path) -> PathBuf {
        self.path
            .as_deref()
            .map_or_else(|| folder.to_path_buf(), |path| folder.join(path))
    }

    /// Number of classes: of names that are there, whatever `nc` claims.
    pub(crate) fn classes(&self) -> Option<usize> {
        Some(self.names.len()).filter(|&n| n > 0)
    }

    /// Names of the classes, in order.
    pub(crate) fn names(&self) -> &[String] {
        &self.names
    }

    /// The text of a `data.yaml` for our folders.
    pub(crate) fn write(classes: &[String]) -> String {
        Self::write_with(classes, |part| format!("images/{part}"))
    }

    /// The text of a `data.yaml` whose parts lie where `place` says.
    pub(crate) fn write_with(classes: &[String], place: impl Fn(&str) -> String) -> String {
        let mut yaml = String::from(
            "# Folders are relative to this file. YOLOv5: add a line `path: <this folder>`.\n",
        );
        for part in Part::ALL {
            yaml += &format!("{}: {}\n", part.name(), place(part.name()));
        }
        yaml += &format!("nc: {}\nnames:\n", classes.len());
        for (i, name) in classes.iter().enumerate() {
            // A JSON string is a YAML string, whatever is in it.
            yaml += &format!("  {i}: {}\n", serde_json::Value::from(name.as_str()));
        }
        yaml
    }

    /// Reads plain keys, and names as `0: a`, as `- a`, or as `[a, b]`; lists of folders, anchors and the like are not
    /// understood.
    pub(crate) fn read(text: &str) -> (Self, Vec<Fault>) {
        let mut yaml = Self::default();
        let mut faults = Vec::new();
        for (i, line) in text.lines().enumerate() {
            let bare = line.trim();
            if bare.is_empty() || bare.starts_with('#') {
                continue;
            }
            if let Err(what) = yaml.take(line, bare) {
                faults.push((Some(i + 1), what));
            }
        }
        faults.extend(yaml.missing().into_iter().map(|what| (None, what)));
        (yaml, faults)
    }

    fn take(&mut self, line: &str, bare: &str) -> Result<(), String> {
        if let Some(name) = bare.strip_prefix("- ") {
            self.names.push(unquoted(name));
            return Ok(());
        }
        let (key, value) = bare
            .split_once(':')
            .ok_or_else(|| format!("\"{bare}\", expected a key and a value"))?;
        let value = value.trim();
        if line.starts_with(' ') {
            let expected = self.names.len();
            self.names.push(unquoted(value));
            return if key == expected.to_string() {
                Ok(())
            } else {
                Err(format!("class {key}, expected {expected}"))
            };
        }
        match key {
            "path" => self.path = Some(unquoted(value)),
            "train" => self.train = Some(unquoted(value)),
            "val" => self.val = Some(unquoted(value)),
            "nc" => {
                self.nc = Some(
                    value
                        .parse()
                        .map_err(|_| format!("nc: {value}, expected a number"))?,
                )
            }
            "names" => self.names.extend(inline(value)),
            _ => {}
        }
        Ok(())
    }

    fn missing(&self) -> Vec<String> {
        let mut missing = Vec::new();
        for part in Part::ALL
            .iter()
            .filter(|&&part| self.folder(part).is_none())
        {
            missing.push(format!("no {}:, which trainers require", part.name()));
        }
        if self.names.is_empty() {
            missing.push("no names, expected one for each class".into());
        } else if let Some(nc) = self.nc.filter(|&nc| nc != self.names.len()) {
            missing.push(format!(
                "nc: {nc}, but there are {} names",
                self.names.len()
            ));
        }
        missing
    }
}

fn inline(value: &str) -> Vec<String> {
    let list = value
        .strip_prefix('[')
        .and_then(|v| v.strip_suffix(']'))
        .unwrap_or_default();
    list.split(',')
        .map(unquoted)
        .filter(|name| !name.is_empty())
        .collect()
}

fn unquoted(text: &str) -> String {
    let text = text.trim();
    serde_json::from_str(text).unwrap_or_else(|_| text.trim_matches('\'').to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_written_reads_back() {
        let classes = ["cap_label", "yes", "a: \"b\" # c", "ö"].map(String::from);
        let (yaml, faults) = DataYaml::read(&DataYaml::write(&classes));
        assert_eq!((yaml.names, faults), (classes.to_vec(), vec![]));
        assert_eq!(yaml.train.as_deref(), Some("images/train"));
    }

    #[test]
    fn names_may_be_a_list() {
        for names in ["names: [cap, 'none']\n", "names:\n- cap\n- \"none\"\n"] {
            let (yaml, faults) = DataYaml::read(&format!("train: a\nval: b\n{names}"));
            assert_eq!(
                (yaml.names.as_slice(), faults),
                (&["cap", "none"].map(String::from)[..], vec![])
            );
        }
    }

    #[test]
    fn faults_name_their_line() {
        let (_, faults) = DataYaml::read("train: a\nnc: two\nnames:\n  0: cap\n  2: none\n");
        assert_eq!(faults[0], (Some(2), "nc: two, expected a number".into()));
        assert_eq!(faults[1], (Some(5), "class 2, expected 1".into()));
        assert_eq!(faults[2], (None, "no val:, which trainers require".into()));
    }
}
