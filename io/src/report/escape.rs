//! Text from outside, made harmless.

/// Text as it may stand in HTML and SVG, in attributes too. Characters that XML does not allow become U+FFFD.
pub(super) fn escape(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '&' => out.push_str("&amp;"),
            '<' => out.push_str("&lt;"),
            '>' => out.push_str("&gt;"),
            '"' => out.push_str("&quot;"),
            '\'' => out.push_str("&#39;"),
            '\n' | '\t' => out.push(' '),
            c if c.is_control() || c == '\u{fffe}' || c == '\u{ffff}' => out.push('\u{fffd}'),
            c => out.push(c),
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::escape;

    #[test]
    fn no_text_leaves_its_place() {
        assert_eq!(
            escape("<script>alert('a&b')</script>"),
            "&lt;script&gt;alert(&#39;a&amp;b&#39;)&lt;/script&gt;"
        );
        assert_eq!(escape("a\"b\u{0}c\u{1b}"), "a&quot;b\u{fffd}c\u{fffd}");
        assert_eq!(escape("Füllstand 液位 °C"), "Füllstand 液位 °C");
    }
}
