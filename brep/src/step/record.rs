//! Typed access to the attributes of records.

use super::text::{Part, Record, Records, Value, decoded};
use crate::BrepError;

/// A record with its file.
#[derive(Clone, Copy)]
pub(super) struct Node<'a> {
    records: &'a Records<'a>,
    pub id: u64,
    record: &'a Record<'a>,
}

/// The attributes that one type gives to a record.
#[derive(Clone, Copy)]
pub(super) struct Fields<'a> {
    node: Node<'a>,
    name: &'a str,
    values: &'a [Value<'a>],
}

/// All records, ascending by id.
pub(super) fn nodes<'a>(records: &'a Records<'a>) -> impl Iterator<Item = Node<'a>> {
    records.iter().map(move |(&id, record)| Node { records, id, record })
}

impl<'a> Node<'a> {
    /// An error at this record.
    pub fn error(&self, what: impl std::fmt::Display) -> BrepError {
        BrepError::Syntax { line: self.record.line, what: format!("#{}: {what}", self.id) }
    }

    /// The types of the record.
    fn parts(&self) -> &'a [Part<'a>] {
        &self.record.parts
    }

    pub fn is(&self, name: &str) -> bool {
        self.parts().iter().any(|part| part.name == name)
    }

    /// The first of some types that the record has.
    pub fn any(&self, names: &[&str]) -> Option<Fields<'a>> {
        names.iter().find_map(|name| self.get(name))
    }

    pub fn get(&self, name: &str) -> Option<Fields<'a>> {
        let part = self.parts().iter().find(|part| part.name == name)?;
        Some(Fields { node: *self, name: part.name, values: &part.values })
    }

    /// The attributes that a type gives.
    ///
    /// # Errors
    /// If the record has another type.
    pub fn fields(&self, name: &str) -> Result<Fields<'a>, BrepError> {
        self.get(name).ok_or_else(|| self.error(format!("it is a {}, not a {name}", self.kind())))
    }

    /// The name of its type, or of all of its types.
    pub fn kind(&self) -> String {
        let names: Vec<&str> = self.parts().iter().map(|part| part.name).collect();
        names.join(" ")
    }

    /// The label of a shape, if it is one that a person gave.
    pub fn label(&self) -> Option<String> {
        let value = match self.parts() {
            [part] => part.values.first(),
            _ => self.get("REPRESENTATION_ITEM")?.values.first(),
        };
        match value {
            Some(Value::Text(text)) => given(decoded(text)),
            _ => None,
        }
    }
}

/// A label that is not one of those that programs write for none.
pub(super) fn given(label: String) -> Option<String> {
    let label = label.trim();
    let is_none = label.is_empty() || label.eq_ignore_ascii_case("none") || label == "''";
    let is_none = is_none || label.starts_with("Open CASCADE STEP translator ");
    (!is_none).then(|| label.to_owned())
}

