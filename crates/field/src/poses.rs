//! Reads camera poses from a file: a trajectory in the TUM RGB-D format, or a table whose first line names its columns.
//!
//! Named columns are read by their names, in any order. Unknown names are an error, because numbers read in the wrong order would still
//! be valid poses. Sources: the formats of TUM RGB-D (Sturm et al. 2012) and of EuRoC MAV (Burri et al. 2016).

use furrow_base::math::{Mat3, Quat, ToFloat, vec3};
use furrow_base::{Error, Result, input};
use furrow_optics::sensor::Pose;
use std::borrow::Cow;

/// Numbers of a pose, in the order of the columns if they have no names.
const ORDER: [&str; 8] = ["time", "x", "y", "z", "qx", "qy", "qz", "qw"];
/// Known names of the time column.
const TIMES: [&str; 4] = ["time", "t", "timestamp", "stamp"];
/// Known prefixes of position columns, before the name of the axis.
const PLACES: [&str; 8] = ["", "t", "p", "p_", "pos_", "position_", "position.", EUROC];
/// Known prefixes of quaternion columns, before the name of the component.
const TURNS: [&str; 7] = ["q", "q_", "quat_", "quaternion_", "orientation_", "orientation.", "q_rs_"];
/// Prefixes of velocities and biases, which EuRoC's tables have after the pose; they are ignored.
const OTHERS: [&str; 3] = ["v_rs_r_", "b_w_rs_s_", "b_a_rs_s_"];
/// Prefix of positions in EuRoC's tables; their times are in nanoseconds unless the column has a unit.
const EUROC: &str = "p_rs_r_";

/// Maximum coordinate along an axis, metres: single precision resolves 0.06 mm there.
const FARTHEST: f64 = 1000.0;
/// Maximum absolute time, seconds: three thousand years from the epoch.
const LATEST: f64 = 1e11;
/// Minimum time between successive poses, seconds.
const SHORTEST: f64 = 1e-6;

/// Maximum number of columns that are parsed: a line may be as long as the file.
const MOST_COLUMNS: usize = 64;
/// Maximum number of column names that an error repeats, and maximum number of characters of each.
const REPEATED: (usize, usize) = (20, 32);

/// Reads times (seconds) and poses; `#` starts a comment. Errors name the line.
pub(super) fn read(bytes: &[u8]) -> Result<Vec<(f64, Pose)>> {
    let mut all: Vec<(f64, Pose)> = Vec::new();
    let mut columns: Option<Columns> = None;
    let mut begun = false;
    let text = text(bytes)?;
    if !text.contains('\n') && text.trim_end().contains('\r') {
        return Err(Error::input("its lines end in carriage returns alone, so that it is one line")
            .help("save the file with line feeds, the line ends of Unix or Windows"));
    }
    for (line, text) in (1..).zip(text.lines()) {
        let (text, comment) = text.split_once('#').unwrap_or((text, ""));
        let words: Vec<&str> = words(text).take(MOST_COLUMNS + 1).collect();
        if words.is_empty() {
            if columns.is_none() {
                columns = Columns::of_comment(line, comment)?;
            }
            continue;
        }
        if text.contains(';') {
            return Err(Error::input(format!("line {line} has a semicolon"))
                .help("separate columns by blanks or commas, and write decimals with a point"));
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
            return Err(wrong("contains a word that is not a number"));
        }
        if words.len() > columns.count {
            return Err(wrong(&format!("has more than {} numbers", columns.count)));
        }
        if words.len() < columns.count {
            return Err(wrong(&format!("has {} numbers, not {}", words.len(), columns.count)));
        }
        let [time, x, y, z, qx, qy, qz, qw] = columns.at.map(|place| finite(words[place]).unwrap_or_default());
        let time = time * columns.unit_s;
        let norm = (qx * qx + qy * qy + qz * qz + qw * qw).sqrt();
        if !(0.9..1.1).contains(&norm) {
            return Err(wrong("has no quaternion of length 1"));
        }
        if time.abs() > LATEST || [x, y, z].iter().any(|v| v.abs() > FARTHEST) {
            return Err(wrong(&format!("is more than {FARTHEST} m from the origin, or its time exceeds {LATEST} s")));
        }
        if all.last().is_some_and(|(before, _)| time - before < SHORTEST) {
            return Err(wrong("is not later than the one before"));
        }
        let q = [qx, qy, qz, qw].map(|v| (v / norm).to_f32());
        let axes = Mat3::from_quat(Quat::from_array(q));
        all.push((time, Pose { position: vec3(x.to_f32(), y.to_f32(), z.to_f32()), axes }));
    }
    Ok(all)
}

