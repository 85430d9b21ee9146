//! Which fragments of compressed pixels make which frame (PS3.5 A.4): by the table of offsets, and by the code streams themselves.

use super::elements::Fragment;

/// Which fragments of compressed pixels make up which frame.
#[derive(Debug, PartialEq)]
pub(super) struct Divided {
    /// For each frame, the index of its first fragment and the number of its fragments.
    pub frames: Vec<(usize, usize)>,
    /// One line for each statement of the file about its frames that is wrong or missing, and for fragments that are doubtful.
    pub warnings: Vec<String>,
}

/// How the compression marks the code streams of which frames consist.
#[derive(Clone, Copy, Debug)]
pub(super) struct Stream<'a> {
    /// The bytes with which every code stream begins.
    pub start: &'a [u8],
    /// True if every code stream ends with an end mark.
    pub has_end: bool,
}

/// Divides fragments among frames. `stated`: the numbers of frames that are consistent with the file's header, empty if it states none. `table`:
/// the offsets of frames in bytes from the first fragment; empty if there is none. If the header, the table and the code streams contradict each
/// other, the frames that are there count, with a warning.
///
/// # Errors
/// One line: nothing tells how to divide the fragments, or there are fewer frames than stated.
pub(super) fn divided(
    stated: &[usize],
    table: &[u64],
    fragments: &[Fragment],
    stream: Stream,
) -> Result<Divided, String> {
    let all = fragments.len();
    if all == 0 {
        return Err("has no fragments".into());
    }
    let is_stated = |firsts: &Vec<usize>| stated.contains(&firsts.len());
    let by_table = by_table(table, fragments);
    let strict = starts(fragments, stream, true);
    // More code streams than the table has frames: the table is not all.
    let least = strict.as_ref().map_or(0, Vec::len);
    let of_table = by_table.clone().filter(|firsts| firsts.len() >= least);
    let each: Vec<usize> = (0..all).collect();
    let whole = (strict.is_none() && (stated.is_empty() || stated.contains(&1))).then(|| vec![0]);
    let loose = starts(fragments, stream, false);
    let most = loose.as_ref().map_or(0, Vec::len);
    let known = [strict.clone(), of_table.clone(), loose, Some(each.clone())];
    let firsts = known.into_iter().flatten().find(is_stated);
    let firsts = firsts.or(of_table).or(strict).or(whole).or((all == 1).then_some(each));
    let Some(firsts) = firsts else {
        let frames = stated.first().copied().unwrap_or(1);
        return Err(format!("has {all} fragments for {frames} frames, and no table that divides them"));
    };
    let (mut warnings, there) = (warnings(stated, table, &firsts)?, firsts.len());
    if most > there {
        let text = "fragments begin like frames, but not all behind an end mark";
        warnings.push(format!("{most} {text}: {there} are read"));
    }
    let ends = firsts.iter().skip(1).copied().chain([all]);
    Ok(Divided { frames: firsts.iter().zip(ends).map(|(first, end)| (*first, end - first)).collect(), warnings })
}

/// # Errors
/// One line: fewer frames than stated.
fn warnings(stated: &[usize], table: &[u64], firsts: &[usize]) -> Result<Vec<String>, String> {
    let there = firsts.len();
    let mut warnings = Vec::new();
    match stated.iter().min() {
        Some(least) if there < *least => {
            return Err(format!("is cut short: {there} of {least} frames (0028,0008) are there"));
        }
        Some(least) if !stated.contains(&there) => warnings.push(format!(
            "frames (0028,0008) states {least}, but there are {there} frames in the pixel data; all are read"
        )),
        None if there > 1 => warnings
            .push(format!("frames (0028,0008) is missing; there are {there} frames in the pixel data, all are read")),
        _ => {}
    }
    if !table.is_empty() && table.len() != there {
        let text = format!("the table of offsets has {} entries for {there} frames; it is not used", table.len());
        warnings.push(text);
    }
    Ok(warnings)
}

/// The first fragment of each frame as a table says; None if it names no fragments, or not in their order.
fn by_table(table: &[u64], fragments: &[Fragment]) -> Option<Vec<usize>> {
    let begin = fragments.first()?.at;
    let find = |offset: &u64| fragments.binary_search_by_key(&begin.checked_add(*offset)?, |f| f.at).ok();
    let firsts = table.iter().map(find).collect::<Option<Vec<usize>>>()?;
    (firsts.first() == Some(&0) && firsts.is_sorted_by(|a, b| a < b)).then_some(firsts)
}

