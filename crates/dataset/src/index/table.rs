//! A table in the format Parquet: typed columns, each of which may lack values, compressed by Snappy.

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

/// A value of one row, or none.
pub(super) enum Cell {
    Text(Option<String>),
    Int(Option<i32>),
    Long(Option<i64>),
    Single(Option<f32>),
    Double(Option<f64>),
}

/// The values of a row with the names of their columns: the same names and kinds in every row.
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

/// The values of one column.
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
            _ => return Err(Error::failed("two rows of a table have other columns")),
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

    /// Writes its values and forgets them.
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
            _ => return Err(Error::failed("a column of a table is of another kind than its table says")),
        };
        done.map(drop).map_err(failed)
    }
}

/// Which rows have a value, as Parquet's definition levels, and the values; what held them is empty then.
fn dense<T, U>(all: &mut Vec<Option<T>>, as_stored: impl Fn(T) -> U) -> (Vec<i16>, Vec<U>) {
    let levels = all.iter().map(|value| i16::from(value.is_some())).collect();
    (levels, std::mem::take(all).into_iter().flatten().map(as_stored).collect())
}

#[expect(clippy::needless_pass_by_value, reason = "what `map_err` hands over")]
fn failed(error: ParquetError) -> Error {
    Error::failed(format!("a table cannot be written: {error}"))
        .help("see that the disk has room and may be written, then run the same command again")
}

/// Rows that are written together: what a reader skips or takes as one.
const GROUP: usize = 100_000;

/// A table under way.
pub(super) struct Table<'s, 'f> {
    writer: SerializedFileWriter<&'s mut Stream<'f>>,
    columns: Vec<Column>,
    waiting: usize,
}

impl<'s, 'f> Table<'s, 'f> {
    /// Begins one whose rows are like this one, which is not written.
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

    /// Writes what is left.
    pub(super) fn end(mut self) -> Result<()> {
        if self.waiting > 0 {
            self.write()?;
        }
        self.writer.close().map(drop).map_err(failed)
    }
}

/// A count as a column holds it.
pub(super) fn count(n: impl TryInto<i64>) -> i64 {
    n.try_into().unwrap_or(i64::MAX)
}
