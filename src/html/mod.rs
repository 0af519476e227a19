//! Pages that people look at: one file that needs no network and nothing beside it, its style, charts and pictures inside.
//!
//! What a page is of belongs to the room that writes it; here is how text, numbers and the page around them look.

mod axis;
mod text;

pub use axis::{step, ticks};
pub use text::{count, escape, keyed, number, pairs, percent, whole};

use base64::Engine;
use base64::engine::general_purpose::STANDARD;

const STYLE: &str = include_str!("style.css");

/// A whole page. `kind` says what it is of, `title` which one; `lead` (HTML, as is all that follows) tells it in a sentence. `style` are
/// rules beyond those that all pages share.
pub fn document(kind: &str, title: &str, lead: &str, style: &str, body: &str, footer: &str) -> String {
    let (kind, title) = (escape(kind), escape(title));
    format!(
        "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n\
         <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n<meta name=\"color-scheme\" content=\"light dark\">\n\
         <title>{kind} {title}</title>\n<link rel=\"icon\" href=\"data:,\">\n<style>\n{STYLE}{style}</style>\n</head>\n<body>\n<main>\n\
         <header><p class=\"kind\">{kind}</p><h1>{title}</h1><p class=\"lead\">{lead}</p></header>\n\
         {body}<footer>{footer}</footer>\n</main>\n</body>\n</html>\n"
    )
}

/// A part of a page below a heading; nothing where it is empty.
pub fn section(title: &str, body: &str) -> String {
    if body.is_empty() { String::new() } else { format!("<section><h2>{}</h2>\n{body}</section>\n", escape(title)) }
}

/// Bytes as the address of a picture inside the page; `kind` is `png` or `jpeg`.
pub fn inside(kind: &str, bytes: &[u8]) -> String {
    format!("data:image/{kind};base64,{}", STANDARD.encode(bytes))
}
