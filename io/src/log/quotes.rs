//! Line ends inside quotes: a remark of several lines in one field is one field, and its row is one row.
//!
//! Only what is certain is joined. A quote opens where a field begins and closes where one ends; an opening that is
//! followed, some lines on, by another opening was a stray sign, and so is one that nothing closes.

use std::borrow::Cow;

/// Stands for a line end inside quotes, so that lines can still be counted.
pub(super) const FOLD: u8 = 0x1e;
/// Longest remark in lines and bytes.
const MOST_LINES: usize = 40;
const MOST_BYTES: usize = 8192;

/// A line with blanks where its remark had line ends.
pub(super) fn unfolded(line: Cow<'_, str>) -> Cow<'_, str> {
    if line.as_bytes().contains(&FOLD) { line.replace(char::from(FOLD), " ").into() } else { line }
}

fn is_separator(byte: u8) -> bool {
    matches!(byte, b',' | b';' | b'\t' | b'|')
}

/// How a quote that opens goes on.
enum Quote {
    /// It closes behind so many line ends; index of the closing sign.
    Closed { at: usize, lines: usize },
    /// The text ends before it does.
    Open,
    /// It is no quote around a field.
    Stray,
}

fn follow(text: &[u8], open: usize, line_end: u8) -> Quote {
    let mut lines = 0;
    let mut at = open + 1;
    while at < text.len() {
        if at - open > MOST_BYTES || lines > MOST_LINES {
            return Quote::Stray;
        }
        let byte = text[at];
        if byte == line_end {
            lines += 1;
        } else if byte == b'"' {
            let next = text.get(at + 1).copied();
            if next == Some(b'"') {
                at += 1;
            } else if next.is_none_or(|b| is_separator(b) || b == line_end || b == b'\r') {
                return Quote::Closed { at, lines };
            } else if lines > 0 && begins_field(text, at, line_end) {
                return Quote::Stray;
            }
        }
        at += 1;
    }
    Quote::Open
}

fn begins_field(text: &[u8], at: usize, line_end: u8) -> bool {
    at.checked_sub(1).is_none_or(|before| is_separator(text[before]) || text[before] == line_end)
}

/// Folds the line ends inside quotes. Gives the bytes of whole rows: fewer than all where a quote is open at the end, so
/// that its row can be tried again with what follows.
pub(super) fn fold(text: &mut [u8], line_end: u8) -> usize {
    let mut from = 0;
    while let Some(found) = memchr::memchr(b'"', &text[from..]) {
        let at = from + found;
        from = at + 1;
        if !begins_field(text, at, line_end) {
            continue;
        }
        match follow(text, at, line_end) {
            Quote::Closed { at: close, lines } => {
                if lines > 0 {
                    for byte in &mut text[at..close] {
                        if *byte == line_end {
                            *byte = FOLD;
                        } else if *byte == b'\r' {
                            *byte = b' ';
                        }
                    }
                }
                from = close + 1;
            }
            Quote::Open => return memchr::memrchr(line_end, &text[..at]).map_or(0, |end| end + 1),
            Quote::Stray => {}
        }
    }
    text.len()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn folded(text: &str) -> (String, usize) {
        let mut bytes = text.as_bytes().to_vec();
        let whole = fold(&mut bytes, b'\n');
        (String::from_utf8(bytes).expect("text").replace('\u{1e}', "¶"), whole)
    }

    #[test]
    fn a_remark_of_several_lines_is_one_field() {
        let (text, whole) = folded("t,note,y\n0,\"first\nline, two\",3\n1,\"a \"\"b\"\"\n\nc\",4\n");
        assert_eq!(text, "t,note,y\n0,\"first¶line, two\",3\n1,\"a \"\"b\"\"¶¶c\",4\n");
        assert_eq!(whole, text.replace('¶', "x").len());
    }

    #[test]
    fn a_stray_quote_swallows_no_rows() {
        for text in [
            "t,y\n0,5\"\n1,6\n2,7\n",
            "t,s,y\n0,\"AUTO,3\n1,\"MAN\",4\n2,\"MAN\",5\n",
            "a,\"b\",c\n1,\"2\",3\n",
        ] {
            assert_eq!(folded(text), (text.to_owned(), text.len()), "{text}");
        }
        let long = format!("t,y\n0,\"5\n{}", "1,6\n".repeat(200));
        assert_eq!(folded(&long), (long.clone(), long.len()));
    }

    #[test]
    fn a_quote_that_is_open_at_the_end_waits_for_more() {
        let text = "t,note\n0,\"x\"\n1,\"first\n";
        assert_eq!(folded(text).1, "t,note\n0,\"x\"\n".len());
    }
}
