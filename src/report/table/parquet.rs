//! Tables as Parquet files: columns of one type each, for data frames.

use super::{Cell, Table};
use crate::{Error, Result};
use parquet::basic::{LogicalType, Repetition, Type as Physical};
use parquet::data_type::{ByteArray, ByteArrayType, DataType, DoubleType, Int64Type};
use parquet::errors::ParquetError;
use parquet::file::properties::WriterProperties;
use parquet::file::writer::{SerializedFileWriter, SerializedRowGroupWriter};
use parquet::schema::types::{Type, TypePtr};
use std::sync::Arc;

impl Table {
    /// The table as a Parquet file with all bits of its numbers. A column that contains a text becomes strings, one of integers
    /// 64-bit integers, any other one doubles; empty cells are null.
    ///
    /// # Errors
    /// [`Error::File`] if the writer rejects the table.
    pub fn parquet(&self) -> Result<Vec<u8>> {
        self.write_parquet().map_err(|e| Error::File {
            file: format!("table '{}'", self.title),
            why: format!("it cannot be written as Parquet: {e}"),
            remedy: "use the CSV file".to_owned(),
        })
    }

    fn write_parquet(&self) -> std::result::Result<Vec<u8>, ParquetError> {
        let kinds: Vec<Physical> = (0..self.columns.len()).map(|c| self.physical(c)).collect();
        let fields = self
            .columns
            .iter()
            .zip(&kinds)
            .map(|(name, kind)| field(name, *kind))
            .collect::<std::result::Result<_, _>>()?;
        let schema = Arc::new(Type::group_type_builder("table").with_fields(fields).build()?);
        let properties = Arc::new(WriterProperties::builder().build());
        let mut file = SerializedFileWriter::new(Vec::new(), schema, properties)?;
        let mut rows = file.next_row_group()?;
        for (c, kind) in kinds.iter().enumerate() {
            let cells = || self.rows.iter().map(move |row| &row[c]);
            match kind {
                Physical::INT64 => column::<Int64Type>(&mut rows, cells().map(whole).collect())?,
                Physical::DOUBLE => column::<DoubleType>(&mut rows, cells().map(number).collect())?,
                _ => column::<ByteArrayType>(&mut rows, cells().map(text).collect())?,
            }
        }
        rows.close()?;
        file.into_inner()
    }

    /// The physical type of a column.
    fn physical(&self, column: usize) -> Physical {
        let cells = || self.rows.iter().map(|row| &row[column]);
        if cells().any(|cell| matches!(cell, Cell::Text(_))) {
            Physical::BYTE_ARRAY
        } else if cells().all(|cell| matches!(cell, Cell::Whole(_))) {
            Physical::INT64
        } else {
            Physical::DOUBLE
        }
    }
}

fn field(name: &str, kind: Physical) -> std::result::Result<TypePtr, ParquetError> {
    let text = (kind == Physical::BYTE_ARRAY).then_some(LogicalType::String);
    let field = Type::primitive_type_builder(name, kind).with_repetition(Repetition::OPTIONAL);
    Ok(Arc::new(field.with_logical_type(text).build()?))
}

/// Writes the values that are not null; the definition level of a row is 1 if it has a value.
fn column<T: DataType>(
    rows: &mut SerializedRowGroupWriter<'_, Vec<u8>>,
    cells: Vec<Option<T::T>>,
) -> std::result::Result<(), ParquetError> {
    let Some(mut column) = rows.next_column()? else { return Ok(()) };
    let levels: Vec<i16> = cells.iter().map(|cell| i16::from(cell.is_some())).collect();
    let values: Vec<T::T> = cells.into_iter().flatten().collect();
    column.typed::<T>().write_batch(&values, Some(&levels), None)?;
    column.close()
}

fn whole(cell: &Cell) -> Option<i64> {
    if let Cell::Whole(v) = cell { Some(*v) } else { None }
}

fn number(cell: &Cell) -> Option<f64> {
    match cell {
        Cell::Number(v) => Some(*v),
        Cell::Whole(v) => Some(*v as f64),
        _ => None,
    }
}

fn text(cell: &Cell) -> Option<ByteArray> {
    match cell {
        Cell::Text(text) => Some(text.as_str().into()),
        Cell::Number(v) => Some(v.to_string().as_str().into()),
        Cell::Whole(v) => Some(v.to_string().as_str().into()),
        Cell::Empty => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use parquet::file::reader::{FileReader, SerializedFileReader};
    use parquet::record::Field;

    #[test]
    fn every_bit_is_read_back() {
        let mut table = Table::new("Mixed", ["cycle", "objective", "end"]);
        let third = 1.0 / 3.0;
        table.push([0usize.into(), third.into(), Cell::Empty]).unwrap();
        table.push([1usize.into(), Cell::Empty, "Converged".into()]).unwrap();
        let path = std::env::temp_dir().join(format!("linkwright-{}.parquet", std::process::id()));
        std::fs::write(&path, table.parquet().unwrap()).unwrap();
        let file = SerializedFileReader::new(std::fs::File::open(&path).unwrap()).unwrap();
        std::fs::remove_file(&path).unwrap();
        let rows: Vec<Vec<Field>> = file
            .get_row_iter(None)
            .unwrap()
            .map(|row| row.unwrap().get_column_iter().map(|(_, field)| field.clone()).collect())
            .collect();
        assert_eq!(rows[0], [Field::Long(0), Field::Double(third), Field::Null]);
        assert_eq!(rows[1], [Field::Long(1), Field::Null, Field::Str("Converged".into())]);
    }
}
