//! Poses of a camera as a file tells them: a trajectory of the TUM RGB-D benchmark, or a table whose first line names its columns.
//!
//! Columns that are named are taken by their names, in any order; names that are not understood are refused, for numbers in another order than
//! the one that is meant are poses all the same. Sources: the formats of TUM RGB-D (Sturm et al. 2012) and of EuRoC MAV (Burri et al. 2016).

use crate::math::{Mat3, Quat, vec3};
use crate::sensor::Pose;
use crate::{Error, Result};
use std::borrow::Cow;

/// The numbers of a pose, in the order in which they stand where nothing names them.
const ORDER: [&str; 8] = ["time", "x", "y", "z", "qx", "qy", "qz", "qw"];
/// What the time is called.
const TIMES: [&str; 4] = ["time", "t", "timestamp", "stamp"];
/// What stands before the axis in the name of a coordinate.
const PLACES: [&str; 8] = ["", "t", "p", "p_", "pos_", "position_", "position.", EUROC];
/// The same of a quaternion's part.
const TURNS: [&str; 7] = ["q", "q_", "quat_", "quaternion_", "orientation_", "orientation.", "q_rs_"];
/// The same of velocities and biases, which EuRoC's tables hold behind the pose.
const OTHERS: [&str; 3] = ["v_rs_r_", "b_w_rs_s_", "b_a_rs_s_"];
/// How EuRoC's tables call places; their times are nanoseconds, whether or not they say so.
const EUROC: &str = "p_rs_r_";

/// Farthest place along an axis, metres: single precision tells 0.06 mm apart there.
const FARTHEST: f64 = 1000.0;
/// Latest time, seconds: three thousand years after the epoch.
const LATEST: f64 = 1e11;
/// Shortest time from one pose to the next, seconds.
const SHORTEST: f64 = 1e-6;

/// Most columns that are looked at: a line may be as long as the file.
const MOST_COLUMNS: usize = 64;
/// Most names of columns that an error repeats, and most characters of each.
const REPEATED: (usize, usize) = (20, 32);

/// Reads times, seconds, and poses; `#` begins a comment. The error names the line.
pub(super) fn read(bytes: &[u8]) -> Result<Vec<(f64, Pose)>> {
    let mut all: Vec<(f64, Pose)> = Vec::new();
    let mut columns: Option<Columns> = None;
    let mut begun = false;
    for (line, text) in (1..).zip(text(bytes)?.lines()) {
        let (text, comment) = text.split_once('#').unwrap_or((text, ""));
        let words: Vec<&str> = words(text).take(MOST_COLUMNS + 1).collect();
        if words.is_empty() {
            if columns.is_none() {
                columns = Columns::of_comment(line, comment)?;
            }
            continue;
        }
        // The first line of a table names its columns.
        if !std::mem::replace(&mut begun, true) && words.len() > 1 && words.iter().all(|w| w.parse::<f64>().is_err()) {
            let names = names(text);
            columns = Some(Columns::named(&names).map_err(|wrong| refused(line, &names, &wrong))?);
            continue;
        }
        let columns = &*columns.get_or_insert(Columns::TUM);
        let wrong = |what: &str| Error::input(format!("line {line} {what}")).help(columns.form());
        let is_read = |place: usize| words.len() != columns.count || columns.at.contains(&place);
        if words.iter().enumerate().any(|(place, word)| is_read(place) && finite(word).is_none()) {
            return Err(wrong("holds something that is no number"));
        }
        if words.len() > columns.count {
            return Err(wrong(&format!("holds more than {} numbers", columns.count)));
        }
        if words.len() < columns.count {
            return Err(wrong(&format!("holds {} numbers, not {}", words.len(), columns.count)));
        }
        let [time, x, y, z, qx, qy, qz, qw] = columns.at.map(|place| finite(words[place]).unwrap_or_default());
        let time = time * columns.unit_s;
        let norm = (qx * qx + qy * qy + qz * qz + qw * qw).sqrt();
        if !(0.9..1.1).contains(&norm) {
            return Err(wrong("holds no quaternion of length 1"));
        }
        if time.abs() > LATEST || [x, y, z].iter().any(|v| v.abs() > FARTHEST) {
            return Err(wrong(&format!("lies beyond {FARTHEST} m from the world's origin, or beyond {LATEST} s")));
        }
        if all.last().is_some_and(|(before, _)| time - before < SHORTEST) {
            return Err(wrong("is not later than the one before"));
        }
        let q = [qx, qy, qz, qw].map(|v| (v / norm) as f32);
        let axes = Mat3::from_quat(Quat::from_array(q));
        all.push((time, Pose { position: vec3(x as f32, y as f32, z as f32), axes }));
    }
    Ok(all)
}

