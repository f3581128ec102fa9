//! Units and words: the first line is what was found, the second what was expected.

use trueup::io::{check_unit, did_you_mean, hint_among, listed};

use super::scene::{Scene, shown};

pub fn target(_: &Scene, bytes: &[u8]) {
    let text = String::from_utf8_lossy(bytes);
    let (found, expected) = text.split_once('\n').unwrap_or((&text, ""));
    assert_eq!(check_unit(Some(found), found), Ok(()));
    let one_way = shown(check_unit(Some(found), expected)).is_some();
    assert_eq!(one_way, shown(check_unit(Some(expected), found)).is_some());
    let words: Vec<&str> = expected.split(' ').collect();
    let _ = did_you_mean(found, &words);
    let _ = hint_among(found, &words);
    let _ = listed(&words);
}
