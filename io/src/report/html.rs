//! A report as one HTML file.

use super::document::{Block, Cell, Report, Table, Tone};
use super::draw::svg;
use super::escape::escape;

const STYLE: &str = "\
:root{color-scheme:light}\
body{font:15px/1.5 Helvetica,Arial,sans-serif;color:#1f262d;background:#fff;max-width:780px;margin:2.2em auto;padding:0 1.2em}\
h1{font-size:1.6em;line-height:1.25;margin:0 0 .4em;overflow-wrap:anywhere}\
h2{font-size:1.15em;margin:1.9em 0 .5em;padding-bottom:.2em;border-bottom:1px solid #dfe3e7;break-after:avoid}\
dl{display:grid;grid-template-columns:max-content 1fr;gap:.1em 1em;color:#57606a;font-size:.87em;margin:0 0 1.4em}\
dt{font-weight:600}dd{margin:0;overflow-wrap:anywhere}\
p,li{overflow-wrap:anywhere}ul{padding-left:1.2em}li{margin:.25em 0}\
.note{border-left:4px solid;padding:.55em .9em;margin:.7em 0;border-radius:0 4px 4px 0;break-inside:avoid;overflow-wrap:anywhere}\
.answer{border-color:#009e73;background:#eef8f4}.no{border-color:#b42318;background:#fdf1f0}.warning{border-color:#c98a00;background:#fdf7e8}\
.table{overflow-x:auto}\
table{border-collapse:collapse;font-size:.85em;width:100%;font-variant-numeric:tabular-nums}\
th,td{padding:.3em .5em;border-bottom:1px solid #e6e9ec;text-align:left;vertical-align:top}\
th{border-bottom:2px solid #c9d0d6;font-weight:600}\
td.n,th.n{text-align:right;white-space:nowrap}\
tr.marked td{background:#eaf3fa;font-weight:600}\
tr{break-inside:avoid}\
figure{margin:1em 0;break-inside:avoid}figure>div{display:flex;flex-wrap:wrap;gap:6px 8px}\
svg.chart{max-width:100%;height:auto;display:block}\
figcaption{color:#57606a;font-size:.85em;margin-top:.4em}\
a{color:#0072b2}\
@media print{body{margin:0;max-width:none;font-size:10.5pt}*{-webkit-print-color-adjust:exact;print-color-adjust:exact}}";

impl Report {
    /// The whole file.
    #[must_use]
    pub fn html(&self) -> String {
        let mut out = format!(
            "<!DOCTYPE html>\n<html lang=\"{}\">\n<head>\n<meta charset=\"utf-8\">\n<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n<meta http-equiv=\"Content-Security-Policy\" content=\"default-src 'none'; style-src 'unsafe-inline'\">\n<title>{title}</title>\n<style>{STYLE}</style>\n</head>\n<body>\n<h1>{title}</h1>\n<dl>",
            self.language,
            title = escape(&self.title)
        );
        for (name, value) in &self.provenance {
            out.push_str(&format!("<dt>{}</dt><dd>{}</dd>", escape(name), escape(value)));
        }
        out.push_str("</dl>\n");
        for block in &self.blocks {
            out.push_str(&written(block));
            out.push('\n');
        }
        out.push_str("</body>\n</html>\n");
        out
    }
}

fn written(block: &Block) -> String {
    match block {
        Block::Heading(text) => format!("<h2>{}</h2>", escape(text)),
        Block::Paragraph(text) => format!("<p>{}</p>", escape(text)),
        Block::Note(tone, text) => {
            let class = match tone {
                Tone::Answer => "answer",
                Tone::No => "no",
                Tone::Warning => "warning",
            };
            format!("<p class=\"note {class}\">{}</p>", escape(text))
        }
        Block::List(lines) => {
            let items: String = lines.iter().map(|l| format!("<li>{}</li>", escape(l))).collect();
            format!("<ul>{items}</ul>")
        }
        Block::Table(table) => written_table(table),
        Block::Figure(charts, caption) => {
            let drawn: String = charts.iter().map(svg).collect();
            format!("<figure><div>{drawn}</div><figcaption>{}</figcaption></figure>", escape(caption))
        }
    }
}

fn written_table(table: &Table) -> String {
    let is_number = |column: usize| table.rows.iter().any(|r| r.get(column).is_some_and(|c| c.is_number));
    let class = |number: bool| if number { " class=\"n\"" } else { "" };
    let mut out = "<div class=\"table\"><table>".to_owned();
    if !table.head.is_empty() {
        let heads = table.head.iter().enumerate();
        let heads: String =
            heads.map(|(i, h)| format!("<th{}>{}</th>", class(is_number(i)), escape(h))).collect();
        out.push_str(&format!("<thead><tr>{heads}</tr></thead>"));
    }
    out.push_str("<tbody>");
    for (place, row) in table.rows.iter().enumerate() {
        let cells: String =
            row.iter().map(|c| format!("<td{}>{}</td>", class(c.is_number), written_cell(c))).collect();
        let marked = if table.marked == Some(place) { " class=\"marked\"" } else { "" };
        out.push_str(&format!("<tr{marked}>{cells}</tr>"));
    }
    out.push_str("</tbody></table></div>");
    out
}

fn written_cell(cell: &Cell) -> String {
    let text = escape(&cell.text);
    match &cell.link {
        // An address is a file beside the report; whatever else a name holds is percent-encoded.
        Some(to) => format!("<a href=\"{}\">{text}</a>", address(to)),
        None => text,
    }
}

fn address(name: &str) -> String {
    let plain = |b: &u8| b.is_ascii_alphanumeric() || b"-_.~".contains(b);
    let encoded: String = name
        .bytes()
        .map(|b| if plain(&b) { char::from(b).to_string() } else { format!("%{b:02X}") })
        .collect();
    format!("./{encoded}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_report_is_one_file_without_scripts_or_addresses_elsewhere() {
        let report = Report {
            language: "en",
            title: "<script>alert(1)</script>".into(),
            provenance: vec![("File".into(), "a\"b<c".into())],
            blocks: vec![
                Block::Note(Tone::No, "<i>".into()),
                Block::Table(Table {
                    head: vec!["<h>".into()],
                    rows: vec![vec![Cell::link("<a>", "javascript:alert(1)//\"x.html")]],
                    marked: Some(0),
                }),
            ],
        };
        let html = report.html();
        assert!(!html.contains("<script") && !html.contains("<i>") && !html.contains("<h>"), "{html}");
        assert!(html.contains("href=\"./javascript%3Aalert%281%29%2F%2F%22x.html\""), "{html}");
        assert!(!html.contains("http://") && !html.contains("https://"), "{html}");
        assert_eq!(html, report.html());
    }
}
