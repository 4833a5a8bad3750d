//! `data.yaml`: the description of a YOLO dataset, written and read.
//!
//! It is read event by event with `saphyr-parser`: unneeded values are skipped without being built,
//! aliases are followed only for texts and lists of texts, and findings name their line.

use crate::dataset::Part;
use saphyr_parser::{Event, Parser, ScalarStyle, ScanError, Span, StrInput};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// Content of a `data.yaml`.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(crate) struct DataYaml {
    path: Option<String>,
    train: Vec<String>,
    val: Vec<String>,
    /// The folders (or lists) of test images, below the dataset's; often none.
    pub(crate) test: Vec<String>,
    nc: Option<usize>,
    /// Names of the classes, in order.
    pub(crate) names: Vec<String>,
    /// The line of `kpt_shape`, and how many numbers the keypoints in a label have according to it,
    /// or what is wrong with it; none for labels without keypoints.
    keypoints: Option<(usize, Result<usize, String>)>,
}

/// Maximum number of classes that are numbered if there is only `nc`.
const MAX_NUMBERED_CLASSES: usize = 10_000;

/// Maximum number of keypoints of an object.
const MAX_KEYPOINTS: usize = 10_000;

/// The problem of a set whose labels have keypoints.
const KEYPOINTS: &str = "kpt_shape: labels with keypoints, expected boxes (class cx cy w h) or outlines and no kpt_shape";

/// A line, if known, and what is wrong there.
type Problem = (Option<usize>, String);

impl DataYaml {
    /// The folders (or lists) of a part's images, below the dataset's.
    pub(crate) fn folders(&self, part: Part) -> &[String] {
        match part {
            Part::Train => &self.train,
            Part::Val => &self.val,
        }
    }

    /// The folder that those of the parts are relative to, for a file in `folder`.
    pub(crate) fn root(&self, folder: &Path) -> PathBuf {
        self.path
            .as_deref()
            .map_or_else(|| folder.to_path_buf(), |path| folder.join(path))
    }

