//! Suggest: the word that a mistyped one most likely means, or none.
//!
//! A suggestion is made only where one known word is nearer than all others and at most a third of the letters differ: a
//! wrong suggestion costs more than none.
//!
//! | | |
//! |---|---|
//! | in: word | as typed |
//! | in: known words | each with its distance from `word`, or none if they have nothing in common: [`distance`] |
//! | out: suggestion | the nearest, if no other is as near |

/// Number of letters to insert, delete, replace or swap with their neighbour to make `known` of `word`; `None` if that is
/// more than a third of the letters of `word`.
pub(crate) fn distance(word: &str, known: &str) -> Option<usize> {
    let letters = word.chars().count();
    let edits = strsim::damerau_levenshtein(&word.to_lowercase(), &known.to_lowercase());
    (edits <= letters / 3 || edits == 0).then_some(edits)
}

/// The known word with the smallest key; none if two have it, or no word has one.
pub(crate) fn nearest<W, K: Ord>(known: impl Iterator<Item = W>, key: impl Fn(&W) -> Option<K>) -> Option<W> {
    let mut keyed: Vec<(K, W)> = known.filter_map(|word| Some((key(&word)?, word))).collect();
    keyed.sort_by(|(a, _), (b, _)| a.cmp(b));
    let tie = matches!(&keyed[..], [(first, _), (second, _), ..] if first == second);
    keyed.into_iter().next().map(|(_, word)| word).filter(|_| !tie)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_near_word_or_none() {
        let known = ["sensor-1", "sensor-2", "eight-by-eight"];
        let suggestion = |word: &str| nearest(known.into_iter(), |known| distance(word, known));
        assert_eq!(suggestion("sensor1"), Some("sensor-1"));
        assert_eq!(suggestion("Sesnor-2"), Some("sensor-2"));
        assert_eq!(suggestion("eigth-by-eight"), Some("eight-by-eight"));
        // Two are as near; nothing is near.
        for word in ["sensor-9", "nope", "s", ""] {
            assert_eq!(suggestion(word), None, "{word}");
        }
    }
}