/// Returns the text of the file without the byte order mark that some programs write. Comments may be in any encoding.
fn text(bytes: &[u8]) -> Result<Cow<'_, str>> {
    if input::wide(bytes).is_some() || bytes.contains(&0) {
        return Err(Error::input("this is not UTF-8 text").help("save the file as UTF-8; some programs write UTF-16"));
    }
    Ok(String::from_utf8_lossy(bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes)))
}

/// Splits a line at blanks and commas.
fn words(text: &str) -> impl Iterator<Item = &str> {
    text.split(|c: char| c.is_whitespace() || c == ',').filter(|word| !word.is_empty())
}

fn finite(word: &str) -> Option<f64> {
    word.parse().ok().filter(|x: &f64| x.is_finite())
}

/// Splits a line into column names: at commas, or at blanks if there are no commas. A unit in brackets belongs to the name before it.
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

/// Returns the error about unknown column names.
fn refused(line: usize, names: &[String], wrong: &str) -> Error {
    let listed: Vec<String> = names.iter().take(REPEATED.0).map(|name| repeated(name)).collect();
    let more = if names.len() > REPEATED.0 { ", …" } else { "" };
    let order = ORDER.join(", ");
    Error::input(format!("line {line} names the columns {}{more}: {wrong}", listed.join(", "))).help(format!(
        "name all of {order}, in any order, in metres and seconds (`time [ns]` for nanoseconds); without names, use this order"
    ))
}

/// Shortens and escapes a name for an error message.
fn repeated(name: &str) -> String {
    name.chars().take(REPEATED.1).flat_map(char::escape_debug).collect()
}

/// Content of a column.
enum ColumnContent {
    /// A number of the pose, by its index in [`ORDER`]; for a time also the unit in seconds, if the name has one.
    Number(usize, Option<f64>),
    /// A quantity that is not part of a pose.
    Other,
}

impl ColumnContent {
    /// Parses the name of a column; `None` if it is unknown.
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

/// Layout of a line: the columns of the numbers of a pose.
struct Columns {
    /// Column index of each number, in the order of [`ORDER`].
    at: [usize; 8],
    /// Number of columns.
    count: usize,
    /// Unit of time, seconds.
    unit_s: f64,
}

impl Columns {
    /// Layout of a file without column names.
    const TUM: Self = Self { at: [0, 1, 2, 3, 4, 5, 6, 7], count: 8, unit_s: 1.0 };

    /// Returns the layout for these column names, or a description of what is wrong with them.
    fn named(names: &[String]) -> Result<Self, String> {
        let mut at = [None; 8];
        let mut unit_s = None;
        for (place, name) in names.iter().enumerate() {
            match ColumnContent::of(name) {
                None => return Err(format!("`{}` is not a known name", repeated(name))),
                Some(ColumnContent::Other) => {}
                Some(ColumnContent::Number(number, unit)) => {
                    if at[number].replace(place).is_some() {
                        return Err(format!("two columns are {}", ORDER[number]));
                    }
                    unit_s = unit_s.or(unit);
                }
            }
        }
        let lacking = ORDER.into_iter().zip(at).filter(|(_, place)| place.is_none());
        let lacking: Vec<&str> = lacking.map(|(name, _)| name).collect();
        if !lacking.is_empty() {
            return Err(format!("no column is {}", lacking.join(", ")));
        }
        let usual_s = if names.iter().any(|name| name.to_lowercase().contains(EUROC)) { 1e-9 } else { 1.0 };
        let at = at.map(Option::unwrap_or_default);
        Ok(Self { at, count: names.len(), unit_s: unit_s.unwrap_or(usual_s) })
    }

    /// Returns the layout that a comment before the first pose describes, as written by EuRoC's tables and numpy. Returns `None` if the
    /// comment is about something else, and an error if it is a list with unknown names.
    fn of_comment(line: usize, comment: &str) -> Result<Option<Self>> {
        let comment = comment.trim_start_matches('#');
        let names = names(comment);
        let wrong = match Self::named(&names) {
            Ok(columns) => return Ok(Some(columns)),
            Err(wrong) => wrong,
        };
        // The name without its unit.
        let first = names.first().and_then(|name| name.split(|c: char| !c.is_alphanumeric()).next());
        let begins_with_time = first.is_some_and(|name| TIMES.contains(&name.to_lowercase().as_str()));
        if comment.contains(',') {
            let is_list = names.len() >= ORDER.len() && begins_with_time;
            return if is_list { Err(refused(line, &names, &wrong)) } else { Ok(None) };
        }
        // Other words may follow the names.
        Ok(names.get(..ORDER.len()).and_then(|first| Self::named(first).ok()))
    }

