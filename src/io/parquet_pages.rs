//! The page headers of a Parquet file, held to their footer before anything is decoded.
//!
//! The decoder believes the counts in a page header, and one damaged byte there makes it ask for more memory than any
//! machine has, which ends the process. Source of the layout: `parquet.thrift` of the format's specification, and the
//! compact protocol of Thrift.

use super::arrow_buffers::MOST_EXPANSION;

/// What a page header says.
#[derive(Debug, Default, Clone, Copy)]
struct PageHeader {
    uncompressed: i64,
    compressed: i64,
    dictionary: bool,
    values: i64,
}

/// Most values of a page: as many as the largest row group that writers make of a column that is all one value.
const MOST_VALUES: i64 = 1 << 26;

/// Whether the pages of a column chunk fit into its bytes and together have its `values`: the decoder makes room for these
/// before it sees that there are fewer.
pub(super) fn pages_agree(chunk: &[u8], values: i64) -> bool {
    let mut thrift = Thrift { bytes: chunk, at: 0 };
    let mut seen = 0;
    while seen < values && thrift.at < chunk.len() {
        let Some(header) = thrift.page_header() else { return false };
        let left = (chunk.len() - thrift.at) as i64;
        // No value of a dictionary is shorter than a byte.
        let most = if header.dictionary { header.uncompressed } else { (values - seen).min(MOST_VALUES) };
        // Compressed or not, a page of levels and values is no longer than that.
        let longest = header.compressed.saturating_add(1).saturating_mul(MOST_EXPANSION as i64);
        if header.uncompressed > longest
            || !(0..=left).contains(&header.compressed)
            || header.uncompressed < 0
            || !(0..=most).contains(&header.values)
        {
            return false;
        }
        seen += if header.dictionary { 0 } else { header.values };
        thrift.at += header.compressed as usize;
    }
    seen == values
}

/// Whether the lists of a footer are no longer than it is: the decoder makes room for them first.
pub(super) fn footer_agrees(footer: &[u8]) -> bool {
    Thrift { bytes: footer, at: 0 }.value(12, 0).is_some()
}

struct Thrift<'a> {
    bytes: &'a [u8],
    at: usize,
}

