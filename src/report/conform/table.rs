//! Tables to be judged: CSV with one quantity a row.

use std::collections::BTreeMap;
use std::io::Read;

use smithwalk_model::{Beckmann, Ggx};
use smithwalk_validation::Distribution;

use crate::description::nearest;
use crate::text::excerpt;

/// One row: what somebody says of one surface.
#[derive(Clone, Debug, PartialEq)]
pub struct Claim {
    /// The line of the file, from 1.
    pub line: u64,
    /// What is claimed.
    pub quantity: Quantity,
    /// The facets.
    pub facets: Facet,
    /// What a facet multiplies the light by.
    pub color: f64,
    /// Their normals.
    pub normals: Normals,
    /// Light that met one facet alone.
    pub single: bool,
    /// How much of it there is.
    pub value: f64,
    /// Its standard error.
    pub stderr: f64,
    /// The degrees of freedom of `stderr`: what it was estimated from, less 1.
    pub freedom: f64,
    /// The standard error of rounding to as many digits as there are.
    pub rounding: f64,
    /// Whatever the row has under `note`.
    pub note: String,
}

/// What is claimed. Directions are [cosθ, φ in radians] and point away from the
/// surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Quantity {
    /// The share of the light from `wi` that stays on its side.
    Albedo {
        /// Where the light comes from.
        wi: [f64; 2],
    },
    /// The share that goes through.
    Transmitted {
        /// Where the light comes from.
        wi: [f64; 2],
    },
    /// The share of diffuse light from above that stays there.
    MeanAlbedo,
    /// f, sr⁻¹, without a cosine.
    F {
        /// Where the light comes from.
        wi: [f64; 2],
        /// Where it goes.
        wo: [f64; 2],
    },
}

/// Kinds of facets.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Facet {
    /// Mirrors.
    Conductor,
    /// Smooth interfaces.
    Dielectric {
        /// Index inside (z < 0) over outside.
        eta: f64,
    },
    /// Lambertian.
    Diffuse,
}

/// Distributions of normals.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Normals {
    /// Trowbridge–Reitz, of α_x and α_y.
    Ggx([f64; 2]),
    /// Gaussian slopes.
    Beckmann([f64; 2]),
    /// D(m) ∝ m_z².
    Quadratic,
}

impl From<Normals> for Distribution {
    fn from(normals: Normals) -> Self {
        match normals {
            Normals::Ggx([alpha_x, alpha_y]) => Self::Ggx(Ggx { alpha_x, alpha_y }),
            Normals::Beckmann([alpha_x, alpha_y]) => Self::Beckmann(Beckmann { alpha_x, alpha_y }),
            Normals::Quadratic => Self::Quadratic,
        }
    }
}

impl Claim {
    /// Whether light comes from below.
    #[must_use]
    pub fn from_inside(&self) -> bool {
        match self.quantity {
            Quantity::Albedo { wi } | Quantity::Transmitted { wi } | Quantity::F { wi, .. } => {
                wi[0] < 0.0
            }
            Quantity::MeanAlbedo => false,
        }
    }
}

/// Why a table can't be judged.
#[derive(Debug, thiserror::Error)]
#[error("line {line}: {message}")]
pub struct TableProblem {
    line: u64,
    message: String,
}

/// The columns there may be. `value` alone is always needed.
const COLUMNS: [&str; 16] = [
    "quantity",
    "facets",
    "eta",
    "color",
    "distribution",
    "alpha",
    "alpha_y",
    "scattering",
    "cos",
    "azimuth",
    "cos_o",
    "azimuth_o",
    "value",
    "stderr",
    "freedom",
    "note",
];

