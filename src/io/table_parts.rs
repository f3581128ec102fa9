//! Tables of several things, such as quotes of several symbols, taken apart.

use std::collections::BTreeMap;

use super::error::InputError;
use super::table::Table;

impl Table {
    /// The rows of each text in the column `name`, in the file's order. They are not copied, and errors give the places they have
    /// in the file.
    ///
    /// # Errors
    /// A missing column, one of times, and a cell that is empty.
    pub fn split_by(&self, name: &str) -> Result<BTreeMap<String, Self>, InputError> {
        let mut rows: BTreeMap<String, Vec<u32>> = BTreeMap::new();
        for (row, text) in self.texts_complete(name)?.into_iter().enumerate() {
            let row = self.row_in_file(row);
            match rows.get_mut(&text) {
                Some(rows) => rows.push(row),
                None => drop(rows.insert(text, vec![row])),
            }
        }
        Ok(rows.into_iter().map(|(text, rows)| (text, self.with_rows(rows))).collect())
    }

    /// The rows of these numbers, from 0.
    #[must_use]
    pub fn chosen(&self, rows: &[usize]) -> Self {
        self.with_rows(rows.iter().map(|row| self.row_in_file(*row)).collect())
    }

    /// The rows for which `keep` says so of their number, from 0.
    #[must_use]
    pub fn filtered(&self, keep: impl Fn(usize) -> bool) -> Self {
        self.with_rows((0..self.rows()).filter(|row| keep(*row)).map(|row| self.row_in_file(row)).collect())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::io::{OutputTable, TimeFormat};

    #[test]
    fn parts_keep_their_rows_and_places_whatever_the_format() {
        let folder = tempfile::tempdir().unwrap();
        let (csv, parquet) = (folder.path().join("a.csv"), folder.path().join("a.parquet"));
        std::fs::write(&csv, "symbol,ts,price\nB,1,1.5\nA,2,\nB,3,x\n").unwrap();
        let table = OutputTable::new()
            .texts("symbol", ["B", "A", "B"].map(str::to_owned))
            .times("ts", [1, 2, 3].map(crate::sim2real::Timestamp))
            .floats("price", [Some(1.5), None, Some(f64::INFINITY)]);
        crate::io::write_table(&parquet, &table, crate::io::Overwrite::Refuse).unwrap();
        for path in [&csv, &parquet] {
            let whole = Table::read(path).unwrap();
            let parts = whole.split_by("symbol").unwrap();
            assert_eq!(parts.keys().collect::<Vec<_>>(), ["A", "B"]);
            let (a, b) = (&parts["A"], &parts["B"]);
            assert_eq!((a.rows(), b.rows(), a.floats("price").unwrap()), (1, 2, vec![None]));
            let times = b.times("ts", &TimeFormat::default()).unwrap();
            assert_eq!(times.iter().map(|time| time.0).collect::<Vec<_>>(), [1, 3]);
            for of in [whole.clone(), whole.chosen(&[2, 0, 1]), whole.pieces(3).next().unwrap()] {
                let pieces: Vec<Table> = of.pieces(2).collect();
                assert_eq!(pieces.iter().map(Table::rows).collect::<Vec<_>>(), [2, 1]);
                let symbols = |table: &Table| table.texts_complete("symbol").unwrap();
                assert_eq!(pieces.iter().flat_map(symbols).collect::<Vec<_>>(), symbols(&of));
                assert_eq!((pieces[1].place(0), pieces[0].place(1)), (of.place(2), of.place(1)));
                assert_eq!(pieces[1].pieces(1).next().unwrap().place(0), of.place(2));
            }
            let third = b.filtered(|row| row == 1);
            let error = third.floats("price").unwrap_err();
            assert_eq!(error.place, whole.place(2), "{error}");
        }
    }
}
