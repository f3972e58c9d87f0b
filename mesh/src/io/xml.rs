//! The part of XML that VTK files use, as a tree.

use std::borrow::Cow;

use quick_xml::events::{BytesStart, Event};
use quick_xml::{Reader, XmlVersion};

use super::error::Problem;
use super::text::shown;

/// Deepest nesting that is read; VTK files need six.
const MAX_DEPTH: usize = 16;

/// An element: its attributes, children and text.
#[derive(Debug, Default)]
pub(super) struct Element<'a> {
    pub(super) name: String,
    attributes: Vec<(String, String)>,
    pub(super) children: Vec<Element<'a>>,
    /// Text directly inside the element.
    pub(super) text: Cow<'a, str>,
}

impl<'a> Element<'a> {
    /// The value of an attribute.
    pub(super) fn attribute(&self, name: &str) -> Option<&str> {
        self.attributes
            .iter()
            .find(|(n, _)| n == name)
            .map(|(_, value)| value.as_str())
    }

    /// The children called `name`.
    pub(super) fn children_named<'s>(&'s self, name: &'static str) -> impl Iterator<Item = &'s Element<'a>> {
        self.children.iter().filter(move |c| c.name == name)
    }

    fn start(tag: &BytesStart) -> Result<Self, String> {
        let mut attributes = Vec::new();
        for attribute in tag.attributes() {
            let attribute = attribute.map_err(|e| e.to_string())?;
            let value = attribute
                .normalized_value(XmlVersion::Implicit1_0)
                .map_err(|e| e.to_string())?;
            attributes.push((attribute.key.0.to_string(), value.into_owned()));
        }
        Ok(Element {
            name: tag.name().0.to_string(),
            attributes,
            ..Element::default()
        })
    }
}

/// The root element of a document. With `open_end`, the document may stop after a start tag `open_end`: every element that
/// is open there ends there.
pub(super) fn parse<'a>(text: &'a str, open_end: Option<&str>) -> Result<Element<'a>, Problem> {
    let mut reader = Reader::from_str(text);
    let mut open: Vec<Element> = vec![Element::default()];
    loop {
        let event = reader.read_event();
        let at = usize::try_from(reader.buffer_position())
            .unwrap_or(text.len())
            .min(text.len());
        let problem = |what: String| {
            let line = 1 + text.as_bytes()[..at].iter().filter(|&&b| b == b'\n').count();
            Problem::new(format!("line {line}"), what)
        };
        let bad_xml = |what: String| problem(format!("is not XML that can be read: {what}"));
        match event.map_err(|e| bad_xml(e.to_string()))? {
            Event::Start(tag) => {
                open.push(Element::start(&tag).map_err(bad_xml)?);
                if open.len() > MAX_DEPTH {
                    return Err(problem(format!("elements are nested deeper than {MAX_DEPTH}")));
                }
                let ends = open_end.is_some_and(|name| open.last().is_some_and(|e| e.name == name));
                while ends && open.len() > 1 {
                    close(&mut open);
                }
            }
            Event::Empty(tag) => {
                open.push(Element::start(&tag).map_err(bad_xml)?);
                close(&mut open);
            }
            Event::End(_) => close(&mut open), // that it ends the open element has been checked by the reader
            Event::Text(part) => {
                if let Some(element) = open.last_mut() {
                    append(&mut element.text, part.into_inner());
                }
            }
            Event::Comment(_) | Event::Decl(_) | Event::PI(_) | Event::DocType(_) => {}
            Event::CData(_) | Event::GeneralRef(_) => {
                return Err(problem("an entity or CDATA section; plain text is accepted".into()));
            }
            Event::Eof => {
                if let Some(element) = open.get(1) {
                    return Err(problem(format!(
                        "the file ends inside <{}>",
                        shown(element.name.as_bytes())
                    )));
                }
                break;
            }
        }
    }
    let mut roots = open.pop().map(|e| e.children).unwrap_or_default();
    match (roots.pop(), roots.is_empty()) {
        (Some(root), true) => Ok(root),
        _ => Err(Problem::new("line 1", "is not an XML document with one root element")),
    }
}

fn close(open: &mut Vec<Element>) {
    if open.len() > 1
        && let (Some(element), Some(parent)) = (open.pop(), open.last_mut())
    {
        parent.children.push(element);
    }
}

fn append<'a>(text: &mut Cow<'a, str>, part: Cow<'a, str>) {
    if text.is_empty() {
        *text = part;
    } else {
        text.to_mut().push_str(&part);
    }
}
