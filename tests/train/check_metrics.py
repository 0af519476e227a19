"""Compares our confusion matrices, scores and regions with scikit-learn's and SciPy's: python check_metrics.py CASES.json"""

import json
import math
import sys
import warnings

import numpy as np
from scipy import ndimage
from sklearn import metrics

# scikit-learn warns about each undefined ratio requested here.
warnings.simplefilter("ignore")


def same(ours, theirs, what):
    if ours is None or math.isnan(theirs):
        assert ours is None and math.isnan(theirs), f"{what}: {ours} against {theirs}"
    else:
        assert abs(ours - theirs) < 1e-12, f"{what}: {ours} against {theirs}"


def check_class(ours, truth, predicted, name):
    """Checks the scores of one class, given true and predicted masks."""
    p, r, f, _ = metrics.precision_recall_fscore_support(
        truth, predicted, pos_label=1, average="binary", zero_division=np.nan
    )
    nothing = not truth.any() and not predicted.any()
    same(ours["precision"], p, f"precision of {name}")
    same(ours["recall"], r, f"recall of {name}")
    same(ours["f1"], f, f"F1 of {name}")
    same(ours["iou"], math.nan if nothing else metrics.jaccard_score(truth, predicted), f"I/U of {name}")


def check_scores(case):
    truth, predicted = (np.array(case[key]) for key in ("truth", "predicted"))
    known = truth != 255
    truth, predicted = truth[known], predicted[known]
    ours = case["scores"]
    matrix = metrics.confusion_matrix(truth, predicted, labels=[0, 1, 2])
    assert matrix.tolist() == case["confusion"], f"{matrix} against {case['confusion']}"
    same(ours["global_accuracy"], metrics.accuracy_score(truth, predicted), "GA")
    same(ours["class_accuracy"], metrics.balanced_accuracy_score(truth, predicted), "CA")
    # Averaged over the labels that occur, which is the default.
    same(ours["mean_iou"], metrics.jaccard_score(truth, predicted, average="macro"), "mean I/U")
    for k, scores in enumerate(ours["classes"]):
        check_class(scores, truth == k, predicted == k, f"class {k}")
    check_class(ours["vegetation"], truth > 0, predicted > 0, "vegetation")


def check_regions(case):
    mask = np.array(case["predicted"]).reshape(case["height"], case["width"]) == 1
    theirs, count = ndimage.label(mask, structure=np.ones((3, 3)))
    ours = np.array(case["regions"]).reshape(mask.shape)
    assert count == len(case["areas"]) == ours.max(initial=0)
    # The same regions, whatever their numbers.
    pairs = {(int(a), int(b)) for a, b in zip(ours.ravel(), theirs.ravel())}
    assert len(pairs) == len({a for a, _ in pairs}) == len({b for _, b in pairs}), "regions differ"
    assert np.bincount(ours.ravel(), minlength=count + 1)[1:].tolist() == case["areas"]


def main():
    with open(sys.argv[1]) as file:
        cases = json.load(file)
    for case in cases:
        check_scores(case)
        check_regions(case)
    print(f"{len(cases)} cases agree")


main()