/// The fragments in which code streams begin; None if the first is no such one. `strict`: only those behind the end of another one, since
/// a picture may hold a smaller one in its headers.
fn starts(fragments: &[Fragment], stream: Stream, strict: bool) -> Option<Vec<usize>> {
    let begins = |n: &usize| {
        let is_behind_end = *n == 0 || fragments[n - 1].ends || !stream.has_end || !strict;
        fragments[*n].head.starts_with(stream.start) && is_behind_end
    };
    let firsts: Vec<usize> = (0..fragments.len()).filter(begins).collect();
    (firsts.first() == Some(&0)).then_some(firsts)
}

#[cfg(test)]
mod tests {
    use super::*;

    const JPEG: Stream = Stream { start: &[0xff, 0xd8, 0xff], has_end: true };

    /// Fragments of 10 bytes. 's': a start, 'e': an end, 'b': both, 'm': the middle of a code stream.
    fn fragments(kinds: &str) -> Vec<Fragment> {
        let one = |(n, kind): (usize, char)| {
            let head = if "sb".contains(kind) { [0xff, 0xd8, 0xff, 0xe0, 0, 0, 0, 0] } else { [7; 8] };
            Fragment { at: 100 + 18 * n as u64, length: 10, head, ends: "eb".contains(kind) }
        };
        kinds.chars().enumerate().map(one).collect()
    }

    fn firsts(stated: &[usize], table: &[u64], kinds: &str) -> (Vec<usize>, Vec<String>) {
        let Divided { frames, warnings } =
            divided(stated, table, &fragments(kinds), JPEG).unwrap_or_else(|why| panic!("{kinds}: {why}"));
        assert_eq!(frames.iter().map(|(_, count)| count).sum::<usize>(), kinds.len());
        (frames.into_iter().map(|(first, _)| first).collect(), warnings)
    }

    #[test]
    fn fragments_are_divided_by_the_table() {
        assert_eq!(firsts(&[3], &[], "mmm").0, [0, 1, 2]);
        assert_eq!(firsts(&[1], &[], "mmm").0, [0]);
        assert_eq!(firsts(&[2], &[0, 36], "mmm"), (vec![0, 2], vec![]));
        for table in [&[][..], &[0, 35], &[36, 0], &[18, 36], &[0, 0], &[0, u64::MAX]] {
            assert!(divided(&[2], table, &fragments("mmm"), JPEG).is_err(), "{table:?}");
        }
        assert!(divided(&[1], &[], &[], JPEG).is_err());
        // The end marks may be missing.
        assert_eq!(firsts(&[2], &[0, 36], "smsm"), (vec![0, 2], vec![]));
    }

    #[test]
    fn fragments_are_divided_where_code_streams_begin() {
        assert_eq!(firsts(&[3], &[], "smebsme"), (vec![0, 3, 4], vec![]));
        assert_eq!(firsts(&[2], &[], "seese"), (vec![0, 3], vec![]), "a fragment of padding");
        let (found, said) = firsts(&[1], &[], "smsme");
        assert_eq!(found, [0], "a small picture in the headers");
        assert!(said.len() == 1 && said[0].contains("2 fragments begin like frames"), "{said:?}");
        assert_eq!(firsts(&[2], &[], "smsme").0, [0, 2], "no end marks");
    }

    #[test]
    fn what_is_there_counts_with_a_warning() {
        let (found, said) = firsts(&[], &[], "bbb");
        assert_eq!(found, [0, 1, 2]);
        assert!(said[0].contains("(0028,0008) is missing; there are 3 frames"), "{said:?}");
        let (found, said) = firsts(&[1], &[0, 36], "mmmm");
        assert_eq!(found, [0, 2]);
        assert!(said[0].contains("states 1, but there are 2"), "{said:?}");
        let (found, said) = firsts(&[1], &[0], "sebse");
        assert_eq!(found, [0, 2, 3]);
        assert!(said.len() == 2 && said[1].contains("has 1 entries for 3 frames"), "{said:?}");
        let few = divided(&[4], &[0, 18, 36], &fragments("bbb"), JPEG).expect_err("refused");
        assert!(few.contains("3 of 4 frames (0028,0008) are there"), "{few}");
        assert_eq!(firsts(&[], &[], "sme"), (vec![0], vec![]));
    }

    #[test]
    fn a_stream_without_an_end_mark_is_known_by_its_start() {
        let start = [2, 0, 0, 0, 64, 0, 0, 0];
        let one = |n: u64, head| Fragment { at: 100 * n, length: 10, head, ends: false };
        let all = [one(0, start), one(1, [9; 8]), one(2, start)];
        let found = divided(&[2], &[], &all, Stream { start: &start, has_end: false }).expect("divided");
        assert_eq!(found.frames, [(0, 2), (2, 1)]);
    }
}
