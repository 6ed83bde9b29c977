//! What a film keeps beside the colour.

use serde::Deserialize;

/// An arbitrary output variable: a layer of the image beside its colour.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Aov {
    /// Directional albedo of the first surface, in [0, 1]; 0 where there is none.
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
}

impl Aov {
    /// All of them, in the order of their layers.
    pub const ALL: [Self; 6] = [
        Self::Albedo,
        Self::Normal,
        Self::Depth,
        Self::Variance,
        Self::Single,
        Self::Multiple,
    ];

    /// The name in scene files and of the layer in EXR files.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Albedo => "albedo",
            Self::Normal => "normal",
            Self::Depth => "depth",
            Self::Variance => "variance",
            Self::Single => "single",
            Self::Multiple => "multiple",
        }
    }

    /// Whether it describes the first surface that a camera ray meets.
    pub const fn is_of_first_hit(self) -> bool {
        matches!(self, Self::Albedo | Self::Normal | Self::Depth)
    }

    /// Names of its channels in EXR files.
    pub(super) const fn channels(self) -> &'static [&'static str] {
        match self {
            Self::Normal => &["X", "Y", "Z"],
            Self::Depth => &["Z"],
            Self::Albedo | Self::Variance | Self::Single | Self::Multiple => &["R", "G", "B"],
        }
    }
}

/// The AOVs that were asked for.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct AovSet(pub(super) u8);

impl AovSet {
    /// No AOVs: the colour alone.
    pub const NONE: Self = Self(0);

    /// Whether `aov` was asked for.
    pub const fn contains(self, aov: Aov) -> bool {
        self.0 & (1 << aov as u8) != 0
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
                .fold(0, |bits, aov| bits | (1 << aov as u8)),
        )
    }
}
