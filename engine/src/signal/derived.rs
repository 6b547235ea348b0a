//! A column that is an expression of others: `u0 + du`, `100 * (h1 - h2) / 30`.
//!
//! Numbers, column names, + − × ÷ (also * /), parentheses. A name with spaces or signs stands in "quotes" or [brackets].

use super::log::LogTable;
use crate::explain::Explain;

/// Why an expression gives no column.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum ExpressionError {
    /// A name no column has.
    #[error("there is no column '{name}': the log has {columns}")]
    UnknownColumn {
        /// Name as typed.
        name: String,
        /// The names there are.
        columns: String,
    },
    /// Anything that does not read as an expression.
    #[error(
        "'{expression}' cannot be read from character {at} on: use column names, numbers, + - * / and parentheses"
    )]
    Syntax {
        /// Expression as typed.
        expression: String,
        /// Position from 1.
        at: usize,
    },
}

impl Explain for ExpressionError {
    fn key(&self) -> &'static str {
        match self {
            Self::UnknownColumn { .. } => "log.unknown_column",
            Self::Syntax { .. } => "log.expression_syntax",
        }
    }

    fn args(&self) -> Vec<(&'static str, String)> {
        match self {
            Self::UnknownColumn { name, columns } => {
                vec![("name", name.clone()), ("columns", columns.clone())]
            }
            Self::Syntax { expression, at } => {
                vec![("expression", expression.clone()), ("at", at.to_string())]
            }
        }
    }
}

impl ExpressionError {
    /// One value of every variant, for the test that compares sentences and translations.
    #[must_use]
    pub fn samples() -> Vec<Self> {
        vec![
            Self::UnknownColumn { name: "u1".to_owned(), columns: "u0, du".to_owned() },
            Self::Syntax { expression: "u0 +".to_owned(), at: 5 },
        ]
    }
}

/// Values of a column or an expression of columns, one a row; NaN where a column has no value.
///
/// # Errors
/// [`ExpressionError`] names the unknown column or the place that cannot be read.
pub fn derived_column(table: &LogTable, expression: &str) -> Result<Vec<f64>, ExpressionError> {
    if let Some(column) = table.column(expression) {
        return Ok(column.values.clone());
    }
    let mut parser = Parser { table, text: expression, chars: expression.char_indices().collect(), at: 0 };
    let value = parser.sum()?;
    parser.skip_blanks();
    if parser.at < parser.chars.len() {
        return Err(parser.syntax());
    }
    Ok(match value {
        Value::Number(number) => vec![number; table.len()],
        Value::Column(values) => values,
    })
}

enum Value {
    Number(f64),
    Column(Vec<f64>),
}

fn combine(a: Value, b: Value, f: impl Fn(f64, f64) -> f64) -> Value {
    match (a, b) {
        (Value::Number(a), Value::Number(b)) => Value::Number(f(a, b)),
        (Value::Number(a), Value::Column(b)) => Value::Column(b.into_iter().map(|b| f(a, b)).collect()),
        (Value::Column(a), Value::Number(b)) => Value::Column(a.into_iter().map(|a| f(a, b)).collect()),
        (Value::Column(a), Value::Column(b)) => {
            Value::Column(a.into_iter().zip(b).map(|(a, b)| f(a, b)).collect())
        }
    }
}

struct Parser<'a> {
    table: &'a LogTable,
    text: &'a str,
    chars: Vec<(usize, char)>,
    at: usize,
}

impl Parser<'_> {
    fn syntax(&self) -> ExpressionError {
        ExpressionError::Syntax { expression: self.text.to_owned(), at: self.at + 1 }
    }

    fn skip_blanks(&mut self) {
        while self.chars.get(self.at).is_some_and(|c| c.1.is_whitespace()) {
            self.at += 1;
        }
    }

    fn take(&mut self, any: &[char]) -> Option<char> {
        self.skip_blanks();
        let found = self.chars.get(self.at).map(|c| c.1).filter(|c| any.contains(c));
        self.at += usize::from(found.is_some());
        found
    }

    fn sum(&mut self) -> Result<Value, ExpressionError> {
        let mut value = self.product()?;
        while let Some(sign) = self.take(&['+', '-', '−']) {
            let other = self.product()?;
            value = if sign == '+' {
                combine(value, other, |a, b| a + b)
            } else {
                combine(value, other, |a, b| a - b)
            };
        }
        Ok(value)
    }

    fn product(&mut self) -> Result<Value, ExpressionError> {
        let mut value = self.factor(0)?;
        while let Some(sign) = self.take(&['*', '×', '/', '÷']) {
            let other = self.factor(0)?;
            value = if matches!(sign, '*' | '×') {
                combine(value, other, |a, b| a * b)
            } else {
                combine(value, other, |a, b| a / b)
            };
        }
        Ok(value)
    }

    fn factor(&mut self, depth: usize) -> Result<Value, ExpressionError> {
        /// Signs and parentheses before this many are no expression anyone means.
        const DEEPEST: usize = 100;
        if depth > DEEPEST || self.chars.iter().filter(|c| c.1 == '(').count() > DEEPEST {
            return Err(self.syntax());
        }
        if self.take(&['-', '−']).is_some() {
            return Ok(combine(Value::Number(0.0), self.factor(depth + 1)?, |a, b| a - b));
        }
        if self.take(&['(']).is_some() {
            let value = self.sum()?;
            return if self.take(&[')']).is_some() { Ok(value) } else { Err(self.syntax()) };
        }
        if let Some(open) = self.take(&['"', '[']) {
            let close = if open == '[' { ']' } else { '"' };
            let start = self.at;
            while self.chars.get(self.at).is_some_and(|c| c.1 != close) {
                self.at += 1;
            }
            let name: String = self.chars[start..self.at].iter().map(|c| c.1).collect();
            return if self.take(&[close]).is_some() { self.named(&name) } else { Err(self.syntax()) };
        }
        self.word()
    }

    fn word(&mut self) -> Result<Value, ExpressionError> {
        let start = self.at;
        let part = |c: char| c.is_alphanumeric() || matches!(c, '_' | '.' | ':' | '#' | '%' | '°');
        while let Some(&(_, c)) = self.chars.get(self.at) {
            let before = self.at.checked_sub(1).filter(|&b| b >= start).map(|b| self.chars[b].1);
            let digits_so_far = self.chars[start..self.at]
                .iter()
                .all(|c| c.1.is_ascii_digit() || matches!(c.1, '.' | 'e' | 'E'));
            let exponent_sign = matches!(c, '+' | '-')
                && digits_so_far
                && matches!(before, Some('e' | 'E'))
                && self.chars[start].1.is_ascii_digit();
            if !part(c) && !exponent_sign {
                break;
            }
            self.at += 1;
        }
        let word: String = self.chars[start..self.at].iter().map(|c| c.1).collect();
        if word.is_empty() {
            return Err(self.syntax());
        }
        if self.table.index_of(&word).is_none()
            && let Ok(number) = word.parse::<f64>()
        {
            return Ok(Value::Number(number));
        }
        self.named(&word)
    }

    fn named(&self, name: &str) -> Result<Value, ExpressionError> {
        match self.table.column(name) {
            Some(column) => Ok(Value::Column(column.values.clone())),
            None => Err(ExpressionError::UnknownColumn {
                name: name.to_owned(),
                columns: self.table.columns.iter().map(|c| c.name.as_str()).collect::<Vec<_>>().join(", "),
            }),
        }
    }
}
