//! Expressions of a scene: numbers and conditions in `x`, `y`, `z` (rest position) and `t`.

use std::borrow::Cow;
use std::fmt;

use crate::error::beginning;

pub(crate) type Unary = fn(f64) -> f64;
pub(crate) type Binary = fn(f64, f64) -> f64;

/// Functions of one argument.
pub(crate) const UNARY: &[(&str, Unary)] = &[
    ("abs", f64::abs),
    ("acos", f64::acos),
    ("asin", f64::asin),
    ("atan", f64::atan),
    ("cbrt", f64::cbrt),
    ("ceil", f64::ceil),
    ("cos", f64::cos),
    ("cosh", f64::cosh),
    ("exp", f64::exp),
    ("floor", f64::floor),
    ("ln", f64::ln),
    ("log", f64::ln),
    ("log10", f64::log10),
    ("log2", f64::log2),
    ("round", f64::round),
    ("sign", sign),
    ("sin", f64::sin),
    ("sinh", f64::sinh),
    ("sqrt", f64::sqrt),
    ("tan", f64::tan),
    ("tanh", f64::tanh),
];

/// Functions of two arguments.
pub(crate) const BINARY: &[(&str, Binary)] = &[
    ("atan2", f64::atan2),
    ("hypot", f64::hypot),
    ("max", f64::max),
    ("maximum", f64::max),
    ("min", f64::min),
    ("minimum", f64::min),
    ("pow", f64::powf),
];

pub(crate) const CONSTANTS: &[(&str, f64)] = &[("pi", std::f64::consts::PI), ("tau", std::f64::consts::TAU)];
const VARIABLES: [&str; 4] = ["x", "y", "z", "t"];
/// Deepest nesting of operands that [`Expression::value`] holds without allocating.
const STACK: usize = 48;
/// Characters of a text that a message shows.
const SHOWN: usize = 120;
/// Longest text (characters).
const LONGEST: usize = 65_536;

fn sign(a: f64) -> f64 {
    if a == 0.0 { 0.0 } else { a.signum() }
}

/// What is wrong with the text of an expression: one line that quotes it.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("cannot read the expression \"{}\": {reason}", beginning(text, SHOWN))]
pub struct ExpressionError {
    /// The text.
    pub text: String,
    /// What is wrong and what is accepted.
    pub reason: String,
}

/// Whether a (sub)expression is a number or a condition.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Kind {
    Number,
    Condition,
}

#[derive(Clone, Copy, Debug)]
enum Op {
    Push(f64),
    Load(u8),
    Unary(Unary),
    Binary(Binary),
    /// condition, then, else
    Select,
    /// Repeats the value on top (chained comparisons).
    Keep,
}

/// An expression ready to be evaluated any number of times without allocating.
///
/// Operators, loosest first: `||` (`|`, `or`), `&&` (`&`, `and`), `!` (`not`), comparisons (chains such as
/// `0 < x < 1` mean what they say), `+ -`, `* / %`, unary `-`, `^` (`**`, binds to the right, before unary minus: `-x^2`
/// is `-(x^2)`). Numbers are 64-bit floats throughout: `1/2` is 0.5. Functions: those of the standard library by their usual
/// names, `min`, `max`, `atan2`, `hypot`, `pow` and `if(condition, a, b)`; constants `pi`, `tau`.
#[derive(Clone)]
pub struct Expression {
    body: Body,
    kind: Kind,
    uses: [bool; 4],
}

#[derive(Clone)]
enum Body {
    /// A number by itself; making one allocates nothing.
    Constant(f64),
    Formula {
        text: String,
        program: Vec<Op>,
    },
}

impl fmt::Debug for Expression {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "Expression({:?})", self.text())
    }
}

impl PartialEq for Expression {
    fn eq(&self, other: &Self) -> bool {
        self.text() == other.text()
    }
}

