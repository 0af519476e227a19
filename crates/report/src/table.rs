//! Tables of text and numbers for users (Markdown, HTML) and programs (CSV, JSON).
//!
//! Markdown and HTML round numbers to their decimals; CSV and JSON contain full precision. Unknown values are `–`, an
//! empty field, and `null`, respectively.

use super::csv::{Lines, csv};
use super::whole;
use maud::{Markup, html};
use serde::{Serialize, Serializer};
use std::fmt::Write;

/// A table cell.
#[derive(Clone, Debug, PartialEq)]
pub enum Cell {
    /// Text.
    Text(String),
    /// A whole number.
    Count(u64),
    /// A number with its displayed decimals; `None` if unknown.
    Number(Option<f64>, usize),
    /// Preformatted numbers: `∞`, `0.93 (0.91 to 0.95)`.
    Shown(String),
}

impl Cell {
    /// Builds a text cell.
    pub fn text(words: impl Into<String>) -> Self {
        Self::Text(words.into())
    }

    /// Builds a number cell with the given displayed decimals. Values that are not finite become unknown.
    pub fn number(value: Option<f64>, decimals: usize) -> Self {
        Self::Number(value.filter(|v| v.is_finite()), decimals)
    }

    /// Builds a percentage from a fraction.
    pub fn percent(share: Option<f64>, decimals: usize) -> Self {
        Self::number(share.map(|s| 100.0 * s), decimals)
    }

    /// Returns the displayed text.
    pub fn shown(&self) -> String {
        match self {
            Self::Text(words) | Self::Shown(words) => words.clone(),
            Self::Count(n) => n.to_string(),
            Self::Number(Some(value), decimals) if value.is_finite() => {
                let text = format!("{value:.decimals$}");
                // A value that rounds to zero is shown without a minus sign.
                let nothing = text.starts_with('-') && !text.contains(|c: char| ('1'..='9').contains(&c));
                if nothing { text[1..].to_owned() } else { text }
            }
            Self::Number(..) => "–".into(),
        }
    }

    fn is_text(&self) -> bool {
        matches!(self, Self::Text(_))
    }
}

impl Serialize for Cell {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match self {
            Self::Text(words) | Self::Shown(words) => serializer.serialize_str(words),
            Self::Count(n) => serializer.serialize_u64(*n),
            Self::Number(value, _) => value.filter(|v| v.is_finite()).serialize(serializer),
        }
    }
}

/// A table. Each row has one cell per column.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Table {
    /// Title.
    pub title: String,
    /// Column headers.
    pub columns: Vec<String>,
    /// Rows of cells.
    pub rows: Vec<Vec<Cell>>,
}

impl Table {
    /// Builds a table without rows.
    pub fn new<S: Into<String>>(title: impl Into<String>, columns: impl IntoIterator<Item = S>) -> Self {
        Self { title: title.into(), columns: columns.into_iter().map(Into::into).collect(), rows: Vec::new() }
    }

    /// Appends a row, which must have one cell per column.
    pub fn push(&mut self, row: impl IntoIterator<Item = Cell>) {
        let row: Vec<Cell> = row.into_iter().collect();
        assert_eq!(row.len(), self.columns.len(), "cells of a row of \"{}\"", self.title);
        self.rows.push(row);
    }

    /// Formats a Markdown table with its title in bold above it. Number columns are right-aligned. Source: GitHub
    /// Flavored Markdown, §4.10.
    pub fn markdown(&self) -> String {
        let heads: Vec<String> = self.columns.iter().map(|head| markdown_text(head)).collect();
        let rows: Vec<Vec<String>> =
            self.rows.iter().map(|row| row.iter().map(|cell| markdown_text(&cell.shown())).collect()).collect();
        let words: Vec<bool> = (0..heads.len()).map(|k| self.is_words(k)).collect();
        let widths: Vec<usize> = (0..heads.len())
            .map(|k| {
                rows.iter().map(|row| &row[k]).chain([&heads[k]]).map(|t| t.chars().count()).max().unwrap_or(0).max(3)
            })
            .collect();
        let line = |cells: &[String]| {
            let mut text = String::from("|");
            for ((cell, width), words) in cells.iter().zip(&widths).zip(&words) {
                let _ = if *words { write!(text, " {cell:<width$} |") } else { write!(text, " {cell:>width$} |") };
            }
            text + "\n"
        };
        let rule: Vec<String> = widths
            .iter()
            .zip(&words)
            .map(|(width, words)| if *words { "-".repeat(*width) } else { "-".repeat(width - 1) + ":" })
            .collect();
        let body: String = rows.iter().map(|row| line(row)).collect();
        let title =
            if self.title.is_empty() { String::new() } else { format!("**{}**\n\n", markdown_text(&self.title)) };
        title + &line(&heads) + &line(&rule) + &body
    }

    /// Returns `true` if a column contains text.
    pub fn is_words(&self, column: usize) -> bool {
        self.rows.iter().any(|row| row[column].is_text())
    }

    /// Formats the table as CSV with a header row and CR LF line endings.
    pub fn csv(&self) -> String {
        csv(&self.columns, self.rows.iter().map(|row| row.iter().map(Self::csv_text).collect()), Lines::CrLf)
    }

    /// Formats an HTML table with the title as its caption; text is left-aligned, numbers are right-aligned.
    pub fn html(&self) -> Markup {
        let class: Vec<Option<&str>> = (0..self.columns.len()).map(|k| self.is_words(k).then_some("words")).collect();
        html! {
            table.numbers {
                @if !self.title.is_empty() { caption { (self.title) } }
                thead { tr { @for (head, class) in self.columns.iter().zip(&class) { td class=[class] { (head) } } } }
                tbody {
                    @for row in &self.rows {
                        tr {
                            @for (cell, class) in row.iter().zip(&class) {
                                td class=[class] { @if let Cell::Count(n) = cell { (whole(*n)) } @else { (cell.shown()) } }
                            }
                        }
                    }
                }
            }
        }
    }

    fn csv_text(cell: &Cell) -> String {
        match cell {
            Cell::Number(value, _) => value.filter(|v| v.is_finite()).map_or_else(String::new, |v| v.to_string()),
            cell => cell.shown(),
        }
    }

    /// `{"title": …, "columns": […], "rows": [[…], …]}`.
    pub fn json(&self) -> String {
        serde_json::to_string_pretty(self).expect("cells are text and numbers, which JSON can represent") + "\n"
    }
}

/// Escapes text so that it stays within its cell.
fn markdown_text(text: &str) -> String {
    text.replace('\\', "\\\\").replace('|', "\\|").replace(['\r', '\n'], " ")
}
