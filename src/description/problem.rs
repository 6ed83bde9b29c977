//! What is wrong with a scene file, told to the person who wrote it.

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
                .take(self.column - 1)
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

/// Where something stands in one of the sources.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Place {
    /// The index of the source.
    pub source: usize,
    /// Counted from 1.
    pub line: usize,
    /// In characters, counted from 1.
    pub column: usize,
    /// In characters; 1 for what has no text of its own.
    pub width: usize,
}

/// The texts that a description is read from, and what is wrong with them.
#[derive(Default)]
pub(super) struct Sources {
    texts: Vec<(String, String)>,
    problems: Vec<Problem>,
}

/// Past this many, further problems are more likely to bury the cause.
const MAX_PROBLEMS: usize = 50;

impl Sources {
    /// Adds a text and gives its index.
    pub fn add(&mut self, name: &str, text: &str) -> usize {
        self.texts.push((name.to_owned(), text.to_owned()));
        self.texts.len() - 1
    }

    pub fn report(&mut self, place: Place, path: String, message: String, nearest: Option<String>) {
        if self.is_full() {
            return;
        }
        let (name, text) = &self.texts[place.source];
        let mut place = place;
        let excerpt = match text.lines().nth(place.line - 1) {
            Some(line) => line,
            // The end of the text is shown behind its last line.
            None => {
                let last = text.lines().last().unwrap_or_default();
                place.line = text.lines().count().max(1);
                place.column = last.chars().count() + 1;
                last
            }
        };
        let excerpt = excerpt.trim_end().to_owned();
        let room = excerpt.chars().count().saturating_sub(place.column - 1);
        self.problems.push(Problem {
            source: name.clone(),
            line: place.line,
            column: place.column,
            path,
            message,
            nearest,
            excerpt,
            width: place.width.min(room).max(1),
            order: place.source,
        });
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
pub(super) fn nearest<'a>(
    name: &str,
    candidates: impl IntoIterator<Item = &'a str>,
) -> Option<String> {
    candidates
        .into_iter()
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
