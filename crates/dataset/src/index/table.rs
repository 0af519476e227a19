//! Parquet table: typed columns with optional values, compressed with Snappy.

use crate::read::set::Stream;
use furrow_base::{Error, Result};
use parquet::basic::{Compression, LogicalType, Repetition, Type as Physical};
use parquet::column::writer::ColumnWriter;
use parquet::data_type::ByteArray;
use parquet::errors::ParquetError;
use parquet::file::properties::WriterProperties;
use parquet::file::writer::SerializedFileWriter;
use parquet::schema::types::Type;
use std::sync::Arc;

/// Optional value of a column in one row.
pub(super) enum Cell {
    Text(Option<String>),
    Int(Option<i32>),
    Long(Option<i64>),
    Single(Option<f32>),
    Double(Option<f64>),
}

/// Values of a row with the names of their columns; names and types are the same in every row.
pub(super) type Row = Vec<(&'static str, Cell)>;

macro_rules! cells {
    ($($from:ty => $kind:ident;)*) => {$(
        impl From<Option<$from>> for Cell {
            fn from(value: Option<$from>) -> Self {
                Self::$kind(value.map(Into::into))
            }
        }

        impl From<$from> for Cell {
            fn from(value: $from) -> Self {
                Some(value).into()
            }
        }
    )*};
}

cells! {
    &str => Text;
    String => Text;
    u16 => Int;
    i32 => Int;
    u32 => Long;
    i64 => Long;
    f32 => Single;
    f64 => Double;
}

/// Values of one column that are not yet written.
enum Column {
    Text(Vec<Option<String>>),
    Int(Vec<Option<i32>>),
    Long(Vec<Option<i64>>),
    Single(Vec<Option<f32>>),
    Double(Vec<Option<f64>>),
}

impl Column {
    fn of(cell: &Cell) -> Self {
        match cell {
            Cell::Text(_) => Self::Text(Vec::new()),
            Cell::Int(_) => Self::Int(Vec::new()),
            Cell::Long(_) => Self::Long(Vec::new()),
            Cell::Single(_) => Self::Single(Vec::new()),
            Cell::Double(_) => Self::Double(Vec::new()),
        }
    }

    fn push(&mut self, cell: Cell) -> Result<()> {
        match (self, cell) {
            (Self::Text(all), Cell::Text(value)) => all.push(value),
            (Self::Int(all), Cell::Int(value)) => all.push(value),
            (Self::Long(all), Cell::Long(value)) => all.push(value),
            (Self::Single(all), Cell::Single(value)) => all.push(value),
            (Self::Double(all), Cell::Double(value)) => all.push(value),
            _ => return Err(Error::failed("two rows of a table have different columns")),
        }
        Ok(())
    }

    fn kind(&self) -> (Physical, Option<LogicalType>) {
        match self {
            Self::Text(_) => (Physical::BYTE_ARRAY, Some(LogicalType::String)),
            Self::Int(_) => (Physical::INT32, None),
            Self::Long(_) => (Physical::INT64, None),
            Self::Single(_) => (Physical::FLOAT, None),
            Self::Double(_) => (Physical::DOUBLE, None),
        }
    }

    /// Writes the values and removes them from memory.
    fn write(&mut self, to: &mut ColumnWriter<'_>) -> Result<()> {
        let done = match (self, to) {
            (Self::Text(all), ColumnWriter::ByteArrayColumnWriter(to)) => {
                let (levels, values) = dense(all, |text| ByteArray::from(text.into_bytes()));
                to.write_batch(&values, Some(&levels), None)
            }
            (Self::Int(all), ColumnWriter::Int32ColumnWriter(to)) => {
                let (levels, values) = dense(all, |value| value);
                to.write_batch(&values, Some(&levels), None)
            }
            (Self::Long(all), ColumnWriter::Int64ColumnWriter(to)) => {
                let (levels, values) = dense(all, |value| value);
                to.write_batch(&values, Some(&levels), None)
            }
            (Self::Single(all), ColumnWriter::FloatColumnWriter(to)) => {
                let (levels, values) = dense(all, |value| value);
                to.write_batch(&values, Some(&levels), None)
            }
            (Self::Double(all), ColumnWriter::DoubleColumnWriter(to)) => {
                let (levels, values) = dense(all, |value| value);
                to.write_batch(&values, Some(&levels), None)
            }
            _ => return Err(Error::failed("a column of a table does not have the type in its schema")),
        };
        done.map(drop).map_err(failed)
    }
}

/// Returns Parquet's definition levels, which mark the rows that have a value, and the values. `all` is empty
/// afterwards.
fn dense<T, U>(all: &mut Vec<Option<T>>, as_stored: impl Fn(T) -> U) -> (Vec<i16>, Vec<U>) {
    let levels = all.iter().map(|value| i16::from(value.is_some())).collect();
    (levels, std::mem::take(all).into_iter().flatten().map(as_stored).collect())
}

#[expect(clippy::needless_pass_by_value, reason = "`map_err` passes the error by value")]
fn failed(error: ParquetError) -> Error {
    Error::failed(format!("a table cannot be written: {error}"))
        .help("check that the disk has free space and can be written, then repeat the command")
}

/// Number of rows in a row group, the unit that readers load or skip.
const GROUP: usize = 100_000;

/// A table that is being written.
pub(super) struct Table<'s, 'f> {
    writer: SerializedFileWriter<&'s mut Stream<'f>>,
    columns: Vec<Column>,
    waiting: usize,
}

impl<'s, 'f> Table<'s, 'f> {
    /// Starts a table with the columns of the row `like`, which is not written.
    pub(super) fn begin(out: &'s mut Stream<'f>, like: &Row) -> Result<Self> {
        let columns: Vec<Column> = like.iter().map(|(_, cell)| Column::of(cell)).collect();
        let field = |((name, _), column): (&(&str, Cell), &Column)| {
            let (physical, logical) = column.kind();
            let built = Type::primitive_type_builder(name, physical)
                .with_repetition(Repetition::OPTIONAL)
                .with_logical_type(logical)
                .build();
            built.map(Arc::new).map_err(failed)
        };
        let fields = like.iter().zip(&columns).map(field).collect::<Result<_>>()?;
        let schema = Type::group_type_builder("schema").with_fields(fields).build().map_err(failed)?;
        let words = concat!("furrow version ", env!("CARGO_PKG_VERSION")).to_owned();
        let properties = WriterProperties::builder().set_compression(Compression::SNAPPY).set_created_by(words).build();
        let writer = SerializedFileWriter::new(out, Arc::new(schema), Arc::new(properties)).map_err(failed)?;
        Ok(Self { writer, columns, waiting: 0 })
    }

    /// Adds a row.
    pub(super) fn add(&mut self, row: Row) -> Result<()> {
        for (column, (_, cell)) in self.columns.iter_mut().zip(row) {
            column.push(cell)?;
        }
        self.waiting += 1;
        if self.waiting == GROUP { self.write() } else { Ok(()) }
    }

    fn write(&mut self) -> Result<()> {
        let mut group = self.writer.next_row_group().map_err(failed)?;
        for column in &mut self.columns {
            let next = group.next_column().map_err(failed)?;
            let mut writer = next.ok_or_else(|| Error::failed("a table lacks a column"))?;
            column.write(writer.untyped())?;
            writer.close().map_err(failed)?;
        }
        group.close().map_err(failed)?;
        self.waiting = 0;
        Ok(())
    }

    /// Writes the remaining rows and closes the table.
    pub(super) fn end(mut self) -> Result<()> {
        if self.waiting > 0 {
            self.write()?;
        }
        self.writer.close().map(drop).map_err(failed)
    }
}

/// Converts a count to the integer type of columns; numbers beyond its range become the largest value.
pub(super) fn count(n: impl TryInto<i64>) -> i64 {
    n.try_into().unwrap_or(i64::MAX)
}
