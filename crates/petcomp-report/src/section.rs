//! Sections of a document of measurements, which becomes an HTML page, Markdown, and a data file
//! for each table and plot.

use super::Diagram;
use petcomp::Result;
use petcomp::io;
use petcomp::plot::{Page, Table, escaped};
use std::path::Path;

/// A part of a document under a heading of its own.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Section {
    /// Its title.
    pub(crate) title: String,
    parts: Vec<SectionPart>,
}

#[derive(Clone, Debug, PartialEq)]
enum SectionPart {
    Text(String),
    Table {
        file: String,
        table: Table,
    },
    Figure {
        file: String,
        svg: String,
        caption: String,
        data: Table,
    },
}

impl Section {
    /// An empty section.
    pub(crate) fn new(title: impl Into<String>) -> Self {
        Self {
            title: title.into(),
            parts: Vec::new(),
        }
    }

    fn with_part(mut self, part: SectionPart) -> Self {
        self.parts.push(part);
        self
    }

    /// Adds a paragraph; nothing for an empty text.
    pub(crate) fn text(self, text: impl Into<String>) -> Self {
        let text = text.into();
        if text.is_empty() {
            return self;
        }
        self.with_part(SectionPart::Text(text))
    }

    /// Adds a table, also written as `<file>.csv`; a table without rows is left out.
    pub(crate) fn table(self, file: impl Into<String>, table: Table) -> Self {
        if table.rows.is_empty() {
            return self;
        }
        let file = file.into();
        self.with_part(SectionPart::Table { file, table })
    }

    /// Adds a drawing with its caption and its data, written as `<file>.csv`.
    pub(crate) fn figure(
        self,
        file: impl Into<String>,
        svg: String,
        caption: impl Into<String>,
        data: Table,
    ) -> Self {
        self.with_part(SectionPart::Figure {
            file: file.into(),
            svg,
            caption: caption.into(),
            data,
        })
    }

    /// Adds a work-precision diagram.
    pub(crate) fn diagram(self, diagram: &Diagram) -> Self {
        self.figure(
            diagram.file.clone(),
            diagram.svg(),
            diagram.caption(),
            diagram.table(),
        )
    }

    /// Adds several diagrams.
    pub(crate) fn diagrams(self, diagrams: &[Diagram]) -> Self {
        diagrams.iter().fold(self, Self::diagram)
    }

    fn put_on(&self, page: &mut Page, number: usize) {
        let title = escaped(&self.title);
        page.html(&format!("<h2 id=\"section{number}\">{title}</h2>\n"));
        for part in &self.parts {
            page.html(&part.html());
        }
    }

    fn markdown(&self) -> String {
        let parts: String = self.parts.iter().map(SectionPart::markdown).collect();
        format!("\n## {}\n{parts}", self.title)
    }
}

/// A document of sections.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Document {
    /// Its title.
    pub(crate) title: String,
    /// Its sections, in order.
    pub(crate) sections: Vec<Section>,
}

impl Document {
    /// The whole document as one self-contained HTML page.
    pub(crate) fn html(&self) -> String {
        let mut page = Page::new(&self.title);
        page.html(&self.contents_html());
        for (number, section) in self.sections.iter().enumerate() {
            section.put_on(&mut page, number);
        }
        page.document()
    }

    /// Links to the sections.
    fn contents_html(&self) -> String {
        let titles = self.sections.iter().map(|section| escaped(&section.title));
        let links: String = titles
            .enumerate()
            .map(|(i, title)| format!("<li><a href=\"#section{i}\">{title}</a></li>\n"))
            .collect();
        format!("<ol>\n{links}</ol>\n")
    }

    /// Its texts and tables as Markdown; plots become their captions.
    pub(crate) fn markdown(&self) -> String {
        let sections: String = self.sections.iter().map(Section::markdown).collect();
        format!("# {}\n{sections}", self.title)
    }

