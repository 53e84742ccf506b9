//! All frames of a text.

use super::read::{Doubt, LeftOut, Read, TextFrame};
use super::reader::Reader;
use super::{json, shown, Layout, Line, NoReadings, Stated};

/// All frames of a text.
#[derive(Clone, Debug, PartialEq)]
pub struct TextFrames {
    /// The layout; `None` if all lines are JSON.
    pub layout: Option<Layout>,
    /// The frames in their order.
    pub frames: Vec<TextFrame>,
    /// What holds none.
    pub left_out: Vec<LeftOut>,
    /// The last line has no end and may be cut within a number, in words.
    pub may_be_cut: Option<String>,
}

/// Reads all frames of a text of an array of `[rows, cols]`.
///
/// ```
/// use dermis_golden::data::text::{frames, Stated};
///
/// let text = "time,a,b,c,d\n0.00,1,2,3,4\n0.01,2,3,4\n0.02,3,4,5,6\n";
/// let read = frames(text, [2, 2], &Stated::default())?;
/// assert_eq!(read.frames[1].readings, [3.0, 4.0, 5.0, 6.0]);
/// assert_eq!(read.frames[1].time_ns, Some(20_000_000));
/// assert_eq!(read.left_out[0].reason.to_string(), "line 3: 4 values, wanted 5");
/// # Ok::<(), dermis_golden::data::text::NoReadings>(())
/// ```
///
/// # Errors
/// No layout, or more than one, that fits; more lines without a frame than frames.
pub fn frames(text: &str, shape: [usize; 2], stated: &Stated) -> Result<TextFrames, NoReadings> {
    let text = text.strip_prefix('\u{feff}').unwrap_or(text);
    let lines = Line::of_text(text, stated.skip_rows);
    let is_json = |line: &Line| json::is_json(line.text);
    let table: Vec<Line> = lines.iter().copied().filter(|line| !is_json(line)).collect();
    let layout = match table.is_empty() && !lines.is_empty() {
        true => None,
        false => Some(Layout::of_lines(&table, shape, stated)?),
    };
    let mut reader = Reader::of_layout(shape, *stated, layout.clone());
    let first_line = layout.as_ref().map_or(1, |layout| layout.first_line);
    let last = lines.last().copied().filter(|_| !text.ends_with('\n'));
    let mut read = TextFrames { layout, frames: Vec::new(), left_out: Vec::new(), may_be_cut: None };
    // Before the first readings stands a header; a line of numbers there is one that does not fit.
    let is_header = |line: &Line| {
        line.number < first_line && !is_json(line) && read.layout.as_ref().is_none_or(|layout| layout.is_header(line))
    };
    let own: Vec<Line> = lines.into_iter().filter(|line| !is_header(line)).collect();
    for line in own {
        read.add(reader.push(line));
    }
    read.add(reader.finish());
    read.leave_out_doubted();
    read.may_be_cut = last.and_then(|last| read.cut_within(&last));
    match read.left_out.first() {
        Some(first) if read.left_out.len() > read.frames.len() => Err(first.reason.clone()),
        None if read.frames.is_empty() => Err(NoReadings::of_text("no line with readings")),
        _ => Ok(read),
    }
}

impl TextFrames {
    fn add(&mut self, read: Vec<Read>) {
        for read in read {
            match read {
                Read::Frame(frame) => self.frames.push(frame),
                Read::LeftOut(left_out) => self.left_out.push(left_out),
                Read::Header(_) => (),
            }
        }
    }

    /// Leaves out the frames with a reading that seems to have lost a character.
    fn leave_out_doubted(&mut self) {
        let reasons: Vec<Option<NoReadings>> = (0..self.frames.len()).map(|k| self.lost_character(k)).collect();
        let mut reasons = reasons.into_iter();
        self.frames.retain(|frame| {
            let reason = reasons.next().flatten();
            let is_whole = reason.is_none();
            self.left_out.extend(reason.map(|reason| LeftOut { id: frame.id.clone(), reason }));
            is_whole
        });
        self.left_out.sort_by_key(|left_out| left_out.reason.line);
    }

    /// Why the frame of this index has lost a character, if one seems to be lost that the frame behind does not lack too.
    fn lost_character(&self, index: usize) -> Option<NoReadings> {
        let frame = &self.frames[index];
        let Some(Doubt::Reading { taxel, cell, before }) = &frame.doubt else { return None };
        let of = |frame: &TextFrame| frame.readings[*taxel];
        let stays = |next: f64| (next - of(frame)).abs() < (next - before).abs();
        if self.frames.get(index + 1).map(of).is_some_and(stays) {
            return None;
        }
        let cell = shown(cell);
        let reason =
            format!("a character of {cell} seems to be lost: {before} beside it, and the others change by less");
        let line = Line { number: frame.line, text: "" };
        Some(NoReadings::of_line(&line, reason).cut())
    }

    /// What may be wrong in frames near a line that has lost characters, in words; `None` if there are none.
    pub fn near_loss_text(&self) -> Option<String> {
        let near = self.frames.iter().filter(|frame| matches!(frame.doubt, Some(Doubt::NearLoss(_)))).count();
        (near > 0).then(|| {
            format!("{near} frames near lines that have lost characters: a digit that one has lost does not show")
        })
    }

    /// That a line without end, the last one, may be cut, in words: editors leave out the last end of a line too.
    fn cut_within(&self, line: &Line) -> Option<String> {
        let is_read = self.frames.last().is_some_and(|frame| frame.line == line.number);
        let layout = self.layout.as_ref().filter(|_| is_read && !json::is_json(line.text))?;
        let cell = layout.cut_cell(line.text)?;
        Some(format!("line {} has no end: its last value, {}, may be cut", line.number, shown(&cell)))
    }

    /// What was left out, in words: how many, and the first three; `None` if nothing was.
    pub fn left_out_text(&self) -> Option<String> {
        let named: Vec<String> = self.left_out.iter().take(3).map(|left_out| left_out.reason.to_string()).collect();
        let more = if self.left_out.len() > named.len() { "; …" } else { "" };
        (!named.is_empty()).then(|| format!("{} left out: {}{more}", self.left_out.len(), named.join("; ")))
    }
}
