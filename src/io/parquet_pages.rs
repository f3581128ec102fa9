//! The footer and the page headers of a Parquet file, held to the format and to each other before anything is decoded.
//!
//! The decoder believes the counts it reads and the field numbers before them: one damaged byte makes it ask for more
//! memory than any machine has, which ends the process. Source of the layout: `parquet.thrift` of the format's specification.

use super::arrow_buffers::MOST_EXPANSION;
use super::thrift::Shape::{self, Bytes, Flag, List, Number, Structure};
use super::thrift::Thrift;

const STATISTICS: Shape =
    Structure(&[(1, Bytes), (2, Bytes), (3, Number), (4, Number), (5, Bytes), (6, Bytes), (7, Flag), (8, Flag)]);

const PAGE_HEADER: Shape = Structure(&[
    (1, Number),
    (2, Number),
    (3, Number),
    (4, Number),
    (5, Structure(&[(1, Number), (2, Number), (3, Number), (4, Number), (5, STATISTICS)])),
    (6, Structure(&[])),
    (7, Structure(&[(1, Number), (2, Number), (3, Flag)])),
    (
        8,
        Structure(&[
            (1, Number),
            (2, Number),
            (3, Number),
            (4, Number),
            (5, Number),
            (6, Number),
            (7, Flag),
            (8, STATISTICS),
        ]),
    ),
]);

const TIME: Shape =
    Structure(&[(1, Flag), (2, Structure(&[(1, Structure(&[])), (2, Structure(&[])), (3, Structure(&[]))]))]);

const SCHEMA_ELEMENT: Shape = Structure(&[
    (1, Number),
    (2, Number),
    (3, Number),
    (4, Bytes),
    (5, Number),
    (6, Number),
    (7, Number),
    (8, Number),
    (9, Number),
    (
        10,
        Structure(&[
            (1, Structure(&[])),
            (2, Structure(&[])),
            (3, Structure(&[])),
            (4, Structure(&[])),
            (5, Structure(&[(1, Number), (2, Number)])),
            (6, Structure(&[])),
            (7, TIME),
            (8, TIME),
            (10, Structure(&[(1, Shape::Byte), (2, Flag)])),
            (11, Structure(&[])),
            (12, Structure(&[])),
            (13, Structure(&[])),
            (14, Structure(&[])),
            (15, Structure(&[])),
        ]),
    ),
]);

const KEY_VALUE: Shape = Structure(&[(1, Bytes), (2, Bytes)]);

const COLUMN_META_DATA: Shape = Structure(&[
    (1, Number),
    (2, List(&Number)),
    (3, List(&Bytes)),
    (4, Number),
    (5, Number),
    (6, Number),
    (7, Number),
    (8, List(&KEY_VALUE)),
    (9, Number),
    (10, Number),
    (11, Number),
    (12, STATISTICS),
    (13, List(&Structure(&[(1, Number), (2, Number), (3, Number)]))),
    (14, Number),
    (15, Number),
    (16, Structure(&[(1, Number), (2, List(&Number)), (3, List(&Number))])),
]);

const COLUMN_CHUNK: Shape = Structure(&[
    (1, Bytes),
    (2, Number),
    (3, COLUMN_META_DATA),
    (4, Number),
    (5, Number),
    (6, Number),
    (7, Number),
    (8, Structure(&[(1, Structure(&[])), (2, Structure(&[(1, List(&Bytes)), (2, Bytes)]))])),
    (9, Bytes),
]);

const ROW_GROUP: Shape = Structure(&[
    (1, List(&COLUMN_CHUNK)),
    (2, Number),
    (3, Number),
    (4, List(&Structure(&[(1, Number), (2, Flag), (3, Flag)]))),
    (5, Number),
    (6, Number),
    (7, Number),
]);

const CIPHER: Shape = Structure(&[(1, Bytes), (2, Bytes), (3, Flag)]);

const FILE_META_DATA: Shape = Structure(&[
    (1, Number),
    (2, List(&SCHEMA_ELEMENT)),
    (3, Number),
    (4, List(&ROW_GROUP)),
    (5, List(&KEY_VALUE)),
    (6, Bytes),
    (7, List(&Structure(&[(1, Structure(&[]))]))),
    (8, Structure(&[(1, CIPHER), (2, CIPHER)])),
    (9, Bytes),
]);

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

