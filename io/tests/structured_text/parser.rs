//! From words to statements; every name is declared, every type fits.

use std::collections::BTreeMap;

use super::lexer::Token;

/// Type of a variable or expression.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Type {
    Real,
    Bool,
}

/// A value.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Value {
    Real(f64),
    Bool(bool),
}

/// An expression.
#[derive(Debug)]
pub enum Expression {
    Constant(Value),
    Variable(usize),
    Call(&'static str, Vec<Expression>),
    Unary(&'static str, Box<Expression>),
    Binary(&'static str, Box<Expression>, Box<Expression>),
}

/// A statement.
#[derive(Debug)]
pub enum Statement {
    Assign(usize, Expression),
    If(Vec<(Expression, Vec<Statement>)>, Vec<Statement>),
}

/// A function block.
#[derive(Debug)]
pub struct Block {
    pub name: String,
    /// Index and type of each variable.
    pub variables: BTreeMap<String, (usize, Type)>,
    pub start: Vec<Value>,
    pub body: Vec<Statement>,
}

type Parsed<T> = Result<T, String>;

struct Parser {
    tokens: std::iter::Peekable<std::vec::IntoIter<Token>>,
    variables: BTreeMap<String, (usize, Type)>,
    start: Vec<Value>,
}

/// Functions of the norm with the number of their arguments, all LREAL.
const FUNCTIONS: [(&str, usize); 4] = [("ABS", 1), ("LIMIT", 3), ("MAX", 2), ("MIN", 2)];
const KEYWORDS: [&str; 20] = [
    "FUNCTION_BLOCK",
    "END_FUNCTION_BLOCK",
    "VAR",
    "VAR_INPUT",
    "VAR_OUTPUT",
    "END_VAR",
    "IF",
    "THEN",
    "ELSIF",
    "ELSE",
    "END_IF",
    "AND",
    "OR",
    "NOT",
    "TRUE",
    "FALSE",
    "LREAL",
    "BOOL",
    "XOR",
    "MOD",
];
/// Binary operators, weakest first; the norm's order.
const LEVELS: [&[&str]; 6] =
    [&["OR"], &["AND"], &["=", "<>"], &["<", ">", "<=", ">="], &["+", "-"], &["*", "/"]];

/// Reads one function block.
pub fn block(tokens: Vec<Token>) -> Parsed<Block> {
    let mut parser =
        Parser { tokens: tokens.into_iter().peekable(), variables: BTreeMap::new(), start: Vec::new() };
    parser.word("FUNCTION_BLOCK")?;
    let name = parser.name()?;
    while parser.take_word(&["VAR_INPUT", "VAR_OUTPUT", "VAR"]).is_some() {
        while parser.take_word(&["END_VAR"]).is_none() {
            parser.declaration()?;
        }
    }
    let body = parser.statements(&["END_FUNCTION_BLOCK"])?;
    parser.word("END_FUNCTION_BLOCK")?;
    match parser.tokens.next() {
        None => Ok(Block { name, variables: parser.variables, start: parser.start, body }),
        Some(token) => Err(format!("{token:?} after the end")),
    }
}

impl Parser {
    fn take_word(&mut self, among: &[&'static str]) -> Option<&'static str> {
        let Some(Token::Word(word)) = self.tokens.peek() else { return None };
        let found = among.iter().find(|w| *w == word)?;
        self.tokens.next();
        Some(found)
    }

    fn word(&mut self, word: &'static str) -> Parsed<()> {
        let found = format!("{:?}", self.tokens.peek());
        self.take_word(&[word]).map(|_| ()).ok_or(format!("{word} expected, not {found}"))
    }

    fn take_sign(&mut self, among: &[&'static str]) -> Option<&'static str> {
        let Some(Token::Sign(sign)) = self.tokens.peek() else { return None };
        let found = among.iter().find(|s| *s == sign)?;
        self.tokens.next();
        Some(found)
    }

    fn sign(&mut self, sign: &'static str) -> Parsed<()> {
        let found = format!("{:?}", self.tokens.peek());
        self.take_sign(&[sign]).map(|_| ()).ok_or(format!("{sign} expected, not {found}"))
    }

    fn name(&mut self) -> Parsed<String> {
        match self.tokens.next() {
            Some(Token::Word(word)) if !KEYWORDS.contains(&word.as_str()) => Ok(word),
            other => Err(format!("a name expected, not {other:?}")),
        }
    }

    fn declaration(&mut self) -> Parsed<()> {
        let name = self.name()?;
        self.sign(":")?;
        let kind = match self.take_word(&["LREAL", "BOOL"]) {
            Some("LREAL") => Type::Real,
            Some(_) => Type::Bool,
            None => return Err(format!("{name} has no type of the subset")),
        };
        let mut value = if kind == Type::Real { Value::Real(0.0) } else { Value::Bool(false) };
        if self.take_sign(&[":="]).is_some() {
            let (expression, given) = self.primary()?;
            value = match expression {
                Expression::Constant(constant) if given == kind => constant,
                Expression::Unary("-", inner) => match *inner {
                    Expression::Constant(Value::Real(x)) if kind == Type::Real => Value::Real(-x),
                    _ => return Err(format!("{name} starts with no constant")),
                },
                _ => return Err(format!("{name} starts with no constant of its type")),
            };
        }
        self.sign(";")?;
        let index = self.start.len();
        self.start.push(value);
        match self.variables.insert(name.clone(), (index, kind)) {
            None => Ok(()),
            Some(_) => Err(format!("{name} is declared twice")),
        }
    }

    fn statements(&mut self, ends: &[&str]) -> Parsed<Vec<Statement>> {
        let mut statements = Vec::new();
        loop {
            match self.tokens.peek() {
                Some(Token::Word(word)) if ends.contains(&word.as_str()) => return Ok(statements),
                Some(Token::Word(word)) if word == "IF" => statements.push(self.condition()?),
                Some(_) => statements.push(self.assignment()?),
                None => return Err(format!("the text ends where {ends:?} is due")),
            }
        }
    }

    fn condition(&mut self) -> Parsed<Statement> {
        let mut branches = Vec::new();
        let mut otherwise = Vec::new();
        self.word("IF")?;
        loop {
            let (test, kind) = self.expression(0)?;
            if kind != Type::Bool {
                return Err("IF without a BOOL".to_owned());
            }
            self.word("THEN")?;
            branches.push((test, self.statements(&["ELSIF", "ELSE", "END_IF"])?));
            match self.take_word(&["ELSIF", "ELSE", "END_IF"]) {
                Some("ELSIF") => {}
                Some("ELSE") => {
                    otherwise = self.statements(&["END_IF"])?;
                    self.word("END_IF")?;
                    break;
                }
                _ => break,
            }
        }
        self.sign(";")?;
        Ok(Statement::If(branches, otherwise))
    }

    fn assignment(&mut self) -> Parsed<Statement> {
        let name = self.name()?;
        let &(index, kind) = self.variables.get(&name).ok_or(format!("{name} is not declared"))?;
        self.sign(":=")?;
        let (value, given) = self.expression(0)?;
        self.sign(";")?;
        if given == kind { Ok(Statement::Assign(index, value)) } else { Err(format!("{name} is a {kind:?}")) }
    }

    fn expression(&mut self, level: usize) -> Parsed<(Expression, Type)> {
        let Some(operators) = LEVELS.get(level) else { return self.primary() };
        let (mut left, mut kind) = self.expression(level + 1)?;
        while let Some(operator) = self.take_sign(operators).or_else(|| self.take_word(operators)) {
            let (right, other) = self.expression(level + 1)?;
            let logical = matches!(operator, "OR" | "AND");
            let either = matches!(operator, "=" | "<>");
            let wanted = if logical { Type::Bool } else { Type::Real };
            if kind != other || !either && kind != wanted {
                return Err(format!("{kind:?} {operator} {other:?}"));
            }
            if !matches!(operator, "+" | "-" | "*" | "/") {
                kind = Type::Bool;
            }
            left = Expression::Binary(operator, Box::new(left), Box::new(right));
        }
        Ok((left, kind))
    }

    fn primary(&mut self) -> Parsed<(Expression, Type)> {
        if self.take_sign(&["("]).is_some() {
            let inner = self.expression(0)?;
            self.sign(")")?;
            return Ok(inner);
        }
        let negated = self.take_sign(&["-"]).or_else(|| self.take_word(&["NOT"]));
        if let Some(operator) = negated {
            let (inner, kind) = self.primary()?;
            let wanted = if operator == "-" { Type::Real } else { Type::Bool };
            let whole = Expression::Unary(operator, Box::new(inner));
            return if kind == wanted { Ok((whole, kind)) } else { Err(format!("{operator} {kind:?}")) };
        }
        match self.take_word(&["TRUE", "FALSE"]) {
            Some(truth) => return Ok((Expression::Constant(Value::Bool(truth == "TRUE")), Type::Bool)),
            None => {
                if let Some(Token::Real(x)) = self.tokens.peek() {
                    let constant = Expression::Constant(Value::Real(*x));
                    self.tokens.next();
                    return Ok((constant, Type::Real));
                }
            }
        }
        let name = self.name()?;
        if let Some(&(function, count)) = FUNCTIONS.iter().find(|(f, _)| *f == name) {
            return self.call(function, count);
        }
        let &(index, kind) = self.variables.get(&name).ok_or(format!("{name} is not declared"))?;
        Ok((Expression::Variable(index), kind))
    }

    fn call(&mut self, function: &'static str, count: usize) -> Parsed<(Expression, Type)> {
        self.sign("(")?;
        let mut arguments = Vec::new();
        loop {
            let (argument, kind) = self.expression(0)?;
            if kind != Type::Real {
                return Err(format!("{function} of a BOOL"));
            }
            arguments.push(argument);
            if self.take_sign(&[","]).is_none() {
                break;
            }
        }
        self.sign(")")?;
        if arguments.len() == count {
            Ok((Expression::Call(function, arguments), Type::Real))
        } else {
            Err(format!("{function} takes {count} values"))
        }
    }
}
