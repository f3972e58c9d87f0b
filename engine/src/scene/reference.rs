//! The reference of scenes in the book, rendered from the types that read them.

use std::fmt::Write;

use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema, schema_for};
use serde_json::Value;

use super::{BladePath, Components, Condition, InitialField, NodalForces, Scene};
use crate::Expression;
use crate::expression::{BINARY, CONSTANTS, UNARY};

const PAGE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../docs/book/scene.md");

/// What stands above the tables.
fn head() -> String {
    let functions: Vec<&str> = UNARY.iter().map(|f| f.0).chain(BINARY.iter().map(|f| f.0)).collect();
    let constants: Vec<&str> = CONSTANTS.iter().map(|c| c.0).collect();
    format!(
        r#"# The scene

A scene is a [TOML](https://toml.io) file. SI units; indices count from zero in the order of the mesh file; files are relative to
the scene. A key that is not listed here is an error, which suggests the nearest one. This page is made from the code that
reads scenes.

An *expression* is a number, or a formula in quotes: `"0.1 * min(t, 0.4)"`. It knows the rest coordinates `x`, `y`, `z`, the
time `t` where that makes sense, `{}`, `+ - * / ^`, comparisons (`0 < x < 1` means what it says), `&& || !`, `if(condition, a, b)`, and the functions `{}`. A *condition* is a formula that
is true or false by the place alone: `"x < 1e-6 && abs(y) < 0.5"`. What it selects must not be nothing, and does not change with
time. A load or a displacement must have a finite value at the start and at the end.
"#,
        constants.join("`, `"),
        functions.join(" ")
    )
}

/// How a type that reads itself is told in the table.
macro_rules! told_as {
    ($type:ty, $name:literal, $words:literal) => {
        impl JsonSchema for $type {
            fn schema_name() -> std::borrow::Cow<'static, str> {
                $name.into()
            }
            fn json_schema(_: &mut SchemaGenerator) -> Schema {
                json_schema!({ "told": $words })
            }
        }
    };
}
told_as!(Expression, "Expression", "expression");
told_as!(Condition, "Condition", "condition");
told_as!(Components<Expression>, "Expressions", "3 expressions (2 in the plane)");
told_as!(Components<f64>, "Numbers", "3 numbers (2 in the plane)");
told_as!(
    InitialField,
    "InitialField",
    "3 expressions (2 in the plane), or `{ file = \"...\", array = \"...\" }`: a point array of a file"
);
told_as!(
    BladePath,
    "BladePath",
    "list of at least 2 samples `[t, [x, y, z], [x, y, z]]`, `t` ascending"
);
told_as!(
    NodalForces,
    "NodalForces",
    "list of 3 numbers (2 in the plane) each, or `{ file = \"...\", array = \"...\" }`: a point array of a file"
);

/// The page, from the schema of a scene.
fn page(root: &Value) -> String {
    let mut out = head();
    let table_start = "\n| key | value | default | what |\n|---|---|---|---|\n";
    out += "\n## Top level\n";
    out += table_start;
    let sections = fields(root);
    for (key, field) in &sections {
        if !is_section(root, field) {
            rows(root, key, field, required(root, key), &mut out);
        }
    }
    for (key, field) in &sections {
        if is_section(root, field) {
            let many = field["type"] == "array";
            let (open, close) = if many { ("[[", "]]") } else { ("[", "]") };
            let target = resolve(root, if many { &field["items"] } else { field });
            let needed = if required(root, key) { " Required." } else { "" };
            writeln!(
                out,
                "\n## `{open}{key}{close}`\n\n{}{needed}",
                text(&target["description"])
            )
            .unwrap();
            out += table_start;
            for (inner, spec) in fields(target) {
                rows(root, inner, spec, required(target, inner), &mut out);
            }
        }
    }
    out
}

fn is_section(root: &Value, field: &Value) -> bool {
    let item = if field["type"] == "array" {
        &field["items"]
    } else {
        field
    };
    resolve(root, item)["properties"].is_object()
}