/// Bytes of a page that are looked at first: few headers have more, and what follows a header is gone over.
const HEADER: u64 = 1 << 12;

/// Whether the pages of a column chunk of `length` bytes fit into it and together have its `values`: the decoder makes room for these
/// before it sees that there are fewer. `read` gives the bytes from a place in the chunk on, so many at most.
pub(super) fn pages_agree<E>(
    length: u64,
    values: i64,
    mut read: impl FnMut(u64, u64) -> Result<Vec<u8>, E>,
) -> Result<bool, E> {
    let (mut at, mut seen) = (0, 0);
    while seen < values && at < length {
        let Some((header, size)) = header_at(at, length, &mut read)? else { return Ok(false) };
        at += size;
        let left = length.saturating_sub(at) as i64;
        // No value of a dictionary is shorter than a byte.
        let most = if header.dictionary { header.uncompressed } else { (values - seen).min(MOST_VALUES) };
        // Compressed or not, a page of levels and values is no longer than that.
        let longest = header.compressed.saturating_add(1).saturating_mul(MOST_EXPANSION as i64);
        if header.uncompressed > longest
            || !(0..=left).contains(&header.compressed)
            || header.uncompressed < 0
            || !(0..=most).contains(&header.values)
        {
            return Ok(false);
        }
        seen += if header.dictionary { 0 } else { header.values };
        at += header.compressed as u64;
    }
    Ok(seen == values)
}

/// The page header at a place in a chunk, and its length in bytes; none where there is none.
fn header_at<E>(
    at: u64,
    length: u64,
    read: &mut impl FnMut(u64, u64) -> Result<Vec<u8>, E>,
) -> Result<Option<(PageHeader, u64)>, E> {
    let mut most = HEADER.min(length - at);
    loop {
        let bytes = read(at, most)?;
        let mut thrift = Thrift::new(&bytes);
        if let Some(header) = page_header(&mut thrift) {
            return Ok(Some((header, (bytes.len() - thrift.left()) as u64)));
        }
        if most == length - at || (bytes.len() as u64) < most {
            return Ok(None);
        }
        // It is longer, or none.
        most = most.saturating_mul(16).min(length - at);
    }
}

/// Whether a footer is built as the format says, and its lists are no longer than it is: the decoder makes room for them
/// first.
pub(super) fn footer_agrees(footer: &[u8]) -> bool {
    Thrift::new(footer).read(FILE_META_DATA, &mut |_, _, _| {}).is_some()
}

/// Reads a page header.
fn page_header(thrift: &mut Thrift<'_>) -> Option<PageHeader> {
    let mut header = PageHeader::default();
    thrift.read(PAGE_HEADER, &mut |outer, field, value| match (outer, field) {
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
        assert!(!footer_agrees(&[0x25, 0x2c, 0]), "a number where the format has a list");
        assert!(!footer_agrees(&[0x29, 0x25, 2, 4, 0]), "numbers where the format has structures");
        assert!(footer_agrees(&[0x05, 0x90, 0x03, 2, 0]), "a field that the format does not know, 200");
        assert!(!footer_agrees(&[0x05, 0x88, 0x80, 0x08, 2, 0]), "field 65540, which is 4 in 16 bits");
    }

    fn pages_agree(chunk: &[u8], values: i64) -> bool {
        let read = |at: u64, most: u64| Ok::<_, ()>(chunk[at as usize..(at + most) as usize].to_vec());
        super::pages_agree(chunk.len() as u64, values, read).unwrap()
    }

    /// Statistics of a page may hold texts of any length.
    #[test]
    fn a_header_of_any_length_is_read() {
        for length in [10_usize, 5_000, 200_000] {
            let (low, mid, high) = (length as u8 | 0x80, (length >> 7) as u8 | 0x80, (length >> 14) as u8);
            let text = vec![b'x'; length];
            let mut page =
                vec![0x15, 0, 0x15, 8, 0x15, 8, 0x2c, 0x15, 6, 0x15, 0, 0x15, 6, 0x15, 6, 0x1c, 0x18, low, mid, high];
            page.extend(&text);
            page.extend([0, 0, 0, 1, 2, 3, 4]);
            assert!(pages_agree(&[page.clone(), page.clone()].concat(), 6), "{length}");
            assert!(!pages_agree(&page[..page.len() - 1], 3), "{length}");
            assert!(!pages_agree(&page[..length / 2], 3), "{length}");
        }
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
