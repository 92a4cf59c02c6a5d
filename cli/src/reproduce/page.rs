//! All sections on one page that needs no network.
use super::Section;
use monorange_formats::report::{STYLE, escape};
use std::fmt::Write as _;

/// The page.
pub fn page(sections: &[Section], command: &str) -> String {
    let mut html = format!(
        "<!DOCTYPE html>\n<html lang=\"en\">\n<meta charset=\"utf-8\">\n<meta name=\"viewport\" content=\"width=device-width\">\n\
         <title>The paper’s experiments – monorange</title>\n<style>{STYLE}</style>\n<main>\
         <p class=\"brand\">monorange · reproduce</p><h1>The paper’s experiments, reproduced, and what this project adds</h1>\
         <p class=\"lead\">“A Virtual Range Finder based on Monocular Vision System in SLAM”. Nothing below is copied from it but the \
         ten measured and ten calculated numbers of its Table 2; everything else was computed when this page was made.</p>"
    );
    for section in sections {
        let _ = write!(html, "<section id=\"{}\"><h2>{}</h2>", section.name, escape(section.title));
        for words in &section.words {
            let _ = write!(html, "<p class=\"hint\">{words}</p>");
        }
        for (caption, drawing) in &section.drawings {
            let _ = write!(html, "<figure>{drawing}<figcaption>{caption}</figcaption></figure>");
        }
        for table in &section.tables {
            let _ = write!(
                html,
                "<table class=\"figures-table\"><caption>{}</caption><tr>",
                escape(&table.caption)
            );
            for (column, name) in table.header.iter().enumerate() {
                let class = if column == 0 { "" } else { " class=\"n\"" };
                let _ = write!(html, "<th{class}>{}", escape(name));
            }
            html += "</tr>";
            for row in &table.rows {
                html += "<tr>";
                for (column, cell) in row.iter().enumerate() {
                    let class = if column == 0 { "" } else { " class=\"n\"" };
                    let _ = write!(html, "<td{class}>{}", escape(cell));
                }
                html += "</tr>";
            }
            html += "</table>";
        }
        html += "</section>";
    }
    let _ = writeln!(
        html,
        "<footer>monorange {} · <code>{}</code></footer></main></html>",
        env!("CARGO_PKG_VERSION"),
        escape(command)
    );
    html
}