/// Reads a table; lines that begin with # are comments.
///
/// # Errors
/// With the line, what was expected there and what was found.
pub fn read(file: impl Read) -> Result<Vec<Claim>, TableProblem> {
    let mut reader = csv::ReaderBuilder::new()
        .comment(Some(b'#'))
        .trim(csv::Trim::All)
        .from_reader(file.chain(&b"\n"[..]));
    // A record's own position is before the comments above it; the reader stands at the
    // beginning of the line after.
    let line_of = |reader: &csv::Reader<_>| reader.position().line() - 1;
    let broken = |error: csv::Error| TableProblem {
        line: error.position().map_or(1, csv::Position::line),
        message: error.to_string(),
    };
    let header = reader.headers().map_err(broken)?;
    let header: Vec<String> = header.iter().map(str::to_owned).collect();
    let line = line_of(&reader);
    for (index, name) in header.iter().enumerate() {
        let message = if header[..index].contains(name) {
            format!("the column `{}` is there twice", excerpt(name))
        } else if !COLUMNS.contains(&name.as_str()) {
            let like = nearest(name, COLUMNS.iter().copied())
                .map_or_else(String::new, |like| format!("; is `{like}` meant?"));
            let known = COLUMNS.join(", ");
            format!(
                "no column is called `{}`{like} Columns are {known}",
                excerpt(name)
            )
        } else {
            continue;
        };
        return Err(TableProblem { line, message });
    }
    let mut claims = Vec::new();
    let mut record = csv::StringRecord::new();
    while reader.read_record(&mut record).map_err(broken)? {
        let line = line_of(&reader);
        let cells = header.iter().map(String::as_str).zip(record.iter());
        let row = Row(cells.filter(|(_, text)| !text.is_empty()).collect());
        let claim = row.claim(line);
        claims.push(claim.map_err(|message| TableProblem { line, message })?);
    }
    if claims.is_empty() {
        let message = "expected rows, found none".to_owned();
        return Err(TableProblem { line, message });
    }
    Ok(claims)
}

/// The cells of a row that are not empty.
struct Row<'a>(BTreeMap<&'a str, &'a str>);

impl Row<'_> {
    fn claim(&self, line: u64) -> Result<Claim, String> {
        let quantity =
            match self.choice("quantity", &["albedo", "transmitted", "mean_albedo", "f"])? {
                "albedo" => Quantity::Albedo {
                    wi: self.direction("cos", "azimuth")?,
                },
                "transmitted" => Quantity::Transmitted {
                    wi: self.direction("cos", "azimuth")?,
                },
                "mean_albedo" => Quantity::MeanAlbedo,
                _ => Quantity::F {
                    wi: self.direction("cos", "azimuth")?,
                    wo: self.direction("cos_o", "azimuth_o")?,
                },
            };
        let facets = match self.choice("facets", &["conductor", "dielectric", "diffuse"])? {
            "conductor" => Facet::Conductor,
            "diffuse" => Facet::Diffuse,
            _ => Facet::Dielectric {
                eta: self.positive("eta")?,
            },
        };
        let alpha = || -> Result<[f64; 2], String> {
            let x = self.positive("alpha")?;
            let y = if self.0.contains_key("alpha_y") {
                self.positive("alpha_y")?
            } else {
                x
            };
            Ok([x, y])
        };
        let normals = match self.choice("distribution", &["ggx", "beckmann", "quadratic"])? {
            "ggx" => Normals::Ggx(alpha()?),
            "beckmann" => Normals::Beckmann(alpha()?),
            _ if self.0.contains_key("alpha") => {
                return Err("`alpha`: the quadratic distribution has no roughness".to_owned());
            }
            _ => Normals::Quadratic,
        };
        let claim = Claim {
            line,
            quantity,
            facets,
            color: self.within("color", Some(1.0), 0.0, 1.0)?,
            normals,
            single: self.choice("scattering", &["multiple", "single"])? == "single",
            value: self.number("value", None)?,
            stderr: self.within("stderr", Some(0.0), 0.0, f64::MAX)?,
            freedom: self.within("freedom", Some(f64::INFINITY), 1.0, f64::INFINITY)?,
            rounding: rounding(self.0.get("value").copied().unwrap_or("")),
            note: self.0.get("note").copied().unwrap_or("").to_owned(),
        };
        if claim.from_inside() && !matches!(claim.facets, Facet::Dielectric { .. }) {
            return Err("`cos`: nothing comes from below but through dielectrics".to_owned());
        }
        Ok(claim)
    }

    /// The cell's text; the first of `choices` where there is none.
    fn choice<'c>(&self, column: &str, choices: &[&'c str]) -> Result<&'c str, String> {
        let Some(&text) = self.0.get(column) else {
            return Ok(choices[0]);
        };
        let found = choices.iter().find(|choice| **choice == text);
        found.copied().ok_or_else(|| {
            let expected = choices.join(", ");
            format!(
                "`{column}`: expected one of {expected}; found `{}`",
                excerpt(text)
            )
        })
    }

    fn number(&self, column: &str, default: Option<f64>) -> Result<f64, String> {
        match (self.0.get(column), default) {
            (Some(text), _) => match text.parse() {
                Ok(number) if f64::is_finite(number) => Ok(number),
                _ => Err(format!(
                    "`{column}`: expected a number, found `{}`",
                    excerpt(text)
                )),
            },
            (None, Some(default)) => Ok(default),
            (None, None) => Err(format!("`{column}`: expected a number, found none")),
        }
    }

    fn within(
        &self,
        column: &str,
        default: Option<f64>,
        least: f64,
        most: f64,
    ) -> Result<f64, String> {
        let number = self.number(column, default)?;
        if (least..=most).contains(&number) {
            Ok(number)
        } else {
            Err(format!(
                "`{column}`: expected {least} to {most}, found {number}"
            ))
        }
    }

    fn positive(&self, column: &str) -> Result<f64, String> {
        let number = self.number(column, None)?;
        if number > 0.0 {
            Ok(number)
        } else {
            Err(format!(
                "`{column}`: expected a number above 0, found {number}"
            ))
        }
    }

    fn direction(&self, cos: &str, azimuth: &str) -> Result<[f64; 2], String> {
        let c = self.within(cos, None, -1.0, 1.0)?;
        if c == 0.0 {
            return Err(format!("`{cos}`: nothing is scattered along the horizon"));
        }
        Ok([c, self.number(azimuth, Some(0.0))?.to_radians()])
    }
}

