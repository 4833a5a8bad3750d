//! A recipe's text with some of its keys set, all else as its author wrote it.

use crate::error::Result;
use crate::io::{self, Override};

/// A key by its path and its value as TOML.
pub(super) type KeyText = (String, String);

/// The text with these keys set: in place of their line, or of the line that shows their default,
/// or at the beginning of their table.
///
/// A text in which that is not possible (tables within lines) is written anew, without its
/// comments; the second value says so.
///
/// # Errors
/// A text that is not TOML; a key that cannot be there.
pub(super) fn with_keys(text: &str, keys: &[KeyText]) -> Result<(String, bool)> {
    let wanted = document_with(text, keys)?;
    let edited = keys.iter().fold(lines_of(text), with_key).join("\n") + "\n";
    let found: Option<toml::Table> = edited.parse().ok();
    if found.as_ref() == Some(&wanted) {
        return Ok((edited, true));
    }
    Ok((wanted.to_string(), false))
}

/// What the edited text must say.
fn document_with(text: &str, keys: &[KeyText]) -> Result<toml::Table> {
    let overrides: Result<Vec<Override>> = keys
        .iter()
        .map(|(path, value)| format!("{path}={value}").parse())
        .collect();
    io::from_table_with(io::parse_toml(text)?, &overrides?)
}

fn lines_of(text: &str) -> Vec<String> {
    text.lines().map(str::to_owned).collect()
}

fn with_key(mut lines: Vec<String>, (path, value): &KeyText) -> Vec<String> {
    match line_of_key(&lines, path) {
        Some((at, key)) => {
            let comment = lines[at].find(" #").map_or("", |from| &lines[at][from..]);
            lines[at] = format!("{key} = {value}{comment}");
        }
        None => add_key(&mut lines, path, value),
    }
    lines
}

/// Adds a key that no line sets.
fn add_key(lines: &mut Vec<String>, path: &str, value: &str) {
    let (table, key) = path.rsplit_once('.').unwrap_or(("", path));
    let line = format!("{key} = {value}");
    match section(lines, table) {
        Some((from, to)) => match default_line(&lines[from..to], key) {
            Some(at) => lines[from + at] = line,
            None => lines.insert(from, line),
        },
        None => lines.extend([String::new(), format!("[{table}]"), line]),
    }
}

/// The line that sets a key, and the key as it is called there: `start.spread` within `[scene]`.
fn line_of_key<'a>(lines: &[String], path: &'a str) -> Option<(usize, &'a str)> {
    let dots = path.match_indices('.').map(|(at, _)| at);
    let splits = std::iter::once(("", path)).chain(dots.map(|at| (&path[..at], &path[at + 1..])));
    splits.into_iter().find_map(|(table, key)| {
        let (from, to) = section(lines, table)?;
        let sets = |line: &String| key_of(line) == Some(key);
        Some((from + lines[from..to].iter().position(sets)?, key))
    })
}

/// The key that a line sets.
fn key_of(line: &str) -> Option<&str> {
    let (key, _) = line.split_once('=')?;
    Some(key.trim()).filter(|key| !key.starts_with('#'))
}

/// The line of a template that shows a key's default: `#scale = [0.9, 1.1]`.
fn default_line(lines: &[String], key: &str) -> Option<usize> {
    let shows = |line: &String| {
        let shown = line.strip_prefix('#').and_then(key_of);
        shown == Some(key)
    };
    lines.iter().position(shows)
}

/// The lines of a table behind its header; those before any header for the document's own.
fn section(lines: &[String], table: &str) -> Option<(usize, usize)> {
    let header = |line: &String| header_of(line).is_some();
    let from = match table {
        "" => 0,
        _ => {
            1 + lines
                .iter()
                .position(|line| header_of(line) == Some(table))?
        }
    };
    let length = lines[from..].iter().position(header);
    Some((from, length.map_or(lines.len(), |length| from + length)))
}

/// The table that a line begins; a list's entry keeps its second bracket.
fn header_of(line: &str) -> Option<&str> {
    let (table, rest) = line.trim().strip_prefix('[')?.rsplit_once(']')?;
    let rest = rest.trim_start();
    (rest.is_empty() || rest.starts_with('#')).then_some(table.trim())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dataset::DatasetConfig;

    fn edited(text: &str, keys: &[(&str, &str)]) -> (String, bool) {
        let keys: Vec<KeyText> = keys
            .iter()
            .map(|(path, value)| ((*path).to_owned(), (*value).to_owned()))
            .collect();
        with_keys(text, &keys).unwrap()
    }

    #[test]
    fn comments_stay_where_they_are() {
        let text = "# mine\nassets = 'a' # here\n\n[scene] # drawn\n# many\nobjects = 3 # by hand\nstart.x = 0\n";
        let keys = [
            ("scene.objects", "[4, 5]"),
            ("scene.start.x", "[0, 1]"),
            ("scene.scale", "2"),
            ("scene.finish.camera_noise.shot", "0.1"),
            ("backgrounds", "\"b\""),
        ];
        let expected = "backgrounds = \"b\"\n# mine\nassets = 'a' # here\n\n[scene] # drawn\nscale = 2\n# many\n\
            objects = [4, 5] # by hand\nstart.x = [0, 1]\n\n[scene.finish.camera_noise]\nshot = 0.1\n";
        assert_eq!(edited(text, &keys), (expected.to_owned(), true));
    }

    #[test]
    fn a_key_takes_the_place_of_its_default_in_the_template() {
        let keys = [
            ("scene.start.spread", "[0.5, 0.75]"),
            ("scene.objects", "{ values = [3, 4], weights = [1, 2] }"),
            ("scene.finish.camera_noise.read", "0.01"),
        ];
        let (text, is_kept) = edited(DatasetConfig::template(), &keys);
        assert!(is_kept);
        // The spread has no line of a default.
        assert_eq!(
            text.lines().count(),
            DatasetConfig::template().lines().count() + 1
        );
        let config: DatasetConfig = toml::from_str(&text).unwrap();
        assert_eq!(config.scene.finish.camera_noise.read.min, 0.01);
        assert_eq!(config.scene.start.spread.unwrap().max, 0.75);
    }

    #[test]
    fn a_table_within_a_line_is_written_anew() {
        let text = "# gone\n[scene]\nfinish = { sharpening = 1 }\n";
        let (text, is_kept) = edited(text, &[("scene.finish.exposure_ev", "0.5")]);
        assert!(!is_kept);
        let config: DatasetConfig = toml::from_str(&text).unwrap();
        assert_eq!(config.scene.finish.exposure_ev.min, 0.5);
        assert_eq!(config.scene.finish.sharpening.min, 1.0);
    }

    #[test]
    fn what_is_no_recipe_is_refused() {
        assert!(with_keys("scene = 3\n", &[("scene.scale".into(), "1".into())]).is_err());
        assert!(with_keys("[scene\n", &[]).is_err());
    }
}
