//! A field of a scene file, declared once: where it stands, what it may hold, what a scene has without it, what it means.
//!
//! [`table!`] declares a table of the file as a struct, whose members are fields. From a declaration follow the struct, its
//! defaults, the reader with its errors, the known names, and what [`Scene::fields`](super::Scene::fields) tells others: the
//! guide's table, the JSON schema, the comments of `dermis new`.

use super::declared::Declared;
use super::reader::Reader;
use super::SceneError;
use crate::spec::plain_text::plain_text;
use serde_json::{json, Value as Json};
use std::marker::PhantomData;
use std::path::{Path, PathBuf};
use toml::Value;

/// The values that a field may hold.
pub(super) trait Kind {
    /// A value as it is read.
    type Value: Clone;

    /// Reads a value of the scene in `file`; `None` if it is not allowed.
    fn read(&self, value: &Value, file: &str) -> Option<Self::Value>;

    /// The allowed values, in words.
    fn allowed(&self) -> String;

    /// What to say of a value that is not allowed.
    fn refuse(&self, _: &Value) -> String {
        self.allowed()
    }

    /// JSON schema.
    fn schema(&self) -> Json;

    /// A value as a scene file has it; `None` where no default can be stated.
    fn show(&self, _: &Self::Value) -> Option<Value> {
        None
    }

    /// A scene without the field has `value`.
    fn or(self, value: Self::Value) -> Field<Self, Or<Self::Value>>
    where
        Self: Sized,
    {
        Field::new(self, Or(value))
    }

    /// A scene may leave the field out, and then has what the words say.
    fn optional(self, words: &'static str) -> Field<Self, Optional>
    where
        Self: Sized,
    {
        Field::new(self, Optional(words))
    }

    /// A scene must have the field.
    fn required(self) -> Field<Self, Required>
    where
        Self: Sized,
    {
        Field::new(self, Required)
    }
}

/// What a scene has without a field.
pub(super) trait Presence<K: Kind> {
    /// What the field gives.
    type Read;

    /// Of a value.
    fn present(&self, value: K::Value) -> Self::Read;

    /// Without one; `None` if the field is required.
    fn absent(&self) -> Option<Self::Read>;

