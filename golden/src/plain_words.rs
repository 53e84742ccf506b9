//! Plain words: what the readers of JSON and TOML say of a text, in words of the text and not of the program.
//!
//! | the reader's | here |
//! |---|---|
//! | missing field, duplicate field | the field is missing, is there twice |
//! | invalid type, value, length; unknown variant | what is found, and what is wanted |
//! | sequence, map, unit, struct, f64 … | list, object, nothing, object, number … |
//! | EOF while parsing, trailing characters … | the text ends too early, more follows … |

use std::fmt::Display;

/// Words of the readers that no message has.
pub const REFUSED: [&str; 22] = [
    "serde",
    "missing field",
    "duplicate field",
    "invalid type",
    "invalid value",
    "invalid length",
    "unknown variant",
    "untagged enum",
    "expected struct",
    "expected enum",
    ", expected ",
    "a sequence",
    "a map",
    "EOF while",
    "expected value",
    "expected ident",
    "trailing characters",
    "a tuple",
    "f64",
    "usize",
    "i128",
    "newtype",
];

/// Where a JSON text is wrong, and how.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct JsonError {
    /// Line, from 1.
    pub line: usize,
    /// Column, from 1.
    pub column: usize,
    /// What is wrong.
    pub message: String,
}

impl JsonError {
    /// What the reader says.
    ///
    /// ```
    /// use dermis_golden::plain_words::JsonError;
    ///
    /// let of = |text: &str| JsonError::new(&serde_json::from_str::<Vec<f64>>(text).unwrap_err()).to_string();
    /// assert_eq!(of("[1, \"2\"]"), "line 1, column 7: the text \"2\" where a number is wanted");
    /// assert_eq!(of("[1,\n 2"), "line 2, column 2: the text ends within a list");
    /// ```
    pub fn new(error: &serde_json::Error) -> JsonError {
        let (line, column) = (error.line(), error.column());
        let text = error.to_string();
        let message = text.strip_suffix(&format!(" at line {line} column {column}")).unwrap_or(&text);
        // At a line's very start, and of what was read before, the reader counts 0.
        JsonError { line: line.max(1), column: column.max(1), message: plain(message) }
    }
}

impl Display for JsonError {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        write!(f, "line {}, column {}: {}", self.line, self.column, self.message)
    }
}

/// The line of a byte of a text, from 1; a byte behind its end is in the last one.
pub fn line_of(text: &[u8], at: usize) -> usize {
    1 + text.iter().take(at).filter(|byte| **byte == b'\n').count()
}

/// What the reader of TOML says of a text, and the line of it, from 1.
///
/// ```
/// use dermis_golden::plain_words::of_toml;
///
/// let of = |text: &str| of_toml(text, &toml::from_str::<toml::Table>(text).unwrap_err());
/// assert_eq!(of("a = 1\nb = 2\na = 3\n"), (3, "a is there twice".to_owned()));
/// ```
pub fn of_toml(text: &str, error: &toml::de::Error) -> (usize, String) {
    let span = error.span().unwrap_or_default();
    let line = line_of(text.as_bytes(), span.start);
    match text.get(span).filter(|_| error.message().contains("duplicate key")) {
        Some(key) => (line, format!("{} is there twice", key.trim())),
        None => (line, plain(error.message())),
    }
}

/// A text without the number that the operating system gives an error, as `(os error 2)`; the words before it say the same.
///
/// ```
/// use dermis_golden::plain_words::without_numbers;
///
/// let text = std::fs::File::open("absent").unwrap_err().to_string();
/// assert_eq!(without_numbers(&text), "No such file or directory");
/// assert_eq!(without_numbers("(os error) of a(os error 7), (os error 12)b"), "(os error) of a(os error 7),b");
/// ```
pub fn without_numbers(text: &str) -> String {
    const START: &str = " (os error ";
    let mut parts = text.split(START);
    let mut plain = parts.next().unwrap_or("").to_owned();
    for part in parts {
        let number = part.split_once(')').filter(|(number, _)| number.bytes().all(|byte| byte.is_ascii_digit()));
        match number {
            Some((_, rest)) => plain += rest,
            None => plain = plain + START + part,
        }
    }
    plain
}

