//! Words of the subset of IEC 61131-3 structured text that the export uses. Anything else is refused.

/// A word.
#[derive(Debug, Clone, PartialEq)]
pub enum Token {
    /// Keyword or name, in capitals: the norm does not tell them from small letters.
    Word(String),
    /// Number of type LREAL: it has a point.
    Real(f64),
    /// Sign of one or two characters.
    Sign(&'static str),
}

const SIGNS: [&str; 17] =
    [":=", "<>", "<=", ">=", "(", ")", ",", ";", ":", "+", "-", "*", "/", "=", "<", ">", "."];

/// Splits a text into words; comments are left out.
pub fn words(text: &str) -> Result<Vec<Token>, String> {
    let mut tokens = Vec::new();
    let mut rest = text.trim_start();
    while let Some(first) = rest.chars().next() {
        if let Some(comment) = rest.strip_prefix("(*") {
            let (_, after) = comment.split_once("*)").ok_or("a comment without end")?;
            rest = after.trim_start();
            continue;
        }
        let length = if first.is_ascii_alphabetic() {
            let end = rest.find(|c: char| !c.is_ascii_alphanumeric() && c != '_').unwrap_or(rest.len());
            tokens.push(Token::Word(rest[..end].to_uppercase()));
            end
        } else if first.is_ascii_digit() {
            let end = real_length(rest);
            let number = &rest[..end];
            if !number.contains('.') {
                return Err(format!("{number} is no LREAL: it has no point"));
            }
            tokens.push(Token::Real(number.parse().map_err(|_| format!("{number} is no number"))?));
            end
        } else {
            let sign =
                SIGNS.iter().find(|s| rest.starts_with(**s)).ok_or(format!("{first:?} has no place here"))?;
            tokens.push(Token::Sign(sign));
            sign.len()
        };
        rest = rest[length..].trim_start();
    }
    Ok(tokens)
}

/// Digits, point, digits, and an exponent with a capital E.
fn real_length(text: &str) -> usize {
    let digits =
        |from: usize| text[from..].find(|c: char| !c.is_ascii_digit()).map_or(text.len(), |n| from + n);
    let mut end = digits(0);
    if text[end..].starts_with('.') {
        end = digits(end + 1);
        if text[end..].starts_with('E') {
            let sign = usize::from(text[end + 1..].starts_with(['+', '-']));
            end = digits(end + 1 + sign);
        }
    }
    end
}