/// The file's text, without the byte order mark that some programs begin it with.
fn text(bytes: &[u8]) -> Result<Cow<'_, str>> {
    let bytes = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
    // Numbers in UTF-16 have a byte of 0 each.
    if bytes.starts_with(b"\xff\xfe") || bytes.starts_with(b"\xfe\xff") || bytes.contains(&0) {
        return Err(Error::input("this is not UTF-8 text").help("save the file as UTF-8; some programs write UTF-16"));
    }
    Ok(String::from_utf8_lossy(bytes))
}

/// What stands between blanks and commas.
fn words(text: &str) -> impl Iterator<Item = &str> {
    text.split(|c: char| c.is_whitespace() || c == ',').filter(|word| !word.is_empty())
}

fn finite(word: &str) -> Option<f64> {
    word.parse().ok().filter(|x: &f64| x.is_finite())
}

/// The names in a line: between commas, or between blanks where there are none; a unit in brackets belongs to the name before it.
fn names(text: &str) -> Vec<String> {
    let text = text.trim().trim_end_matches(',');
    if text.contains(',') {
        return text.split(',').take(MOST_COLUMNS).map(|name| name.trim().to_owned()).collect();
    }
    let mut all: Vec<String> = Vec::new();
    for word in text.split_whitespace().take(MOST_COLUMNS) {
        match all.last_mut() {
            Some(name) if word.starts_with('[') => *name = format!("{name} {word}"),
            _ => all.push(word.to_owned()),
        }
    }
    all
}

/// The error about names that are not understood.
fn refused(line: usize, names: &[String], wrong: &str) -> Error {
    let told: Vec<String> = names.iter().take(REPEATED.0).map(|name| repeated(name)).collect();
    let more = if names.len() > REPEATED.0 { ", …" } else { "" };
    let order = ORDER.join(", ");
    Error::input(format!("line {line} names the columns {}{more}: {wrong}", told.join(", "))).help(format!(
        "name all of {order}, in any order, in metres and seconds (`time [ns]` for nanoseconds); without names they stand in this order"
    ))
}

/// A name as an error repeats it.
fn repeated(name: &str) -> String {
    name.chars().take(REPEATED.1).flat_map(char::escape_debug).collect()
}

/// What a column holds.
enum Held {
    /// The number at this place of [`ORDER`]; of a time also its unit, seconds, where the name tells it.
    Number(usize, Option<f64>),
    /// What no pose is made of.
    Other,
}

impl Held {
    /// By the column's name; `None` where nobody is known to call any so.
    fn of(name: &str) -> Option<Self> {
        let name = name.trim_matches(|c: char| c.is_whitespace() || c == '"').to_lowercase();
        let bracket = name.strip_suffix([']', ')']).and_then(|inner| inner.rsplit_once(['[', '(']));
        let (name, unit) = match (bracket, name.rsplit_once('_')) {
            (Some((name, unit)), _) => (name.trim_end(), unit.trim()),
            (None, Some((name, unit @ ("s" | "ms" | "us" | "ns" | "m")))) => (name, unit),
            (None, _) => (name.as_str(), ""),
        };
        if TIMES.contains(&name) {
            let seconds = match unit {
                "" => None,
                "s" => Some(1.0),
                "ms" => Some(1e-3),
                "us" => Some(1e-6),
                "ns" => Some(1e-9),
                _ => return None,
            };
            return Some(Self::Number(0, seconds));
        }
        let axis = ["x", "y", "z", "w"].into_iter().position(|axis| name.ends_with(axis))?;
        let before = &name[..name.len() - 1];
        if axis < 3 && PLACES.contains(&before) && ["", "m"].contains(&unit) {
            return Some(Self::Number(1 + axis, None));
        }
        if TURNS.contains(&before) && ["", "-", "1"].contains(&unit) {
            return Some(Self::Number(4 + axis, None));
        }
        (axis < 3 && OTHERS.contains(&before)).then_some(Self::Other)
    }
}

/// Where in a line the numbers of a pose stand.
struct Columns {
    /// Their places, in the order of [`ORDER`].
    at: [usize; 8],
    /// How many columns there are.
    count: usize,
    /// The unit of time, seconds.
    unit_s: f64,
}

impl Columns {
    /// Those that nothing names.
    const TUM: Self = Self { at: [0, 1, 2, 3, 4, 5, 6, 7], count: 8, unit_s: 1.0 };