/// The standard error of what a number written like this was rounded by: half a unit
/// of its last digit, evenly distributed.
fn rounding(text: &str) -> f64 {
    let (digits, exponent) = text
        .split_once(['e', 'E'])
        .map_or((text, 0), |(digits, e)| (digits, e.parse().unwrap_or(0)));
    let places = digits
        .split_once('.')
        .map_or(0, |(_, part)| part.len() as i32);
    10f64.powi(exponent - places) / 12f64.sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_tell_what_they_were_rounded_by() {
        for (text, unit) in [("0.709946", 1e-6), ("7.1e-3", 1e-4), ("3", 1.0)] {
            assert!(
                (rounding(text) * 12f64.sqrt() / unit - 1.0).abs() < 1e-12,
                "{text}"
            );
        }
    }

    #[test]
    fn problems_name_line_and_column() {
        let told = |text: &str| read(text.as_bytes()).expect_err("a problem").to_string();
        for (text, words) in [
            (
                "alfa,value\n1,1\n",
                "line 1: no column is called `alfa`; is `alpha` meant?",
            ),
            ("alpha,alpha,value\n1,1,1\n", "twice"),
            (
                "alpha,cos,value\n# c\n1,0.5,\n",
                "line 3: `value`: expected a number, found none",
            ),
            (
                "alpha,cos,value\n-1,0.5,1\n",
                "`alpha`: expected a number above 0, found -1",
            ),
            (
                "alpha,cos,value\n1,2,1\n",
                "`cos`: expected -1 to 1, found 2",
            ),
            (
                "alpha,cos,value\n1,-0.5,1\n",
                "`cos`: nothing comes from below",
            ),
            (
                "facets,alpha,cos,value\nwood,1,1,1\n",
                "`facets`: expected one of conductor",
            ),
            ("alpha,cos,value\n", "expected rows, found none"),
            ("alpha,cos,value\n1,1\n", "line 2"),
        ] {
            assert!(told(text).contains(words), "{text}: {}", told(text));
        }
    }
}
