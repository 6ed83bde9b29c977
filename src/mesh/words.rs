//! What lines of an OBJ file consist of.

/// The words of a line up to a comment. MSVC writes numbers that are none with
/// a `#` inside.
pub(super) struct Words<'a>(pub &'a [u8]);

impl<'a> Iterator for Words<'a> {
    type Item = &'a [u8];

    fn next(&mut self) -> Option<&'a [u8]> {
        let text = self.0.trim_ascii_start();
        let end = text
            .iter()
            .position(|byte| byte.is_ascii_whitespace() || *byte == b'#');
        let mut end = end.unwrap_or(text.len());
        let mut rest = &text[end..];
        if rest.first() == Some(&b'#') {
            let word_end = text.iter().position(u8::is_ascii_whitespace);
            let word_end = word_end.unwrap_or(text.len());
            if is_no_number(&text[..word_end]) {
                end = word_end;
                rest = &text[end..];
            } else {
                rest = b"";
            }
        }
        self.0 = rest;
        (end > 0).then(|| &text[..end])
    }
}

/// Whether this is how a C library writes infinity or a NaN: `-1.#IND`,
/// `1.#INF00`, `1.#QNAN`, `1.#J` (rounded to two digits), `-nan(ind)`.
pub(super) fn is_no_number(word: &[u8]) -> bool {
    let word = word
        .strip_prefix(b"-")
        .or(word.strip_prefix(b"+"))
        .unwrap_or(word);
    let starts = |beginnings: &[&[u8]]| {
        let begins = |beginning: &&[u8]| {
            word.get(..beginning.len())
                .is_some_and(|start| start.eq_ignore_ascii_case(beginning))
        };
        beginnings.iter().any(begins)
    };
    starts(&[
        b"1.#inf", b"1.#ind", b"1.#qnan", b"1.#snan", b"1.#j", b"1.#r", b"nan(", b"nan:",
    ])
}

/// Writes an index. A hot path: three million per million triangles.
pub(super) fn push_decimal(out: &mut Vec<u8>, mut number: u64) {
    let mut digits = [0; 20];
    let mut start = digits.len();
    loop {
        start -= 1;
        digits[start] = b'0' + (number % 10) as u8;
        number /= 10;
        if number == 0 {
            break;
        }
    }
    out.extend_from_slice(&digits[start..]);
}
