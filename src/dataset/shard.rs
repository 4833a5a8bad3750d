//! Which samples of a dataset a run generates: all, one machine's share, or one.

use crate::dataset::WebDataset;
use crate::error::{Error, Result};
use serde::{Deserialize, Serialize};
use std::fmt;
use std::path::{Path, PathBuf};
use std::str::FromStr;

/// Which samples of a dataset a run generates.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum SampleRange {
    /// All missing samples.
    #[default]
    All,
    /// The missing samples of a shard.
    Shard(Shard),
    /// This one, whether it exists or not.
    One(u64),
    /// The missing samples from the first number up to, but not including, the second.
    Span(u64, u64),
}

impl SampleRange {
    /// Whether sample `k` is one of them.
    pub fn contains(self, k: u64) -> bool {
        match self {
            Self::All => true,
            Self::Shard(shard) => shard.contains(k),
            Self::One(one) => k == one,
            Self::Span(first, end) => (first..end).contains(&k),
        }
    }

    /// Fails if a single requested sample is not below `count`.
    pub(crate) fn check(self, count: u64) -> Result<()> {
        match self {
            Self::One(k) if k >= count => {
                let what = format!("{k}, expected a number below the number of images, {count}");
                Err(Error::value("only", what))
            }
            _ => Ok(()),
        }
    }

    /// Where they are written, given the folder of the dataset: a shard has one of its own, unless it generates
    /// archives.
    #[doc(hidden)]
    pub fn folder(self, dataset: &Path, archives: Option<WebDataset>) -> PathBuf {
        match (self, archives) {
            (Self::Shard(shard), None) => dataset.join(shard.folder()),
            _ => dataset.into(),
        }
    }

    /// Those of them that are less than `count`, in order.
    pub(crate) fn below(self, count: u64) -> impl Iterator<Item = u64> + Send {
        let (first, step, end) = self.steps(count);
        (first..end).step_by(usize::try_from(step).unwrap_or(usize::MAX))
    }

    /// How many of them are less than `count`.
    pub(crate) fn count_below(self, count: u64) -> u64 {
        let (first, step, end) = self.steps(count);
        end.saturating_sub(first).div_ceil(step)
    }

    /// The first of them, the step to the next, and the end.
    fn steps(self, count: u64) -> (u64, u64, u64) {
        match self {
            Self::All => (0, 1, count),
            Self::Shard(Shard { index, of }) => (index.saturating_sub(1), of.max(1), count),
            Self::One(k) => (k, 1, count.min(k.saturating_add(1))),
            Self::Span(first, end) => (first, 1, count.min(end)),
        }
    }
}

/// A share of the samples, every `of`-th: each machine generates its own and none has to know of
/// another.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Shard {
    /// Which shard, from 1.
    pub index: u64,
    /// Number of shards.
    pub of: u64,
}

impl fmt::Display for Shard {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}/{}", self.index, self.of)
    }
}

impl Shard {
    /// The shard, if it is possible.
    ///
    /// # Errors
    /// An index that is not in `1..=of`.
    pub fn new(index: u64, of: u64) -> Result<Self> {
        let shard = Self { index, of };
        match shard.expectation() {
            None => Ok(shard),
            Some(expected) => {
                let what = format!("{shard}, expected {expected}");
                Err(Error::value("shard", what))
            }
        }
    }

    /// The shard that a variable of the environment gives, if it is possible.
    fn of_variable(name: &str, value: u64, index: u64, of: u64) -> Result<Self> {
        let shard = Self { index, of };
        match shard.expectation() {
            None => Ok(shard),
            Some(expected) => {
                let what = format!("{value} is shard {shard}, expected {expected}");
                Err(Error::value(name, what))
            }
        }
    }

    /// What is expected instead of an impossible shard; none if it is possible.
    fn expectation(self) -> Option<String> {
        let Self { index, of } = self;
        match index {
            _ if of == 0 => Some("at least one shard".into()),
            0 => Some(format!("1/{of} to {of}/{of}")),
            _ if index > of => Some(format!("at most {of}/{of}")),
            _ => None,
        }
    }

    /// Whether sample `k` belongs to it.
    pub fn contains(self, k: u64) -> bool {
        k.checked_rem(self.of)
            .is_some_and(|rest| rest + 1 == self.index)
    }

    /// Name of its folder: in order of name, shards are in order of number.
    pub fn folder(self) -> String {
        let digits = self.of.to_string().len();
        format!("shard-{:0digits$}-of-{}", self.index, self.of)
    }
}

/// The argument of `--shard`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ShardChoice {
    /// `3/8`.
    Given(Shard),
    /// `auto` or `auto/8`: taken from the cluster's environment, see [`ShardChoice::within`].
    Auto {
        /// Number of shards, if the environment does not give it.
        of: Option<u64>,
    },
}

