//! Texts of strangers in our messages.

/// Characters of a quoted text that are shown: enough to know it by.
const SHOWN: usize = 60;

/// The beginning of `text`, on one line and without what a terminal would obey.
pub(crate) fn excerpt(text: &str) -> String {
    let mut shown = String::new();
    for (index, character) in text.chars().enumerate() {
        if index == SHOWN {
            shown.push('…');
            break;
        }
        push_printable(&mut shown, character);
    }
    shown
}

/// As [`excerpt`], of bytes that need not be text.
pub(crate) fn excerpt_of_bytes(bytes: &[u8]) -> String {
    // No character of UTF-8 has more than four bytes.
    excerpt(&String::from_utf8_lossy(
        &bytes[..bytes.len().min(4 * SHOWN + 4)],
    ))
}

/// Adds a character, escaped if it is a control character or turns the
/// direction of what follows.
fn push_printable(out: &mut String, character: char) {
    let turns = matches!(character, '\u{200e}' | '\u{200f}' | '\u{202a}'..='\u{202e}' | '\u{2066}'..='\u{2069}');
    if character.is_control() || turns {
        out.extend(character.escape_default());
    } else {
        out.push(character);
    }
}

/// A message of at most `bytes` bytes with every control character but line
/// breaks and tabs escaped; says how much it leaves out.
#[must_use]
pub fn bounded(message: &str, bytes: usize) -> String {
    let mut shown = String::new();
    for (index, character) in message.char_indices() {
        if shown.len() >= bytes {
            let left = message.len() - index;
            shown.push_str(&format!("… ({left} more bytes)"));
            break;
        }
        match character {
            '\n' | '\t' => shown.push(character),
            _ => push_printable(&mut shown, character),
        }
    }
    shown
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn excerpts_are_short_and_harmless() {
        assert_eq!(
            excerpt("a\u{1b}[31m\nb\u{202e}"),
            "a\\u{1b}[31m\\nb\\u{202e}"
        );
        assert_eq!(excerpt(&"ä".repeat(100)), "ä".repeat(SHOWN) + "…");
        assert_eq!(excerpt_of_bytes(b"W\xfcrfel"), "W\u{fffd}rfel");
        assert_eq!(bounded("a\n\u{7}bcd", 8), "a\n\\u{7}b… (2 more bytes)");
    }
}
