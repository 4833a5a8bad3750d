//! A page of text, tables, charts and pictures in one HTML file that needs nothing else.

use super::Table;
use crate::error::printable;

/// A self-contained HTML page, built from top to bottom.
#[derive(Clone, Debug)]
pub struct Page {
    title: String,
    body: String,
}

/// Looks like a report and not like a web site; wide things scroll inside their own frame.
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
    pub fn heading(&mut self, text: &str) -> &mut Self {
        self.html(&format!("<h2>{}</h2>\n", escaped(text)))
    }

    /// Starts a part of a section.
    pub fn subheading(&mut self, text: &str) -> &mut Self {
        self.html(&format!("<h3>{}</h3>\n", escaped(text)))
    }

    /// A paragraph.
    pub fn text(&mut self, text: &str) -> &mut Self {
        self.html(&format!("<p>{}</p>\n", escaped(text)))
    }

    /// A table.
    pub fn table(&mut self, table: &Table) -> &mut Self {
        self.html(&format!("<figure>{}</figure>\n", table.html()))
    }

    /// The first rows of a table that may be long, and where the others are.
    pub fn beginning(&mut self, table: &Table, rows: usize, file: &str) -> &mut Self {
        self.table(&Table {
            columns: table.columns.clone(),
            rows: table.rows.iter().take(rows).cloned().collect(),
        });
        match table.rows.len().saturating_sub(rows) {
            0 => self,
            more => self.text(&format!("{more} more rows are in {file}.")),
        }
    }

    /// A drawing with what is to be seen in it; `svg` is an SVG document, e.g. of [`Chart::row`](super::Chart::row).
    pub fn chart(&mut self, svg: &str, caption: &str) -> &mut Self {
        self.html(&format!(
            "<figure>{svg}<figcaption>{}</figcaption></figure>\n",
            escaped(caption)
        ))
    }

    /// A picture with what is to be seen in it; `png` are the bytes of a PNG file.
    pub fn picture(&mut self, png: &[u8], caption: &str) -> &mut Self {
        let data = base64(png);
        self.html(&format!(
            "<figure><img alt=\"\" src=\"data:image/png;base64,{data}\"><figcaption>{}</figcaption></figure>\n",
            escaped(caption)
        ))
    }

    /// Markup as it is.
    pub fn html(&mut self, markup: &str) -> &mut Self {
        self.body += markup;
        self
    }

    /// The whole document.
    pub fn document(&self) -> String {
        let Self { title, body } = self;
        let title = escaped(title);
        format!(
            "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n<title>{title}</title>\n\
             <style>{STYLE}</style>\n</head>\n<body>\n<h1>{title}</h1>\n{body}</body>\n</html>\n"
        )
    }
}

/// Text as it may stand in HTML and SVG, attributes included; control characters, which SVG does not allow, are written out.
pub fn escaped(text: &str) -> String {
    printable(text)
        .replace('&', "&amp;")
        .replace('<', "&lt;")
        .replace('>', "&gt;")
        .replace('"', "&quot;")
}

/// Bytes in the alphabet of RFC 4648 section 4, padded.
pub fn base64(bytes: &[u8]) -> String {
    const ALPHABET: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let mut text = String::with_capacity(bytes.len().div_ceil(3) * 4);
    for group in bytes.chunks(3) {
        let word = group
            .iter()
            .fold(0_u32, |word, &b| word << 8 | u32::from(b))
            << (8 * (3 - group.len()));
        for i in 0..4 {
            let code = ALPHABET[(word >> (18 - 6 * i) & 63) as usize];
            text.push(if i <= group.len() {
                char::from(code)
            } else {
                '='
            });
        }
    }
    text
}

#[cfg(test)]
mod tests {
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
