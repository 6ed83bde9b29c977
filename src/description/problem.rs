//! What is wrong with a scene file, told to the person who wrote it.

use crate::text::bounded;
use std::borrow::Cow;
use std::fmt;

/// One thing wrong with a scene file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Problem {
    /// The file, or the option, that holds the mistake.
    pub source: String,
    /// Counted from 1; 0 when the whole source is meant.
    pub line: usize,
    /// In characters, counted from 1.
    pub column: usize,
    /// The keys and indices that lead to the place, joined by dots.
    pub path: String,
    /// What was expected and what was found.
    pub message: String,
    /// The known name that looks most like an unknown one.
    pub nearest: Option<String>,
    excerpt: String,
    /// Characters of the excerpt before the place.
    indent: usize,
    width: usize,
    /// Which source, in the order of reading.
    order: usize,
}

impl Problem {
    /// A problem with a source as a whole.
    pub(super) fn of_source(source: &str, message: String) -> Self {
        Self {
            source: source.to_owned(),
            line: 0,
            column: 0,
            path: String::new(),
            message,
            nearest: None,
            excerpt: String::new(),
            indent: 0,
            width: 0,
            order: 0,
        }
    }
}

/// All that is wrong with a scene file; never empty.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub struct Problems(Vec<Problem>);

impl Problems {
    pub(super) fn new(mut problems: Vec<Problem>) -> Self {
        problems.sort_by_key(|problem| (problem.order, problem.line, problem.column));
        Self(problems)
    }

    /// The problems, in the order of their lines.
    pub fn iter(&self) -> impl Iterator<Item = &Problem> {
        self.0.iter()
    }
}

impl fmt::Display for Problems {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        for (index, problem) in self.0.iter().enumerate() {
            if index > 0 {
                f.write_str("\n")?;
            }
            problem.fmt(f)?;
        }
        Ok(())
    }
}

impl fmt::Display for Problem {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str(&self.source)?;
        if self.line > 0 {
            write!(f, ":{}:{}", self.line, self.column)?;
        }
        f.write_str(": ")?;
        if !self.path.is_empty() {
            write!(f, "{}: ", self.path)?;
        }
        f.write_str(&self.message)?;
        if let Some(name) = &self.nearest {
            write!(f, "; did you mean `{name}`?")?;
        }
        if self.line > 0 {
            let number = self.line.to_string();
            let margin = " ".repeat(number.len());
            // Tabs stay tabs, so that the caret lands below what it points at.
            let indent: String = self
                .excerpt
                .chars()
                .take(self.indent)
                .map(|c| if c == '\t' { '\t' } else { ' ' })
                .collect();
            write!(
                f,
                "\n {number} | {}\n {margin} | {indent}{}",
                self.excerpt,
                "^".repeat(self.width)
            )?;
        }
        Ok(())
    }
}

/// Where something stands in one of the sources. Small, since every node has one.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Place {
    /// The index of the source.
    pub source: u32,
    /// Counted from 1.
    pub line: u32,
    /// In characters, counted from 1.
    pub column: u32,
    /// In characters; 1 for what has no text of its own.
    pub width: u32,
}

impl Place {
    /// Numbers beyond 32 bits stay at the largest.
    pub fn new(source: usize, line: usize, column: usize, width: usize) -> Self {
        let [source, line, column, width] =
            [source, line, column, width].map(|number| u32::try_from(number).unwrap_or(u32::MAX));
        Self {
            source,
            line,
            column,
            width,
        }
    }
}

/// The texts that a description is read from, and what is wrong with them.
#[derive(Default)]
pub(super) struct Sources<'a> {
    texts: Vec<(String, Cow<'a, str>)>,
    problems: Vec<Problem>,
}

