//! A self-contained HTML page, and building blocks shared by pages.

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use maud::{DOCTYPE, Markup, PreEscaped, html};
use std::fmt::Display;

const STYLE: &str = include_str!("style.css");

/// An HTML page.
pub struct Page<'a> {
    /// Kind of the page, shown above its title: `Dataset`, `Evaluation`.
    pub kind: &'a str,
    /// Title of the page.
    pub title: &'a str,
    /// A sentence below the title.
    pub lead: Markup,
    /// CSS rules in addition to the shared ones.
    pub style: &'a str,
    /// Content between the lead and the footer.
    pub body: Markup,
    /// Script that runs once the page is loaded; may be empty.
    pub script: &'a str,
}

impl Page<'_> {
    /// Returns the text of the file. `furrow` is the program version shown in the footer.
    pub fn html(&self, furrow: &str) -> String {
        let page = html! {
            (DOCTYPE)
            html lang="en" {
                head {
                    meta charset="utf-8";
                    meta name="viewport" content="width=device-width, initial-scale=1";
                    meta name="color-scheme" content="light dark";
                    title { (self.kind) " " (self.title) }
                    link rel="icon" href="data:,";
                    style { (PreEscaped(STYLE)) (PreEscaped(self.style)) }
                }
                body {
                    main {
                        header {
                            p.kind { (self.kind) }
                            h1 { (self.title) }
                            p.lead { (self.lead) }
                        }
                        (self.body)
                        footer { "Written by Furrow " (furrow) }
                    }
                    @if !self.script.is_empty() { script { (PreEscaped(self.script)) } }
                }
            }
        };
        page.into_string() + "\n"
    }
}

/// A section with a heading; empty if its body is empty.
#[expect(clippy::needless_pass_by_value, reason = "markup is made where it is used")]
pub fn section(title: &str, body: Markup) -> Markup {
    html! { @if !body.0.is_empty() { section { h2 { (title) } (body) } } }
}

/// A large number with a caption.
pub struct Number {
    /// Key for programs that read the page.
    pub key: &'static str,
    /// Full-precision value; `null` if unknown.
    pub value: String,
    /// Value as displayed.
    pub shown: String,
    /// Caption: what the number counts or measures.
    pub words: String,
}

impl Number {
    /// Builds a count.
    pub fn count(key: &'static str, n: u64, words: impl Into<String>) -> Self {
        Self { key, value: n.to_string(), shown: super::whole(n), words: words.into() }
    }
}

/// The row of numbers at the top of a page.
pub fn numbers(all: impl IntoIterator<Item = Number>) -> Markup {
    html! {
        div.figures {
            @for Number { key, value, shown, words } in all { div { b { (keyed(key, value, &shown)) } span { (words) } } }
        }
    }
}

/// A number that programs find by its key: `value` at full precision, `shown` as displayed.
pub fn keyed(key: &str, value: impl Display, shown: &str) -> Markup {
    html! { span data-key=(key) data-value=(value) { (shown) } }
}

/// A list of names with their descriptions.
pub fn pairs<N: AsRef<str>>(rows: &[(N, Markup)]) -> Markup {
    html! { dl.pairs { @for (name, value) in rows { dt { (name.as_ref()) } dd { (value) } } } }
}

/// A bulleted list of sentences; empty if there are none.
pub fn list<S: AsRef<str>>(items: &[S]) -> Markup {
    html! { @if !items.is_empty() { ul { @for item in items { li { (item.as_ref()) } } } } }
}

/// A legend: pairs of a mark and its description.
pub fn legend(entries: impl IntoIterator<Item = (Markup, Markup)>) -> Markup {
    html! { p.legend { @for (mark, words) in entries { span { (mark) (words) } } } }
}

/// A colour swatch for a legend.
pub fn swatch(rgb: [u8; 3]) -> Markup {
    html! { i.swatch style={ "background:" (color(rgb)) } {} }
}

/// Formats a colour for CSS and SVG.
pub fn color(rgb: [u8; 3]) -> String {
    format!("#{}", hex::encode(rgb))
}

/// Encodes an image as a data URL; `kind` is `png` or `jpeg`.
pub fn data_url(kind: &str, bytes: &[u8]) -> String {
    format!("data:image/{kind};base64,{}", STANDARD.encode(bytes))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_html_would_misread_is_escaped() {
        let body = html! { (section("a & b", pairs(&[("<x>", html! { "\"" })]))) (section("Not shown", html! {})) };
        let page = Page { kind: "Kind", title: "<t>", lead: html! {}, style: "", body, script: "" }.html("1");
        assert!(page.contains("<h1>&lt;t&gt;</h1>") && page.contains("<h2>a &amp; b</h2>") && page.contains("&quot;"));
        assert!(!page.contains("<script") && !page.contains("Not shown"));
    }
}
