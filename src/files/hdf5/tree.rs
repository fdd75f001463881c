//! The groups and datasets of a file, with their places.
//!
//! ```text
//! superblock │ object headers: groups, datasets │ data of dataset 1 │ data of dataset 2 │ …
//! ```
//! All datasets are contiguous, so the place of each of their values follows from the shapes alone,
//! and every rank can compute it.

use super::encode::{Header, superblock};
use std::collections::BTreeMap;

/// Data begin at multiples of this.
const ALIGNMENT: u64 = 64;

/// The type of the values of a dataset, in the byte order of this machine.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    U8,
    I32,
    I64,
    F64,
    /// UTF-8 text of this many bytes, padded with zeros.
    Text(u32),
}

impl Kind {
    /// The size of a value in bytes.
    pub fn bytes(self) -> u64 {
        match self {
            Self::U8 => 1,
            Self::I32 => 4,
            Self::I64 | Self::F64 => 8,
            Self::Text(length) => length.into(),
        }
    }
}

/// The value of an attribute.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum Value {
    /// A single integer.
    Integer(i64),
    /// A list of integers.
    Integers(Vec<i64>),
    /// ASCII text of fixed length.
    Text(&'static str),
}

/// A dataset or group.
#[derive(Clone, Debug, Default)]
struct Object {
    /// The type and shape of a dataset; `None` for a group.
    dataset: Option<(Kind, Vec<u64>)>,
    attributes: Vec<(&'static str, Value)>,
    /// The members of a group: name and path of the object.
    members: BTreeMap<String, String>,
    /// The number of names of the object.
    names: u32,
}

/// The groups and datasets of a file, by path (the root is `""`). Groups need not be added.
#[derive(Clone, Debug, Default)]
pub(super) struct Tree {
    objects: BTreeMap<String, Object>,
}

impl Tree {
    /// Adds a dataset.
    pub fn add(&mut self, path: &str, kind: Kind, shape: &[u64]) {
        self.object(path).dataset = Some((kind, shape.to_vec()));
        self.link(path, path);
    }

    /// Gives a dataset a further name.
    pub fn link(&mut self, path: &str, of: &str) {
        let (group, name) = path.rsplit_once('/').expect("a path begins with a slash");
        self.object(of).names += 1;
        let parent = self.object(group);
        parent.members.insert(name.to_owned(), of.to_owned());
        if parent.names == 0 && !group.is_empty() {
            self.link(group, group);
        }
    }

    /// Gives a dataset or group an attribute.
    pub fn attribute(&mut self, path: &str, name: &'static str, value: Value) {
        self.object(path).attributes.push((name, value));
    }

    fn object(&mut self, path: &str) -> &mut Object {
        self.objects.entry(path.to_owned()).or_default()
    }

    /// Computes the places of all objects.
    pub fn place(self) -> Placed {
        let mut end = superblock(0, 0).len() as u64;
        let mut headers = BTreeMap::new();
        for (path, object) in &self.objects {
            headers.insert(path.clone(), end);
            end += object.header(0, |_| 0).len() as u64;
        }
        let mut data = BTreeMap::new();
        for (path, object) in &self.objects {
            if let Some(bytes) = object.bytes() {
                end = end.next_multiple_of(ALIGNMENT);
                data.insert(path.clone(), end);
                end += bytes;
            }
        }
        Placed { tree: self, headers, data, end }
    }
}

impl Object {
    /// The size of a dataset.
    fn bytes(&self) -> Option<u64> {
        self.dataset.as_ref().map(|(kind, shape)| kind.bytes() * shape.iter().product::<u64>())
    }

    /// The object header; `data` is the place of a dataset's values, `header_of` that of an object.
    /// Its length does not depend on these.
    fn header(&self, data: u64, header_of: impl Fn(&str) -> u64) -> Vec<u8> {
        let mut header = Header::default();
        match &self.dataset {
            Some((kind, shape)) => header.dataset(*kind, shape, data),
            None => header.group(self.members.iter().map(|(name, of)| (name.as_str(), header_of(of)))),
        }
        self.attributes.iter().for_each(|(name, value)| header.attribute(name, value));
        if self.names > 1 {
            header.names(self.names);
        }
        header.finish()
    }
}

/// A tree whose objects have places.
#[derive(Clone, Debug)]
pub(super) struct Placed {
    tree: Tree,
    headers: BTreeMap<String, u64>,
    data: BTreeMap<String, u64>,
    end: u64,
}

impl Placed {
    /// The length of the file.
    pub fn bytes(&self) -> u64 {
        self.end
    }

    /// Everything before the data.
    pub fn head(&self) -> Vec<u8> {
        let mut head = superblock(self.end, self.headers[""]);
        for (path, object) in &self.tree.objects {
            let data = self.data.get(path).copied().unwrap_or_default();
            head.extend(object.header(data, |of| self.headers[of]));
        }
        head
    }

    /// The place of the value with this index of a dataset.
    ///
    /// # Panics
    /// If there is no such dataset.
    pub fn place_of(&self, path: &str, index: u64) -> u64 {
        let (kind, _) = self.dataset(path);
        self.data[path] + index * kind.bytes()
    }

    /// The type and shape of a dataset.
    ///
    /// # Panics
    /// If there is no such dataset.
    pub fn dataset(&self, path: &str) -> (Kind, &[u64]) {
        let object = self.tree.objects.get(path);
        let dataset = object.and_then(|object| object.dataset.as_ref());
        let (kind, shape) = dataset.unwrap_or_else(|| panic!("no dataset {path}"));
        (*kind, shape)
    }

    /// Whether there is a dataset with this path.
    pub fn has(&self, path: &str) -> bool {
        self.data.contains_key(path)
    }
}