    /// The same in words, and as a value where there is one.
    fn words(&self, kind: &K) -> (Option<String>, Option<Value>);
}

/// This value.
pub(super) struct Or<V>(V);

/// Nothing; the words say what takes its place.
pub(super) struct Optional(&'static str);

/// An error.
pub(super) struct Required;

impl<K: Kind> Presence<K> for Or<K::Value> {
    type Read = K::Value;

    fn present(&self, value: K::Value) -> K::Value {
        value
    }

    fn absent(&self) -> Option<K::Value> {
        Some(self.0.clone())
    }

    fn words(&self, kind: &K) -> (Option<String>, Option<Value>) {
        let value = kind.show(&self.0);
        (value.as_ref().map(Value::to_string), value)
    }
}

impl<K: Kind> Presence<K> for Optional {
    type Read = Option<K::Value>;

    fn present(&self, value: K::Value) -> Option<K::Value> {
        Some(value)
    }

    fn absent(&self) -> Option<Option<K::Value>> {
        Some(None)
    }

    fn words(&self, _: &K) -> (Option<String>, Option<Value>) {
        (Some(self.0.to_owned()), None)
    }
}

impl<K: Kind> Presence<K> for Required {
    type Read = K::Value;

    fn present(&self, value: K::Value) -> K::Value {
        value
    }

    fn absent(&self) -> Option<K::Value> {
        None
    }

    fn words(&self, _: &K) -> (Option<String>, Option<Value>) {
        (None, None)
    }
}

/// A field with its values, `K`, and what a scene has without it, `P`.
pub(super) struct Field<K, P> {
    kind: K,
    presence: P,
    hardware: &'static str,
    page: Option<&'static str>,
}

impl<K, P> Field<K, P> {
    fn new(kind: K, presence: P) -> Self {
        Field { kind, presence, hardware: "yes", page: None }
    }

    /// The hardware has the field to this extent.
    pub(super) fn hardware(self, hardware: &'static str) -> Self {
        Field { hardware, ..self }
    }

    /// This page of the guide tells more.
    pub(super) fn page(self, page: &'static str) -> Self {
        Field { page: Some(page), ..self }
    }
}

/// What stands at one place of a table: a field, several fields that give one value, or a table.
pub(super) trait Member {
    /// What it gives.
    type Value;

    /// Reads it at `path`.
    fn read(&self, reader: &Reader, path: &str) -> Result<Self::Value, SceneError>;

    /// Adds its fields, of which one has the given doc comment.
    fn declare(&self, path: &str, doc: &[&str], fields: &mut Vec<Declared>);
}

/// A member that a scene may leave out.
pub(super) trait HasDefault: Member {
    /// What a scene has without it.
    fn default_value(&self) -> Self::Value;
}

impl<K: Kind, P: Presence<K>> Member for Field<K, P> {
    type Value = P::Read;

    fn read(&self, reader: &Reader, path: &str) -> Result<P::Read, SceneError> {
        match reader.value(path) {
            None => self.presence.absent().ok_or_else(|| reader.missing(path, self.kind.allowed())),
            Some(value) => match self.kind.read(value, reader.file) {
                Some(read) => Ok(self.presence.present(read)),
                None => Err(reader.wrong(path, value, self.kind.refuse(value))),
            },
        }
    }

    fn declare(&self, path: &str, doc: &[&str], fields: &mut Vec<Declared>) {
        let (without, default) = self.presence.words(&self.kind);
        let meaning = plain_text(doc);
        let mut schema = self.kind.schema();
        schema["description"] = json!(meaning);
        if let Some(default) = default {
            schema["default"] = json!(default);
        }
        let (allowed, hardware, page) = (self.kind.allowed(), self.hardware, self.page);
        fields.push(Declared { path: path.to_owned(), allowed, without, hardware, page, meaning, schema });
    }
}

impl<K: Kind> HasDefault for Field<K, Or<K::Value>> {
    fn default_value(&self) -> K::Value {
        self.presence.0.clone()
    }
}

impl<K: Kind> HasDefault for Field<K, Optional> {
    fn default_value(&self) -> Option<K::Value> {
        None
    }
}

/// A table of a scene file; [`table!`] implements it.
pub(super) trait Table: Sized {
    /// Reads its fields.
    fn read(reader: &Reader) -> Result<Self, SceneError>;

    /// Adds its fields.
    fn declare(fields: &mut Vec<Declared>);

    /// The first field, as `table.field`, that differs from that of another.
    fn differing_field(&self, other: &Self) -> Option<&'static str>;
}

/// A table as a member of another.
pub(super) struct Nested<T>(PhantomData<T>);

/// The table `T` as a member.
pub(super) fn nested<T>() -> Nested<T> {
    Nested(PhantomData)
}

impl<T: Table> Member for Nested<T> {
    type Value = T;

    fn read(&self, reader: &Reader, _: &str) -> Result<T, SceneError> {
        T::read(reader)
    }

    fn declare(&self, _: &str, _: &[&str], fields: &mut Vec<Declared>) {
        T::declare(fields);
    }
}

impl<T: Table + Default> HasDefault for Nested<T> {
    fn default_value(&self) -> T {
        T::default()
    }
}

/// Declares a table of a scene file: `pub struct Name in "table" { /// Meaning. field: Type = member; }`. With `with defaults`
/// behind the table's name a scene may leave it out, and the struct has a [`Default`].
macro_rules! table {
    ($(#[$meta:meta])* $vis:vis struct $name:ident in $table:literal with defaults {
        $($(#[doc = $doc:literal])* $field:ident: $type:ty = $member:expr;)*
    }) => {
        $crate::spec::scene::field::table! {
            $(#[$meta])* $vis struct $name in $table { $($(#[doc = $doc])* $field: $type = $member;)* }
        }

        impl Default for $name {
            fn default() -> Self {
                #[allow(unused_imports)]
                use $crate::spec::scene::field::HasDefault as _;
                $name { $($field: $member.default_value(),)* }
            }
        }
    };
    ($(#[$meta:meta])* $vis:vis struct $name:ident in $table:literal {
        $($(#[doc = $doc:literal])* $field:ident: $type:ty = $member:expr;)*
    }) => {
        $(#[$meta])*
        $vis struct $name { $($(#[doc = $doc])* $vis $field: $type,)* }

        impl $crate::spec::scene::field::Table for $name {
            fn read(reader: &$crate::spec::scene::reader::Reader) -> Result<Self, $crate::spec::scene::SceneError> {
                use $crate::spec::scene::field::Member as _;
                Ok($name { $($field: $member.read(reader, concat!($table, ".", stringify!($field)))?,)* })
            }

            fn declare(fields: &mut Vec<$crate::spec::scene::declared::Declared>) {
                use $crate::spec::scene::field::Member as _;
                $($member.declare(concat!($table, ".", stringify!($field)), &[$($doc),*], fields);)*
            }

            fn differing_field(&self, other: &Self) -> Option<&'static str> {
                let differs = [$((concat!($table, ".", stringify!($field)), self.$field != other.$field)),*];
                differs.into_iter().find_map(|(field, differs)| differs.then_some(field))
            }
        }
    };
}
pub(super) use table;

/// A whole number from `least` to `most`.
pub(super) fn whole<T>(least: u32, most: u32) -> Whole<T> {
    Whole { least, most, step: 1, as_type: PhantomData }
}

/// A whole number; see [`whole`].
pub(super) struct Whole<T> {
    least: u32,
    most: u32,
    step: u32,
    as_type: PhantomData<T>,
}

impl<T> Whole<T> {
    /// Only multiples of `step`.
    pub(super) fn multiple_of(self, step: u32) -> Self {
        Whole { step, ..self }
    }
}

impl<T: Clone + TryFrom<i64> + TryInto<i64>> Kind for Whole<T> {
    type Value = T;

    fn read(&self, value: &Value, _: &str) -> Option<T> {
        let [least, most, step] = [self.least, self.most, self.step].map(i64::from);
        let number = value.as_integer().filter(|number| (least..=most).contains(number) && number % step == 0)?;
        T::try_from(number).ok()
    }

    fn allowed(&self) -> String {
        let Whole { least, most, step, .. } = self;
        match step {
            1 => format!("a whole number from {least} to {most}"),
            _ => format!("a multiple of {step} from {least} to {most}"),
        }
    }

    fn schema(&self) -> Json {
        let mut schema = json!({ "type": "integer", "minimum": self.least, "maximum": self.most });
        if self.step > 1 {
            schema["multipleOf"] = json!(self.step);
        }
        schema
    }

    fn show(&self, value: &T) -> Option<Value> {
        value.clone().try_into().ok().map(Value::Integer)
    }
}

/// The numbers that a field may hold, all finite.
#[derive(Clone, Copy, Debug)]
pub(super) enum Number {
    /// Above 0.
    Positive,
    /// 0 or above.
    NotNegative,
    /// Above 0 and at most this.
    UpTo(f64),
    /// From the first to the second.
    Within(f64, f64),
    /// Above the first and below the second.
    Between(f64, f64),
    /// 0, or from the first to the second.
    ZeroOr(f64, f64),
}

impl Number {
    /// Whether the number is allowed; NaN is not.
    pub(super) fn contains(self, number: f64) -> bool {
        number.is_finite()
            && match self {
                Number::Positive => number > 0.0,
                Number::NotNegative => number >= 0.0,
                Number::UpTo(most) => number > 0.0 && number <= most,
                Number::Within(least, most) => (least..=most).contains(&number),
                Number::Between(below, above) => number > below && number < above,
                Number::ZeroOr(least, most) => number == 0.0 || (least..=most).contains(&number),
            }
    }
}

/// A finite number; integers are accepted as well.
pub(super) fn number_of(value: &Value) -> Option<f64> {
    value.as_float().or(value.as_integer().map(|whole| whole as f64)).filter(|number| number.is_finite())
}

impl Kind for Number {
    type Value = f64;

    fn read(&self, value: &Value, _: &str) -> Option<f64> {
        number_of(value).filter(|number| self.contains(*number))
    }

    fn allowed(&self) -> String {
        match self {
            Number::Positive => "a number above 0".to_owned(),
            Number::NotNegative => "a number of at least 0".to_owned(),
            Number::UpTo(most) => format!("a number above 0, at most {most}"),
            Number::Within(least, most) => format!("a number from {least} to {most}"),
            Number::Between(below, above) => format!("a number above {below} and below {above}"),
            Number::ZeroOr(least, most) => format!("0, or a number from {least} to {most}"),
        }
    }

    fn schema(&self) -> Json {
        match *self {
            Number::Positive => json!({ "type": "number", "exclusiveMinimum": 0 }),
            Number::NotNegative => json!({ "type": "number", "minimum": 0 }),
            Number::UpTo(most) => json!({ "type": "number", "exclusiveMinimum": 0, "maximum": most }),
            Number::Within(least, most) => json!({ "type": "number", "minimum": least, "maximum": most }),
            Number::Between(below, above) => {
                json!({ "type": "number", "exclusiveMinimum": below, "exclusiveMaximum": above })
            }
            Number::ZeroOr(least, most) => {
                json!({ "type": "number", "anyOf": [{ "const": 0 }, { "minimum": least, "maximum": most }] })
            }
        }
    }

    fn show(&self, value: &f64) -> Option<Value> {
        Some(Value::Float(*value))
    }
}

/// One of several names, each with what it stands for.
pub(super) fn choice<T>(names: &'static [(&'static str, T)]) -> Choice<T> {
    Choice { names, former: &[] }
}

/// One of several names; see [`choice`].
pub(super) struct Choice<T: 'static> {
    names: &'static [(&'static str, T)],
    former: &'static [(&'static str, &'static str)],
}

impl<T> Choice<T> {
    /// Names of earlier versions, each with what takes its place.
    pub(super) fn formerly(self, former: &'static [(&'static str, &'static str)]) -> Self {
        Choice { former, ..self }
    }
}

impl<T: Copy + PartialEq> Kind for Choice<T> {
    type Value = T;

    fn read(&self, value: &Value, _: &str) -> Option<T> {
        self.names.iter().find(|(name, _)| value.as_str() == Some(name)).map(|(_, choice)| *choice)
    }

    fn allowed(&self) -> String {
        self.names.iter().map(|(name, _)| format!("{name:?}")).collect::<Vec<_>>().join(" or ")
    }

    fn refuse(&self, value: &Value) -> String {
        let former = self.former.iter().find(|(former, _)| value.as_str() == Some(former));
        former.map_or_else(|| self.allowed(), |(_, now)| (*now).to_owned())
    }

    fn schema(&self) -> Json {
        json!({ "enum": self.names.iter().map(|(name, _)| *name).collect::<Vec<_>>() })
    }

    fn show(&self, value: &T) -> Option<Value> {
        let named = self.names.iter().find(|(_, choice)| choice == value);
        named.map(|(name, _)| Value::String((*name).to_owned()))
    }
}

/// One of several whole numbers.
pub(super) struct Listed<const N: usize>(pub(super) [usize; N]);

impl<const N: usize> Kind for Listed<N> {
    type Value = usize;

    fn read(&self, value: &Value, _: &str) -> Option<usize> {
        usize::try_from(value.as_integer()?).ok().filter(|number| self.0.contains(number))
    }

    fn allowed(&self) -> String {
        let numbers = self.0.map(|number| number.to_string());
        match numbers.as_slice() {
            [others @ .., last] if !others.is_empty() => format!("{} or {last}", others.join(", ")),
            _ => numbers.concat(),
        }
    }

    fn schema(&self) -> Json {
        json!({ "enum": self.0.as_slice() })
    }

    fn show(&self, number: &usize) -> Option<Value> {
        i64::try_from(*number).ok().map(Value::Integer)
    }
}

/// The power of two that is read as its binary logarithm, up to this.
pub(super) struct Power(pub(super) u32);

impl Kind for Power {
    type Value = u32;

    fn read(&self, value: &Value, _: &str) -> Option<u32> {
        (0..=self.0).find(|power| value.as_integer() == Some(1 << power))
    }

    fn allowed(&self) -> String {
        format!("a power of two from 1 to {}", 1u64 << self.0)
    }

    fn schema(&self) -> Json {
        json!({ "enum": (0..=self.0).map(|power| 1u64 << power).collect::<Vec<_>>() })
    }

    fn show(&self, value: &u32) -> Option<Value> {
        Some(Value::Integer(1 << value))
    }
}

/// Whether something is so.
pub(super) struct Flag;

impl Kind for Flag {
    type Value = bool;

    fn read(&self, value: &Value, _: &str) -> Option<bool> {
        value.as_bool()
    }

    fn allowed(&self) -> String {
        "true or false".to_owned()
    }

    fn schema(&self) -> Json {
        json!({ "type": "boolean" })
    }

    fn show(&self, value: &bool) -> Option<Value> {
        Some(Value::Boolean(*value))
    }
}

/// A path relative to the folder of the scene's file, read as one relative to the working folder.
pub(super) struct File;

impl Kind for File {
    type Value = PathBuf;

    fn read(&self, value: &Value, file: &str) -> Option<PathBuf> {
        value.as_str().filter(|name| !name.is_empty()).map(|name| Path::new(file).with_file_name(name))
    }

    fn allowed(&self) -> String {
        "the name of a file".to_owned()
    }

    fn schema(&self) -> Json {
        json!({ "type": "string", "minLength": 1 })
    }
}

/// Two numbers above 0 in ascending order.
pub(super) struct Limits;

impl Kind for Limits {
    type Value = [f64; 2];

    fn read(&self, value: &Value, _: &str) -> Option<[f64; 2]> {
        let [least, most] = value.as_array()?.as_slice() else { return None };
        let limits = [number_of(least)?, number_of(most)?];
        (0.0 < limits[0] && limits[0] <= limits[1]).then_some(limits)
    }

    fn allowed(&self) -> String {
        "[least, largest], numbers above 0".to_owned()
    }

    fn schema(&self) -> Json {
        json!({ "type": "array", "items": { "type": "number", "exclusiveMinimum": 0 }, "minItems": 2, "maxItems": 2 })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_allowed_is_read_and_said() {
        let reads = |kind: &dyn Kind<Value = f64>, text: &str| {
            let table: toml::Table = toml::from_str(&format!("x = {text}")).unwrap();
            kind.read(&table["x"], "a.toml")
        };
        let kinds = [
            (Number::Positive, "0.1", "0"),
            (Number::NotNegative, "0", "-0.1"),
            (Number::UpTo(2.0), "2", "2.1"),
            (Number::Within(0.0, 0.5), "0.5", "0.6"),
            (Number::Between(0.0, 0.5), "0.4", "0.5"),
            (Number::ZeroOr(0.1, 2.0), "0", "0.05"),
        ];
        for (kind, allowed, refused) in kinds {
            assert!(reads(&kind, allowed).is_some(), "{kind:?} {allowed}");
            for refused in [refused, "nan", "inf", "\"1\""] {
                assert_eq!(reads(&kind, refused), None, "{kind:?} {refused}");
            }
        }
        assert_eq!(Listed([4, 2, 1]).allowed(), "4, 2 or 1");
        assert_eq!(whole::<u32>(4, 1024).multiple_of(4).read(&Value::Integer(6), ""), None);
    }
}
