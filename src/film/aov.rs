//! What a film keeps beside the colour. To add an AOV: a row of the table here, and
//! its value where paths are traced, in [`Sample::with`]'s caller.
//!
//! [`Sample::with`]: super::Sample::with

use serde::{Deserialize, Serialize};

/// An arbitrary output variable: a layer of the image beside its colour.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Aov {
    /// The colour of the first surface, of its facets, its base or what it lets
    /// through, which noise filters take for the albedo; 0 where there is none.
    Albedo,
    /// Shading normal of the first surface in world space, averaged over the
    /// samples and hence shorter than 1 at edges; 0 where there is none.
    Normal,
    /// Distance to the first surface along the view axis in metres, averaged over the
    /// samples that have one; 1e10, as in Blender, where none has.
    Depth,
    /// Variance of the pixel's mean colour, see [`super::FilmTile::variance`].
    Variance,
    /// The part of the colour that met no microsurface more than once per
    /// surface interaction.
    Single,
    /// The rest: what multiple scattering within microsurfaces adds.
    Multiple,
    /// What a transparent film does not let through: one minus the share of the camera's
    /// rays that reach the world or a holdout.
    Alpha,
}

/// What becomes of an AOV's values.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Accumulation {
    /// Their mean over all samples.
    Mean,
    /// Their mean over the samples that have one; this where none has.
    MeanOfHits(f64),
    /// It has none: it follows from the colour.
    OfColor,
}

/// A row of the table of AOVs.
pub(super) struct Row {
    pub aov: Aov,
    /// In messages and, but for alpha, scene files.
    pub name: &'static str,
    /// In EXR files; none stands beside the colour.
    pub layer: &'static str,
    /// In EXR files.
    pub channels: &'static [&'static str],
    pub accumulation: Accumulation,
    /// Whether it describes the first surface that a camera ray meets.
    pub of_first_hit: bool,
}

/// Depth where no sample met a surface, as in Blender, in metres.
const NO_DEPTH: f64 = 1e10;

const RGB: &[&str] = &["R", "G", "B"];

/// In the order of the enum and of an image's layers.
const TABLE: [Row; Aov::COUNT] = {
    use Accumulation::{Mean, MeanOfHits, OfColor};
    const fn row(
        aov: Aov,
        name: &'static str,
        channels: &'static [&'static str],
        accumulation: Accumulation,
        of_first_hit: bool,
    ) -> Row {
        Row {
            aov,
            name,
            layer: name,
            channels,
            accumulation,
            of_first_hit,
        }
    }
    [
        row(Aov::Albedo, "albedo", RGB, Mean, true),
        row(Aov::Normal, "normal", &["X", "Y", "Z"], Mean, true),
        row(Aov::Depth, "depth", &["Z"], MeanOfHits(NO_DEPTH), true),
        row(Aov::Variance, "variance", RGB, OfColor, false),
        row(Aov::Single, "single", RGB, Mean, false),
        row(Aov::Multiple, "multiple", RGB, Mean, false),
        Row {
            layer: "",
            ..row(Aov::Alpha, "alpha", &["A"], Mean, false)
        },
    ]
};

impl Aov {
    /// Number of all AOVs.
    pub const COUNT: usize = Self::Alpha as usize + 1;

    /// All of them, in the order of their layers.
    pub const ALL: [Self; Self::COUNT] = {
        let mut all = [Self::Albedo; Self::COUNT];
        let mut index = 0;
        while index < all.len() {
            all[index] = TABLE[index].aov;
            index += 1;
        }
        all
    };

    pub(super) const fn row(self) -> &'static Row {
        &TABLE[self as usize]
    }

    /// The name in messages and scene files, and but for alpha of the layer in EXR files.
    pub const fn name(self) -> &'static str {
        self.row().name
    }

    /// Whether it describes the first surface that a camera ray meets.
    pub const fn is_of_first_hit(self) -> bool {
        self.row().of_first_hit
    }
}

/// The AOVs that were asked for.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct AovSet(u32);

impl AovSet {
    /// No AOVs: the colour alone.
    pub const NONE: Self = Self(0);

    /// Whether `aov` was asked for.
    pub const fn contains(self, aov: Aov) -> bool {
        self.0 & (1 << aov as u32) != 0
    }

    /// Those asked for, in the order of [`Aov::ALL`].
    pub fn iter(self) -> impl Iterator<Item = Aov> {
        Aov::ALL.into_iter().filter(move |&aov| self.contains(aov))
    }
}

impl FromIterator<Aov> for AovSet {
    fn from_iter<I: IntoIterator<Item = Aov>>(aovs: I) -> Self {
        Self(
            aovs.into_iter()
                .fold(0, |bits, aov| bits | (1 << aov as u32)),
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_table_is_in_the_order_of_the_enum_and_has_its_names() {
        for (index, aov) in Aov::ALL.into_iter().enumerate() {
            assert_eq!(aov as usize, index);
            let named: Aov = serde_json::from_value(aov.name().into()).unwrap();
            assert_eq!(named, aov);
        }
    }
}
