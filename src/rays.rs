//! Kinds of rays, by which things may be hidden from some of them.

use serde::Deserialize;

/// A kind of ray, as Cycles tells them apart: by the scattering that sent it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum RayKind {
    /// From the camera, through nothing but what lets light straight through.
    Camera,
    /// Reflected by a diffuse closure.
    Diffuse,
    /// Reflected by a mirror or a rough metal or glass.
    Glossy,
    /// Scattered to the other side of a surface.
    Transmission,
    /// Towards a light sample.
    Shadow,
}

/// A set of kinds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct RayKinds(u8);

impl RayKinds {
    /// All of them.
    pub const ALL: Self = Self(0b1_1111);

    /// All but these.
    #[must_use]
    pub fn all_but(hidden: impl IntoIterator<Item = RayKind>) -> Self {
        hidden.into_iter().fold(Self::ALL, Self::without)
    }

    /// This set without a kind.
    #[must_use]
    pub fn without(self, kind: RayKind) -> Self {
        Self(self.0 & !kind.bit())
    }

    /// Whether a kind is among them.
    #[must_use]
    #[inline(always)]
    pub fn contains(self, kind: RayKind) -> bool {
        self.0 & kind.bit() != 0
    }

    /// Whether the set has a kind beside that of the camera's rays and shadow rays that
    /// is missing.
    #[must_use]
    pub fn hides_from_scattered(self) -> bool {
        let scattered = [RayKind::Diffuse, RayKind::Glossy, RayKind::Transmission];
        !scattered.into_iter().all(|kind| self.contains(kind))
    }

    /// As a mask of bits.
    pub(crate) fn mask(self) -> u32 {
        self.0.into()
    }
}

impl RayKind {
    #[inline(always)]
    fn bit(self) -> u8 {
        1 << self as u8
    }

    /// As a mask of bits.
    #[inline(always)]
    pub(crate) fn mask(self) -> u32 {
        self.bit().into()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_hidden_is_all_that_is_missing() {
        let all = [
            RayKind::Camera,
            RayKind::Diffuse,
            RayKind::Glossy,
            RayKind::Transmission,
            RayKind::Shadow,
        ];
        for hidden in all {
            let left = RayKinds::all_but([hidden]);
            assert!(all.iter().all(|&k| left.contains(k) == (k != hidden)));
        }
        assert!(all.iter().all(|&k| RayKinds::ALL.contains(k)));
        assert_eq!(RayKinds::all_but(all).mask(), 0);
    }
}
