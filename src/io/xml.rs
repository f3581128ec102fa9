//! XML as records: the attributes of each element, a table for each name of an element.

use std::collections::BTreeMap;
use std::path::Path;

use quick_xml::Reader;
use quick_xml::events::{BytesStart, Event};

use super::error::{InputError, Place};
use super::records::Records;
use super::source::{bytes, open};

/// Reads the elements of an XML file that have attributes: the table is the name of the element, the row its number among those
/// of that name, from 1. Texts between elements are passed over, and entities of a document's own are not resolved.
///
/// # Errors
/// A file that is missing or not UTF-8, and what is no well-formed XML, such as a file that was cut off.
pub fn read_xml(path: impl AsRef<Path>) -> Result<Vec<Records>, InputError> {
    let path = path.as_ref();
    let text = String::from_utf8(bytes(path, open(path)?)?).map_err(|_| {
        InputError::new(path, "expected UTF-8 text").hint("write the XML as UTF-8, which is what brokers deliver")
    })?;
    xml_records(path, &text)
}

/// The elements of a text that stands in the file `path`.
///
/// # Errors
/// As [`read_xml`].
pub fn xml_records(path: &Path, text: &str) -> Result<Vec<Records>, InputError> {
    let text = text.strip_prefix('\u{feff}').unwrap_or(text);
    let mut reader = Reader::from_str(text);
    let mut tables: BTreeMap<String, Records> = BTreeMap::new();
    let (mut depth, mut elements) = (0_usize, 0_usize);
    loop {
        let event = reader.read_event();
        let here = usize::try_from(reader.buffer_position()).unwrap_or(usize::MAX);
        let fail = |message: String| broken(path, text, here, message);
        match event.map_err(|error| fail(error.to_string()))? {
            Event::Eof if depth > 0 => return Err(fail("an element is not closed".to_owned())),
            Event::Eof if elements == 0 => return Err(fail("there is no element".to_owned())),
            Event::Eof => return Ok(tables.into_values().collect()),
            Event::End(_) => depth = depth.saturating_sub(1),
            Event::Start(element) => {
                (depth, elements) = (depth + 1, elements + 1);
                add(path, &mut tables, &element).map_err(fail)?;
            }
            Event::Empty(element) => {
                elements += 1;
                add(path, &mut tables, &element).map_err(fail)?;
            }
            _ => {}
        }
    }
}

fn add(path: &Path, tables: &mut BTreeMap<String, Records>, element: &BytesStart<'_>) -> Result<(), String> {
    let name = String::from_utf8_lossy(element.name().as_ref()).into_owned();
    let mut cells = Vec::new();
    for attribute in element.attributes() {
        let attribute = attribute.map_err(|error| error.to_string())?;
        let key = String::from_utf8_lossy(attribute.key.as_ref()).into_owned();
        let value = attribute.unescape_value().map_err(|error| error.to_string())?;
        cells.push((key, value.into_owned()));
    }
    if cells.is_empty() {
        return Ok(());
    }
    let records = tables.entry(name.clone()).or_insert_with(|| Records::new(path, Some(&name)));
    records.push(records.len() + 1, cells);
    Ok(())
}

fn broken(path: &Path, text: &str, at: usize, message: String) -> InputError {
    let mut at = at.min(text.len());
    while !text.is_char_boundary(at) {
        at -= 1;
    }
    let before = &text[..at];
    let start = before.rfind('\n').map_or(0, |newline| newline + 1);
    let place = Place::Line { line: 1 + before.matches('\n').count(), column: 1 + before[start..].chars().count() };
    InputError::new(path, format!("expected well-formed XML ({message})"))
        .at(place)
        .hint("the file is cut off or damaged: fetch it again")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn elements_become_records_by_their_names() {
        let text = "<?xml version='1.0'?>\n<R><T a='1 &amp; 2' b=\"\"/><T a='3'>x</T><U/></R>";
        let tables = xml_records(Path::new("a.xml"), text).unwrap();
        assert_eq!(tables.iter().map(|t| (t.table().unwrap(), t.len())).collect::<Vec<_>>(), [("T", 2)]);
        let values: Vec<_> = tables[0].iter().map(|record| (record.row(), record.get("a"), record.get("b"))).collect();
        assert_eq!(values, [(1, Some("1 & 2"), None), (2, Some("3"), None)]);
    }

    #[test]
    fn what_is_cut_off_or_twice_is_refused_with_its_place() {
        for text in
            ["", "abc", "<R>\n<T a='1'", "<R>\n<T a='1'/>", "<R>\n<T a='1' a='2'/></R>", "<R>\n<T a='&x;'/></R>", "<R></T>"]
        {
            let error = xml_records(Path::new("a.xml"), text).unwrap_err().to_string();
            assert!(error.starts_with("a.xml:") && error.contains("well-formed XML"), "{text}: {error}");
        }
    }
}
