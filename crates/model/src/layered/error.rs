//! What is wrong with a stack.

use std::fmt;

/// A number that a stack cannot be made with.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Quantity {
    /// The absolute index of refraction of an interface: positive.
    Ior,
    /// A slope roughness: not negative.
    Alpha,
    /// The thickness of a slab: not negative.
    Thickness,
    /// The absorption of a slab, per unit of length: not negative.
    Absorption,
    /// The factor on an interface's reflectance at normal incidence: not
    /// negative, and no more than makes it 1.
    Reflection,
    /// The factor on what an interface lets through: from 0 to 1.
    Transmission,
    /// An albedo or a reflectance: from 0 to 1.
    Reflectance,
    /// A component of a complex index of refraction: not negative, and not 0
    /// both.
    ComplexIndex,
    /// The share of a mix: from 0 to 1.
    Share,
}

impl Quantity {
    /// Its name, and what it has to be.
    fn words(self) -> [&'static str; 2] {
        match self {
            Self::Ior => ["index of refraction", "positive and finite"],
            Self::Alpha => ["alpha", "0 or more, and finite"],
            Self::Thickness => ["thickness", "0 or more, and finite"],
            Self::Absorption => ["absorption", "0 or more, and finite"],
            Self::Reflection => [
                "colour of reflection",
                "0 or more, and such that no more than all is reflected",
            ],
            Self::Transmission => ["colour of transmission", "between 0 and 1"],
            Self::Reflectance => ["reflectance", "between 0 and 1"],
            Self::ComplexIndex => ["complex index", "0 or more, finite, and not 0 + 0i"],
            Self::Share => ["share of the mix", "between 0 and 1"],
        }
    }
}

/// Why a stack cannot be made.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum LayeredError {
    /// A number is out of its range.
    Range {
        /// The number of the interface, 1 for the topmost; `None` is the base.
        interface: Option<usize>,
        /// What it is.
        quantity: Quantity,
        /// Its value.
        value: f64,
    },
    /// Neither an interface nor a base.
    Empty,
    /// The last interface of an open stack has absorption below it, where
    /// there is no slab.
    AbsorptionBelow,
    /// A mix of no surfaces, or one whose shares, of this sum, do not add up
    /// to 1.
    Shares(f64),
    /// One part of a mixed base is open: light would be both stopped and let
    /// through.
    OpenInMix,
}

impl fmt::Display for LayeredError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Range {
                interface,
                quantity,
                value,
            } => {
                let [name, range] = quantity.words();
                match interface {
                    Some(number) => write!(f, "interface {number}: ")?,
                    None => write!(f, "base: ")?,
                }
                write!(f, "the {name} is {value}, but must be {range}")
            }
            Self::Empty => write!(f, "a stack needs an interface or a base"),
            Self::AbsorptionBelow => write!(
                f,
                "the last interface absorbs below it, but without a base there is no slab"
            ),
            Self::Shares(sum) => write!(
                f,
                "the shares of the base's mix add up to {sum}, but must to 1"
            ),
            Self::OpenInMix => write!(f, "a part of the base's mix is open"),
        }
    }
}

impl std::error::Error for LayeredError {}
