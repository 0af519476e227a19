//! A table of leaves: the layers of all stages in a CSV file instead of lists in the species file.
//!
//! A row is one layer of leaves at one stage. An empty cell keeps the leaf's value of the previous stage, and so do a
//! missing row and a stage without rows; a table therefore only lists changes. The rows are converted to the RON text
//! of `layers`, and every value remembers its cell, so that errors are reported at the cell.
//!
//! Cells are names and numbers, so a comma always ends a cell. Lines are split here rather than by the `csv` crate,
//! which does not report the position of a cell in the file.

use furrow_base::ron_file::{RonFile, choose};
use furrow_base::{Error, Result};
use std::collections::BTreeMap;
use std::ops::Range;

/// Columns that the first line may name, and the corresponding fields of a layer. The first two identify the layer.
const COLUMNS: [(&str, &str); 13] = [
    ("leaf", ""),
    ("stage", ""),
    ("kind", "kind"),
    ("leaves", "leaves"),
    ("alpha", "alpha"),
    ("blade_mm", "blade_mm"),
    ("width_mm", "width_mm"),
    ("petiole_mm", "stalk_mm"),
    ("angle_deg", "angle_deg"),
    ("pitch_deg", "pitch_deg"),
    ("bend_deg", "bend_deg"),
    ("fold_deg", "fold_deg"),
    ("internode_mm", "internode_mm"),
];

/// Columns that every table must have.
const NEEDED: [&str; 6] = ["leaf", "stage", "kind", "blade_mm", "width_mm", "angle_deg"];

/// A part of the text of `layers`, and the byte range of the table that it was made from.
pub type TextSpan = (String, Range<usize>);

/// Error: the table has no rows for the first stage of the species file, which has this BBCH code.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct NoRows(pub u32);

/// A table of leaves.
pub struct LeafTable<'t> {
    page: &'t RonFile,
    rows: Vec<Row<'t>>,
}

struct Row<'t> {
    leaf: u32,
    stage: u32,
    /// Byte range of the whole line.
    line: Range<usize>,
    /// Byte range of the leaf number.
    number: Range<usize>,
    /// Byte range of the BBCH code.
    code: Range<usize>,
    /// Non-empty cells, by field.
    cells: BTreeMap<&'static str, Cell<'t>>,
}

#[derive(Clone)]
struct Cell<'t> {
    text: &'t str,
    at: Range<usize>,
}