impl FromStr for ShardChoice {
    type Err = Error;

    fn from_str(text: &str) -> Result<Self> {
        parse_choice(text).unwrap_or_else(|| {
            let what = format!("\"{text}\", expected I/N, auto or auto/N");
            Err(Error::value("shard", what))
        })
    }
}

impl ShardChoice {
    /// The selected shard; `variable` returns environment variables.
    ///
    /// `auto` supports the tasks of a Slurm array (`SLURM_ARRAY_TASK_ID` with `_MIN`, `_MAX`, `_STEP` and `_COUNT`),
    /// the children of an AWS Batch array job (`AWS_BATCH_JOB_ARRAY_INDEX`, from 0, and `AWS_BATCH_JOB_ARRAY_SIZE`) and
    /// the pods of an indexed Kubernetes job (`JOB_COMPLETION_INDEX`, from 0; `auto/N` gives the number of shards,
    /// since Kubernetes does not).
    ///
    /// Slurm does not tell resubmitted tasks which array they were in: `auto` requires an array of all tasks, `auto/N`
    /// accepts any tasks of an array from 1 to N.
    ///
    /// # Errors
    /// An environment with none of these; an array with gaps, or without its first tasks; for
    /// `auto/N` an array from 0; invalid numbers.
    pub fn within(self, variable: impl Fn(&str) -> Option<String>) -> Result<Shard> {
        let of = match self {
            Self::Given(shard) => return Ok(shard),
            Self::Auto { of } => of,
        };
        let environment = JobEnvironment { variable };
        let slurm = environment.number("SLURM_ARRAY_TASK_ID")?;
        let aws = environment.number("AWS_BATCH_JOB_ARRAY_INDEX")?;
        match (slurm, aws) {
            (Some(id), _) => environment.slurm_shard(id, of),
            (None, Some(index)) => environment.aws_batch_shard(index, of),
            (None, None) => environment.kubernetes_shard(of),
        }
    }
}

fn parse_choice(text: &str) -> Option<Result<ShardChoice>> {
    let Some((index, of)) = text.split_once('/') else {
        return (text == "auto").then_some(Ok(ShardChoice::Auto { of: None }));
    };
    let of = of.parse().ok()?;
    if index == "auto" {
        return (of > 0).then_some(Ok(ShardChoice::Auto { of: Some(of) }));
    }
    Some(Shard::new(index.parse().ok()?, of).map(ShardChoice::Given))
}

/// What a scheduler tells a job through environment variables.
struct JobEnvironment<V> {
    variable: V,
}

impl<V: Fn(&str) -> Option<String>> JobEnvironment<V> {
    fn number(&self, name: &str) -> Result<Option<u64>> {
        (self.variable)(name)
            .map(|text| parse_number(name, &text))
            .transpose()
    }

    fn kubernetes_shard(&self, of: Option<u64>) -> Result<Shard> {
        let name = "JOB_COMPLETION_INDEX";
        let Some(index) = self.number(name)? else {
            let what = "auto, but none of SLURM_ARRAY_TASK_ID, AWS_BATCH_JOB_ARRAY_INDEX and JOB_COMPLETION_INDEX is set; \
                        otherwise use I/N";
            return Err(Error::value("shard", what));
        };
        let of = of.ok_or_else(|| {
            let what = "Kubernetes does not give the number of shards: use auto/N";
            Error::value("shard", what)
        })?;
        Shard::of_variable(name, index, index.saturating_add(1), of)
    }

    fn aws_batch_shard(&self, index: u64, of: Option<u64>) -> Result<Shard> {
        let of = of.or(self.number("AWS_BATCH_JOB_ARRAY_SIZE")?);
        let of = of.ok_or_else(|| {
            let what = "AWS_BATCH_JOB_ARRAY_SIZE is not set: use auto/N";
            Error::value("shard", what)
        })?;
        let name = "AWS_BATCH_JOB_ARRAY_INDEX";
        Shard::of_variable(name, index, index.saturating_add(1), of)
    }

    /// The shard of a task of a Slurm array.
    fn slurm_shard(&self, id: u64, of: Option<u64>) -> Result<Shard> {
        let first = self.number("SLURM_ARRAY_TASK_MIN")?;
        match of {
            Some(of) => shard_of_task(id, first, of),
            None => self.slurm_shard_of_all(id, first.unwrap_or(0)),
        }
    }