    /// The message about a folder or list of images that does not exist.
    pub(crate) fn why_missing(&self) -> &'static str {
        match self
            .path
            .as_deref()
            .is_some_and(|path| Path::new(path).is_relative())
        {
            true => {
                "no such folder or list: a relative `path` is taken from the folder of data.yaml"
            }
            false => "no such folder or list",
        }
    }

    /// Number of classes that have a name, even if it is only a number, whatever `nc` is; none
    /// without names.
    pub(crate) fn class_count(&self) -> Option<usize> {
        Some(self.names.len()).filter(|&n| n > 0)
    }

    /// The text of a `data.yaml` for our folders.
    pub(crate) fn write(classes: &[String]) -> String {
        Self::write_with(classes, &[], |part| format!("images/{part}"))
    }

    /// The text of a `data.yaml` whose parts are at the paths that `place` returns, with these test
    /// paths.
    pub(crate) fn write_with(
        classes: &[String],
        test: &[String],
        place: impl Fn(&str) -> String,
    ) -> String {
        let mut yaml = String::from(
            "# Folders are relative to this file. YOLOv5: add a line `path: <whole path of this folder>`.\n",
        );
        for part in Part::ALL {
            yaml += &format!("{}: {}\n", part.name(), place(part.name()));
        }
        if !test.is_empty() {
            // A JSON list of strings is a YAML one, whatever the strings contain.
            yaml += &format!("test: {}\n", serde_json::Value::from(test));
        }
        yaml += &format!("nc: {}\nnames:\n", classes.len());
        yaml + &yaml_names(classes)
    }

    /// Reads the keys that trainers need; all others are skipped. What could be read is kept,
    /// whatever else is wrong.
    pub(crate) fn read(text: &str) -> (Self, Vec<Problem>) {
        let (yaml, mut problems) = Self::read_given(text);
        problems.extend(yaml.keypoint_problem());
        problems.extend(yaml.missing().into_iter().map(|what| (None, what)));
        (yaml, problems)
    }

    /// Only the names of the classes, whatever else is missing; also for labels with keypoints.
    pub(crate) fn read_names(text: &str) -> Result<Vec<String>, Problem> {
        let (yaml, problems) = Self::read_given(text);
        let unnamed = yaml.names_problem().map(|what| (None, what));
        match problems.into_iter().next().or(unnamed) {
            None => Ok(yaml.names),
            Some(problem) => Err(problem),
        }
    }

    /// How many numbers the keypoints in a label have according to `kpt_shape`, whatever else is
    /// wrong; 0 without it.
    pub(crate) fn read_keypoint_numbers(text: &str) -> Result<usize, Problem> {
        match Self::read_given(text).0.keypoints {
            None => Ok(0),
            Some((line, numbers)) => numbers.map_err(|what| (Some(line), what)),
        }
    }

    /// The content, and what is wrong with it; keypoints are wrong only for some readers.
    fn read_given(text: &str) -> (Self, Vec<Problem>) {
        let (mut yaml, mut problems) = (Self::default(), Vec::new());
        let read = Reader::new(text).read_keys(|key, line, value| {
            if let Err((value_line, what)) = yaml.set(key, line, value) {
                problems.push((Some(value_line.unwrap_or(line)), what));
            }
        });
        problems.extend(read.err());
        yaml.number_classes();
        (yaml, problems)
    }

    /// Names the classes as Ultralytics does if there is only `nc`.
    fn number_classes(&mut self) {
        let count = self.nc.filter(|&nc| nc <= MAX_NUMBERED_CLASSES);
        if self.names.is_empty() {
            let numbers = 0..count.unwrap_or(0);
            self.names = numbers.map(|i| format!("class_{i}")).collect();
        }
    }

    fn set(&mut self, key: &str, line: usize, value: Value) -> Result<(), Problem> {
        match key {
            "path" => self.path = value.texts(key)?.pop(),
            "train" => self.train = value.texts(key)?,
            "val" => self.val = value.texts(key)?,
            // As Ultralytics renames it.
            "validation" if self.val.is_empty() => self.val = value.texts(key)?,
            "test" => self.test = value.texts(key)?,
            "nc" => self.nc = Some(value.count(key)?),
            "names" => return self.set_names(value),
            "kpt_shape" => {
                let is_given = !matches!(value, Value::Null);
                self.keypoints = is_given.then(|| (line, value.keypoint_numbers(key)));
            }
            _ => {}
        }
        Ok(())
    }

    /// Names as `[a, b]` or as `0: a`, in any order, with no number left out.
    fn set_names(&mut self, value: Value) -> Result<(), Problem> {
        let Value::Map(mut entries) = value else {
            self.names = value.texts("names")?;
            return match self.names.is_empty() {
                true => Err((None, "names: none, expected one for each class".into())),
                false => Ok(()),
            };
        };
        entries.sort_by_key(|(_, key, _)| key.parse().unwrap_or(usize::MAX));
        let mut wrong = Ok(());
        // If a key is repeated, trainers use the last value.
        self.names.clear();
        for (expected, (line, key, name)) in entries.into_iter().enumerate() {
            if wrong.is_ok() && key != expected.to_string() {
                wrong = Err((Some(line), format!("class {key}, expected {expected}")));
            }
            self.names.push(name);
        }
        wrong
    }

    fn keypoint_problem(&self) -> Option<Problem> {
        let (line, numbers) = self.keypoints.as_ref()?;
        let what = numbers.as_ref().err().map_or(KEYPOINTS, String::as_str);
        Some((Some(*line), what.to_owned()))
    }

    fn missing(&self) -> Vec<String> {
        let parts = Part::ALL.into_iter();
        parts
            .filter(|&part| self.folders(part).is_empty())
            .map(|part| format!("no {}:, which trainers require", part.name()))
            .chain(self.names_problem())
            .collect()
    }

    fn names_problem(&self) -> Option<String> {
        let count = self.names.len();
        if count == 0 {
            return Some("no names, expected one for each class".into());
        }
        let nc = self.nc.filter(|&nc| nc != count)?;
        Some(format!("nc: {nc}, but there are {count} names"))
    }
}

/// A value of the document, as far as a `data.yaml` needs one.
#[derive(Clone, Debug)]
enum Value {
    /// Nothing, or `null`.
    Null,
    Text(String),
    List(Vec<String>),
    /// Line, key and value of each entry.
    Map(Vec<(usize, String, String)>),
    /// Nested lists and the like.
    Other,
}

impl Value {
    /// One text or a list of texts.
    fn texts(self, key: &str) -> Result<Vec<String>, Problem> {
        match self {
            Self::Null => Ok(Vec::new()),
            Self::Text(text) => Ok(vec![text]),
            Self::List(texts) => Ok(texts),
            Self::Map(_) | Self::Other => Err((
                None,
                format!("{key}: not understood, expected a text or a list of texts"),
            )),
        }
    }