fn fields(schema: &Value) -> Vec<(&String, &Value)> {
    schema["properties"]
        .as_object()
        .map_or_else(Vec::new, |o| o.iter().collect())
}

fn required(schema: &Value, key: &str) -> bool {
    schema["required"]
        .as_array()
        .is_some_and(|all| all.iter().any(|k| k == key))
}

/// A schema behind references, and behind "or nothing".
fn resolve<'a>(root: &'a Value, schema: &'a Value) -> &'a Value {
    if let Some(name) = schema["$ref"].as_str() {
        return resolve(root, root.pointer(&name[1..]).expect("a definition"));
    }
    match schema["anyOf"].as_array() {
        Some(any) => resolve(root, any.iter().find(|s| s["type"] != "null").expect("a type")),
        None => schema,
    }
}

/// The line of a key; for a table inside a section, one line for each of its keys.
fn rows(root: &Value, key: &str, field: &Value, required: bool, out: &mut String) {
    let target = resolve(root, field);
    let what = if field["description"].is_string() {
        &field["description"]
    } else {
        &target["description"]
    };
    let default = match (&field["default"], required) {
        (_, true) => "required".to_owned(),
        (Value::Null | Value::Object(_), _) => String::new(),
        (value, _) => format!("`{}`", value.to_string().replace(',', ", ")),
    };
    let inner = fields(target);
    if inner.is_empty() {
        let value = value(root, target);
        writeln!(out, "| `{key}` | {value} | {default} | {} |", text(what)).unwrap();
        return;
    }
    writeln!(out, "| `{key}` | table | {default} | {} |", text(what)).unwrap();
    for (name, spec) in inner {
        rows(root, &format!("{key}.{name}"), spec, self::required(target, name), out);
    }
}

/// What a key takes.
fn value(root: &Value, schema: &Value) -> String {
    let schema = resolve(root, schema);
    if let Some(words) = schema["told"].as_str() {
        return words.to_owned();
    }
    if let Some(variants) = schema["oneOf"].as_array() {
        let name = |v: &Value| format!("`{}`: {}", v["const"], text(&v["description"]));
        return variants.iter().map(name).collect::<Vec<_>>().join("<br>");
    }
    if let Some(names) = schema["enum"].as_array() {
        return names.iter().map(|v| format!("`{v}`")).collect::<Vec<_>>().join(", ");
    }
    let kind = match &schema["type"] {
        Value::Array(kinds) => kinds.iter().find(|k| *k != "null").and_then(Value::as_str),
        kind => kind.as_str(),
    };
    match kind {
        Some("array") => {
            let item = value(root, &schema["items"]);
            match (&schema["minItems"], &schema["maxItems"]) {
                (Value::Number(least), Value::Number(most)) if least == most => format!("{least} of: {item}"),
                _ => format!("list of: {item}"),
            }
        }
        Some("integer") if schema["minimum"] == 0 => "whole number from 0".into(),
        Some("integer") => "whole number".into(),
        Some("boolean") => "`true` or `false`".into(),
        Some(kind) => kind.to_owned(),
        None => panic!("no words for {schema}"),
    }
}

/// A doc comment in one cell of a table.
fn text(description: &Value) -> String {
    description
        .as_str()
        .unwrap_or("")
        .replace('\n', " ")
        .replace('|', "\\|")
}
/// `KERFEM_UPDATE=1 cargo test -p kerfem-engine reference` writes the page anew.
#[test]
fn the_page_says_what_the_code_reads() {
    let page = page(schema_for!(Scene).as_value());
    if std::env::var_os("KERFEM_UPDATE").is_some() {
        std::fs::write(PAGE, &page).unwrap();
    }
    let written = std::fs::read_to_string(PAGE).unwrap();
    assert!(
        written == page,
        "docs/book/scene.md is stale; KERFEM_UPDATE=1 cargo test -p kerfem-engine reference writes it anew"
    );
}