    /// The same for an array that has a task for every shard.
    fn slurm_shard_of_all(&self, id: u64, first: u64) -> Result<Shard> {
        check_first_task(first)?;
        let step = self.number("SLURM_ARRAY_TASK_STEP")?.unwrap_or(1).max(1);
        let of = self.slurm_task_count(first, step)?.ok_or_else(|| {
            let what = "SLURM_ARRAY_TASK_COUNT is not set: use auto/N";
            Error::value("shard", what)
        })?;
        let index = (tasks_before(id, first)? / step).saturating_add(1);
        Shard::of_variable("SLURM_ARRAY_TASK_ID", id, index, of)
    }

    /// Number of tasks; fails for an array with gaps.
    fn slurm_task_count(&self, first: u64, step: u64) -> Result<Option<u64>> {
        let count = self.number("SLURM_ARRAY_TASK_COUNT")?;
        let last = self.number("SLURM_ARRAY_TASK_MAX")?;
        if let (Some(count), Some(last)) = (count, last) {
            check_all_tasks(count, first, last, step)?;
        }
        Ok(count)
    }
}

fn parse_number(name: &str, text: &str) -> Result<u64> {
    let number = text.trim().parse();
    number.map_err(|_| Error::value(name, format!("\"{text}\", expected a number")))
}

/// The shard of a task by its number alone, whichever tasks its array has.
fn shard_of_task(id: u64, first: Option<u64>, of: u64) -> Result<Shard> {
    if id > 0 && first != Some(0) {
        return Shard::of_variable("SLURM_ARRAY_TASK_ID", id, id, of);
    }
    let what = format!("an array from 0, expected 1-{of} for auto/{of}; otherwise use I/{of}");
    Err(Error::value("SLURM_ARRAY_TASK_MIN", what))
}

/// An array that begins later resubmits some tasks of another one.
fn check_first_task(first: u64) -> Result<()> {
    if first <= 1 {
        return Ok(());
    }
    let what = format!(
        "{first}, expected 0 or 1: tasks are missing; to repeat tasks of an array 1-N use auto/N, of any other array I/N"
    );
    Err(Error::value("SLURM_ARRAY_TASK_MIN", what))
}

fn tasks_before(id: u64, first: u64) -> Result<u64> {
    id.checked_sub(first).ok_or_else(|| {
        let what = format!("{id}, expected at least {first}");
        Error::value("SLURM_ARRAY_TASK_ID", what)
    })
}