impl<'a> Fields<'a> {
    pub fn node(&self) -> Node<'a> {
        self.node
    }

    /// The type that gives these attributes.
    pub fn name(&self) -> &'a str {
        self.name
    }

    fn value(&self, index: usize) -> Result<&'a Value<'a>, BrepError> {
        let missing = || self.wrong(index, "a value");
        self.values.get(index).ok_or_else(missing)
    }

    fn wrong(&self, index: usize, wanted: &str) -> BrepError {
        self.node.error(format!("{wanted} is expected as attribute {} of {}", index + 1, self.name))
    }

    pub fn is_set(&self, index: usize) -> bool {
        !matches!(self.values.get(index), None | Some(Value::Unset))
    }

    pub fn number(&self, index: usize) -> Result<f64, BrepError> {
        number(self.value(index)?).ok_or_else(|| self.wrong(index, "a number"))
    }

    /// A positive number.
    pub fn length(&self, index: usize) -> Result<f64, BrepError> {
        let number = self.number(index)?;
        if number > 0.0 { Ok(number) } else { Err(self.wrong(index, "a positive number")) }
    }

    pub fn count(&self, index: usize) -> Result<usize, BrepError> {
        count(self.value(index)?).ok_or_else(|| self.wrong(index, "a count"))
    }

    pub fn flag(&self, index: usize) -> Result<bool, BrepError> {
        match self.value(index)? {
            Value::Enum("T" | "TRUE") => Ok(true),
            Value::Enum("F" | "FALSE" | "U" | "UNKNOWN") => Ok(false),
            _ => Err(self.wrong(index, "`.T.` or `.F.`")),
        }
    }

    pub fn name_of(&self, index: usize) -> Option<&'a str> {
        match self.values.get(index) {
            Some(Value::Enum(name)) => Some(name),
            _ => None,
        }
    }

    pub fn text(&self, index: usize) -> Option<String> {
        match self.values.get(index) {
            Some(Value::Text(text)) => Some(decoded(text)),
            _ => None,
        }
    }

    fn list(&self, index: usize) -> Result<&'a [Value<'a>], BrepError> {
        match self.value(index)? {
            Value::List(list) => Ok(list),
            _ => Err(self.wrong(index, "a list")),
        }
    }

    pub fn numbers(&self, index: usize) -> Result<Vec<f64>, BrepError> {
        let all: Option<Vec<f64>> = self.list(index)?.iter().map(number).collect();
        all.ok_or_else(|| self.wrong(index, "a list of numbers"))
    }

    pub fn counts(&self, index: usize) -> Result<Vec<usize>, BrepError> {
        let all: Option<Vec<usize>> = self.list(index)?.iter().map(count).collect();
        all.ok_or_else(|| self.wrong(index, "a list of counts"))
    }

    /// Lists of numbers of equal lengths.
    pub fn rows(&self, index: usize) -> Result<Vec<Vec<f64>>, BrepError> {
        let row = |value: &Value| match value {
            Value::List(list) => list.iter().map(number).collect(),
            _ => None,
        };
        let all: Option<Vec<Vec<f64>>> = self.list(index)?.iter().map(row).collect();
        all.ok_or_else(|| self.wrong(index, "a list of lists of numbers"))
    }

    fn refer(&self, index: usize, value: &Value) -> Result<Node<'a>, BrepError> {
        let Value::Id(id) = value else { return Err(self.wrong(index, "a reference")) };
        let records = self.node.records;
        let record = records.get(id).ok_or_else(|| self.node.error(format!("there is no #{id}")))?;
        Ok(Node { records, id: *id, record })
    }

    /// The record to which an attribute refers.
    pub fn refers(&self, index: usize) -> Result<Node<'a>, BrepError> {
        self.refer(index, self.value(index)?)
    }

    /// The same; `None` if the attribute is not set.
    pub fn may_refer(&self, index: usize) -> Result<Option<Node<'a>>, BrepError> {
        match self.values.get(index) {
            None | Some(Value::Unset) => Ok(None),
            Some(value) => self.refer(index, value).map(Some),
        }
    }

    /// The records to which a list refers.
    pub fn refers_all(&self, index: usize) -> Result<Vec<Node<'a>>, BrepError> {
        self.list(index)?.iter().map(|value| self.refer(index, value)).collect()
    }

    /// The records to which a list of lists refers.
    pub fn refers_rows(&self, index: usize) -> Result<Vec<Vec<Node<'a>>>, BrepError> {
        let row = |value: &'a Value<'a>| match value {
            Value::List(list) => list.iter().map(|value| self.refer(index, value)).collect(),
            _ => Err(self.wrong(index, "a list of lists")),
        };
        self.list(index)?.iter().map(row).collect()
    }
}

/// A number, which may be wrapped in the name of its measure.
fn number(value: &Value) -> Option<f64> {
    match value {
        Value::Number(number) => Some(*number),
        Value::Typed(_, values) => match values[..] {
            [Value::Number(number)] => Some(number),
            _ => None,
        },
        _ => None,
    }
}

/// A number that is an index or a count.
fn count(value: &Value) -> Option<usize> {
    let number = number(value)?;
    (number >= 0.0 && number <= f64::from(u32::MAX) && number.fract() == 0.0).then_some(number as usize)
}