impl Thrift<'_> {
    /// Reads a `PageHeader`.
    fn page_header(&mut self) -> Option<PageHeader> {
        let mut header = PageHeader::default();
        self.structure(0, 0, &mut |outer, field, value| match (outer, field) {
            (0, 2) => header.uncompressed = value,
            (0, 3) => header.compressed = value,
            // The headers of data pages, old and new, and of dictionaries.
            (5 | 8, 1) => header.values = value,
            (7, 1) => {
                header.values = value;
                header.dictionary = true;
            }
            _ => {}
        })?;
        Some(header)
    }

    /// Reads a structure; shows its integers, and those of structures directly in it, with the number of their field
    /// and of the field around it.
    fn structure(&mut self, depth: u8, outer: i64, show: &mut dyn FnMut(i64, i64, i64)) -> Option<()> {
        let mut field = 0_i64;
        loop {
            let head = self.byte()?;
            let (delta, kind) = (head >> 4, head & 0x0f);
            if kind == 0 {
                return Some(());
            }
            field = if delta == 0 { self.zigzag()? } else { field.checked_add(i64::from(delta))? };
            match kind {
                4..=6 => {
                    let value = self.zigzag()?;
                    if depth <= 1 {
                        show(outer, field, value);
                    }
                }
                // Within a structure of a structure nothing is asked for.
                12 if depth < 8 => self.structure(depth + 1, field, show)?,
                // A boolean is in its head already.
                1 | 2 => {}
                3 => self.skip(1)?,
                7 => self.skip(8)?,
                8 => {
                    let length = self.varint()?;
                    self.skip(length)?;
                }
                // Lists, sets and maps are in no page header.
                _ => return None,
            }
        }
    }

    /// Goes over a value of that kind.
    fn value(&mut self, kind: u8, depth: u8) -> Option<()> {
        match kind {
            4..=6 => self.varint().map(drop),
            9 | 10 if depth < 16 => {
                let head = self.byte()?;
                let count = if head >> 4 == 15 { self.varint()? } else { u64::from(head >> 4) };
                // No item is shorter than a byte, and a boolean is one.
                let fits = count <= (self.bytes.len() - self.at) as u64;
                match head & 0x0f {
                    _ if !fits => None,
                    1 | 2 => self.skip(count),
                    kind => (0..count).try_for_each(|_| self.value(kind, depth + 1)),
                }
            }
            12 if depth < 16 => loop {
                let head = self.byte()?;
                match head & 0x0f {
                    0 => return Some(()),
                    _ if head >> 4 == 0 => self.zigzag().map(drop)?,
                    _ => {}
                }
                // A boolean is in its head already.
                if !matches!(head & 0x0f, 1 | 2) {
                    self.value(head & 0x0f, depth + 1)?;
                }
            },
            3 => self.skip(1),
            7 => self.skip(8),
            8 => {
                let length = self.varint()?;
                self.skip(length)
            }
            // There are no maps in a footer.
            _ => None,
        }
    }

    fn byte(&mut self) -> Option<u8> {
        let byte = self.bytes.get(self.at).copied()?;
        self.at += 1;
        Some(byte)
    }

    fn skip(&mut self, length: u64) -> Option<()> {
        self.at = self.at.checked_add(usize::try_from(length).ok()?).filter(|at| *at <= self.bytes.len())?;
        Some(())
    }

    fn varint(&mut self) -> Option<u64> {
        let mut value = 0;
        for shift in (0..64).step_by(7) {
            let byte = self.byte()?;
            value |= u64::from(byte & 0x7f) << shift;
            if byte & 0x80 == 0 {
                return Some(value);
            }
        }
        None
    }

    fn zigzag(&mut self) -> Option<i64> {
        let value = self.varint()?;
        Some((value >> 1) as i64 ^ -((value & 1) as i64))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A data page of 3 values and 4 bytes: type 0, sizes 4 and 4, header with 3 values and encodings 0, 3, 3.
    const PAGE: [u8; 20] = [0x15, 0, 0x15, 8, 0x15, 8, 0x2c, 0x15, 6, 0x15, 0, 0x15, 6, 0x15, 6, 0, 0, 1, 2, 3];

    #[test]
    fn a_list_beyond_its_footer_is_found() {
        // Field 2: a list of 2 structures, each with an integer in field 1; of 15 and more, the count follows.
        assert!(footer_agrees(&[0x29, 0x2c, 0x15, 2, 0, 0x15, 4, 0, 0]));
        assert!(!footer_agrees(&[0x29, 0xfc, 0x80, 0x80, 0x80, 0x80, 0x04, 0x15, 2, 0, 0x15, 4, 0, 0]));
        assert!(!footer_agrees(&[0x19; 1_000_000]), "lists within lists");
        assert!(!footer_agrees(&[0x29, 0x3c, 0x15, 2, 0, 0x15, 4, 0, 0]));
    }

    #[test]
    fn pages_are_counted_and_measured() {
        let chunk = [&PAGE[..], &[4], &PAGE[..], &[4]].concat();
        assert!(pages_agree(&chunk, 6));
        assert!(!pages_agree(&chunk, 7), "fewer values than the footer says");
        assert!(!pages_agree(&chunk, 5), "more values than the footer says");
        assert!(!pages_agree(&chunk[..chunk.len() - 1], 6), "a page that goes beyond its chunk");
        let header = |values: &[u8], size: &[u8]| {
            let before = [&[0x15, 0, 0x15][..], size, &[0x15, 8, 0x2c, 0x15], values].concat();
            [&before[..], &[0x15, 0, 0x15, 6, 0x15, 6, 0, 0, 1, 2, 3, 4]].concat()
        };
        assert!(pages_agree(&header(&[6], &[8]), 3));
        assert!(!pages_agree(&header(&[0x80, 0x80, 0x80, 0x80, 0x04], &[8]), 1 << 29), "a page of 2^29 values");
        assert!(!pages_agree(&header(&[6], &[0x80, 0x80, 0x80, 0x80, 0x04]), 3), "4 bytes that are 2^29");
        let mut negative = chunk.clone();
        negative[8] = 5;
        assert!(!pages_agree(&negative, 6), "a page of -3 values");
        assert!(!pages_agree(&[0xff; 40], 6));
    }
}