    /// Those of these names; otherwise what is wrong with the names.
    fn named(names: &[String]) -> Result<Self, String> {
        let mut at = [None; 8];
        let mut unit_s = None;
        for (place, name) in names.iter().enumerate() {
            match Held::of(name) {
                None => return Err(format!("`{}` is none that is known", repeated(name))),
                Some(Held::Other) => {}
                Some(Held::Number(number, unit)) => {
                    if at[number].replace(place).is_some() {
                        return Err(format!("two of them are {}", ORDER[number]));
                    }
                    unit_s = unit_s.or(unit);
                }
            }
        }
        let lacking = ORDER.into_iter().zip(at).filter(|(_, place)| place.is_none());
        let lacking: Vec<&str> = lacking.map(|(name, _)| name).collect();
        if !lacking.is_empty() {
            return Err(format!("none of them is {}", lacking.join(", ")));
        }
        let usual_s = if names.iter().any(|name| name.to_lowercase().contains(EUROC)) { 1e-9 } else { 1.0 };
        let at = at.map(Option::unwrap_or_default);
        Ok(Self { at, count: names.len(), unit_s: unit_s.unwrap_or(usual_s) })
    }

    /// Those that a comment before the first pose names, as EuRoC's tables and numpy write them; `None` of a comment about something else. An
    /// error where it is a list of names that are not understood.
    fn of_comment(line: usize, comment: &str) -> Result<Option<Self>> {
        let comment = comment.trim_start_matches('#');
        let names = names(comment);
        let wrong = match Self::named(&names) {
            Ok(columns) => return Ok(Some(columns)),
            Err(wrong) => wrong,
        };
        // Whatever its unit.
        let first = names.first().and_then(|name| name.split(|c: char| !c.is_alphanumeric()).next());
        let begins_with_time = first.is_some_and(|name| TIMES.contains(&name.to_lowercase().as_str()));
        if comment.contains(',') {
            let is_list = names.len() >= ORDER.len() && begins_with_time;
            return if is_list { Err(refused(line, &names, &wrong)) } else { Ok(None) };
        }
        // There may be words behind the names.
        Ok(names.get(..ORDER.len()).and_then(|first| Self::named(first).ok()))
    }

