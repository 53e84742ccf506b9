//! NumPy arrays: `\x93NUMPY`, version, length of the header, a Python dictionary, then the values.
//!
//! | field | read |
//! |---|---|
//! | `descr` | integers of 1 to 8 bytes, floats of 2, 4 and 8, booleans; little- and big-endian |
//! | `fortran_order` | both |
//! | `shape` | (frames, rows, cols), (rows, cols) for one frame, (frames, taxels) beside a stated size |
//!
//! A value that is not a number is a missing reading. The header is read here and not by a general reader of
//! Python literals: three fields of fixed kinds need no recursion and no allocation that a damaged header can inflate.

use super::error::{ImportError, Source};
use super::format::{Format, NPY_MAGIC};
use super::recording::{is_reading, RawFrame, Recording, LARGEST_SIDE};
use crate::data::number::{NumberFormat, NumberKind as Kind};

/// The fields of a header.
#[derive(Debug, PartialEq)]
struct Header {
    number: NumberFormat,
    fortran: bool,
    shape: Vec<usize>,
}

/// Reads a recording; `size` is the stated number of rows and columns.
pub(super) fn parse(bytes: &[u8], size: Option<[usize; 2]>, source: &Source) -> Result<Recording, ImportError> {
    let (text, data) = split(bytes).ok_or_else(|| source.field("the NumPy header", "cut off", "complete"))?;
    let header = header(&text, source)?;
    let [count, rows, cols] = dimensions(&header.shape, size, source)?;
    let taxels = rows * cols;
    let frame_bytes = taxels.checked_mul(header.number.width);
    let wanted = frame_bytes.and_then(|bytes| bytes.checked_mul(count));
    // Frames stand one after the other but in the order of Fortran.
    let whole = frame_bytes.filter(|_| !header.fortran).map_or(0, |bytes| data.len() / bytes);
    let cut = wanted.is_some_and(|wanted| data.len() < wanted).then(|| format!("the header states {count} frames"));
    let count = if cut.is_some() { whole } else { count };
    if cut.is_none() && wanted != Some(data.len()) {
        let allowed = format!("the number of bytes of shape {:?}", header.shape);
        return Err(source.field("bytes behind the NumPy header", data.len(), allowed));
    }
    let width = header.number.width;
    let value = |index: usize| header.number.value(&data[index * width..][..width]);
    let mut frames = Vec::with_capacity(count);
    for frame in 0..count {
        let mut values = Vec::with_capacity(taxels);
        for taxel in 0..taxels {
            let (row, col) = (taxel / cols, taxel % cols);
            let index = match (header.fortran, header.shape.len()) {
                (false, _) => frame * taxels + taxel,
                (true, 3) => frame + count * (row + rows * col),
                // One frame, or a line of taxels per frame.
                (true, _) if count == 1 && header.shape == [rows, cols] => row + rows * col,
                (true, _) => frame + count * taxel,
            };
            let number = value(index);
            if !number.is_nan() && !is_reading(number) {
                let place = format!("frame {}, row {row}, column {col}", frame + 1);
                return Err(source.field(&place, number, "a number up to 1e9 in magnitude, or NaN"));
            }
            values.push(number);
        }
        frames.push(RawFrame { number: frame + 1, time_s: None, values, stated: None, device: None });
    }
    Ok(Recording { cut, ..Recording::bare(Format::Npy, [rows, cols], frames) })
}

/// Text of the header, and the bytes behind it.
fn split(bytes: &[u8]) -> Option<(String, &[u8])> {
    let rest = bytes.strip_prefix(NPY_MAGIC)?;
    let (version, rest) = rest.split_at_checked(2)?;
    let (length, rest) = match version[0] {
        1 => rest.split_at_checked(2).map(|(l, rest)| (usize::from(u16::from_le_bytes([l[0], l[1]])), rest))?,
        _ => {
            let (l, rest) = rest.split_at_checked(4)?;
            (usize::try_from(u32::from_le_bytes([l[0], l[1], l[2], l[3]])).ok()?, rest)
        }
    };
    let (header, data) = rest.split_at_checked(length)?;
    Some((String::from_utf8_lossy(header).into_owned(), data))
}

