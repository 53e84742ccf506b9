//! A document as one self-contained HTML page: no network access, no script, pictures embedded.

use super::document::{Document, Item, Picture, Table};
use super::style::{escape, themed, variables};

const RULES: &str = "\
*{box-sizing:border-box}\n\
body{margin:0 auto;max-width:84rem;padding:1rem;background:var(--page);color:var(--ink);\
font:16px/1.5 system-ui,'Segoe UI','DejaVu Sans',sans-serif}\n\
h1{font-size:1.7rem;line-height:1.2;margin:.5rem 0}\n\
h2{font-size:1.3rem;margin:2.5rem 0 .5rem;border-top:1px solid var(--grid);padding-top:1rem}\n\
p{max-width:60rem;margin:.5rem 0}\n\
nav{display:flex;flex-wrap:wrap;gap:.3rem 1rem;margin:1rem 0}\n\
a{color:var(--s1)}\n\
.scroll{overflow-x:auto;margin:.3rem 0 1rem}\n\
table{border-collapse:collapse;font-size:.85rem;font-variant-numeric:tabular-nums}\n\
th,td{padding:.25rem .6rem;border-bottom:1px solid var(--grid);text-align:left;vertical-align:top}\n\
th{background:var(--panel);vertical-align:bottom}\n\
td,th{white-space:nowrap}\n\
th{white-space:normal}\n\
.n{text-align:right}\n\
.l{white-space:normal;min-width:18rem}\n\
.caption,figcaption,summary{font-size:.85rem;opacity:.85}\n\
summary{cursor:pointer;margin:.5rem 0}\n\
.pictures{display:grid;grid-template-columns:repeat(auto-fill,minmax(min(100%,22rem),1fr));gap:1rem;margin:1rem 0}\n\
.pictures.four{grid-template-columns:repeat(auto-fit,minmax(min(100%,16rem),1fr))}\n\
.pictures.two{grid-template-columns:repeat(auto-fit,minmax(min(100%,26rem),1fr))}\n\
figure{margin:0;padding:.5rem;background:var(--panel);border-radius:.5rem}\n\
svg{display:block;width:100%;height:auto;font-family:system-ui,'Segoe UI','DejaVu Sans',sans-serif}\n\
@media(max-width:30rem){body{padding:.6rem}figure{padding:.2rem}\
table{font-size:.75rem}td,th{padding:.2rem .3rem;white-space:normal}.n{white-space:nowrap}th.n{white-space:normal}}\n\
@media print{figure,table{break-inside:avoid}}\n";

/// Number of characters above which a cell's text is wrapped.
const LONG: usize = 40;

/// The document as HTML.
pub fn html(document: &Document) -> String {
    let mut text = format!(
        "<!doctype html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n\
         <meta name=\"viewport\" content=\"width=device-width,initial-scale=1\">\n\
         <link rel=\"icon\" href=\"data:,\">\n<title>{}</title>\n<style>\n{}{RULES}</style>\n</head>\n\
         <body>\n<h1>{}</h1>\n",
        escape(&document.title),
        variables(),
        escape(&document.title),
    );
    for paragraph in &document.intro {
        text.push_str(&format!("<p>{}</p>\n", escape(paragraph)));
    }
    let links = document.sections.iter().map(|s| format!("<a href=\"#{}\">{}</a>", s.id, escape(&s.title)));
    text.push_str(&format!("<nav>{}</nav>\n", links.collect::<Vec<_>>().join("\n")));
    for section in &document.sections {
        text.push_str(&format!("<h2 id=\"{}\">{}</h2>\n", section.id, escape(&section.title)));
        for item in &section.items {
            match item {
                Item::Text(paragraph) => text.push_str(&format!("<p>{}</p>\n", escape(paragraph))),
                Item::Table(one) => table(&mut text, one),
                Item::Pictures(all) => pictures(&mut text, all),
            }
        }
    }
    text + "</body>\n</html>\n"
}

fn table(text: &mut String, table: &Table) {
    let caption = escape(&table.caption);
    text.push_str(&match table.collapsed {
        true => format!("<details><summary>{caption} ({} rows)</summary>\n", table.rows.len()),
        false => format!("<p class=\"caption\">{caption}</p>\n"),
    });
    let class = |column: usize| if table.is_number(column) { " class=\"n\"" } else { "" };
    let head = table.head.iter().enumerate().map(|(k, head)| format!("<th{}>{}</th>", class(k), escape(head)));
    let head: String = head.collect();
    text.push_str(&format!("<div class=\"scroll\"><table id=\"{}\"><tr>{head}</tr>\n", table.id));
    for row in &table.rows {
        let cells = row.iter().enumerate().map(|(k, cell)| {
            let class = if cell.shown.chars().count() > LONG { " class=\"l\"" } else { class(k) };
            format!("<td{class}>{}</td>", escape(&cell.shown))
        });
        text.push_str(&format!("<tr>{}</tr>\n", cells.collect::<String>()));
    }
    text.push_str("</table></div>\n");
    if table.collapsed {
        text.push_str("</details>\n");
    }
}

fn pictures(text: &mut String, all: &[Picture]) {
    // Two pictures are drawn larger; four are laid out in one row.
    let class = match all.len() {
        2 => " two",
        4 => " four",
        _ => "",
    };
    text.push_str(&format!("<div class=\"pictures{class}\">\n"));
    for Picture { id, caption, svg } in all {
        let (svg, caption) = (themed(svg, caption), escape(caption));
        text.push_str(&format!("<figure id=\"{id}\">{svg}<figcaption>{caption}</figcaption></figure>\n"));
    }
    text.push_str("</div>\n");
}
