//! The part of TensorBoard's event file format that the training log needs.
//!
//! Source: `event.proto`, `summary.proto` and `lib/io/record_writer.h` of TensorFlow 2, with the same field numbers and types. A
//! record consists of the message length, a masked CRC-32C of the length, the message, and a masked CRC-32C of the message.

use furrow_base::math::ToInt;
use prost::{Message, Oneof};

/// Protobuf message `Event`.
#[derive(Clone, PartialEq, Message)]
pub(super) struct Event {
    /// Seconds since 1970.
    #[prost(double, tag = "1")]
    pub(super) wall_time: f64,
    #[prost(int64, tag = "2")]
    pub(super) step: i64,
    #[prost(oneof = "EventContent", tags = "3, 5, 7")]
    pub(super) what: Option<EventContent>,
}

/// Content of an event.
#[derive(Clone, PartialEq, Oneof)]
pub(super) enum EventContent {
    #[prost(string, tag = "3")]
    FileVersion(String),
    #[prost(message, tag = "5")]
    Summary(Summary),
    #[prost(message, tag = "7")]
    SessionLog(SessionLog),
}

/// Protobuf message `SessionLog`.
#[derive(Clone, PartialEq, Message)]
pub(super) struct SessionLog {
    #[prost(int32, tag = "1")]
    pub(super) status: i32,
}

/// `SessionLog.START`: earlier records of this step and of later ones are superseded.
pub(super) const STARTED: i32 = 1;

/// Protobuf message `Summary`.
#[derive(Clone, PartialEq, Message)]
pub(super) struct Summary {
    #[prost(message, repeated, tag = "1")]
    pub(super) value: Vec<Value>,
}

/// Protobuf message `Summary.Value`.
#[derive(Clone, PartialEq, Message)]
pub(super) struct Value {
    #[prost(string, tag = "1")]
    pub(super) tag: String,
    #[prost(oneof = "SummaryValue", tags = "2, 4")]
    pub(super) of: Option<SummaryValue>,
}

/// Value of a summary: a number or an image.
#[derive(Clone, PartialEq, Oneof)]
pub(super) enum SummaryValue {
    #[prost(float, tag = "2")]
    Number(f32),
    #[prost(message, tag = "4")]
    Image(Image),
}

/// Protobuf message `Summary.Image`.
#[derive(Clone, PartialEq, Message)]
pub(super) struct Image {
    #[prost(int32, tag = "1")]
    pub(super) height: i32,
    #[prost(int32, tag = "2")]
    pub(super) width: i32,
    /// Number of channels: 3 for RGB.
    #[prost(int32, tag = "3")]
    pub(super) colorspace: i32,
    /// PNG file.
    #[prost(bytes = "vec", tag = "4")]
    pub(super) encoded: Vec<u8>,
}

/// Encodes an event as a record of the file.
pub(super) fn record(event: &Event) -> Vec<u8> {
    let message = event.encode_to_vec();
    let length = message.len().to_u64().to_le_bytes();
    [&length[..], &masked(&length), &message, &masked(&message)].concat()
}

/// Returns the length in bytes of the complete records at the start of a file, and their highest step.
pub(super) fn whole(bytes: &[u8]) -> (usize, u64) {
    let (mut at, mut last) = (0, 0);
    while let Some((message, length)) = first(&bytes[at..]) {
        let Ok(event) = Event::decode(message) else { break };
        at += length;
        last = last.max(event.step.cast_unsigned());
    }
    (at, last)
}

/// Returns the message of the first record and the length of the record, if it is complete and its checksums match.
fn first(bytes: &[u8]) -> Option<(&[u8], usize)> {
    let (length, rest) = bytes.split_first_chunk::<8>()?;
    let (sum, rest) = rest.split_first_chunk::<4>()?;
    if *sum != masked(length) {
        return None;
    }
    let size = usize::try_from(u64::from_le_bytes(*length)).ok()?;
    let (message, rest) = rest.split_at_checked(size)?;
    (rest.first_chunk::<4>()? == &masked(message)).then_some((message, 16 + size))
}

fn masked(bytes: &[u8]) -> [u8; 4] {
    (crc32c::crc32c(bytes).rotate_right(15).wrapping_add(0xa282_ead8)).to_le_bytes()
}
