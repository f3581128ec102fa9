//! The buffers of an Arrow file, held to its size before anything is decoded.
//!
//! The decoder believes the lengths in a message, and one damaged byte there makes it ask for more memory than any machine
//! has, which ends the process. Source of the layout: `File.fbs`, `Message.fbs` of the format's specification, and the
//! binary encoding of FlatBuffers.

/// Most bytes that one byte becomes: a block of zstd repeats a byte 2^17 times, and is 4 bytes long.
pub(super) const MOST_EXPANSION: u64 = 1 << 15;
/// Numbers of the fields of a `Footer`, and bytes of each `Block` it lists: offset, length of the message, length of the body.
const FOOTER_BLOCKS: [usize; 2] = [2, 3];
const BLOCK: usize = 24;
/// Numbers of the fields of a `Message`.
const HEADER_KIND: usize = 1;
const HEADER: usize = 2;
/// The kinds of a message's header that have buffers, and the field of a `DictionaryBatch` in which they are.
const DICTIONARY_BATCH: u8 = 2;
const RECORD_BATCH: u8 = 3;
const DICTIONARY_DATA: usize = 1;
/// Numbers of the fields of a `RecordBatch`, and bytes of each `FieldNode` (length, nulls) and `Buffer` (offset, length).
const LENGTH: usize = 0;
const NODES: usize = 1;
const BUFFERS: usize = 2;
const COMPRESSION: usize = 3;
const PAIR: usize = 16;

/// Whether the buffers that an Arrow file declares lie within it, and its columns are no longer than these can hold.
pub(super) fn buffers_agree(file: &[u8]) -> bool {
    checked(file, file.len() as u64).is_some()
}

/// The same of a [`part`] of a file of `size` bytes.
pub(super) fn part_agrees(part: &[u8], size: u64) -> bool {
    checked(part, size).is_some()
}

/// A message of a file and its body: where it begins, and the bytes of both.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Block {
    pub(super) offset: u64,
    pub(super) message: u32,
    pub(super) body: u64,
}

impl Block {
    pub(super) fn length(self) -> u64 {
        u64::from(self.message).saturating_add(self.body)
    }
}

/// The blocks of dictionaries and those of record batches that a `footer` lists, where it can be read.
pub(super) fn blocks(footer: &[u8]) -> Option<[Vec<Block>; 2]> {
    let footer = Bytes(footer);
    let root = footer.root()?;
    let listed = |field| {
        let block = |at: usize| {
            Some(Block {
                offset: u64::try_from(footer.i64(at)?).ok()?,
                message: u32::try_from(footer.i32(at + 8)?).ok()?,
                body: u64::try_from(footer.i64(at + 16)?).ok()?,
            })
        };
        footer.items(root, field, BLOCK)?.map(block).collect::<Option<Vec<Block>>>()
    };
    let [dictionaries, batches] = FOOTER_BLOCKS.map(listed);
    Some([dictionaries?, batches?])
}

/// A file of all dictionaries and one record batch: `bodies` are the bytes of each, in the order of `blocks`, and `footer`
/// is that of the whole file.
pub(super) fn part(footer: &[u8], blocks: [&[Block]; 2], bodies: &[Vec<u8>]) -> Option<Vec<u8>> {
    // As in the whole file, the magic is filled up to a multiple of 8.
    let mut file = b"ARROW1\0\0".to_vec();
    let mut footer = footer.to_vec();
    let root = Bytes(&footer).root()?;
    let mut bodies = bodies.iter();
    for (field, blocks) in FOOTER_BLOCKS.into_iter().zip(blocks) {
        let places: Vec<usize> = Bytes(&footer).items(root, field, BLOCK)?.collect();
        for (at, block) in places.into_iter().zip(blocks) {
            footer.get_mut(at..at + 8)?.copy_from_slice(&(file.len() as u64).to_le_bytes());
            footer.get_mut(at + 8..at + 12)?.copy_from_slice(&block.message.to_le_bytes());
            footer.get_mut(at + 16..at + 24)?.copy_from_slice(&block.body.to_le_bytes());
            file.extend_from_slice(bodies.next()?);
        }
        if let Some(list) = Bytes(&footer).field(root, field)? {
            let count = Bytes(&footer).below(list)?;
            footer.get_mut(count..count + 4)?.copy_from_slice(&u32::try_from(blocks.len()).ok()?.to_le_bytes());
        }
    }
    file.extend_from_slice(&footer);
    file.extend_from_slice(&u32::try_from(footer.len()).ok()?.to_le_bytes());
    file.extend_from_slice(b"ARROW1");
    Some(file)
}

fn checked(file: &[u8], size: u64) -> Option<()> {
    // At the end stand the footer, its length, and `ARROW1`.
    let tail = file.strip_suffix(b"ARROW1")?.len().checked_sub(4)?;
    let start = tail.checked_sub(usize::try_from(Bytes(file).i32(tail)?).ok()?)?;
    let footer = Bytes(file.get(start..tail)?);
    for field in FOOTER_BLOCKS {
        let blocks = footer.root()?;
        for at in footer.items(blocks, field, BLOCK)? {
            let offset = usize::try_from(footer.i64(at)?).ok()?;
            let length = usize::try_from(footer.i32(at + 8)?).ok()?;
            let (begin, body) = (offset.checked_add(length)?, usize::try_from(footer.i64(at + 16)?).ok()?);
            // What reached beyond it would be one thing in the whole file and another in a part of it.
            let body = file.get(begin..begin.checked_add(body)?)?;
            message_agrees(Bytes(file.get(offset..offset + length)?), body, size)?;
        }
    }
    Some(())
}

