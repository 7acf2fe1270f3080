from dataclasses import replace

import numpy as np
import pytest

from r2c2r_core.errors import GenerationFailed, OverrideError
from r2c2r_core.generate.consensus import choose_candidate, chosen_by_person
from r2c2r_core.model.mesh import MeshAsset, TexturedMesh

NOTHING = TexturedMesh(
    vertices=np.zeros((0, 3)), faces=np.zeros((0, 3), np.int64), uv=np.zeros((0, 2)), texture=np.zeros((2, 2, 3), np.uint8)
)


def candidate(name, middle, short, filled, iou=0.9, residual=0.01, generator="completion", size=0.9):
    metrics = {"extent_middle": middle, "extent_short": short, "volume_ratio": filled}
    if iou is not None:
        metrics |= {"mask_iou": iou, "depth_residual_m": residual, "size_m": size}
    return MeshAsset(
        object_name="mug_1",
        candidate_id=name,
        mesh=NOTHING,
        generator=generator,
        seed=0,
        watertight=True,
        frames=(),
        metrics=metrics,
        parameters={},
        warnings=(),
    )


FIVE = [
    candidate("c0", 0.60, 0.50, 0.80),
    candidate("c1", 0.62, 0.52, 0.78),  # in the middle of the three that agree
    candidate("c2", 0.64, 0.54, 0.76),
    candidate("c3", 1.00, 0.99, 0.10),  # two outliers, of which this one shifts the mean
    candidate("c4", 0.50, 0.40, 0.82),
]


def test_the_medoid_is_chosen_among_outliers():
    chosen = choose_candidate(FIVE)
    assert chosen.chosen_id == "c1"
    assert set(chosen.ranking[-2:]) == {"c3", "c4"}


def test_the_choice_does_not_depend_on_candidate_order():
    assert choose_candidate(FIVE[::-1]).chosen_id == "c1"


def test_the_mean_rule_follows_outliers():
    """Mean middle side 0.67, short 0.59, filled 0.65: c2 is nearest to it."""
    assert choose_candidate(FIVE, rule="mean").chosen_id == "c2"


@pytest.mark.parametrize(("size", "taken"), [(0.18, "c1"), (1.8, "c0")])
def test_depth_residuals_are_judged_relative_to_object_size(size, taken):
    pair = [candidate("c0", 0.9, 0.9, 0.5, 0.86, 0.027, size=size), candidate("c1", 0.9, 0.9, 0.5, 0.80, 0.004, size=size)]
    assert choose_candidate(pair).chosen_id == taken


def test_among_similar_shapes_the_fit_to_masks_and_depth_decides():
    alike = [
        candidate(f"c{k}", 0.6, 0.5, 0.8, iou, residual)
        for k, (iou, residual) in enumerate([(0.90, 0.01), (0.95, 0.01), (0.95, 0.03)])
    ]
    chosen = choose_candidate(alike)
    assert chosen.chosen_id == "c1"
    assert "95 %" in chosen.reason
    assert "10 mm" in chosen.reason


def test_rejected_candidates_are_ranked_last_and_counted_in_the_reason():
    chosen = choose_candidate(FIVE, rejected=("c1", "c3", "c4"))
    assert chosen.chosen_id in ("c0", "c2")
    assert len(chosen.candidates) == 5
    assert set(chosen.ranking[2:]) == {"c1", "c3", "c4"}
    assert "3 rejected" in chosen.reason


def test_rejecting_every_candidate_raises_with_advice():
    with pytest.raises(GenerationFailed, match=r"mug_1: every candidate was rejected; .*upload"):
        choose_candidate(FIVE, rejected=("c0", "c1", "c2", "c3", "c4"))


def test_an_upload_without_fit_is_ranked_by_its_shape():
    good = [*FIVE, candidate("upload0", 0.62, 0.52, 0.78, iou=None, generator="upload")]
    assert "upload0" in choose_candidate(good).ranking[:2]
    odd = [*FIVE, candidate("upload0", 0.2, 0.1, 0.3, iou=None, generator="upload")]
    assert choose_candidate(odd).ranking[-1] == "upload0"


def test_a_lone_upload_is_chosen_as_the_only_candidate():
    chosen = choose_candidate([candidate("upload0", 0.6, 0.5, 0.8, iou=None, generator="upload")])
    assert chosen.chosen_id == "upload0"
    assert "only candidate" in chosen.reason


def test_a_person_overrides_the_consensus():
    chosen = chosen_by_person(choose_candidate(FIVE), "c3")
    assert (chosen.chosen_id, chosen.chosen_by) == ("c3", "person")
    with pytest.raises(OverrideError, match="no candidate 'c9'"):
        chosen_by_person(chosen, "c9")


def test_the_first_of_equal_candidates_is_chosen():
    assert choose_candidate([replace(FIVE[0], candidate_id=f"c{k}") for k in range(3)]).chosen_id == "c0"


def test_the_reason_compares_the_choice_with_that_of_the_mean_rule():
    assert "would take c2" in choose_candidate(FIVE).reason
    assert "takes it too" in choose_candidate(FIVE[:3]).reason
    assert "paper" not in choose_candidate(FIVE[:2]).reason


