//! Which samples of a pixel a film has.

use std::ops::Range;

/// A set of sample indices: ranges in ascending order with gaps between them.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Taken {
    ranges: Vec<Range<u32>>,
}

impl Taken {
    /// The samples of these ranges, in any order; `None` when one is empty or two
    /// have a sample in common.
    #[must_use]
    pub fn new(mut ranges: Vec<Range<u32>>) -> Option<Self> {
        ranges.sort_unstable_by_key(|range| range.start);
        let mut taken = Self::default();
        for range in ranges {
            if range.is_empty() || taken.end() > range.start {
                return None;
            }
            match taken.ranges.last_mut() {
                Some(last) if last.end == range.start => last.end = range.end,
                _ => taken.ranges.push(range),
            }
        }
        Some(taken)
    }

    /// The ranges, in ascending order.
    #[must_use]
    pub fn ranges(&self) -> &[Range<u32>] {
        &self.ranges
    }

    /// Number of samples.
    #[must_use]
    pub fn count(&self) -> u32 {
        self.ranges
            .iter()
            .map(|range| range.end - range.start)
            .sum()
    }

    /// Number of samples with an index below `end`.
    #[must_use]
    pub fn count_below(&self, end: u32) -> u32 {
        let below = |range: &Range<u32>| range.end.min(end).saturating_sub(range.start);
        self.ranges.iter().map(below).sum()
    }

    /// The index behind the last sample; 0 without one.
    #[must_use]
    pub fn end(&self) -> u32 {
        self.ranges.last().map_or(0, |range| range.end)
    }

    /// Whether it has the samples from the first one on, without a gap.
    #[must_use]
    pub fn is_whole(&self) -> bool {
        matches!(self.ranges[..], [Range { start: 0, .. }])
    }

    /// Adds the sample `index`, which comes behind all others.
    pub(super) fn push(&mut self, index: u32) {
        debug_assert!(index >= self.end());
        match self.ranges.last_mut() {
            Some(last) if last.end == index => last.end += 1,
            _ => self.ranges.push(index..index + 1),
        }
    }

    /// The samples of both; `None` when they have one in common.
    #[must_use]
    pub fn union(&self, other: &Self) -> Option<Self> {
        Self::new([&self.ranges[..], &other.ranges[..]].concat())
    }
}

impl std::fmt::Display for Taken {
    /// For people: `0–15, 32–47`.
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        if self.ranges.is_empty() {
            return f.write_str("none");
        }
        for (position, range) in self.ranges.iter().enumerate() {
            let comma = if position > 0 { ", " } else { "" };
            write!(f, "{comma}{}–{}", range.start, range.end - 1)?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ranges_join_and_overlaps_are_refused() {
        let taken = |ranges: &[Range<u32>]| Taken::new(ranges.to_vec());
        let whole = taken(&[8..16, 0..8]).unwrap();
        assert_eq!(whole.ranges(), std::slice::from_ref(&(0..16)));
        assert!(whole.is_whole());
        let gap = taken(&[0..4, 8..12]).unwrap();
        assert_eq!((gap.count(), gap.count_below(9), gap.end()), (8, 5, 12));
        assert_eq!(gap.to_string(), "0–3, 8–11");
        assert!(!gap.is_whole());
        assert_eq!(taken(&[0..4, 3..8]), None);
        assert_eq!(gap.union(&taken(&[5..7, 7..9]).unwrap()), None);
        let filled = gap.union(&taken(&[4..6, 6..8]).unwrap()).unwrap();
        assert_eq!((filled.count(), filled.is_whole()), (12, true));
    }

    #[test]
    fn samples_are_added_one_by_one() {
        let mut taken = Taken::default();
        (8..12).for_each(|index| taken.push(index));
        assert_eq!(taken.ranges(), std::slice::from_ref(&(8..12)));
    }
}
