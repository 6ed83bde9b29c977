//! How many samples a pass takes.

use std::time::Duration;

/// Between two looks at the clock, at most this share of the time limit.
const TIME_SLICE: f64 = 0.05;

/// Samples per pixel of a pass at most.
const LONGEST_PASS: u32 = 64;

/// Samples per pixel of the next pass: doubling from one, so that early noise figures
/// are cheap and late passes are long enough to keep threads busy.
pub(in super::super) fn pass_length(
    done: u32,
    left: u32,
    time: Option<Duration>,
    sample: Duration,
) -> u32 {
    let doubling = done.clamp(1, LONGEST_PASS).min(left);
    match time {
        Some(time) if !sample.is_zero() => {
            let slice = (time.as_secs_f64() * TIME_SLICE / sample.as_secs_f64()) as u32;
            doubling.min(slice.max(1))
        }
        _ => doubling,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn passes_double_and_keep_to_the_time() {
        let second = Duration::from_secs(1);
        assert_eq!(pass_length(0, 100, None, second), 1);
        assert_eq!(pass_length(16, 100, None, second), 16);
        assert_eq!(pass_length(1000, 1000, None, second), LONGEST_PASS);
        assert_eq!(pass_length(1000, 3, None, second), 3);
        assert_eq!(pass_length(1000, 1000, Some(100 * second), second), 5);
        assert_eq!(pass_length(1000, 1000, Some(second), second), 1);
    }
}