def test_open_and_very_large_meshes_are_penalised():
    alike = [candidate(f"c{k}", 0.6, 0.5, 0.8) for k in range(3)]
    opened = [replace(alike[0], watertight=False), *alike[1:]]
    assert choose_candidate(opened).ranking == ("c1", "c2", "c0")
    heavy = [replace(alike[0], metrics={**alike[0].metrics, "faces": 200_000.0}), *alike[1:]]
    assert choose_candidate(heavy).ranking == ("c1", "c2", "c0")
    better = [replace(opened[0], metrics={**opened[0].metrics, "mask_iou": 0.9 + 0.11}), *alike[1:]]
    assert choose_candidate(better).chosen_id == "c0"


def test_a_deviating_hypothesis_is_not_penalised_and_is_reported():
    """Two hypotheses have one depth and one has another: the evidence for the unseen side decides."""
    guesses = [replace(candidate(f"c{k}", 0.6, 0.5, 0.8), assumes="to the wall") for k in range(3)]
    guesses[2] = replace(candidate("c2", 1.0, 0.9, 0.3), assumes="shallower")
    far = [
        replace(c, metrics={**c.metrics, "unseen_error_m": error}) for c, error in zip(guesses, (0.2, 0.1, 0.0), strict=True)
    ]
    chosen = choose_candidate(far)
    assert chosen.ranking == ("c2", "c1", "c0")
    assert chosen.reason.startswith("c2 (shallower): ")


def guesses(*changes):
    """Candidates that differ only in these metrics, each with its own assumption."""
    alike = [replace(candidate(f"c{k}", 0.6, 0.5, 0.8), assumes="a guess") for k in range(len(changes))]
    return [replace(c, metrics={**c.metrics, **change}) for c, change in zip(alike, changes, strict=True)]


@pytest.mark.parametrize(
    ("other", "said"),
    [
        ({"unseen_error_m": 0.34}, "c1 fits as well, but its unseen side is 34 cm from its most likely place"),
        (
            {"mask_iou": 0.93, "unseen_error_m": 0.34},
            "c1 fits better, but its unseen side is 34 cm from its most likely place",
        ),
        ({"stands": 0.0}, "c1 fits as well, but it would tip over"),
        ({"mask_iou": 0.92, "carved": 1.0}, "c1 fits better, but it copies the masks with their errors"),
        ({"faces": 80_000.0}, "c1 fits as well, but it has 80000 faces"),
    ],
)
def test_the_reason_states_why_an_equally_fitting_rival_lost(other, said):
    chosen = choose_candidate(guesses({}, other))
    assert chosen.chosen_id == "c0"
    assert said in chosen.reason


def test_the_reason_gives_proportions_only_where_they_decide():
    assert "proportions" in choose_candidate(FIVE).reason
    assert "proportions" not in choose_candidate(guesses({}, {"extent_middle": 0.9})).reason
    odd = replace(candidate("c3", 1.0, 0.99, 0.10, iou=0.95))
    assert "c3 fits better, but its proportions differ" in choose_candidate([*FIVE[:3], odd]).reason


def test_the_reason_gives_only_the_rank_where_the_fit_decides():
    """The rank is that of the fit alone, without the unseen side."""
    reason = choose_candidate(guesses({"unseen_error_m": 0.01}, {"mask_iou": 0.8})).reason
    assert "its fit to masks and depth is the best of 2." in reason
    assert "but" not in reason


def test_unstable_shapes_are_penalised():
    alike = [candidate(f"c{k}", 0.6, 0.5, 0.8) for k in range(3)]
    assert choose_candidate([replace(alike[0], metrics={**alike[0].metrics, "stands": 0.0}), *alike[1:]]).chosen_id == "c1"


def test_carved_shapes_need_a_clearly_better_fit_than_clean_shapes():
    clean, carved = (replace(candidate(f"c{k}", 0.6, 0.5, 0.8, iou), assumes="a guess") for k, iou in enumerate((0.90, 0.93)))
    carved = replace(carved, metrics={**carved.metrics, "carved": 1.0})
    assert choose_candidate([carved, clean]).chosen_id == "c0"
    assert choose_candidate([replace(carved, metrics={**carved.metrics, "mask_iou": 0.97}), clean]).chosen_id == "c1"


def test_the_reason_does_not_compare_an_upload_by_fit():
    """The upload has the medoid shape; without alignment, its fit is unknown."""
    upload = candidate("upload0", 0.62, 0.52, 0.78, iou=None, generator="upload")
    others = [candidate("c0", 0.60, 0.50, 0.80, iou=0.9), candidate("c1", 0.66, 0.56, 0.74, iou=0.9)]
    reason = choose_candidate([*others, upload]).reason
    assert reason.startswith("upload0: its proportions differ")
    assert "known only after alignment" in reason
    assert "fits" not in reason


@pytest.mark.parametrize(("gain", "chosen"), [(0.015, "c0"), (0.04, "c1")])
def test_among_equal_hypotheses_the_draw_from_most_frames_is_preferred(gain, chosen):
    """Two draws of a mug differed by an IoU of 0.017; the mesh from a third of the frames was the worse one to place."""
    whole, part = (candidate(f"c{k}", 0.6, 0.5, 0.8, 0.70 + k * gain) for k in (0, 1))
    whole = replace(whole, assumes="round and hollow", frames=tuple(range(30)))
    part = replace(part, assumes="round and hollow", frames=tuple(range(10)))
    for given in ([whole, part], [part, whole]):
        assert choose_candidate(given).chosen_id == chosen
    other = replace(part, assumes="round and full")
    assert choose_candidate([whole, other]).chosen_id == "c1"