impl Expression {
    /// Reads a number: any expression that is not a condition.
    ///
    /// # Errors
    /// [`ExpressionError`] says where the text stops making sense, with the nearest known name for an unknown one.
    pub fn number(text: &str) -> Result<Self, ExpressionError> {
        Self::read(text, Kind::Number)
    }

    /// Reads a condition such as `x < 1e-6 && abs(y) < 0.5`.
    ///
    /// # Errors
    /// As [`Self::number`].
    pub fn condition(text: &str) -> Result<Self, ExpressionError> {
        Self::read(text, Kind::Condition)
    }

    /// The number itself.
    pub fn constant(value: f64) -> Self {
        Expression {
            body: Body::Constant(value),
            kind: Kind::Number,
            uses: [false; 4],
        }
    }

    fn read(text: &str, wanted: Kind) -> Result<Self, ExpressionError> {
        let fail = |reason: String| ExpressionError {
            text: text.to_owned(),
            reason,
        };
        let length = text.chars().count();
        if length > LONGEST {
            return Err(fail(format!(
                "it has {length} characters; at most {LONGEST} are accepted"
            )));
        }
        let mut parser = Parser::new(text).map_err(fail)?;
        let kind = parser.disjunction().map_err(fail)?;
        if let Some(token) = parser.peek() {
            return Err(fail(format!("{token} is not expected there")));
        }
        if kind != wanted {
            return Err(fail(match wanted {
                Kind::Number => "it is a condition where a number is needed".into(),
                Kind::Condition => "it is a number where a condition is needed, such as x < 0.5".into(),
            }));
        }
        Ok(Expression {
            body: Body::Formula {
                text: text.to_owned(),
                program: parser.program,
            },
            kind,
            uses: parser.uses,
        })
    }

    /// The text it was read from.
    pub fn text(&self) -> Cow<'_, str> {
        match &self.body {
            Body::Constant(value) => format!("{value:?}").into(),
            Body::Formula { text, .. } => text.into(),
        }
    }

    /// The text as a message quotes it: the beginning of a long one.
    pub(crate) fn shown(&self) -> String {
        beginning(&self.text(), SHOWN)
    }

    /// Whether its value depends on the time.
    pub fn uses_time(&self) -> bool {
        self.uses[3]
    }

    /// Whether its value depends on the place.
    pub fn uses_place(&self) -> bool {
        self.uses[..3].contains(&true)
    }

    /// The value at a rest position (m) and a time (s). NaN where a function has no value.
    pub fn value(&self, place: &nalgebra::Vector3<f64>, t: f64) -> f64 {
        let program = match &self.body {
            Body::Constant(value) => return *value,
            Body::Formula { program, .. } => program,
        };
        let variables = [place.x, place.y, place.z, t];
        let mut stack = [0.0f64; STACK];
        let mut top = 0;
        for op in program {
            match *op {
                Op::Push(value) => {
                    stack[top] = value;
                    top += 1;
                }
                Op::Load(k) => {
                    stack[top] = variables[k as usize];
                    top += 1;
                }
                Op::Keep => {
                    // a b  ->  b a b: the left operand of the next link waits below the finished comparison
                    let (a, b) = (stack[top - 2], stack[top - 1]);
                    stack[top - 2..=top].copy_from_slice(&[b, a, b]);
                    top += 1;
                }
                Op::Unary(f) => stack[top - 1] = f(stack[top - 1]),
                Op::Binary(f) => {
                    top -= 1;
                    stack[top - 1] = f(stack[top - 1], stack[top]);
                }
                Op::Select => {
                    top -= 2;
                    stack[top - 1] = if stack[top - 1] != 0.0 {
                        stack[top]
                    } else {
                        stack[top + 1]
                    };
                }
            }
        }
        stack[0]
    }

    /// Whether the condition holds at a rest position (m).
    pub fn holds(&self, place: &nalgebra::Vector3<f64>) -> bool {
        debug_assert!(self.kind == Kind::Condition);
        self.value(place, 0.0) != 0.0
    }
}

