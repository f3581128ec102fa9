//! Paths from one folder to another's file.

use std::path::{Component, Path, PathBuf};

/// The path that leads to `file` from `folder`, with `/` between its parts: relative where the two share a top folder,
/// so that both can be moved together, and absolute otherwise. `folder` need not exist yet.
pub(super) fn path_from(folder: &Path, file: &Path) -> String {
    let (from, to) = (whole(folder), whole(file));
    let (from_parts, to_parts): (Vec<_>, Vec<_>) = (from.components().collect(), to.components().collect());
    let shared = from_parts.iter().zip(&to_parts).take_while(|(a, b)| a == b).count();
    let top = to_parts.iter().take_while(|c| matches!(c, Component::Prefix(_) | Component::RootDir)).count();
    if shared <= top {
        return to.to_string_lossy().into_owned();
    }
    let up = std::iter::repeat_n("..".into(), from_parts.len() - shared);
    let down = to_parts[shared..].iter().map(|part| part.as_os_str().to_string_lossy());
    up.chain(down).collect::<Vec<_>>().join("/")
}

/// The absolute path without links, as far as it exists.
fn whole(path: &Path) -> PathBuf {
    let absolute = std::path::absolute(path).unwrap_or_else(|_| path.to_path_buf());
    let known = absolute.ancestors().find_map(|part| Some((part, part.canonicalize().ok()?)));
    match known {
        Some((part, real)) => match absolute.strip_prefix(part) {
            Ok(rest) if rest.as_os_str().is_empty() => real,
            Ok(rest) => real.join(rest),
            Err(_) => absolute,
        },
        None => absolute,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn paths_lead_from_folder_to_file() {
        let path = |folder: &str, file: &str| path_from(Path::new(folder), Path::new(file));
        assert_eq!(path("/no_such/a", "/no_such/a/q.csv"), "q.csv");
        assert_eq!(path("/no_such/out/x", "/no_such/a/q.csv"), "../../a/q.csv");
        assert_eq!(path("/no_such/out", "/other/q.csv"), "/other/q.csv");
        assert_eq!(path("out", "data/q.csv"), "../data/q.csv");
    }
}
