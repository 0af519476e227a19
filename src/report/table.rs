//! Rows of words and numbers, for people (Markdown, HTML) and for programs (CSV, JSON).
//!
//! Markdown and HTML show numbers to their decimals. CSV and JSON hold them in full. What is not known is `–`, empty, `null`.

use super::csv::{Lines, csv};
use super::whole;
use maud::{Markup, html};
use serde::{Serialize, Serializer};
use std::fmt::Write;

/// One place of a table.
#[derive(Clone, Debug, PartialEq)]
pub enum Cell {
    /// Words.
    Text(String),
    /// A whole number.
    Count(u64),
    /// A number, if it is known and finite; shown to so many decimals.
    Number(Option<f64>, usize),
    /// Numbers already in words: `∞`, `0.93 (0.91 to 0.95)`.
    Shown(String),
}

impl Cell {
    /// Words.
    pub fn text(words: impl Into<String>) -> Self {
        Self::Text(words.into())
    }

    /// A number shown to so many decimals; one that is not finite is not known.
    pub fn number(value: Option<f64>, decimals: usize) -> Self {
        Self::Number(value.filter(|v| v.is_finite()), decimals)
    }

    /// A share as percent.
    pub fn percent(share: Option<f64>, decimals: usize) -> Self {
        Self::number(share.map(|s| 100.0 * s), decimals)
    }

    /// As people read it.
    pub fn shown(&self) -> String {
        match self {
            Self::Text(words) | Self::Shown(words) => words.clone(),
            Self::Count(n) => n.to_string(),
            Self::Number(Some(value), decimals) if value.is_finite() => {
                let text = format!("{value:.decimals$}");
                // What rounds to nothing has no sign.
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

/// A table: as many cells in each row as columns.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Table {
    /// What it is of.
    pub title: String,
    /// Heads of the columns.
    pub columns: Vec<String>,
    /// Cells row by row.
    pub rows: Vec<Vec<Cell>>,
}

impl Table {
    /// Without rows yet.
    pub fn new<S: Into<String>>(title: impl Into<String>, columns: impl IntoIterator<Item = S>) -> Self {
        Self { title: title.into(), columns: columns.into_iter().map(Into::into).collect(), rows: Vec::new() }
    }

    /// Adds a row of as many cells as there are columns.
    pub fn push(&mut self, row: impl IntoIterator<Item = Cell>) {
        let row: Vec<Cell> = row.into_iter().collect();
        assert_eq!(row.len(), self.columns.len(), "cells of a row of \"{}\"", self.title);
        self.rows.push(row);
    }

    /// A Markdown table, its title in bold above it; columns of numbers are set to the right. Source: GitHub Flavored Markdown, §4.10.
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

    /// Whether a column holds words.
    pub fn is_words(&self, column: usize) -> bool {
        self.rows.iter().any(|row| row[column].is_text())
    }

    /// Comma-separated values with a line of heads, lines ended by CR LF.
    pub fn csv(&self) -> String {
        csv(&self.columns, self.rows.iter().map(|row| row.iter().map(Self::csv_text).collect()), Lines::CrLf)
    }

    /// An HTML table, its title as the caption; words on the left, numbers on the right.
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
        serde_json::to_string_pretty(self).expect("words and numbers") + "\n"
    }
}

/// Text that stays in its cell.
fn markdown_text(text: &str) -> String {
    text.replace('\\', "\\\\").replace('|', "\\|").replace(['\r', '\n'], " ")
}