#[derive(Clone, Debug, PartialEq)]
enum Token {
    Number(f64),
    Name(String),
    Symbol(&'static str),
}

impl fmt::Display for Token {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Token::Number(n) => write!(f, "the number {n}"),
            Token::Name(n) => write!(f, "\"{n}\""),
            Token::Symbol(s) => write!(f, "\"{s}\""),
        }
    }
}

const SYMBOLS: [&str; 20] = [
    "&&", "||", "**", "<=", ">=", "==", "!=", "&", "|", "^", "<", ">", "!", "+", "-", "*", "/", "%", "(", ")",
];

fn tokens(text: &str) -> Result<Vec<Token>, String> {
    let mut out = Vec::new();
    let mut rest = text.trim_start();
    while let Some(first) = rest.chars().next() {
        let used = if first.is_ascii_digit() || first == '.' {
            let n = number_length(rest.as_bytes());
            let value: f64 = rest[..n]
                .parse()
                .map_err(|_| format!("\"{}\" is not a number", &rest[..n]))?;
            if !value.is_finite() {
                return Err(format!("{} is not a finite number", &rest[..n]));
            }
            out.push(Token::Number(value));
            n
        } else if first.is_ascii_alphabetic() || first == '_' {
            let n = rest
                .find(|c: char| !c.is_ascii_alphanumeric() && c != '_')
                .unwrap_or(rest.len());
            out.push(match &rest[..n] {
                "and" => Token::Symbol("&&"),
                "or" => Token::Symbol("||"),
                "not" => Token::Symbol("!"),
                name => Token::Name(name.to_owned()),
            });
            n
        } else if first == ',' {
            out.push(Token::Symbol(","));
            1
        } else {
            let symbol = SYMBOLS.iter().find(|s| rest.starts_with(**s));
            let symbol = symbol.ok_or_else(|| format!("\"{first}\" is not an operator"))?;
            out.push(Token::Symbol(match *symbol {
                "&" => "&&",
                "|" => "||",
                "**" => "^",
                s => s,
            }));
            symbol.len()
        };
        rest = rest[used..].trim_start();
    }
    Ok(out)
}

/// Length of the decimal number that `s` begins with, exponent included.
fn number_length(s: &[u8]) -> usize {
    let digits = |from: usize| {
        s[from..]
            .iter()
            .take_while(|c| c.is_ascii_digit() || **c == b'.')
            .count()
    };
    let mut n = digits(0);
    if n < s.len() && (s[n] | 32) == b'e' {
        let sign = usize::from(n + 1 < s.len() && (s[n + 1] == b'+' || s[n + 1] == b'-'));
        let exponent = s[n + 1 + sign..].iter().take_while(|c| c.is_ascii_digit()).count();
        if exponent > 0 {
            n += 1 + sign + exponent;
        }
    }
    n
}

/// Recursive descent; each method reads one level of precedence and returns what it read.
struct Parser {
    tokens: Vec<Token>,
    next: usize,
    program: Vec<Op>,
    uses: [bool; 4],
    depth: usize,
    level: usize,
}

impl Parser {
    fn new(text: &str) -> Result<Self, String> {
        Ok(Parser {
            tokens: tokens(text)?,
            next: 0,
            program: Vec::new(),
            uses: [false; 4],
            depth: 0,
            level: 0,
        })
    }

    fn peek(&self) -> Option<&Token> {
        self.tokens.get(self.next)
    }