/// The value behind `'key':`.
fn field<'a>(text: &'a str, key: &str, source: &Source) -> Result<&'a str, ImportError> {
    let behind = ['\'', '"'].iter().find_map(|quote| text.split_once(&format!("{quote}{key}{quote}")));
    let value = behind.and_then(|(_, rest)| rest.trim_start().strip_prefix(':'));
    value.map(str::trim_start).ok_or_else(|| source.missing(key, "the header of a NumPy file states it"))
}

fn header(text: &str, source: &Source) -> Result<Header, ImportError> {
    let descr = field(text, "descr", source)?;
    let quoted = descr.strip_prefix(['\'', '"']).and_then(|rest| rest.split(['\'', '"']).next());
    let number = quoted
        .and_then(number)
        .ok_or_else(|| source.field("descr", literal(descr), "an integer, float or boolean type, such as '<f4'"))?;
    let order = field(text, "fortran_order", source)?;
    let fortran = match (order.starts_with("True"), order.starts_with("False")) {
        (true, _) => true,
        (_, true) => false,
        _ => return Err(source.field("fortran_order", literal(order), "True or False")),
    };
    let shape = field(text, "shape", source)?;
    let wrong = || source.field("shape", literal(shape), "two or three whole numbers above 0 in brackets");
    let inner = shape.strip_prefix('(').and_then(|rest| rest.split_once(')')).ok_or_else(wrong)?.0;
    let numbers = inner.split(',').map(str::trim).filter(|number| !number.is_empty());
    let shape: Vec<usize> =
        numbers.map(|n| n.parse().ok().filter(|n| *n > 0).ok_or_else(wrong)).collect::<Result<_, _>>()?;
    Ok(Header { number, fortran, shape })
}

/// The value at the begin of a text, to the comma behind it or the end of the dictionary, brackets within it closed.
fn literal(text: &str) -> &str {
    let mut depth = 0;
    let is_end = |c: char| {
        match c {
            '(' | '[' => depth += 1,
            ')' | ']' => depth -= 1,
            _ => (),
        }
        depth <= 0 && matches!(c, ',' | '}')
    };
    text[..text.find(is_end).unwrap_or(text.len())].trim()
}

/// The numbers of a type such as `<f4`.
fn number(descr: &str) -> Option<NumberFormat> {
    let big_endian = descr.starts_with('>');
    let rest = descr.strip_prefix(['<', '>', '|', '='])?;
    let (kind, width) = match rest {
        "b1" | "u1" => (Kind::Unsigned, 1),
        "u2" => (Kind::Unsigned, 2),
        "u4" => (Kind::Unsigned, 4),
        "u8" => (Kind::Unsigned, 8),
        "i1" => (Kind::Signed, 1),
        "i2" => (Kind::Signed, 2),
        "i4" => (Kind::Signed, 4),
        "i8" => (Kind::Signed, 8),
        "f2" => (Kind::Float, 2),
        "f4" => (Kind::Float, 4),
        "f8" => (Kind::Float, 8),
        _ => return None,
    };
    Some(NumberFormat { kind, width, big_endian })
}

/// Frames, rows and columns of a shape.
fn dimensions(shape: &[usize], size: Option<[usize; 2]>, source: &Source) -> Result<[usize; 3], ImportError> {
    let wrong = |allowed: &str| source.field("shape", format!("{shape:?}"), allowed);
    let sides = match (shape, size) {
        ([frames, taxels], Some([rows, cols])) if rows * cols == *taxels => [*frames, rows, cols],
        ([rows, cols], None) => [1, *rows, *cols],
        ([frames, rows, cols], None) => [*frames, *rows, *cols],
        ([rows, cols], Some(size)) if size == [*rows, *cols] => [1, *rows, *cols],
        ([frames, rows, cols], Some(size)) if size == [*rows, *cols] => [*frames, *rows, *cols],
        (_, Some(_)) => return Err(wrong("that of --size: (frames, rows, cols), (rows, cols) or (frames, taxels)")),
        _ => return Err(wrong("(frames, rows, cols) or (rows, cols)")),
    };
    match sides[1].max(sides[2]) <= LARGEST_SIDE {
        true => Ok(sides),
        false => Err(wrong(&format!("at most {LARGEST_SIDE} rows and columns"))),
    }
}
