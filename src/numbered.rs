//! Names of files of which every frame has one of its own.

use crate::text::excerpt;
use serde::Deserialize;
use std::path::PathBuf;

/// More than numbers of frames have, and less than file names may.
const MOST_DIGITS: usize = 32;

/// A file name with one row of `#`, which stands for the number of a frame: padded
/// with zeros to as many digits as there are `#`, as in Blender's output paths.
#[derive(Clone, Debug, PartialEq, Eq, Deserialize)]
#[serde(try_from = "String")]
pub struct Numbered {
    before: String,
    digits: usize,
    after: String,
}

/// A name in which it is not clear where the number goes.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("expected one row of at most 32 # where the number of the frame goes, as in frame_####, found `{}`", excerpt(.0))]
pub struct NotNumbered(String);

impl Numbered {
    /// # Errors
    /// When there is no row of `#` in it, or more than one.
    pub fn new(name: &str) -> Result<Self, NotNumbered> {
        let found = name.find('#').map(|start| {
            let after = name[start..].trim_start_matches('#');
            (start, name.len() - start - after.len(), after)
        });
        match found {
            Some((start, digits @ ..=MOST_DIGITS, after)) if !after.contains('#') => Ok(Self {
                before: name[..start].to_owned(),
                digits,
                after: after.to_owned(),
            }),
            _ => Err(NotNumbered(name.to_owned())),
        }
    }

    /// The name of a frame's file.
    #[must_use]
    pub fn at(&self, frame: i32) -> PathBuf {
        let Self {
            before,
            digits,
            after,
        } = self;
        let sign = if frame < 0 { "-" } else { "" };
        let number = frame.unsigned_abs();
        format!("{before}{sign}{number:0digits$}{after}").into()
    }
}

impl TryFrom<String> for Numbered {
    type Error = NotNumbered;

    fn try_from(name: String) -> Result<Self, NotNumbered> {
        Self::new(&name)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_stand_where_the_name_has_its_row() {
        let name = Numbered::new("a/f_####.yaml").unwrap();
        for (frame, path) in [
            (7, "a/f_0007.yaml"),
            (-12, "a/f_-0012.yaml"),
            (123_456, "a/f_123456.yaml"),
        ] {
            assert_eq!(name.at(frame), PathBuf::from(path));
        }
        assert_eq!(Numbered::new("#").unwrap().at(3), PathBuf::from("3"));
        for wrong in ["", "frames.yaml", "#/f_#.yaml", &"#".repeat(100_000)] {
            let error = Numbered::new(wrong).unwrap_err();
            assert!(error.to_string().len() < 300, "{error}");
        }
    }
}