/// A message of the readers of JSON and TOML in plain words.
///
/// ```
/// use dermis_golden::plain_words::plain;
///
/// assert_eq!(plain("missing field `rows`"), "rows is missing");
/// assert_eq!(plain("unknown variant `x`, expected `tsvd` or `exact`"), "\"x\" where tsvd or exact is wanted");
/// assert_eq!(plain("invalid type: map, expected a sequence"), "an object where a list is wanted");
/// assert_eq!(plain("invalid length 2, expected an array of length 3"), "2 values where a list of length 3 is wanted");
/// ```
pub fn plain(message: &str) -> String {
    // The reader of TOML names a type of its own.
    if message.contains("as i128") {
        return "an integer has more than 64 bits".to_owned();
    }
    let name = |text: &str| text.trim_matches('`').to_owned();
    let (found, wanted) = match message.split_once(", expected ") {
        Some((found, wanted)) => (found, Some(self::wanted(wanted))),
        None => (message, None),
    };
    let started = |start: &str| found.strip_prefix(start);
    if let Some(field) = started("missing field ") {
        return format!("{} is missing", name(field));
    }
    if let Some(field) = started("duplicate field ") {
        return format!("{} is there twice", name(field));
    }
    if let Some(field) = started("unknown field ") {
        return match wanted {
            Some(wanted) => format!("unknown field {}; there are {wanted}", name(field)),
            None => format!("unknown field {}", name(field)),
        };
    }
    let found = match (started("invalid type: ").or(started("invalid value: ")), started("invalid length ")) {
        (Some(found), _) => self::found(found),
        (_, Some(length)) => format!("{length} values"),
        _ => match started("unknown variant ") {
            Some(variant) => format!("{:?}", name(variant)),
            None => syntax(found),
        },
    };
    match wanted {
        Some(wanted) => format!("{found} where {wanted} is wanted"),
        None => found,
    }
}

/// What stands in the text.
fn found(what: &str) -> String {
    let value =
        |kind: &str, named: &str| what.strip_prefix(kind).map(|value| format!("{named} {}", value.trim_matches('`')));
    let named = [
        ("string ", "the text"),
        ("integer ", "the number"),
        ("floating point ", "the number"),
        ("boolean ", "the value"),
        ("character ", "the text"),
    ];
    let is = |word: &str| what == word || what.strip_suffix(" value") == Some(word);
    let kinds = [("map", "an object"), ("sequence", "a list"), ("null", "null"), ("unit", "null"), ("Option", "null")];
    let of_value = named.into_iter().find_map(|(kind, named)| value(kind, named));
    of_value
        .or_else(|| kinds.into_iter().find(|(word, _)| is(word)).map(|(_, named)| named.to_owned()))
        .unwrap_or_else(|| "another kind of value".to_owned())
}

/// What may stand there.
fn wanted(what: &str) -> String {
    let numbers = ["f32", "f64", "a float", "floating point"];
    let whole = ["u8", "u16", "u32", "u64", "u128", "usize", "i8", "i16", "i32", "i64", "i128", "isize", "an integer"];
    match what {
        _ if numbers.contains(&what) => "a number".to_owned(),
        _ if whole.contains(&what) => "a whole number".to_owned(),
        "a sequence" => "a list".to_owned(),
        "a map" => "an object".to_owned(),
        "a string" | "a borrowed string" | "string or map" => "a text".to_owned(),
        "unit" | "option" => "null".to_owned(),
        "any valid JSON value" | "any valid TOML value" | "value" => "a value".to_owned(),
        _ if what.starts_with("struct ") || what.contains("enum ") || what.contains("variant ") => {
            "an object".to_owned()
        }
        _ => {
            let lists =
                what.replace("an array of length", "a list of length").replace("a tuple of size", "a list of length");
            lists.replace("tuple struct", "a list of").replace("one of ", "").replace('`', "")
        }
    }
}

/// What is wrong with the form of the text.
fn syntax(message: &str) -> String {
    if let Some(part) = message.strip_prefix("EOF while parsing ") {
        let part = match part {
            "a list" | "an object" => part,
            "a string" => "a text",
            _ => return "the text ends where a value is wanted".to_owned(),
        };
        return format!("the text ends within {part}");
    }
    if let Some(wanted) = message.strip_prefix("expected ") {
        return match wanted {
            "value" => "no value where one is wanted".to_owned(),
            "ident" => "a word that is none of true, false and null".to_owned(),
            other => format!("no {other} where it is wanted"),
        };
    }
    let known = [
        ("trailing characters", "more follows behind the end"),
        ("trailing comma", "a comma without a value behind it"),
        ("key must be a string", "a name that is not in quotes"),
        ("control character (\\u0000-\\u001F) found while parsing a string", "a control character in a text"),
        ("lone leading surrogate in hex escape", "an escape that is no character"),
        ("unexpected end of hex escape", "an escape that is no character"),
        ("invalid unicode code point", "a character that does not exist"),
        ("recursion limit exceeded", "lists or objects within one another that are too deep"),
        ("invalid number", "a number that cannot be read"),
        ("number out of range", "a number out of range"),
        ("invalid escape", "an escape that is not known"),
    ];
    match known.into_iter().find(|(own, _)| *own == message) {
        Some((_, plain)) => plain.to_owned(),
        None if message.contains("untagged enum") => "none of the forms that are allowed here".to_owned(),
        None => message.to_owned(),
    }
}