    fn symbol(&mut self, among: &[&'static str]) -> Option<&'static str> {
        let Some(Token::Symbol(s)) = self.peek() else {
            return None;
        };
        let found = among.iter().copied().find(|a| a == s)?;
        self.next += 1;
        Some(found)
    }

    fn expect(&mut self, symbol: &'static str) -> Result<(), String> {
        match self.symbol(&[symbol]) {
            Some(_) => Ok(()),
            None => Err(match self.peek() {
                Some(t) => format!("\"{symbol}\" is expected before {t}"),
                None => format!("\"{symbol}\" is missing at the end"),
            }),
        }
    }

    fn emit(&mut self, op: Op) -> Result<(), String> {
        match op {
            Op::Push(_) | Op::Load(_) | Op::Keep => self.depth += 1,
            Op::Binary(_) => self.depth -= 1,
            Op::Select => self.depth -= 2,
            Op::Unary(_) => {}
        }
        self.program.push(op);
        if self.depth < STACK {
            Ok(())
        } else {
            Err("it is nested too deeply".into())
        }
    }

    fn need(&self, kind: Kind, wanted: Kind, of: &str) -> Result<(), String> {
        match (kind == wanted, wanted) {
            (true, _) => Ok(()),
            (_, Kind::Number) => Err(format!("\"{of}\" needs numbers, not conditions")),
            (_, Kind::Condition) => Err(format!("\"{of}\" needs conditions, not numbers")),
        }
    }

    fn disjunction(&mut self) -> Result<Kind, String> {
        let mut kind = self.conjunction()?;
        while self.symbol(&["||"]).is_some() {
            self.need(kind, Kind::Condition, "||")?;
            kind = self.conjunction()?;
            self.need(kind, Kind::Condition, "||")?;
            self.emit(Op::Binary(f64::max))?;
        }
        Ok(kind)
    }

    fn conjunction(&mut self) -> Result<Kind, String> {
        let mut kind = self.negation()?;
        while self.symbol(&["&&"]).is_some() {
            self.need(kind, Kind::Condition, "&&")?;
            kind = self.negation()?;
            self.need(kind, Kind::Condition, "&&")?;
            self.emit(Op::Binary(f64::min))?;
        }
        Ok(kind)
    }

    fn negation(&mut self) -> Result<Kind, String> {
        if self.symbol(&["!"]).is_none() {
            return self.comparison();
        }
        let kind = self.nested(Self::negation)?;
        self.need(kind, Kind::Condition, "!")?;
        self.emit(Op::Unary(|a| 1.0 - a))?;
        Ok(Kind::Condition)
    }

    fn comparison(&mut self) -> Result<Kind, String> {
        const ALL: [&str; 6] = ["<=", ">=", "==", "!=", "<", ">"];
        let kind = self.sum()?;
        let mut links = 0;
        while let Some(symbol) = self.symbol(&ALL) {
            self.need(kind, Kind::Number, symbol)?;
            let right = self.sum()?;
            self.need(right, Kind::Number, symbol)?;
            let more = matches!(self.peek(), Some(Token::Symbol(s)) if ALL.contains(s));
            self.link(symbol, more)?;
            links += 1;
        }
        // a chain leaves its comparisons under one another: all must hold
        for _ in 1..links {
            self.emit(Op::Binary(f64::min))?;
        }
        Ok(if links > 0 { Kind::Condition } else { kind })
    }

    /// Compares the two values on top; with `more`, leaves the right one on top of the result.
    fn link(&mut self, symbol: &str, more: bool) -> Result<(), String> {
        let compare: Binary = match symbol {
            "<=" => |a, b| f64::from(u8::from(a <= b)),
            ">=" => |a, b| f64::from(u8::from(a >= b)),
            "==" => |a, b| f64::from(u8::from(a == b)),
            "!=" => |a, b| f64::from(u8::from(a != b)),
            "<" => |a, b| f64::from(u8::from(a < b)),
            _ => |a, b| f64::from(u8::from(a > b)),
        };
        if more {
            self.emit(Op::Keep)?;
        }
        self.emit(Op::Binary(compare))?;
        if more {
            // b c  ->  c b
            self.emit(Op::Keep)?;
            self.emit(Op::Binary(|a, _| a))?;
        }
        Ok(())
    }

    fn sum(&mut self) -> Result<Kind, String> {
        let mut kind = self.product()?;
        while let Some(symbol) = self.symbol(&["+", "-"]) {
            self.need(kind, Kind::Number, symbol)?;
            kind = self.product()?;
            self.need(kind, Kind::Number, symbol)?;
            self.emit(Op::Binary(if symbol == "+" { |a, b| a + b } else { |a, b| a - b }))?;
        }
        Ok(kind)
    }

    fn product(&mut self) -> Result<Kind, String> {
        let mut kind = self.signed()?;
        while let Some(symbol) = self.symbol(&["*", "/", "%"]) {
            self.need(kind, Kind::Number, symbol)?;
            kind = self.signed()?;
            self.need(kind, Kind::Number, symbol)?;
            self.emit(Op::Binary(match symbol {
                "*" => |a, b| a * b,
                "/" => |a, b| a / b,
                _ => f64::rem_euclid,
            }))?;
        }
        Ok(kind)
    }

    fn signed(&mut self) -> Result<Kind, String> {
        let Some(symbol) = self.symbol(&["-", "+"]) else {
            return self.power();
        };
        let kind = self.nested(Self::signed)?;
        self.need(kind, Kind::Number, symbol)?;
        if symbol == "-" {
            self.emit(Op::Unary(|a| -a))?;
        }
        Ok(kind)
    }

    fn power(&mut self) -> Result<Kind, String> {
        let kind = self.atom()?;
        if self.symbol(&["^"]).is_none() {
            return Ok(kind);
        }
        self.need(kind, Kind::Number, "^")?;
        let exponent = self.nested(Self::signed)?;
        self.need(exponent, Kind::Number, "^")?;
        self.emit(Op::Binary(power))?;
        Ok(Kind::Number)
    }

    /// Goes one level down, so that no text can overflow the call stack.
    fn nested(&mut self, read: fn(&mut Self) -> Result<Kind, String>) -> Result<Kind, String> {
        self.level += 1;
        if self.level > 4 * STACK {
            return Err("it is nested too deeply".into());
        }
        let kind = read(self);
        self.level -= 1;
        kind
    }

    fn atom(&mut self) -> Result<Kind, String> {
        let token = self.peek().cloned();
        self.next += 1;
        match token {
            Some(Token::Number(value)) => self.emit(Op::Push(value)).map(|()| Kind::Number),
            Some(Token::Symbol("(")) => {
                let kind = self.nested(Self::disjunction)?;
                self.expect(")")?;
                Ok(kind)
            }
            Some(Token::Name(name)) => self.named(&name),
            Some(other) => Err(format!("a value is expected before {other}")),
            None => Err("it ends where a value is expected".into()),
        }
    }

    fn named(&mut self, name: &str) -> Result<Kind, String> {
        if let Some(k) = VARIABLES.iter().position(|v| *v == name) {
            self.uses[k] = true;
            return self.emit(Op::Load(k as u8)).map(|()| Kind::Number);
        }
        if let Some((_, value)) = CONSTANTS.iter().find(|(n, _)| *n == name) {
            return self.emit(Op::Push(*value)).map(|()| Kind::Number);
        }
        if let Some((_, f)) = UNARY.iter().find(|(n, _)| *n == name) {
            self.arguments(name, &[Kind::Number])?;
            return self.emit(Op::Unary(*f)).map(|()| Kind::Number);
        }
        if let Some((_, f)) = BINARY.iter().find(|(n, _)| *n == name) {
            self.arguments(name, &[Kind::Number; 2])?;
            return self.emit(Op::Binary(*f)).map(|()| Kind::Number);
        }
        if name == "if" {
            self.arguments(name, &[Kind::Condition, Kind::Number, Kind::Number])?;
            return self.emit(Op::Select).map(|()| Kind::Number);
        }
        Err(unknown_name(name))
    }

    fn arguments(&mut self, name: &str, kinds: &[Kind]) -> Result<(), String> {
        self.expect("(")?;
        for (i, wanted) in kinds.iter().enumerate() {
            if i > 0 {
                self.expect(",")?;
            }
            let kind = self.nested(Self::disjunction)?;
            self.need(kind, *wanted, name)?;
        }
        self.expect(")")
    }
}

fn power(a: f64, b: f64) -> f64 {
    if b.fract() == 0.0 && b.abs() < 64.0 {
        a.powi(b as i32)
    } else {
        a.powf(b)
    }
}

fn unknown_name(name: &str) -> String {
    let known: Vec<&str> = (UNARY.iter().map(|(n, _)| *n))
        .chain(BINARY.iter().map(|(n, _)| *n))
        .chain(CONSTANTS.iter().map(|(n, _)| *n))
        .chain(["if"])
        .collect();
    match crate::nearest::nearest(name, known.iter().copied()) {
        Some(close) => format!("\"{name}\" is not known; did you mean \"{close}\"?"),
        None => format!(
            "\"{name}\" is not known; variables are x, y, z and t, functions {}",
            known.join(" ")
        ),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Vector3;

    fn value(text: &str) -> f64 {
        Expression::number(text)
            .unwrap()
            .value(&Vector3::new(2.0, -3.0, 0.5), 0.25)
    }

    fn holds(text: &str) -> bool {
        Expression::condition(text)
            .unwrap()
            .holds(&Vector3::new(2.0, -3.0, 0.5))
    }

    #[test]
    fn arithmetic_follows_the_usual_rules() {
        for (text, want) in [
            ("1/2", 0.5),
            ("-x^2", -4.0),
            ("2^-1", 0.5),
            ("2^3^2", 512.0),
            ("2**3", 8.0),
            ("0.01*x+0.02*y+-0.01*z", 0.02 - 0.06 - 0.005),
            ("1e-3*x", 0.002),
            ("1.5E+2", 150.0),
            ("8 - 2 - 1", 5.0),
            ("8/2/2", 2.0),
            ("-7 % 4", 1.0),
            ("max(x, min(y, 1))", 2.0),
            ("if(x > 1 && t < 1, 3, 4)", 3.0),
            ("2*(x+y)", -2.0),
            ("atan2(0, -1)", std::f64::consts::PI),
            ("sqrt(abs(y) + 1)", 2.0),
            ("t", 0.25),
        ] {
            assert!((value(text) - want).abs() < 1e-15, "{text}: {} != {want}", value(text));
        }
    }

    #[test]
    fn conditions_combine_and_chain() {
        for (text, want) in [
            ("x < 1e-6 && abs(y) < 0.5", false),
            ("x < 1e-6 || abs(y) > 0.5", true),
            ("(x<1e-9)|(x>1-1e-9)", true),
            ("!(x > 1)", false),
            ("not x > 1", false),
            ("0 < z < 1", true),
            ("0 < x < 1", false),
            ("3 > x > 1 > y", true),
            ("3 > x > 1 > y and z == 0.5", true),
            ("x + y != -1", false),
            ("z <= 0.5 && z >= 0.5", true),
        ] {
            assert_eq!(holds(text), want, "{text}");
        }
    }

    #[test]
    fn mistakes_are_named() {
        for (text, part) in [
            ("sqrrt(x)", "did you mean \"sqrt\""),
            ("x +", "ends where a value"),
            ("(x", "\")\" is missing"),
            ("x y", "not expected"),
            ("x < 1", "condition where a number"),
            ("x && y", "needs conditions"),
            ("max(x)", "\",\" is expected before"),
            ("1.2.3", "not a number"),
            ("x $ y", "not an operator"),
            ("", "ends where a value"),
            ("(x < 1) + 2", "needs numbers"),
        ] {
            let error = Expression::number(text).unwrap_err().to_string();
            assert!(error.contains(part), "{text}: {error}");
        }
        assert!(
            Expression::condition("x")
                .unwrap_err()
                .to_string()
                .contains("condition is needed")
        );
        let deep = "(".repeat(60_000);
        assert!(
            Expression::number(&deep)
                .unwrap_err()
                .reason
                .contains("nested too deeply")
        );
        let wide = "1+(".repeat(60) + "1" + &")".repeat(60);
        assert!(
            Expression::number(&wide)
                .unwrap_err()
                .reason
                .contains("nested too deeply")
        );
    }
}