    /// Writes `report.html`, `report.md` and the data of each table and plot (`.csv`) into a
    /// folder; the page comes last.
    ///
    /// # Errors
    /// Files that cannot be written.
    pub(crate) fn write(&self, folder: &Path) -> Result<()> {
        io::create_folder(folder)?;
        let parts = self.sections.iter().flat_map(|section| &section.parts);
        for (file, table) in parts.filter_map(SectionPart::data_file) {
            io::write_text(folder.join(format!("{file}.csv")), &table.csv())?;
        }
        io::write_text(folder.join("report.md"), &self.markdown())?;
        io::write_text(folder.join("report.html"), &self.html())
    }
}

impl SectionPart {
    /// The name and the contents of the data file.
    fn data_file(&self) -> Option<(&str, &Table)> {
        match self {
            Self::Text(_) => None,
            Self::Table { file, table } => Some((file, table)),
            Self::Figure { file, data, .. } => Some((file, data)),
        }
    }

    fn html(&self) -> String {
        match self {
            Self::Text(text) => format!("<p>{}</p>\n", with_code(text)),
            Self::Table { table, .. } => format!("<figure>{}</figure>\n", table.html()),
            Self::Figure {
                svg, caption, data, ..
            } => figure_html(svg, caption, data),
        }
    }

    fn markdown(&self) -> String {
        match self {
            Self::Text(text) => format!("\n{text}\n"),
            Self::Table { table, .. } => format!("\n{}", table.markdown()),
            Self::Figure { file, caption, .. } => format!("\n* `{file}.csv`: {caption}\n"),
        }
    }
}

fn figure_html(svg: &str, caption: &str, data: &Table) -> String {
    let (caption, points) = (with_code(caption), data.html());
    format!(
        "<figure>{svg}<figcaption>{caption}</figcaption></figure>\n\
         <details><summary>Its points</summary>{points}</details>\n"
    )
}

/// Text for HTML, with everything between backticks as code.
fn with_code(text: &str) -> String {
    let pieces = text.split('`').map(escaped).enumerate();
    pieces
        .map(|(i, piece)| match i % 2 {
            0 => piece,
            _ => format!("<code>{piece}</code>"),
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use petcomp::plot::Chart;

    fn document() -> Document {
        let mut table = Table::new(["a", "b"]);
        table.push(["1", "2"]);
        let section = Section::new("One & two")
            .text("Said.")
            .text("")
            .table("numbers", table.clone())
            .table("none", Table::new(["a"]))
            .figure("plot", Chart::row(&[]), "What is seen.", table);
        Document {
            title: "All".into(),
            sections: vec![section],
        }
    }

    #[test]
    fn a_document_is_one_page_and_a_file_of_data_for_each_part() {
        let folder = tempfile::tempdir().unwrap();
        document().write(folder.path()).unwrap();
        let mut names: Vec<_> = std::fs::read_dir(folder.path())
            .unwrap()
            .map(|e| e.unwrap().file_name().into_string().unwrap())
            .collect();
        names.sort();
        assert_eq!(
            names,
            ["numbers.csv", "plot.csv", "report.html", "report.md"]
        );
        let html = io::read_text(folder.path().join("report.html")).unwrap();
        assert!(
            html.contains("One &amp; two") && html.contains("<svg") && html.contains("<td>2</td>")
        );
        assert!(
            !html.contains("src=") && !html.contains("href=\"http"),
            "needs no other file"
        );
    }

    #[test]
    fn code_is_code_and_text_is_text() {
        assert_eq!(with_code("a < `b < c` d"), "a &lt; <code>b &lt; c</code> d");
    }

    #[test]
    fn markdown_has_the_tables_and_says_where_plots_are() {
        let text = document().markdown();
        assert!(
            text.starts_with("# All\n\n## One & two\n\nSaid.\n\n| a | b |\n"),
            "{text}"
        );
        assert!(text.contains("* `plot.csv`: What is seen."));
    }
}