/// An array with gaps would not generate a whole dataset.
fn check_all_tasks(count: u64, first: u64, last: u64, step: u64) -> Result<()> {
    if count > 0 && last.checked_sub(first) == (count - 1).checked_mul(step) {
        return Ok(());
    }
    let what =
        format!("{count} tasks from {first} to {last}: tasks are missing, expected all of 1-N");
    Err(Error::value("SLURM_ARRAY_TASK_COUNT", what))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn within(text: &str, variables: &[(&str, &str)]) -> std::result::Result<String, String> {
        let find = |name: &str| {
            variables
                .iter()
                .find(|(n, _)| *n == name)
                .map(|(_, v)| (*v).to_string())
        };
        let shard = text
            .parse::<ShardChoice>()
            .and_then(|choice| choice.within(find));
        shard.map(|s| s.to_string()).map_err(|e| e.to_string())
    }

    #[test]
    fn every_sample_belongs_to_one_shard() {
        for of in 1..7 {
            let shards: Vec<Shard> = (1..=of)
                .map(|index| Shard::new(index, of).unwrap())
                .collect();
            assert!((0..50).all(|k| shards.iter().filter(|s| s.contains(k)).count() == 1));
        }
    }

    #[test]
    fn numbers_are_counted_without_counting() {
        let shard = |index, of| SampleRange::Shard(Shard { index, of });
        for numbers in [
            SampleRange::All,
            SampleRange::One(0),
            SampleRange::One(7),
            SampleRange::One(49),
            shard(1, 3),
            shard(3, 3),
            shard(9, 9),
            SampleRange::Span(3, 9),
        ] {
            for count in [0, 1, 7, 8, 50] {
                let wanted: Vec<u64> = (0..count).filter(|&k| numbers.contains(k)).collect();
                let at = format!("{numbers:?} below {count}");
                assert_eq!(numbers.count_below(count), wanted.len() as u64, "{at}");
                assert_eq!(numbers.below(count).collect::<Vec<_>>(), wanted, "{at}");
            }
        }
        let last = SampleRange::One(u64::MAX - 1).below(u64::MAX);
        assert_eq!(last.collect::<Vec<_>>(), [u64::MAX - 1]);
        assert_eq!(shard(2, u64::MAX).count_below(u64::MAX), 1);
    }

    #[test]
    fn a_shard_that_cannot_be_holds_nothing() {
        for (index, of) in [(1, 0), (0, 4), (0, 0), (u64::MAX, u64::MAX)] {
            assert!(!Shard { index, of }.contains(3));
        }
        assert!(Shard::new(1, 0).is_err());
    }

    #[test]
    fn a_shard_is_given_by_hand() {
        assert_eq!(within("3/8", &[]).unwrap(), "3/8");
        let refused = |text| within(text, &[]).unwrap_err();
        assert_eq!(refused("0/8"), "shard: 0/8, expected 1/8 to 8/8");
        assert_eq!(refused("9/8"), "shard: 9/8, expected at most 8/8");
        for wrong in ["3", "3/", "a/b", "auto/x", "auto/0", ""] {
            let expected = "expected I/N, auto or auto/N";
            assert!(refused(wrong).contains(expected), "{wrong}");
        }
    }

    #[test]
    fn a_slurm_array_tells_the_shard() {
        let array = |id, min, max, step, count| {
            let v = [
                ("ID", id),
                ("MIN", min),
                ("MAX", max),
                ("STEP", step),
                ("COUNT", count),
            ];
            let named: Vec<(String, &str)> = v
                .iter()
                .map(|(n, v)| (format!("SLURM_ARRAY_TASK_{n}"), *v))
                .collect();
            let named: Vec<(&str, &str)> = named.iter().map(|(n, v)| (n.as_str(), *v)).collect();
            within("auto", &named)
        };
        assert_eq!(array("3", "1", "4", "1", "4").unwrap(), "3/4");
        assert_eq!(array("0", "0", "6", "2", "4").unwrap(), "1/4");
        assert_eq!(array("6", "0", "6", "2", "4").unwrap(), "4/4");
        let holes = array("7", "0", "7", "1", "3").unwrap_err();
        assert!(holes.contains("tasks are missing"), "{holes}");
        let wrong = array("x", "0", "7", "1", "8").unwrap_err();
        assert!(wrong.contains("\"x\", expected a number"), "{wrong}");
    }

    #[test]
    fn repeated_tasks_of_a_slurm_array_keep_their_shards() {
        let repeated = |text, id, first| {
            let count = [
                ("SLURM_ARRAY_TASK_COUNT", "1"),
                ("SLURM_ARRAY_TASK_MAX", id),
            ];
            let task = [("SLURM_ARRAY_TASK_ID", id), ("SLURM_ARRAY_TASK_MIN", first)];
            within(text, &[task, count].concat())
        };
        assert_eq!(repeated("auto/4", "3", "3").unwrap(), "3/4");
        assert_eq!(repeated("auto/4", "4", "2").unwrap(), "4/4");
        for (text, id, first) in [
            ("auto", "3", "3"),
            ("auto/4", "0", "0"),
            ("auto/4", "3", "0"),
        ] {
            let refused = repeated(text, id, first).unwrap_err();
            assert!(
                refused.starts_with("SLURM_ARRAY_TASK_MIN: ") && refused.contains(" use "),
                "{refused}"
            );
        }
    }

    #[test]
    fn an_indexed_job_tells_its_index_but_not_of_how_many() {
        let pod = [("JOB_COMPLETION_INDEX", "0")];
        assert_eq!(within("auto/8", &pod).unwrap(), "1/8");
        assert!(within("auto", &pod).unwrap_err().contains("use auto/N"));
        let told = within("auto/4", &[("JOB_COMPLETION_INDEX", "4")]).unwrap_err();
        let expected = "JOB_COMPLETION_INDEX: 4 is shard 5/4, expected at most 4/4";
        assert_eq!(told, expected);
        assert!(within("auto", &[]).unwrap_err().contains("none of"));
        let most = u64::MAX.to_string();
        for variable in ["JOB_COMPLETION_INDEX", "SLURM_ARRAY_TASK_ID"] {
            let refused = within("auto/4", &[(variable, &most)]).unwrap_err();
            assert!(refused.starts_with(variable), "{refused}");
            assert!(refused.contains("expected at most 4/4"), "{refused}");
        }
    }

    #[test]
    fn an_aws_batch_array_tells_the_shard() {
        let index = ("AWS_BATCH_JOB_ARRAY_INDEX", "2");
        let size = ("AWS_BATCH_JOB_ARRAY_SIZE", "8");
        assert_eq!(within("auto", &[index, size]).unwrap(), "3/8");
        assert_eq!(within("auto/4", &[index, size]).unwrap(), "3/4");
        assert!(within("auto", &[index]).unwrap_err().contains("use auto/N"));
        let beyond = [("AWS_BATCH_JOB_ARRAY_INDEX", "8"), size];
        assert!(within("auto", &beyond).unwrap_err().contains("at most 8/8"));
    }

    #[test]
    fn folders_of_shards_are_in_order() {
        let names: Vec<String> = (1..=12)
            .map(|i| Shard { index: i, of: 12 }.folder())
            .collect();
        assert!(names.is_sorted());
        assert_eq!(names[0], "shard-01-of-12");
    }
}
