//! A page of text, tables, charts and pictures in one self-contained HTML file.

use super::Table;
use super::markup::text;
use maud::{DOCTYPE, Markup, PreEscaped, html};

/// A self-contained HTML page, built from top to bottom.
#[derive(Clone, Debug)]
pub struct Page {
    title: String,
    body: String,
}

/// Looks like a report, not like a web site; wide content scrolls inside its own frame.
const STYLE: &str = "body{font:15px/1.5 sans-serif;max-width:1100px;margin:2em auto;padding:0 1em;color:#222}\
    table{border-collapse:collapse;margin:1em 0;font-size:13px}\
    th,td{border:1px solid #ccc;padding:2px 8px;text-align:left;min-width:3.5em;max-width:32em;overflow-wrap:anywhere}\
    th{background:#f2f2f2;overflow-wrap:normal}h1,h2,p{overflow-wrap:anywhere}\
    figure{margin:1em 0;overflow-x:auto}figcaption{color:#555;font-size:13px;overflow-wrap:anywhere}\
    img,svg{max-width:100%}";

impl Page {
    /// An empty page.
    pub fn new(title: impl Into<String>) -> Self {
        Self {
            title: title.into(),
            body: String::new(),
        }
    }

    /// Starts a section.
    pub fn heading(&mut self, heading: &str) -> &mut Self {
        self.push(html! { h2 { (text(heading)) } })
    }

    /// Starts a subsection.
    pub fn subheading(&mut self, heading: &str) -> &mut Self {
        self.push(html! { h3 { (text(heading)) } })
    }

    /// A paragraph.
    pub fn text(&mut self, paragraph: &str) -> &mut Self {
        self.push(html! { p { (text(paragraph)) } })
    }

    /// A table.
    pub fn table(&mut self, table: &Table) -> &mut Self {
        self.push(html! { figure { (PreEscaped(table.html())) } })
    }

    /// The first rows of a table that may be long, and the name of the file with all of them.
    pub fn beginning(&mut self, table: &Table, rows: usize, file: &str) -> &mut Self {
        self.table(&table.first_rows(rows));
        match table.rows.len().saturating_sub(rows) {
            0 => self,
            more => self.text(&format!("{more} more rows are in {file}.")),
        }
    }

    /// A drawing with a caption; `svg` is an SVG document, e.g. from
    /// [`Chart::row`](super::Chart::row).
    pub fn chart(&mut self, svg: &str, caption: &str) -> &mut Self {
        self.push(html! { figure { (PreEscaped(svg)) figcaption { (text(caption)) } } })
    }

    /// A picture with a caption; `png` is the content of a PNG file.
    pub fn picture(&mut self, png: &[u8], caption: &str) -> &mut Self {
        let data = format!("data:image/png;base64,{}", base64(png));
        self.push(html! { figure { img alt="" src=(data); figcaption { (text(caption)) } } })
    }

    /// Adds markup unchanged.
    pub fn html(&mut self, markup: &str) -> &mut Self {
        self.body += markup;
        self
    }

    fn push(&mut self, markup: Markup) -> &mut Self {
        self.body += &markup.0;
        self.body.push('\n');
        self
    }

    /// The whole document.
    pub fn document(&self) -> String {
        html! {
            (DOCTYPE)
            html lang="en" {
                head {
                    meta charset="utf-8";
                    title { (text(&self.title)) }
                    style { (PreEscaped(STYLE)) }
                }
                body {
                    h1 { (text(&self.title)) }
                    (PreEscaped(&self.body))
                }
            }
        }
        .into_string()
    }
}

/// Bytes encoded as Base64 (RFC 4648 section 4), padded.
pub fn base64(bytes: &[u8]) -> String {
    let mut text = String::with_capacity(bytes.len().div_ceil(3) * 4);
    for group in bytes.chunks(3) {
        let letters = base64_letters(group);
        text.extend(&letters[..=group.len()]);
        text.extend(std::iter::repeat_n('=', 3 - group.len()));
    }
    text
}

/// The letters of three bytes; those of missing bytes are meaningless.
fn base64_letters(group: &[u8]) -> [char; 4] {
    const ALPHABET: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let word = group
        .iter()
        .fold(0_u32, |word, &b| word << 8 | u32::from(b));
    let word = word << (8 * (3 - group.len()));
    [18, 12, 6, 0].map(|shift| char::from(ALPHABET[(word >> shift & 63) as usize]))
}

#[cfg(test)]
mod tests {
    use super::super::markup::escaped;
    use super::*;

    #[test]
    fn base64_is_that_of_the_rfc() {
        let told =
            ["", "f", "fo", "foo", "foob", "fooba", "foobar"].map(|text| base64(text.as_bytes()));
        assert_eq!(
            told,
            [
                "", "Zg==", "Zm8=", "Zm9v", "Zm9vYg==", "Zm9vYmE=", "Zm9vYmFy"
            ]
        );
    }

    #[test]
    fn a_page_needs_no_other_file_and_keeps_text_as_text() {
        let mut page = Page::new("a < b");
        page.heading("one")
            .text("<script>")
            .picture(b"foo", "a \"picture\"");
        let html = page.document();
        assert!(html.contains("<title>a &lt; b</title>") && html.contains("&lt;script&gt;"));
        assert!(html.contains("data:image/png;base64,Zm9v") && !html.contains("http"));
        assert_eq!(escaped("\u{1b}[2J\n<"), "\\x1b[2J\\n&lt;");
    }
}