    fn count(&self, key: &str) -> Result<usize, Problem> {
        let (found, number) = match self {
            Self::Text(text) => (text.as_str(), text.parse().ok()),
            _ => ("no number", None),
        };
        number.ok_or_else(|| (None, format!("{key}: {found}, expected a number")))
    }

    /// Points by the numbers of each.
    fn keypoint_numbers(&self, key: &str) -> Result<usize, String> {
        let texts: &[String] = match self {
            Self::List(texts) => &texts[..],
            _ => &[],
        };
        let numbers = texts.iter().map(|text| text.parse::<usize>().ok());
        match numbers.collect::<Option<Vec<_>>>().as_deref() {
            Some(&[points @ 1..=MAX_KEYPOINTS, each @ 2..=3]) => Ok(points * each),
            _ => Err(format!("{key}: expected [number of points, 2 or 3]")),
        }
    }

    fn bytes(&self) -> usize {
        match self {
            Self::Null | Self::Other => 0,
            Self::Text(text) => text.len(),
            Self::List(texts) => texts.iter().map(|text| text.len() + 1).sum(),
            Self::Map(entries) => entries.iter().map(|(_, k, v)| k.len() + v.len() + 1).sum(),
        }
    }
}

/// Plain texts that mean null.
const NULLS: [&str; 5] = ["", "~", "null", "Null", "NULL"];

/// Deeper documents are rejected: a parser's work grows with the square of the depth.
const MAX_DEPTH: usize = 64;

/// Aliases may add this many times the document's length, which stops "billion laughs".
const MAX_ALIAS_GROWTH: usize = 4;

/// The events of a document.
struct Reader<'a> {
    parser: Parser<'a, StrInput<'a>>,
    anchors: BTreeMap<usize, Value>,
    /// Bytes that aliases may still add.
    alias_budget: usize,
}

impl<'a> Reader<'a> {
    fn new(text: &'a str) -> Self {
        Self {
            parser: Parser::new_from_str(text),
            anchors: BTreeMap::new(),
            alias_budget: MAX_ALIAS_GROWTH * text.len(),
        }
    }

    /// Passes each key of the first document with its line and value to `set`.
    fn read_keys(&mut self, mut set: impl FnMut(&str, usize, Value)) -> Result<(), Problem> {
        if !self.enter_document()? {
            return Ok(());
        }
        loop {
            let (event, span) = self.next()?;
            if matches!(event, Event::MappingEnd) {
                return Ok(());
            }
            let key = self.value(event)?;
            let (event, _) = self.next()?;
            let value = self.value(event)?;
            if let Value::Text(key) = key {
                set(&key, span.start.line(), value);
            }
        }
    }

    /// Goes to the first key; false if there is none.
    fn enter_document(&mut self) -> Result<bool, Problem> {
        loop {
            match self.next()?.0 {
                Event::MappingStart(..) => return Ok(true),
                Event::StreamEnd | Event::DocumentEnd => return Ok(false),
                Event::Scalar(..) | Event::SequenceStart(..) | Event::Alias(_) => {
                    return Err((None, "expected keys and values".into()));
                }
                _ => {}
            }
        }
    }

    fn next(&mut self) -> Result<(Event<'a>, Span), Problem> {
        match self.parser.next_event() {
            Some(Ok(event)) => Ok(event),
            Some(Err(e)) => Err(not_yaml(&e)),
            None => Ok((Event::StreamEnd, Span::default())),
        }
    }

    /// The value that begins with an event.
    fn value(&mut self, event: Event<'a>) -> Result<Value, Problem> {
        let (anchor, value) = match event {
            Event::Alias(anchor) => return self.alias(anchor),
            Event::Scalar(text, style, anchor, _) => (anchor, scalar(&text, style)),
            Event::SequenceStart(anchor, _) => (anchor, self.list()?),
            Event::MappingStart(anchor, _) => (anchor, self.map()?),
            _ => return Ok(Value::Null),
        };
        if anchor > 0 {
            self.anchors.insert(anchor, value.clone());
        }
        Ok(value)
    }

    fn alias(&mut self, anchor: usize) -> Result<Value, Problem> {
        let value = self.anchors.get(&anchor).cloned().unwrap_or(Value::Other);
        let left = self.alias_budget.checked_sub(value.bytes());
        self.alias_budget = left.ok_or((None, "aliases repeat too much text".into()))?;
        Ok(value)
    }

