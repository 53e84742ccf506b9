//! NumPy arrays: `\x93NUMPY`, version, length of the header, a Python dictionary, then the values.
//!
//! | field | read |
//! |---|---|
//! | `descr` | integers of 1 to 8 bytes, floats of 2, 4 and 8, booleans; little- and big-endian |
//! | `fortran_order` | both |
//! | `shape` | (frames, rows, cols), (rows, cols) for one frame; beside a stated size also (frames, taxels), (rows, cols, frames) and (taxels, frames) |
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
    let order = Order::of(&header.shape, size, source)?;
    let Order { frames: count, size: [rows, cols], .. } = order;
    let taxels = rows * cols;
    let frame_bytes = taxels.checked_mul(header.number.width);
    let wanted = frame_bytes.and_then(|bytes| bytes.checked_mul(count));
    let steps = order.steps(&header.shape, header.fortran);
    // Of those that do not stand one after the other none is whole.
    let whole = frame_bytes.filter(|_| steps[0] == taxels).map_or(0, |bytes| data.len() / bytes);
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
            let number = value(frame * steps[0] + row * steps[1] + col * steps[2]);
            if !number.is_nan() && !is_reading(number) {
                let place = format!("frame {}, row {row}, column {col}", frame + 1);
                return Err(source.field(&place, number, "a number up to 1e9 in magnitude, or NaN"));
            }
            values.push(number);
        }
        frames.push(RawFrame { number: frame + 1, time_s: None, values, stated: None, device: None });
    }
    let in_doubt = in_doubt(&header.shape, size);
    Ok(Recording { cut, in_doubt, ..Recording::bare(Format::Npy, [rows, cols], frames) })
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

/// Shapes beside a stated size.
const OF_SIZE: &str =
    "that of --size: (frames, rows, cols), (rows, cols), (frames, taxels), (rows, cols, frames) or (taxels, frames)";

/// What the axes of an array are.
struct Order {
    frames: usize,
    size: [usize; 2],
    /// Axis of the frames, of the rows, of the columns; one of all taxels is that of both, and one frame has none.
    axes: [Option<usize>; 3],
}

impl Order {
    /// That of a shape.
    fn of(shape: &[usize], size: Option<[usize; 2]>, source: &Source) -> Result<Order, ImportError> {
        let wrong = |allowed: &str| source.field("shape", format!("{shape:?}"), allowed);
        let (frames, size, axes) = match (shape, size) {
            ([frames, taxels], Some(size)) if size[0] * size[1] == *taxels => {
                (*frames, size, [Some(0), Some(1), Some(1)])
            }
            ([rows, cols], size) if size.is_none_or(|size| size == [*rows, *cols]) => {
                (1, [*rows, *cols], [None, Some(0), Some(1)])
            }
            ([frames, rows, cols], size) if size.is_none_or(|size| size == [*rows, *cols]) => {
                (*frames, [*rows, *cols], [Some(0), Some(1), Some(2)])
            }
            ([rows, cols, frames], Some(size)) if size == [*rows, *cols] => {
                (*frames, size, [Some(2), Some(0), Some(1)])
            }
            ([taxels, frames], Some(size)) if size[0] * size[1] == *taxels => {
                (*frames, size, [Some(1), Some(0), Some(0)])
            }
            (_, Some(_)) => return Err(wrong(OF_SIZE)),
            _ => return Err(wrong("(frames, rows, cols) or (rows, cols)")),
        };
        match size[0].max(size[1]) <= LARGEST_SIDE {
            true => Ok(Order { frames, size, axes }),
            false => Err(wrong(&format!("at most {LARGEST_SIDE} rows and columns"))),
        }
    }