    /// What a line should hold, in words.
    fn form(&self) -> String {
        let mut order: Vec<usize> = (0..ORDER.len()).collect();
        order.sort_by_key(|number| self.at[*number]);
        let order: Vec<&str> = order.into_iter().map(|number| ORDER[number]).collect();
        let units = if self.unit_s == 1.0 { "in seconds and metres" } else { "as the columns are named" };
        format!("write: {}, {units}", order.join(" "))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Rationale: a table in another order than the one that is meant gives poses that look right and are not. Expected: the same pose in every order,
    /// by every spelling, whatever the separators; in nanoseconds too; a byte order mark changes nothing. Source: the same pose as TUM RGB-D
    /// writes it; times to 1 ns.
    #[test]
    fn columns_are_taken_by_their_names() {
        let plain = "3 0.1 0.2 0.6 0.5 -0.5 0.1 0.7";
        let expected = read(plain.as_bytes()).unwrap();
        assert_eq!(expected.len(), 1);
        let euroc = "#timestamp [ns],p_RS_R_x [m],p_RS_R_y [m],p_RS_R_z [m],q_RS_w [],q_RS_x [],q_RS_y [],q_RS_z []";
        let whole = "#timestamp, p_RS_R_x [m], p_RS_R_y [m], p_RS_R_z [m], q_RS_w [], q_RS_x [], q_RS_y [], q_RS_z [], \
                     v_RS_R_x [m s^-1], b_w_RS_S_x [rad s^-1], b_a_RS_S_x [m s^-2]";
        for text in [
            "time,x,y,z,qx,qy,qz,qw\n3,0.1,0.2,0.6,0.5,-0.5,0.1,0.7".to_owned(),
            "time,x,y,z,qw,qx,qy,qz\n3,0.1,0.2,0.6,0.7,0.5,-0.5,0.1".to_owned(),
            format!("# the flight, of a Tuesday\n{plain}"),
            "\n Time [s], Z, Y, X, QX, QY, QZ, QW,\n3, 0.6, 0.2, 0.1, 0.5, -0.5, 0.1, 0.7,".to_owned(),
            "qx qy qz qw tx ty tz t\n0.5 -0.5 0.1 0.7 0.1 0.2 0.6 3".to_owned(),
            format!("# timestamp tx ty tz qx qy qz qw\n# of the left camera\n{plain}"),
            "# timestamp tx ty tz qw qx qy qz of the left camera\n3 0.1 0.2 0.6 0.7 0.5 -0.5 0.1".to_owned(),
            "# time,x,y,z,qw,qx,qy,qz\n3 0.1 0.2 0.6 0.7 0.5 -0.5 0.1".to_owned(),
            "timestamp [ns] position_x position_y position_z q_w q_x q_y q_z\n3e9 0.1 0.2 0.6 0.7 0.5 -0.5 0.1"
                .to_owned(),
            "time_ms,x_m,y_m,z_m,qx,qy,qz,qw\n3000,0.1,0.2,0.6,0.5,-0.5,0.1,0.7".to_owned(),
            format!("{euroc}\n3000000000,0.1,0.2,0.6,0.7,0.5,-0.5,0.1"),
            format!("{whole}\n3000000000,0.1,0.2,0.6,0.7,0.5,-0.5,0.1,nan,0,0"),
            format!("\u{feff}{plain}"),
            "\u{feff}time,x,y,z,qw,qx,qy,qz\r\n3,0.1,0.2,0.6,0.7,0.5,-0.5,0.1\r\n".to_owned(),
        ] {
            let found = read(text.as_bytes()).unwrap_or_else(|e| panic!("{text}: {e}"));
            assert!(found.len() == 1 && found[0].1 == expected[0].1, "{text}: {found:?}");
            assert!((found[0].0 - 3.0).abs() < 1e-9, "{text}: {}", found[0].0);
        }
    }

    /// Expected: the line, the names that stand there, what is wrong with them, and the names in the usual order.
    #[test]
    fn names_that_are_not_understood_are_refused() {
        let numbers = "\n0 0 0 1 1 0 0 0";
        for (names, words) in [
            ("time,x,y,z,qw,qx,qy", "line 1 names the columns time, x, y, z, qw, qx, qy: none of them is qz"),
            ("time x y height qx qy qz qw", "`height` is none that is known"),
            ("time,x,y,x,qx,qy,qz,qw", "two of them are x"),
            ("\n#timestamp [h],x,y,z,qx,qy,qz,qw", "line 2 names the columns timestamp [h], x, y"),
            ("time,x [ft],y,z,qx,qy,qz,qw", "`x [ft]` is none that is known"),
            ("a b\nc d", "line 1 names the columns a, b: `a` is none that is known"),
        ] {
            let error = read(format!("{names}{numbers}").as_bytes()).unwrap_err().to_string();
            assert!(error.contains(words), "{error}");
            assert!(error.contains("name all of time, x, y, z, qx, qy, qz, qw, in any order"), "{error}");
        }
        let long = format!("time,{},y", "\u{1b}x".repeat(1000));
        let error = read(long.as_bytes()).unwrap_err().to_string();
        assert!(error.len() < 1000 && !error.contains('\u{1b}'), "{error}");
    }

    #[test]
    fn lines_that_are_no_poses_are_named() {
        for (text, words) in [
            ("0 0 0 1 1 0 0 0\nx", "line 2 holds something"),
            ("0 0 0 1", "line 1 holds 4 numbers"),
            ("0 0 0 1 1 0 0 0 0", "line 1 holds more than 8 numbers"),
            ("0 0 0 1 0 0 0 0", "no quaternion"),
            ("1 0 0 1 1 0 0 0\n1 0 0 1 1 0 0 0", "line 2 is not later"),
            ("0 0 0 NaN 1 0 0 0", "line 1 holds something"),
            ("0 1e300 0 1 1 0 0 0", "line 1 lies beyond 1000 m"),
            ("-1e300 0 0 1 1 0 0 0", "line 1 lies beyond"),
            ("time,x,y,z,qw,qx,qy,qz\nc d", "line 2 holds something"),
            ("time,x,y,z,qw,qx,qy,qz\n0 0 0 1", "write: time x y z qw qx qy qz, in seconds and metres"),
        ] {
            let error = read(text.as_bytes()).unwrap_err().to_string();
            assert!(error.contains(words), "{error}");
        }
    }

    /// Expected: what is UTF-16 is called so, with and without its byte order mark.
    #[test]
    fn other_encodings_are_refused() {
        let wide: Vec<u8> = "0 0 0 1 1 0 0 0".encode_utf16().flat_map(u16::to_le_bytes).collect();
        for bytes in [wide.clone(), [&b"\xff\xfe"[..], &wide].concat()] {
            let error = read(&bytes).unwrap_err().to_string();
            assert!(error.contains("not UTF-8 text") && error.contains("save the file as UTF-8"), "{error}");
        }
    }
}