impl<'t> LeafTable<'t> {
    /// Reads a table.
    pub fn read(page: &'t RonFile) -> Result<Self> {
        if page.text.contains('\r') && !page.text.contains('\n') {
            let help = "save it with line feeds, as Unix or Windows programs do";
            return Err(page.about_bytes(0..1, "this table ends its lines with carriage returns alone", help));
        }
        let mut heads: Option<Vec<(&'static str, &'static str)>> = None;
        let (mut rows, mut start): (Vec<Row<'t>>, usize) = (Vec::new(), 0);
        for line in page.text.split_inclusive('\n') {
            let cells = cells(start, line);
            start += line.len();
            if line.starts_with('#') {
                continue;
            }
            if cells.iter().all(|cell| cell.text.is_empty()) {
                continue;
            }
            match &heads {
                None => heads = Some(head(page, &cells)?),
                Some(heads) => rows.push(row(page, heads, &cells)?),
            }
        }
        if rows.is_empty() {
            let help = "the first line names the columns: leaf,stage,kind,blade_mm,width_mm,petiole_mm,angle_deg";
            return Err(page.about_bytes(0..1, "this table has no rows", help));
        }
        for (k, row) in rows.iter().enumerate() {
            if let Some(twice) = rows[..k].iter().find(|other| (other.leaf, other.stage) == (row.leaf, row.stage)) {
                let line = page.text[..twice.line.start].matches('\n').count() + 1;
                let message = format!("leaf {} at BBCH {} is also in line {line}", row.leaf, row.stage);
                return Err(page.about_bytes(row.line.clone(), message, "remove one of the two lines"));
            }
        }
        Ok(Self { page, rows })
    }

    /// Returns the text of `layers` at each of these stages, which must be in ascending order.
    pub fn layers(&self, stages: &[u32]) -> Result<Result<Vec<Vec<TextSpan>>, NoRows>> {
        if let Some(row) = self.rows.iter().find(|row| !stages.contains(&row.stage)) {
            let known = stages.iter().map(u32::to_string).collect::<Vec<_>>().join(", ");
            let message = format!("the species file has no stage of BBCH {}", row.stage);
            return Err(self.wrong(&row.code, message, format!("its stages are {known}")));
        }
        let mut known: BTreeMap<u32, BTreeMap<&'static str, Cell<'t>>> = BTreeMap::new();
        let mut all = Vec::new();
        for stage in stages {
            let oldest_new = known.keys().next_back().copied().unwrap_or(0);
            let rows: Vec<&Row<'t>> = self.rows.iter().filter(|row| row.stage == *stage).collect();
            if rows.is_empty() && known.is_empty() {
                return Ok(Err(NoRows(*stage)));
            }
            for row in rows {
                if !known.contains_key(&row.leaf) && row.leaf < oldest_new {
                    let message = format!("leaf {} comes later than leaf {oldest_new}", row.leaf);
                    let help = "number the leaves from the oldest; a pair of equal age is one leaf with `leaves` 2";
                    return Err(self.wrong(&row.number, message, help.to_owned()));
                }
                let cells = known.entry(row.leaf).or_default();
                cells.extend(row.cells.iter().map(|(field, cell)| (*field, cell.clone())));
                for column in &NEEDED[2..] {
                    if !cells.contains_key(column) {
                        let message = format!("leaf {} has no {column} yet", row.leaf);
                        let help = format!("write its {column}; only a value that does not change may be left empty");
                        return Err(self.wrong(&row.line, message, help));
                    }
                }
            }
            all.push(parts(known.values()));
        }
        Ok(Ok(all))
    }

    fn wrong(&self, at: &Range<usize>, message: impl Into<String>, help: String) -> Error {
        self.page.about_bytes(at.clone(), message, help)
    }
}

/// Returns the RON text of a list of layers.
fn parts<'c, 't: 'c>(layers: impl Iterator<Item = &'c BTreeMap<&'static str, Cell<'t>>>) -> Vec<TextSpan> {
    let mut parts = vec![("[".to_owned(), 0..1)];
    for cells in layers {
        let mut between = "(";
        for (field, cell) in cells {
            parts.push((format!("{between}{field}: "), cell.at.clone()));
            parts.push((value(field, cell.text), cell.at.clone()));
            between = ", ";
        }
        parts.push(("), ".to_owned(), 0..1));
    }
    parts.push(("]".to_owned(), 0..1));
    parts
}

/// Returns the cells of a line that starts at byte `start`, without surrounding blanks.
fn cells(start: usize, line: &str) -> Vec<Cell<'_>> {
    let mut next = start;
    let cell = |whole: &'_ str| {
        let from = next + whole.len() - whole.trim_start().len();
        next += whole.len() + 1;
        from..from + whole.trim().len()
    };
    line.split(',').map(str::trim).zip(line.split(',').map(cell)).map(|(text, at)| Cell { text, at }).collect()
}

