//! A function block in operation.

use super::lexer::words;
use super::parser::{Block, Expression, Statement, Type, Value, block};

/// A block with its variables.
pub struct Instance {
    block: Block,
    values: Vec<Value>,
}

impl Instance {
    /// Reads a text and puts every variable to its start.
    pub fn new(text: &str) -> Result<Self, String> {
        let block = block(words(text)?)?;
        let values = block.start.clone();
        Ok(Self { block, values })
    }

    pub fn name(&self) -> &str {
        &self.block.name
    }

    fn index(&self, name: &str, kind: Type) -> usize {
        let (index, found) = self.block.variables[name];
        assert_eq!(found, kind, "{name}");
        index
    }

    pub fn set(&mut self, name: &str, value: f64) {
        let index = self.index(name, Type::Real);
        self.values[index] = Value::Real(value);
    }

    pub fn switch(&mut self, name: &str, on: bool) {
        let index = self.index(name, Type::Bool);
        self.values[index] = Value::Bool(on);
    }

    pub fn real(&self, name: &str) -> f64 {
        real(self.values[self.index(name, Type::Real)])
    }

    pub fn truth(&self, name: &str) -> bool {
        truth(self.values[self.index(name, Type::Bool)])
    }

    /// One call of the block.
    pub fn call(&mut self) {
        execute(&self.block.body, &mut self.values);
    }
}

fn execute(body: &[Statement], values: &mut [Value]) {
    for statement in body {
        match statement {
            Statement::Assign(index, expression) => values[*index] = evaluate(expression, values),
            Statement::If(branches, otherwise) => {
                let taken = branches.iter().find(|(test, _)| truth(evaluate(test, values)));
                execute(taken.map_or(otherwise, |(_, body)| body), values);
            }
        }
    }
}

fn real(value: Value) -> f64 {
    match value {
        Value::Real(x) => x,
        Value::Bool(_) => panic!("the parser checks types"),
    }
}

fn truth(value: Value) -> bool {
    match value {
        Value::Bool(b) => b,
        Value::Real(_) => panic!("the parser checks types"),
    }
}

fn evaluate(expression: &Expression, values: &[Value]) -> Value {
    match expression {
        Expression::Constant(value) => *value,
        Expression::Variable(index) => values[*index],
        Expression::Unary("-", inner) => Value::Real(-real(evaluate(inner, values))),
        Expression::Unary(_, inner) => Value::Bool(!truth(evaluate(inner, values))),
        Expression::Call(function, arguments) => {
            let x: Vec<f64> = arguments.iter().map(|a| real(evaluate(a, values))).collect();
            Value::Real(match *function {
                "ABS" => x[0].abs(),
                "MAX" => x[0].max(x[1]),
                "MIN" => x[0].min(x[1]),
                // The norm: LIMIT(MN, IN, MX) = MIN(MAX(IN, MN), MX).
                _ => x[1].max(x[0]).min(x[2]),
            })
        }
        Expression::Binary(operator, left, right) => {
            match (operator, evaluate(left, values), evaluate(right, values)) {
                (&"OR", Value::Bool(a), Value::Bool(b)) => Value::Bool(a || b),
                (&"AND", Value::Bool(a), Value::Bool(b)) => Value::Bool(a && b),
                (&"=", a, b) => Value::Bool(a == b),
                (&"<>", a, b) => Value::Bool(a != b),
                (operator, a, b) => arithmetic(operator, real(a), real(b)),
            }
        }
    }
}

fn arithmetic(operator: &str, a: f64, b: f64) -> Value {
    match operator {
        "<" => Value::Bool(a < b),
        ">" => Value::Bool(a > b),
        "<=" => Value::Bool(a <= b),
        ">=" => Value::Bool(a >= b),
        "+" => Value::Real(a + b),
        "-" => Value::Real(a - b),
        "*" => Value::Real(a * b),
        _ => Value::Real(a / b),
    }
}