    /// Describes the expected content of a line, for error messages.
    fn form(&self) -> String {
        let mut order: Vec<usize> = (0..ORDER.len()).collect();
        order.sort_by_key(|number| self.at[*number]);
        let order: Vec<&str> = order.into_iter().map(|number| ORDER[number]).collect();
        let units = if self.unit_s == 1.0 { "in seconds and metres" } else { "in the units of the column names" };
        format!("write: {}, {units}", order.join(" "))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Rationale: the whole of such a file is one line, and behind `#` it is one comment. Expected: an error that names the
    /// line ends; carriage returns before line feeds, or at the end of one line, are none.
    #[test]
    fn carriage_returns_alone_are_refused() {
        let pose = "3 0.1 0.2 0.6 0.5 -0.5 0.1 0.7";
        for text in [format!("# by hand\r{pose}\r"), format!("{pose}\r4{}", &pose[1..])] {
            let shown = read(text.as_bytes()).unwrap_err().to_string();
            assert!(shown.contains("carriage returns alone"), "{shown}");
        }
        assert_eq!(read(format!("{pose}\r").as_bytes()).unwrap().len(), 1);
        assert_eq!(read(format!("# by hand\r\n{pose}\r\n").as_bytes()).unwrap().len(), 1);
    }

    /// Rationale: a table read in the wrong column order gives poses that look right and are not. Expected: the same pose for every column
    /// order, spelling and separator, and for nanoseconds; a byte order mark has no effect. Source: the same pose in the TUM RGB-D
    /// format; times within 1 ns.
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

    /// Expected: the error has the line, its column names, their fault, and the known names in the default order.
    #[test]
    fn names_that_are_not_understood_are_refused() {
        let numbers = "\n0 0 0 1 1 0 0 0";
        for (names, words) in [
            ("time,x,y,z,qw,qx,qy", "line 1 names the columns time, x, y, z, qw, qx, qy: no column is qz"),
            ("time x y height qx qy qz qw", "`height` is not a known name"),
            ("time,x,y,x,qx,qy,qz,qw", "two columns are x"),
            ("\n#timestamp [h],x,y,z,qx,qy,qz,qw", "line 2 names the columns timestamp [h], x, y"),
            ("time,x [ft],y,z,qx,qy,qz,qw", "`x [ft]` is not a known name"),
            ("a b\nc d", "line 1 names the columns a, b: `a` is not a known name"),
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
            ("0 0 0 1 1 0 0 0\nx", "line 2 contains a word"),
            ("0 0 0 1", "line 1 has 4 numbers"),
            ("0;0,1;0;1;1;0;0;0", "line 1 has a semicolon"),
            ("time;x;y\n0;0;0", "write decimals with a point"),
            ("0 0 0 1 1 0 0 0 0", "line 1 has more than 8 numbers"),
            ("0 0 0 1 0 0 0 0", "no quaternion"),
            ("1 0 0 1 1 0 0 0\n1 0 0 1 1 0 0 0", "line 2 is not later"),
            ("0 0 0 NaN 1 0 0 0", "line 1 contains a word"),
            ("0 1e300 0 1 1 0 0 0", "line 1 is more than 1000 m from the origin"),
            ("-1e300 0 0 1 1 0 0 0", "line 1 is more than 1000 m"),
            ("time,x,y,z,qw,qx,qy,qz\nc d", "line 2 contains a word"),
            ("time,x,y,z,qw,qx,qy,qz\n0 0 0 1", "write: time x y z qw qx qy qz, in seconds and metres"),
        ] {
            let error = read(text.as_bytes()).unwrap_err().to_string();
            assert!(error.contains(words), "{error}");
        }
    }

    /// Expected: UTF-16 text is rejected with a hint at its encoding, with and without a byte order mark.
    #[test]
    fn other_encodings_are_refused() {
        let wide: Vec<u8> = "0 0 0 1 1 0 0 0".encode_utf16().flat_map(u16::to_le_bytes).collect();
        for bytes in [wide.clone(), [&b"\xff\xfe"[..], &wide].concat()] {
            let error = read(&bytes).unwrap_err().to_string();
            assert!(error.contains("not UTF-8 text") && error.contains("save the file as UTF-8"), "{error}");
        }
    }
}