    /// The rest of a list; [`Value::Other`] if anything in it is not text.
    fn list(&mut self) -> Result<Value, Problem> {
        let (mut texts, mut is_plain) = (Vec::new(), true);
        loop {
            let (event, _) = self.next()?;
            if matches!(event, Event::SequenceEnd | Event::StreamEnd) {
                break;
            }
            match self.text(event)? {
                Some(text) => texts.push(text),
                None => is_plain = false,
            }
        }
        Ok(if is_plain {
            Value::List(texts)
        } else {
            Value::Other
        })
    }

    /// The rest of a mapping; [`Value::Other`] if anything in it is not text.
    fn map(&mut self) -> Result<Value, Problem> {
        let (mut entries, mut is_plain) = (Vec::new(), true);
        loop {
            let (event, span) = self.next()?;
            if matches!(event, Event::MappingEnd | Event::StreamEnd) {
                break;
            }
            let key = self.text(event)?;
            let (event, _) = self.next()?;
            match key.zip(self.text(event)?) {
                Some((key, text)) => entries.push((span.start.line(), key, text)),
                None => is_plain = false,
            }
        }
        Ok(if is_plain {
            Value::Map(entries)
        } else {
            Value::Other
        })
    }

    /// The text that an event is or refers to; none, skipping it, for anything else.
    fn text(&mut self, event: Event<'a>) -> Result<Option<String>, Problem> {
        let is_collection = matches!(event, Event::SequenceStart(..) | Event::MappingStart(..));
        if is_collection {
            self.skip()?;
            return Ok(None);
        }
        Ok(match self.value(event)? {
            Value::Text(text) => Some(text),
            Value::Null => Some(String::new()),
            _ => None,
        })
    }

    /// Skips the rest of a list or mapping.
    fn skip(&mut self) -> Result<(), Problem> {
        let mut depth = 1;
        while depth > 0 {
            let (event, span) = self.next()?;
            match event {
                Event::SequenceStart(..) | Event::MappingStart(..) => depth += 1,
                Event::SequenceEnd | Event::MappingEnd => depth -= 1,
                Event::StreamEnd => return Ok(()),
                _ => {}
            }
            if depth > MAX_DEPTH {
                let what = format!("more than {MAX_DEPTH} levels");
                return Err((Some(span.start.line()), what));
            }
        }
        Ok(())
    }
}

/// The entries below `names:`.
pub(crate) fn yaml_names(classes: &[String]) -> String {
    let names = classes.iter().enumerate();
    names
        // A JSON string is a YAML string, whatever it contains.
        .map(|(i, name)| format!("  {i}: {}\n", serde_json::Value::from(name.as_str())))
        .collect()
}

fn scalar(text: &str, style: ScalarStyle) -> Value {
    match style {
        ScalarStyle::Plain if NULLS.contains(&text) => Value::Null,
        _ => Value::Text(text.to_owned()),
    }
}