/// Returns the columns in the order of the first line.
fn head(page: &RonFile, cells: &[Cell<'_>]) -> Result<Vec<(&'static str, &'static str)>> {
    let names: Vec<&str> = COLUMNS.iter().map(|(name, _)| *name).collect();
    let mut heads: Vec<(&'static str, &'static str)> = Vec::new();
    if let [only] = cells
        && only.text.contains([';', '\t'])
    {
        let help = "save the table as CSV with commas between cells and points in decimals";
        return Err(page.about_bytes(only.at.clone(), "this table separates its cells by semicolons or tabs", help));
    }
    for cell in cells {
        let Some(column) = COLUMNS.iter().find(|(name, _)| *name == cell.text) else {
            let message = format!("no column is called `{}`", cell.text);
            return Err(page.about_bytes(cell.at.clone(), message, choose("columns", &names, cell.text)));
        };
        if heads.contains(column) {
            return Err(page.about_bytes(cell.at.clone(), format!("column {} is named twice", column.0), "remove one"));
        }
        heads.push(*column);
    }
    if let Some(missing) = NEEDED.iter().find(|name| heads.iter().all(|(head, _)| head != *name)) {
        let at = cells.first().map_or(0, |c| c.at.start)..cells.last().map_or(1, |c| c.at.end);
        let help = format!("columns are {}", names.join(", "));
        return Err(page.about_bytes(at, format!("there is no column {missing}"), help));
    }
    Ok(heads)
}

fn row<'t>(page: &RonFile, heads: &[(&'static str, &'static str)], cells: &[Cell<'t>]) -> Result<Row<'t>> {
    let line = cells.first().map_or(0, |c| c.at.start)..cells.last().map_or(0, |c| c.at.end);
    if cells.len() != heads.len() {
        let message = format!("{} cells, but the first line names {} columns", cells.len(), heads.len());
        let help = if cells.len() < heads.len() {
            "separate all cells by commas, empty ones too"
        } else {
            "a comma ends a cell; decimals are written with a point: 5.5"
        };
        return Err(page.about_bytes(line, message, help));
    }
    let named = |name: &str| heads.iter().zip(cells).find(|((head, _), _)| *head == name).map(|(_, cell)| cell);
    let whole = |name: &str, what: &str| {
        let cell = named(name).ok_or_else(|| page.about_bytes(line.clone(), format!("no {name}"), ""))?;
        let number: u32 = cell.text.parse().map_err(|_| {
            let message = format!("`{}` is not a {what}", cell.text);
            page.about_bytes(around(page, cell), message, "write a whole number")
        })?;
        Ok::<_, Error>((number, cell.at.clone()))
    };
    let (leaf, number) = whole("leaf", "leaf number")?;
    let (stage, code) = whole("stage", "BBCH code")?;
    let mut own = BTreeMap::new();
    for ((name, field), cell) in
        heads.iter().zip(cells).filter(|((_, field), cell)| !field.is_empty() && !cell.text.is_empty())
    {
        if *field != "kind" && numbers(cell.text).is_none() {
            let message = format!("`{}` is not a valid {name}", cell.text);
            let help = "write a number, or a range that each leaf draws from: 12.5 or 10..15";
            return Err(page.about_bytes(cell.at.clone(), message, help));
        }
        own.insert(*field, cell.clone());
    }
    Ok(Row { leaf, stage, line: line.clone(), number, code, cells: own })
}

/// Returns the byte range of a cell, at least one character long.
fn around(page: &RonFile, cell: &Cell<'_>) -> Range<usize> {
    cell.at.start..cell.at.end.max((cell.at.start + 1).min(page.text.len()))
}

/// Parses a number, or the two ends of a range.
fn numbers(text: &str) -> Option<(f64, Option<f64>)> {
    let number = |text: &str| text.trim().parse().ok().filter(|x: &f64| x.is_finite());
    match text.split_once("..") {
        Some((low, high)) => Some((number(low)?, Some(number(high)?))),
        None => Some((number(text)?, None)),
    }
}