#[cfg(test)]
mod tests {
    #![allow(dead_code, reason = "fields that are only read from a text")]

    use super::*;
    use serde::de::DeserializeOwned;
    use serde::Deserialize;
    use std::collections::BTreeMap;

    #[derive(Debug, Deserialize)]
    #[serde(deny_unknown_fields)]
    struct Fields {
        number: f64,
        whole: u8,
        list: Vec<bool>,
        three: [i64; 3],
        pair: (String, char),
        choice: Choice,
        either: Either,
        unit: (),
        named: Named,
        more: BTreeMap<String, usize>,
        inner: Option<Box<Fields>>,
    }

    #[derive(Debug, Deserialize)]
    #[serde(rename_all = "lowercase")]
    enum Choice {
        One,
        Two(f64),
        Three { size: f64 },
    }

    #[derive(Debug, Deserialize)]
    #[serde(untagged)]
    enum Either {
        Number(f64),
        List(Vec<f64>),
    }

    #[derive(Debug, Deserialize)]
    struct Named(f64, f64);

    const WHOLE: &str = r#"{"number":1.5,"whole":2,"list":[true],"three":[1,2,3],"pair":["a","b"],"choice":{"three":{"size":1}},
        "either":[1],"unit":null,"named":[1,2],"more":{"a":1},"inner":null}"#;

    fn said<T: DeserializeOwned>(text: &str) -> Option<String> {
        serde_json::from_str::<T>(text).err().map(|error| JsonError::new(&error).to_string())
    }

    /// Every value replaced by one of every other kind, and every byte by others: no message has words of the program.
    #[test]
    fn no_message_of_json_has_words_of_the_program() {
        assert_eq!(said::<Fields>(WHOLE), None);
        let value: serde_json::Value = serde_json::from_str(WHOLE).unwrap();
        let others = ["null", "true", "7", "-7", "1e300", "\"x\"", "[]", "{}", "[[1]]", "{\"x\":1}", "[1,2,3,4,5]"];
        let mut texts: Vec<String> = Vec::new();
        for (name, own) in value.as_object().unwrap() {
            let own = format!("\"{name}\":{own}");
            let all = value.to_string();
            texts.extend(others.map(|other| all.replace(&own, &format!("\"{name}\":{other}"))));
            texts.push(all.replace(&own, "\"y\":1"));
            texts.push(all.replace(&own, &format!("{own},{own}")));
        }
        for at in 0..WHOLE.len() {
            texts.extend([b'"', b'{', b']', b',', b'e', b'\\', 1].map(|byte| {
                let mut bytes = WHOLE.as_bytes().to_vec();
                bytes[at] = byte;
                String::from_utf8(bytes).unwrap()
            }));
            texts.push(WHOLE[..at].to_owned());
        }
        texts.push(format!("{WHOLE} 5"));
        texts.push("[".repeat(200));
        let mut kinds = std::collections::BTreeSet::new();
        for text in texts {
            let messages = [said::<Fields>(&text), said::<serde_json::Value>(&text)].into_iter().flatten();
            for message in messages {
                let refused = REFUSED.iter().find(|word| message.contains(**word));
                assert_eq!(refused, None, "{message}\n{text}");
                kinds.insert(message.split(": ").nth(1).unwrap().to_owned());
            }
        }
        assert!(kinds.len() > 40, "{kinds:#?}");
    }

    #[test]
    fn no_message_of_toml_has_words_of_the_program() {
        let whole = "number = 1.5\nwhole = 2\nlist = [true]\nthree = [1, 2, 3]\nchoice = \"one\"\n[more]\na = 1\n";
        let mut said = 0;
        let wide = toml::from_str::<toml::Table>("a = 392233720368547758072").unwrap_err();
        assert_eq!(plain(wide.message()), "an integer has more than 64 bits");
        for at in 0..whole.len() {
            for byte in *b"\"[]={}\n.e#" {
                let mut bytes = whole.as_bytes().to_vec();
                bytes[at] = byte;
                let text = String::from_utf8(bytes).unwrap();
                let errors = [toml::from_str::<Fields>(&text).err(), toml::from_str::<toml::Table>(&text).err()];
                for error in errors.into_iter().flatten() {
                    let message = plain(error.message());
                    let refused = REFUSED.iter().find(|word| message.contains(**word));
                    assert_eq!(refused, None, "{message}\n{text}");
                    said += 1;
                }
            }
        }
        assert!(said > 500, "{said}");
    }
}