    /// Values from one frame, row and column to the next; those of a shape that no file can hold are the largest number.
    fn steps(&self, shape: &[usize], fortran: bool) -> [usize; 3] {
        let step = |axis: usize| {
            let inner = if fortran { &shape[..axis] } else { &shape[axis + 1..] };
            inner.iter().fold(1, |step: usize, side| step.saturating_mul(*side))
        };
        let [frames, rows, cols] = self.axes.map(|axis| axis.map_or(0, step));
        // Taxels on one axis.
        let rows = if self.axes[1] == self.axes[2] { rows.saturating_mul(self.size[1]) } else { rows };
        [frames, rows, cols]
    }
}

/// That an array may be of another order, in words: more columns than frames, where no size is stated.
fn in_doubt(shape: &[usize], size: Option<[usize; 2]>) -> Vec<String> {
    match (shape, size) {
        ([a, b, c], None) if c > a => {
            vec![format!("read as {a} frames of {b}×{c}; --size {a}x{b} reads {c} frames of {a}×{b}")]
        }
        _ => Vec::new(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// An array of bytes whose axes, of this shape, have these steps in (frame, row, column), of 3 frames of 2×4.
    fn array(shape: &[usize], place: impl Fn([usize; 3]) -> usize, fortran: bool) -> Vec<u8> {
        let order = if fortran { "True" } else { "False" };
        let header =
            format!("{{'descr': '|u1', 'fortran_order': {order}, 'shape': ({shape:?}), }}\n").replace(['[', ']'], "");
        let mut data = vec![0; 24];
        for value in 0..24 {
            data[place([value / 8, value / 4 % 2, value % 4])] = value as u8 + 1;
        }
        [NPY_MAGIC, &[1, 0], &(header.len() as u16).to_le_bytes(), header.as_bytes(), &data].concat()
    }

    #[test]
    fn frames_are_the_same_in_every_order() {
        type Place = fn([usize; 3]) -> usize;
        let orders: [(&[usize], Place, Place); 4] = [
            (&[3, 2, 4], |[f, r, c]| (2 * f + r) * 4 + c, |[f, r, c]| f + 3 * (r + 2 * c)),
            (&[3, 8], |[f, r, c]| 8 * f + 4 * r + c, |[f, r, c]| f + 3 * (4 * r + c)),
            (&[2, 4, 3], |[f, r, c]| (4 * r + c) * 3 + f, |[f, r, c]| r + 2 * (c + 4 * f)),
            (&[8, 3], |[f, r, c]| (4 * r + c) * 3 + f, |[f, r, c]| 4 * r + c + 8 * f),
        ];
        let wanted: Vec<Vec<f64>> =
            (0..3).map(|frame| (1..9).map(|own| f64::from(8 * frame + own)).collect()).collect();
        let source = Source { file: "a.npy" };
        for (shape, c, fortran) in orders {
            for bytes in [array(shape, c, false), array(shape, fortran, true)] {
                let read = parse(&bytes, Some([2, 4]), &source).unwrap();
                let frames: Vec<Vec<f64>> = read.frames.into_iter().map(|frame| frame.values).collect();
                assert_eq!((frames, read.in_doubt), (wanted.clone(), vec![]), "{shape:?}");
            }
        }
        // More frames than a file can hold, in every order: none is whole.
        let most = usize::MAX / 2;
        for shape in [[most, 2, 4], [2, 4, most]] {
            for fortran in [false, true] {
                let bytes = array(&shape, |[f, r, c]| 8 * f + 4 * r + c, fortran);
                let read = parse(&bytes, Some([2, 4]), &source);
                let said = read.map_or_else(|error| error.to_string(), |read| read.cut.unwrap_or_default());
                assert!(said.contains(&most.to_string()), "{shape:?}: {said}");
            }
        }
        // More columns than frames, and no size that says what they are.
        let read = |shape: &[usize]| parse(&array(shape, |[f, r, c]| 8 * f + 4 * r + c, false), None, &source).unwrap();
        assert_eq!(read(&[2, 4, 3]).in_doubt, ["read as 2 frames of 4×3; --size 2x4 reads 3 frames of 2×4"]);
        assert!(read(&[4, 2, 3]).in_doubt.is_empty());
    }
}