fn not_yaml(error: &ScanError) -> Problem {
    let what = format!("not YAML: {}", error.info());
    (Some(error.marker().line()), what)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_written_reads_back() {
        let classes = ["cap_label", "yes", "a: \"b\" # c", "ö"].map(String::from);
        let (yaml, faults) = DataYaml::read(&DataYaml::write(&classes));
        assert_eq!((yaml.names, faults), (classes.to_vec(), vec![]));
        assert_eq!(yaml.train, ["images/train"]);
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
    fn names_go_by_their_numbers() {
        let (yaml, faults) = DataYaml::read("train: a\nval: b\nnames:\n  1: none\n  0: cap\n");
        assert_eq!(
            (yaml.names, faults),
            (["cap", "none"].map(String::from).to_vec(), vec![])
        );
    }

    #[test]
    fn of_names_that_stand_twice_the_last_count() {
        for last in ["names:\n  0: cap\n  1: none\n", "names: [cap, none]\n"] {
            let text = format!("train: a\nval: b\nnames:\n  0: old\n{last}");
            let (yaml, faults) = DataYaml::read(&text);
            assert_eq!(
                (yaml.names, faults),
                (["cap", "none"].map(String::from).to_vec(), vec![])
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

    #[test]
    fn files_of_other_programs_are_read() {
        let ultralytics = "# COCO8 by Ultralytics\npath: ../datasets/coco8 # dataset root dir\n\
            train: images/train\nval: images/val\ntest: # optional\n\nnames:\n  0: person\n  1: bicycle\n\n\
            download: |\n  names: [x]\n  0: y\n";
        let (yaml, problems) = DataYaml::read(ultralytics);
        assert_eq!(problems, []);
        assert_eq!(
            yaml.root(Path::new("/d")),
            Path::new("/d/../datasets/coco8")
        );
        assert_eq!(yaml.names, ["person", "bicycle"]);
        let roboflow = "train: ../train/images\nval: ../valid/images\n\nnc: 2\nnames: ['cap', \"la, bel\"]\n\n\
            roboflow:\n  workspace: w\n  version: 3\n  tags: [a, [b]]\n";
        let (yaml, problems) = DataYaml::read(roboflow);
        assert_eq!(
            (problems, yaml.names),
            (vec![], vec!["cap".into(), "la, bel".into()])
        );
    }

    #[test]
    fn what_ultralytics_adds_is_added() {
        let (yaml, problems) = DataYaml::read("train: a\nvalidation: b\nnc: 2\n");
        assert_eq!(problems, []);
        assert_eq!(
            (yaml.val, yaml.names),
            (
                vec!["b".into()],
                ["class_0", "class_1"].map(String::from).to_vec()
            )
        );
        for text in ["validation: a\nval: b\n", "val: b\nvalidation: a\n"] {
            assert_eq!(DataYaml::read(text).0.val, ["b"]);
        }
        let (yaml, problems) = DataYaml::read("train: a\nval: b\nnc: 999999999999\n");
        assert_eq!((yaml.names.len(), problems.len()), (0, 1));
    }

    #[test]
    fn keypoints_are_named() {
        let text = "train: a\nval: b\nnames: [cap]\nkpt_shape: [4, 2]\n";
        let (_, problems) = DataYaml::read(text);
        assert_eq!(problems.len(), 1);
        assert_eq!(problems[0], (Some(4), KEYPOINTS.into()));
        for shape in ["[4, 2]", "17"] {
            let names = DataYaml::read_names(&format!("kpt_shape: {shape}\nnames: [cap]\n"));
            assert_eq!(names, Ok(vec!["cap".into()]), "{shape}");
        }
        let numbers = DataYaml::read_keypoint_numbers;
        assert_eq!(numbers(text), Ok(8));
        assert_eq!(numbers("names: 3\nkpt_shape:\n"), Ok(0));
        // If a key is repeated, trainers use the last value.
        assert_eq!(numbers("kpt_shape: [4, 3]\nkpt_shape:\n"), Ok(0));
        let expected = "kpt_shape: expected [number of points, 2 or 3]";
        for bad in ["17", "[17]", "[17, 4]", "[0, 3]"] {
            let told = numbers(&format!("kpt_shape: {bad}\n"));
            assert_eq!(told, Err((Some(1), expected.into())), "{bad}");
        }
    }

    #[test]
    fn lists_of_folders_and_anchors_are_followed() {
        let text = "train: &both\n  - a.txt\n  - b.txt\nval: *both\nnames: [&n cap, *n]\n";
        let (yaml, problems) = DataYaml::read(text);
        assert_eq!(problems, []);
        assert_eq!(
            (yaml.val, yaml.names),
            (vec!["a.txt".into(), "b.txt".into()], vec!["cap".into(); 2])
        );
    }

    #[test]
    fn hostile_documents_end_soon() {
        let deep_flow = format!("x: {}", "[".repeat(1 << 20));
        assert!(!DataYaml::read(&deep_flow).1.is_empty());
        let deep_block = format!("x:\n{}a", "- ".repeat(1 << 20));
        let problems = DataYaml::read(&deep_block).1;
        assert!(problems[0].1.contains("levels"), "{:?}", problems[0]);
        let laughs = format!(
            "a: &a {}\nnames: [{}]\n",
            "x".repeat(1 << 16),
            "*a, ".repeat(1 << 16)
        );
        let (yaml, problems) = DataYaml::read(&laughs);
        assert!(problems[0].1.contains("aliases"), "{:?}", problems[0]);
        assert!(yaml.names.is_empty());
        for text in [
            "[",
            "- a",
            "a",
            "{",
            "? [a]: b",
            "names: *nowhere",
            "\u{0}",
            "a: b: c",
        ] {
            assert!(!DataYaml::read(text).1.is_empty(), "{text}");
        }
    }
}
