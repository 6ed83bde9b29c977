//! Why a scene can't be rendered.

/// Everything that keeps a scene from being rendered, a line or more each.
#[derive(Debug, PartialEq, Eq)]
pub struct ResolveError {
    /// For people.
    pub problems: Vec<String>,
}

impl std::fmt::Display for ResolveError {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(&self.problems.join("\n"))
    }
}

impl std::error::Error for ResolveError {}