/// Holds what a message says to its `body`.
fn message_agrees(message: Bytes<'_>, body: &[u8], size: u64) -> Option<()> {
    // Since version 0.15 four bytes of ones stand before the length.
    let before = if message.i32(0)? == -1 { 8 } else { 4 };
    let message = Bytes(message.0.get(before..)?);
    let table = message.root()?;
    let header = message.below(message.field(table, HEADER)??)?;
    let batch = match *message.0.get(message.field(table, HEADER_KIND)??)? {
        DICTIONARY_BATCH => message.below(message.field(header, DICTIONARY_DATA)??)?,
        RECORD_BATCH => header,
        _ => return Some(()),
    };
    let compressed = message.field(batch, COMPRESSION)?.is_some();
    let mut bytes = size;
    for at in message.items(batch, BUFFERS, PAIR)? {
        let (offset, length) = (usize::try_from(message.i64(at)?).ok()?, usize::try_from(message.i64(at + 8)?).ok()?);
        let buffer = Bytes(body.get(offset..offset.checked_add(length)?)?);
        bytes = bytes.checked_add(if compressed { buffer.decompressed()? } else { length as u64 })?;
    }
    // No column but one of nothing has less than a bit a row.
    let most = bytes.checked_mul(8)?;
    let fits = |length: i64| u64::try_from(length).ok().filter(|length| *length <= most).map(drop);
    fits(message.field(batch, LENGTH)?.map_or(Some(0), |at| message.i64(at))?)?;
    message.items(batch, NODES, PAIR)?.try_for_each(|at| fits(message.i64(at)?))
}

/// Bytes in which FlatBuffers or a buffer stand.
#[derive(Clone, Copy)]
struct Bytes<'a>(&'a [u8]);

impl Bytes<'_> {
    /// How long the buffer says it is without its compression, where that can be.
    fn decompressed(self) -> Option<u64> {
        if self.0.is_empty() {
            return Some(0);
        }
        let declared = self.i64(0)?;
        let compressed = self.0.len() as u64 - 8;
        let most = compressed.checked_mul(MOST_EXPANSION)?;
        // -1 stands before what could not be made smaller.
        if declared == -1 { Some(compressed) } else { u64::try_from(declared).ok().filter(|length| *length <= most) }
    }

    /// Where the root table stands.
    fn root(self) -> Option<usize> {
        self.below(0)
    }

    /// Where that stands which the offset at `at` leads to.
    fn below(self, at: usize) -> Option<usize> {
        at.checked_add(usize::try_from(self.i32(at)?).ok()?)
    }

    /// Where field `number` of the table at `table` stands: none where the table leaves it out.
    fn field(self, table: usize, number: usize) -> Option<Option<usize>> {
        let fields = usize::try_from(i64::try_from(table).ok()? - i64::from(self.i32(table)?)).ok()?;
        let entry = 4 + 2 * number;
        if entry >= self.u16(fields)? {
            return Some(None);
        }
        let offset = self.u16(fields.checked_add(entry)?)?;
        Some(if offset == 0 { None } else { Some(table.checked_add(offset)?) })
    }

    /// Where the items of `size` bytes stand that field `number` of the table at `table` lists.
    fn items(self, table: usize, number: usize, size: usize) -> Option<impl Iterator<Item = usize>> {
        let (first, count) = match self.field(table, number)? {
            Some(at) => {
                let list = self.below(at)?;
                (list.checked_add(4)?, usize::try_from(self.i32(list)?).ok()?)
            }
            None => (0, 0),
        };
        self.0.get(first..first.checked_add(count.checked_mul(size)?)?)?;
        Some((0..count).map(move |k| first + k * size))
    }

    fn u16(self, at: usize) -> Option<usize> {
        Some(u16::from_le_bytes(self.0.get(at..at.checked_add(2)?)?.try_into().ok()?).into())
    }

    fn i32(self, at: usize) -> Option<i32> {
        Some(i32::from_le_bytes(self.0.get(at..at.checked_add(4)?)?.try_into().ok()?))
    }

    fn i64(self, at: usize) -> Option<i64> {
        Some(i64::from_le_bytes(self.0.get(at..at.checked_add(8)?)?.try_into().ok()?))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const FILES: [&[u8]; 3] = [
        include_bytes!("../../fuzz/seeds/arrow/plain"),
        include_bytes!("../../fuzz/seeds/arrow/dictionary"),
        include_bytes!("../../fuzz/seeds/arrow/zstd"),
    ];

    /// Where a little-endian number of 8 bytes stands.
    fn places(file: &[u8], number: i64) -> Vec<usize> {
        (0..file.len() - 8).filter(|at| file[*at..].starts_with(&number.to_le_bytes())).collect()
    }

    #[test]
    fn whole_files_agree_and_cut_ones_do_not() {
        for file in FILES {
            assert!(buffers_agree(file));
            assert!((0..file.len()).all(|cut| !buffers_agree(&file[..cut])));
        }
    }

    #[test]
    fn a_length_beyond_the_file_is_found() {
        // Each has 3 rows and its first column 3 values of 8 bytes; what else is 3 or 24 may be anything.
        let file = FILES[0];
        for (number, at_least) in [(3, 5), (24, 2)] {
            for beyond in [i64::MAX, 1 << 40, -2] {
                let found = places(file, number).into_iter().filter(|at| {
                    let mut damaged = file.to_vec();
                    damaged[*at..at + 8].copy_from_slice(&beyond.to_le_bytes());
                    !buffers_agree(&damaged)
                });
                assert!(found.count() >= at_least, "{number} as {beyond}");
            }
        }
        let zipped = Bytes(&[0, 0, 0, 0, 1, 0, 0, 0, 9]);
        assert_eq!((zipped.decompressed(), Bytes(&[255; 9]).decompressed()), (None, Some(1)));
    }
}