/// Converts a cell to a value of the species file.
fn value(field: &str, text: &str) -> String {
    match numbers(text) {
        _ if field == "kind" => format!("{text:?}"),
        Some((low, Some(high))) => format!("Uniform({low}, {high})"),
        Some((number, None)) => number.to_string(),
        None => text.to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn layers(text: &str, stages: &[u32]) -> Result<Vec<String>> {
        let page = RonFile { path: "x.csv".into(), text: text.to_owned() };
        let layers = LeafTable::read(&page)?.layers(stages)?;
        let layers = layers.map_err(|NoRows(code)| Error::input(format!("no rows of {code}")))?;
        Ok(layers.iter().map(|parts| parts.iter().map(|(text, _)| text.as_str()).collect()).collect())
    }

    const HEAD: &str = "leaf,stage,kind,leaves,blade_mm,width_mm,petiole_mm,angle_deg\n";

    /// Rationale: a table lists changes only. Expected: an empty cell, or a leaf without a row, keeps the values of the
    /// previous stage; a range becomes a uniform distribution. Source: the text of `layers` as it is written by hand.
    #[test]
    fn rows_become_layers_and_what_is_empty_stays() {
        let text = format!(
            "# sizes\n{HEAD}1,10,seed,2,5,3,,70..80\r\n1,12,,,6,,1,\n2, 12, leaf,, 9.5 ,4,2,-3..50\n\n2,14,,,12,5,,\n"
        );
        assert_eq!(
            layers(&text, &[10, 12, 14]).unwrap(),
            [
                r#"[(angle_deg: Uniform(70, 80), blade_mm: 5, kind: "seed", leaves: 2, width_mm: 3), ]"#,
                r#"[(angle_deg: Uniform(70, 80), blade_mm: 6, kind: "seed", leaves: 2, stalk_mm: 1, width_mm: 3), (angle_deg: Uniform(-3, 50), blade_mm: 9.5, kind: "leaf", stalk_mm: 2, width_mm: 4), ]"#,
                r#"[(angle_deg: Uniform(70, 80), blade_mm: 6, kind: "seed", leaves: 2, stalk_mm: 1, width_mm: 3), (angle_deg: Uniform(-3, 50), blade_mm: 12, kind: "leaf", stalk_mm: 2, width_mm: 5), ]"#,
            ]
        );
    }

    /// Rationale: missing values do not change, so a stage that only adds flowers needs no rows. Expected: the layers
    /// of the previous stage.
    #[test]
    fn a_stage_without_rows_keeps_its_leaves() {
        let text = format!("{HEAD}1,10,seed,2,5,3,1,70\n1,12,,,6,,,\n2,65,leaf,1,9,4,2,50\n");
        let all = layers(&text, &[10, 12, 51, 65, 89]).unwrap();
        assert_eq!((&all[2], &all[4]), (&all[1], &all[3]));
        assert_ne!(all[1], all[3]);
    }

    /// Rationale: a table is long, so an error must name its place. Expected: line, column and message for each
    /// mistake.
    #[test]
    fn an_error_is_reported_with_line_and_column() {
        let first = "1,10,seed,2,5,3,1,70\n";
        for (text, line, column, words) in [
            (format!("{HEAD}{first}1,12,,,6,x,1,\n"), 3, 10, "`x` is not a valid width_mm"),
            (format!("{HEAD}{first}1,12,,,6..,7,1,\n"), 3, 8, "`6..` is not a valid blade_mm"),
            (format!("{HEAD}{first}1,13,,,6,7,1,\n"), 3, 3, "no stage of BBCH 13"),
            (format!("{HEAD}{first}1,12,,,6,7,1\n"), 3, 1, "7 cells"),
            (format!("{HEAD}{first}1,12,,,6,5,7,1,\n"), 3, 1, "9 cells"),
            ("leaf;stage;kind\n1;10;a\n".to_owned(), 1, 1, "semicolons or tabs"),
            (format!("{HEAD}{first}").replace('\n', "\r"), 1, 1, "carriage returns alone"),
            (format!("{HEAD}{first}2,12,leaf,,,7,1,50\n"), 3, 1, "leaf 2 has no blade_mm yet"),
            (format!("{HEAD}{first}{first}"), 3, 1, "is also in line 2"),
            (format!("{HEAD}2,10,seed,2,5,3,1,70\n1,12,leaf,1,5,3,1,70\n"), 3, 1, "comes later than leaf 2"),
            (format!("{HEAD}a,10,seed,2,5,3,1,70\n"), 2, 1, "`a` is not a leaf number"),
            ("leaf,stage,kind,blade_mm,width_mm,angle_dge\n".to_owned(), 1, 35, "no column is called `angle_dge`"),
            ("leaf,stage,kind,blade_mm,width_mm\n1,10,a,1,1\n".to_owned(), 1, 1, "there is no column angle_deg"),
            (HEAD.to_owned(), 1, 1, "no rows"),
        ] {
            let error = layers(&text, &[10, 12]).unwrap_err();
            let span = error.place().unwrap().span.clone().unwrap();
            assert!(error.message().contains(words), "{error}");
            assert_eq!((span.line, span.column), (line, column), "{error}");
            assert!(error.advice().is_some(), "{error}");
        }
        let later = format!("{HEAD}1,12,seed,2,5,3,1,70\n");
        assert!(layers(&later, &[10, 12]).unwrap_err().message().contains("no rows of 10"));
    }
}