/// Past this many, further problems are more likely to bury the cause.
const MAX_PROBLEMS: usize = 50;
/// In bytes; longer names are not compared with others.
const MAX_NAME: usize = 200;
/// In bytes; longer messages and paths are cut.
const MAX_MESSAGE: usize = 1000;
/// In characters: what is shown of a line, and how far before the place it
/// starts if the line is longer.
const EXCERPT: usize = 160;
const BEFORE: usize = 60;

/// What is shown of a line, and how many of its characters come before `column`,
/// counted from 1.
fn excerpt(line: &str, column: usize) -> (String, usize) {
    let start = match line.chars().nth(EXCERPT) {
        Some(_) => (column - 1).saturating_sub(BEFORE),
        None => 0,
    };
    let shown = line.chars().skip(start).take(EXCERPT);
    // What moves the cursor would move the caret away from the place.
    let shown = shown.map(|c| {
        if c.is_control() && c != '\t' {
            '\u{fffd}'
        } else {
            c
        }
    });
    let before = if start > 0 { "…" } else { "" };
    let excerpt: String = before.chars().chain(shown).collect();
    let indent = column - 1 - start + before.chars().count();
    (excerpt.trim_end().to_owned(), indent)
}

impl<'a> Sources<'a> {
    /// Adds a text and gives its index.
    pub fn add(&mut self, name: &str, text: impl Into<Cow<'a, str>>) -> usize {
        self.texts.push((name.to_owned(), text.into()));
        self.texts.len() - 1
    }

    pub fn report(&mut self, place: Place, path: String, message: String, nearest: Option<String>) {
        if self.is_full() {
            return;
        }
        let (name, text) = &self.texts[place.source as usize];
        let (mut number, mut column) = (place.line as usize, place.column as usize);
        let line = match text.lines().nth(number - 1) {
            Some(line) => line,
            // The end of the text is shown behind its last line.
            None => {
                let last = text.lines().last().unwrap_or_default();
                number = text.lines().count().max(1);
                column = last.chars().count() + 1;
                last
            }
        };
        let (excerpt, indent) = excerpt(line, column);
        let room = excerpt.chars().count().saturating_sub(indent);
        self.problems.push(Problem {
            source: name.clone(),
            line: number,
            column,
            path: bounded(&path, MAX_MESSAGE),
            message: bounded(&message, MAX_MESSAGE),
            nearest,
            excerpt,
            indent,
            width: (place.width as usize).min(room).max(1),
            order: place.source as usize,
        });
    }

    /// A place and the path to it, as problems begin.
    pub fn describe(&self, place: Place, path: &str) -> String {
        let (name, _) = &self.texts[place.source as usize];
        let (line, column) = (place.line, place.column);
        bounded(&format!("{name}:{line}:{column}: {path}"), MAX_MESSAGE)
    }

    pub fn report_whole(&mut self, source: usize, message: &str) {
        let name = &self.texts[source].0;
        self.problems
            .push(Problem::of_source(name, message.to_owned()));
    }

    pub fn is_full(&self) -> bool {
        self.problems.len() >= MAX_PROBLEMS
    }

    pub fn count(&self) -> usize {
        self.problems.len()
    }

    pub fn into_problems(self) -> Problems {
        Problems::new(self.problems)
    }
}

/// The candidate that looks most like `name`, if any looks alike.
pub(crate) fn nearest<'a>(
    name: &str,
    candidates: impl IntoIterator<Item = &'a str>,
) -> Option<String> {
    // Longer names are no slip of the pen, and take long to compare.
    let comparable = |name: &str| name.len() <= MAX_NAME;
    candidates
        .into_iter()
        .filter(|candidate| comparable(name) && comparable(candidate))
        .map(|candidate| {
            (
                strsim::jaro_winkler(&name.to_lowercase(), &candidate.to_lowercase()),
                candidate,
            )
        })
        .filter(|(likeness, _)| *likeness > 0.75)
        .max_by(|a, b| a.0.total_cmp(&b.0))
        .map(|(_, candidate)| candidate.to_owned())
}
