//! The terminal: results on standard output, progress on standard error.

use std::io::{ErrorKind, IsTerminal, Write};
use std::path::PathBuf;
use std::sync::Mutex;
use std::time::Duration;

use comfy_table::{Cell, CellAlignment, ContentArrangement, Table, TableComponent, presets};
use indicatif::{ProgressBar, ProgressStyle};

use super::answer::Listener;
use super::stop::Stop;
use crate::io::InputError;
use crate::report::Listing;

/// Columns of text where there is no terminal to ask.
const DEFAULT_WIDTH: u16 = 110;

/// Where a command shows what it does and what came of it.
pub(super) struct Screen {
    width: u16,
    progress: bool,
    /// A program that takes the place of the terminal.
    caller: Option<Caller>,
}

/// What is told to a program.
struct Caller {
    text: Mutex<String>,
    listener: Listener,
}

impl Screen {
    /// The terminal of this process; `progress` is told even where there is none.
    pub fn new(progress: bool) -> Self {
        let width = Table::new().width().unwrap_or(DEFAULT_WIDTH).clamp(60, 160);
        Self { width, progress, caller: None }
    }

    /// No terminal: results are kept, and progress is told to `listener`.
    pub fn collecting(listener: Listener) -> Self {
        Self { width: DEFAULT_WIDTH, progress: false, caller: Some(Caller { text: Mutex::default(), listener }) }
    }

    /// What was kept.
    pub fn collected(self) -> String {
        self.caller.and_then(|caller| caller.text.into_inner().ok()).unwrap_or_default()
    }

    /// Prints a result.
    pub fn print(&self, text: &str) -> Result<(), Stop> {
        if let Some(caller) = &self.caller {
            let mut kept = caller.text.lock().map_err(|_| Stop::Bug("a thread has stopped while it told".to_owned()))?;
            kept.push_str(text);
            return Ok(());
        }
        let mut out = std::io::stdout().lock();
        let written = out.write_all(text.as_bytes()).and_then(|()| out.flush());
        written.map_err(|error| match error.kind() {
            ErrorKind::BrokenPipe => Stop::Unread,
            _ => InputError::new("standard output", format!("cannot be written ({error})")).into(),
        })
    }

    /// What tells the progress of one piece of work.
    pub fn progress(&self) -> Progress {
        let listener = self.caller.as_ref().map(|caller| Listener::clone(&caller.listener));
        let bar = (listener.is_none() && std::io::stderr().is_terminal()).then(bar);
        Progress { lines: self.progress && bar.is_none(), bar, listener, last: Mutex::new(String::new()) }
    }

    /// A table with these heads over its columns; those that begin with `>` hold numbers and are aligned right.
    pub fn table<const N: usize>(&self, heads: [&str; N]) -> Table {
        self.table_of(&heads)
    }

    /// A table as a report lists it.
    pub fn listing(&self, listing: &Listing) -> Table {
        let aligned = listing.heads.iter().zip(listing.numbers());
        let heads: Vec<String> = aligned.map(|(head, number)| format!("{}{head}", if number { ">" } else { "" })).collect();
        let mut table = self.table_of(&heads.iter().map(String::as_str).collect::<Vec<_>>());
        listing.rows.iter().for_each(|row| {
            table.add_row(row);
        });
        table
    }

    fn table_of(&self, heads: &[&str]) -> Table {
        let mut table = Table::new();
        table.load_preset(presets::NOTHING).set_content_arrangement(ContentArrangement::Dynamic).set_width(self.width);
        for component in [TableComponent::HeaderLines, TableComponent::MiddleHeaderIntersections] {
            table.set_style(component, '\u{2500}');
        }
        table.set_header(heads.iter().map(|head| Cell::new(head.trim_start_matches('>'))));
        for (column, head) in table.column_iter_mut().zip(heads) {
            if head.starts_with('>') {
                column.set_cell_alignment(CellAlignment::Right);
            }
        }
        table
    }

    /// `text` in lines that fit: the first after `head`, those after it indented as far as that is long.
    pub fn wrapped(&self, head: &str, text: &str) -> String {
        let indent = head.chars().count();
        let (mut out, mut length) = (head.to_owned(), indent);
        for (k, word) in text.split(' ').enumerate() {
            let letters = word.chars().count();
            if k > 0 && length + 1 + letters > usize::from(self.width) {
                out.push('\n');
                out.extend(std::iter::repeat_n(' ', indent));
                length = indent;
            } else if k > 0 {
                out.push(' ');
                length += 1;
            }
            out.push_str(word);
            length += letters;
        }
        out
    }
}

/// A table below its title, with blank lines around.
pub(super) fn titled(title: &str, table: &Table) -> String {
    format!("\n{title}\n\n{}\n", table.trim_fmt())
}

/// What was written, a line each, below what is told.
pub(super) fn written(paths: &[PathBuf]) -> String {
    paths.iter().fold("\n".to_owned(), |text, path| text + &format!("Written: {}\n", path.display()))
}

fn bar() -> ProgressBar {
    // The template is a constant; a bar of the library's own style is no harm.
    let style = ProgressStyle::with_template("{spinner} {msg} {wide_bar:.dim} {pos}/{len} {elapsed}");
    let bar = ProgressBar::new(1).with_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()));
    bar.enable_steady_tick(Duration::from_millis(100));
    bar
}

/// Tells the steps of one piece of work, and wipes them away when dropped.
pub(super) struct Progress {
    bar: Option<ProgressBar>,
    listener: Option<Listener>,
    /// Whether each step is a line of its own.
    lines: bool,
    last: Mutex<String>,
}

impl Progress {
    /// Tells that `step` is being done, and how many of how many parts of it lie behind; 0 where nobody knows how many there are.
    pub fn tell(&self, step: &str, done: usize, of: usize) {
        if let Some(listener) = &self.listener {
            listener(step, done, of);
        }
        if let Some(bar) = &self.bar {
            bar.set_message(step.to_owned());
            match of {
                0 => bar.unset_length(),
                _ => bar.set_length(of as u64),
            }
            bar.set_position(done as u64);
        }
        if self.lines
            && let Ok(mut last) = self.last.lock()
            && *last != step
        {
            eprintln!("{step} ...");
            step.clone_into(&mut last);
        }
    }
}

impl Drop for Progress {
    fn drop(&mut self) {
        if let Some(bar) = &self.bar {
            bar.finish_and_clear();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn text_is_wrapped_between_words() {
        let screen = Screen { width: 10, progress: false, caller: None };
        assert_eq!(screen.wrapped("- ", "one two three four"), "- one two\n  three\n  four");
        assert_eq!(screen.wrapped("", "one two three"), "one two\nthree");
    }

    #[test]
    fn tables_fit_the_terminal() {
        let screen = Screen { width: 60, progress: false, caller: None };
        let mut table = screen.table(["name", ">value"]);
        table.add_row(["x".repeat(10), "word ".repeat(40)]);
        assert!(table.trim_fmt().lines().all(|line| line.chars().count() <= 60));
    }
}
