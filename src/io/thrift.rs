//! Going over Thrift's compact protocol without making room for anything. Source: `thrift-compact-protocol.md` of Apache
//! Thrift.

/// What a field holds.
#[derive(Debug, Clone, Copy)]
pub(super) enum Shape {
    /// Whatever it is said to hold.
    Any,
    /// An integer of 16, 32 or 64 bits.
    Number,
    /// An integer of 8 bits.
    Byte,
    /// A boolean.
    Flag,
    /// A text or bytes.
    Bytes,
    /// A list.
    List(&'static Shape),
    /// A structure, with the numbers of its fields; those not among them may hold anything.
    Structure(&'static [(i16, Shape)]),
}

impl Shape {
    /// Whether a value of that kind is one. Decoders go by the number of a field, and not by its kind.
    fn has(self, kind: u8) -> bool {
        match self {
            Shape::Any => true,
            Shape::Number => matches!(kind, 4..=6),
            Shape::Byte => kind == 3,
            Shape::Flag => matches!(kind, 1 | 2),
            Shape::Bytes => kind == 8,
            Shape::List(_) => kind == 9,
            Shape::Structure(_) => kind == 12,
        }
    }
}

/// Shown an integer with the number of its field and of the field around that, 0 if there is none.
pub(super) type Show<'a> = &'a mut dyn FnMut(i16, i16, i64);

/// Deepest nesting: the formats read here have seven levels.
const DEEPEST: u8 = 16;

/// Bytes, and how far they were read.
pub(super) struct Thrift<'a> {
    bytes: &'a [u8],
    at: usize,
}

impl<'a> Thrift<'a> {
    pub(super) fn new(bytes: &'a [u8]) -> Self {
        Thrift { bytes, at: 0 }
    }

    /// How many bytes are left.
    pub(super) fn left(&self) -> usize {
        self.bytes.len() - self.at
    }

    /// Reads a structure; shows its integers, and those of structures directly in it.
    pub(super) fn read(&mut self, shape: Shape, show: Show<'_>) -> Option<()> {
        self.structure(shape, 0, 0, show)
    }

    /// Goes over so many bytes.
    pub(super) fn skip(&mut self, length: u64) -> Option<()> {
        self.at = self.at.checked_add(usize::try_from(length).ok()?).filter(|at| *at <= self.bytes.len())?;
        Some(())
    }

    fn structure(&mut self, shape: Shape, depth: u8, outer: i16, show: Show<'_>) -> Option<()> {
        let fields = if let Shape::Structure(fields) = shape { fields } else { &[] };
        let mut field = 0_i16;
        loop {
            let head = self.byte()?;
            let (delta, kind) = (head >> 4, head & 0x0f);
            if kind == 0 {
                return Some(());
            }
            field = if delta == 0 { i16::try_from(self.zigzag()?).ok()? } else { field.checked_add(i16::from(delta))? };
            let inner = fields.iter().find(|(known, _)| *known == field).map_or(Shape::Any, |(_, shape)| *shape);
            if !inner.has(kind) {
                return None;
            }
            match kind {
                // A boolean is in its head already.
                1 | 2 => {}
                4..=6 => {
                    let value = self.zigzag()?;
                    if depth <= 1 {
                        show(outer, field, value);
                    }
                }
                12 if depth < DEEPEST => self.structure(inner, depth + 1, field, &mut *show)?,
                kind => self.value(inner, kind, depth)?,
            }
        }
    }

    /// Goes over what is neither an integer of a structure nor a structure in one.
    fn value(&mut self, shape: Shape, kind: u8, depth: u8) -> Option<()> {
        match kind {
            3 => self.skip(1),
            4..=6 => self.varint().map(drop),
            7 => self.skip(8),
            8 => {
                let length = self.varint()?;
                self.skip(length)
            }
            9 | 10 if depth < DEEPEST => self.list(shape, depth + 1),
            12 if depth < DEEPEST => self.structure(shape, depth + 2, 0, &mut |_, _, _| {}),
            // The formats read here have no maps.
            _ => None,
        }
    }

    fn list(&mut self, shape: Shape, depth: u8) -> Option<()> {
        let inner = if let Shape::List(inner) = shape { *inner } else { Shape::Any };
        let head = self.byte()?;
        let (count, kind) = match head >> 4 {
            15 => (self.varint()?, head & 0x0f),
            count => (u64::from(count), head & 0x0f),
        };
        // No item is shorter than a byte, and a boolean is one. Some writers leave the kind of an empty list open.
        match kind {
            _ if count == 0 => Some(()),
            _ if count > self.left() as u64 || !inner.has(kind) => None,
            1 | 2 => self.skip(count),
            kind => (0..count).try_for_each(|_| self.value(inner, kind, depth)),
        }
    }

    fn byte(&mut self) -> Option<u8> {
        let byte = self.bytes.get(self.at).copied()?;
        self.at += 1;
        Some(byte)
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
