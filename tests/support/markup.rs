//! A strict reader of the page: HTML whose elements are all closed in their order, or the test fails with the place.

/// Elements that hold nothing and are not closed, as far as the pages have them.
const VOID: [&str; 1] = ["meta"];

/// Elements whose text ends at their closing tag and has no entities.
const RAW: [&str; 2] = ["style", "script"];

/// An element with its attributes; what it holds stands behind it in the list.
#[derive(Debug)]
pub(crate) struct Element {
    pub(crate) name: String,
    pub(crate) attributes: Vec<(String, String)>,
    /// Text directly in it, entities resolved.
    pub(crate) text: String,
}

impl Element {
    /// The value of an attribute.
    pub(crate) fn get(&self, name: &str) -> Option<&str> {
        self.attributes.iter().find(|(own, _)| own == name).map(|(_, value)| value.as_str())
    }
}

/// All elements of a document in their order.
#[track_caller]
pub(crate) fn elements(document: &str) -> Vec<Element> {
    let mut rest = document.strip_prefix("<!DOCTYPE html>").expect("the type comes first");
    let mut found: Vec<Element> = Vec::new();
    let mut open: Vec<usize> = Vec::new();
    while !rest.is_empty() {
        let end = rest.find('<').unwrap_or(rest.len());
        let (text, behind) = rest.split_at(end);
        match open.last() {
            Some(&i) => found[i].text += &resolved(text),
            None => assert!(text.trim().is_empty(), "text outside of the document: {text}"),
        }
        rest = behind;
        if let Some(closing) = rest.strip_prefix("</") {
            let (name, behind) = closing.split_once('>').expect("a closed tag");
            let i = open.pop().expect("something to close");
            assert_eq!(found[i].name, name, "closed in the order of opening");
            rest = behind;
        } else if let Some(opening) = rest.strip_prefix('<') {
            let (mut element, mut behind) = tag(opening);
            if RAW.contains(&element.name.as_str()) {
                let end = behind.find("</").expect("an element has an end");
                (element.text, behind) = (behind[..end].to_owned(), &behind[end..]);
            }
            if !VOID.contains(&element.name.as_str()) {
                open.push(found.len());
            }
            found.push(element);
            rest = behind;
        }
    }
    assert!(open.is_empty(), "not closed: {:?}", open.iter().map(|&i| &found[i].name).collect::<Vec<_>>());
    found
}

/// The tag that begins here, and what follows.
#[track_caller]
fn tag(text: &str) -> (Element, &str) {
    let is_name = |c: char| c.is_ascii_alphanumeric() || c == '-';
    let end = text.find(|c| !is_name(c)).expect("a tag has an end");
    let (name, mut rest) = text.split_at(end);
    assert!(!name.is_empty(), "a tag without name: {}", &text[..text.len().min(40)]);
    let mut attributes: Vec<(String, String)> = Vec::new();
    loop {
        if let Some(behind) = rest.strip_prefix('>') {
            return (Element { name: name.to_owned(), attributes, text: String::new() }, behind);
        }
        rest = rest.strip_prefix(' ').expect("attributes are apart");
        if let Some(behind) = rest.strip_prefix("hidden") {
            attributes.push(("hidden".to_owned(), String::new()));
            rest = behind;
            continue;
        }
        let (key, behind) = rest.split_once("=\"").expect("an attribute has a value in quotes");
        assert!(!key.is_empty() && key.chars().all(is_name_or_case), "{key}");
        let (value, behind) = behind.split_once('"').expect("a quote has an end");
        assert!(!value.contains('<') && attributes.iter().all(|(own, _)| own != key), "{key}={value}");
        attributes.push((key.to_owned(), resolved(value)));
        rest = behind;
    }
}

/// Names in SVG have capitals inside.
fn is_name_or_case(c: char) -> bool {
    c.is_ascii_alphanumeric() || c == '-'
}

/// Text without its entities.
#[track_caller]
fn resolved(text: &str) -> String {
    let mut out = String::new();
    let mut rest = text;
    while let Some((before, behind)) = rest.split_once('&') {
        let (entity, behind) = behind.split_once(';').expect("an entity has an end");
        out += before;
        out += match entity {
            "amp" => "&",
            "lt" => "<",
            "gt" => ">",
            "quot" => "\"",
            other => panic!("an entity that the pages do not need: {other}"),
        };
        rest = behind;
    }
    assert!(text.chars().all(|c| c == '\n' || c == '\t' || !c.is_control()), "a control character");
    out + rest
}
