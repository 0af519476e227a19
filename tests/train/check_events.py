"""Compares a training's TensorBoard file, read by TensorBoard, with its `log.csv`: check_events.py RUN."""

import csv
import io
import sys

from PIL import Image
from tensorboard.backend.event_processing.event_file_loader import RawEventFileLoader
from tensorboard.compat.proto.event_pb2 import Event

run = sys.argv[1]
found, pictures, versions = {}, [], []
# The loader verifies the checksum of every record, and stops at the first invalid one.
for raw in RawEventFileLoader(f"{run}/training.tfevents").Load():
    event = Event.FromString(raw)
    assert event.wall_time > 1.7e9
    if event.HasField("file_version"):
        versions.append(event.file_version)
    if event.HasField("session_log"):
        # Like TensorBoard's reader: earlier values of this step and later ones are discarded.
        found = {key: value for key, value in found.items() if key[1] < event.step}
        pictures = [step for step in pictures if step < event.step]
    for value in event.summary.value:
        if value.HasField("image"):
            picture = Image.open(io.BytesIO(value.image.encoded_image_string))
            assert picture.size == (value.image.width, value.image.height) and picture.getextrema() != ((255, 255),) * 3
            pictures.append(event.step)
        else:
            assert (value.tag, event.step) not in found, (value.tag, event.step)
            found[value.tag, event.step] = value.simple_value
assert versions == ["brain.Event:2"], versions
rows = list(csv.DictReader(open(f"{run}/log.csv")))
looks = [int(row["step"]) for row in rows if row["validation_mean_iou"]]
assert pictures == looks, (pictures, looks)
names = {
    "loss": "loss/training",
    "rate": "learning rate",
    "validation_mean_iou": "validation/mean IoU",
    "validation_loss": "loss/validation",
}
names |= {c: "validation/IoU of " + c.removeprefix("validation_iou_") for c in rows[0] if c.startswith("validation_iou_")}
compared = 0
for row in rows:
    for column, tag in names.items():
        if row[column]:
            theirs = found.pop((tag, int(row["step"])))
            assert abs(theirs - float(row[column])) <= 1e-6 * max(1, abs(theirs)), (tag, row["step"])
            compared += 1
left = {tag for tag, _ in found}
assert left <= {"validation/accuracy"}, left
print(f"{compared} numbers and {len(pictures)} pictures agree")
