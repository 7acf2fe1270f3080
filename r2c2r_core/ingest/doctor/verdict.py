"""Verdict on a recording from its measures: findings, worst first, with advice."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

from r2c2r_core.ingest.doctor.hypotheses import Finding
from r2c2r_core.ingest.doctor.registration import Registration
from r2c2r_core.ingest.doctor.report import VERDICTS, CaptureFigures, Remark, Verdict
from r2c2r_core.ingest.doctor.unit import Unit
from r2c2r_core.tuning import param, tuned

_UNKNOWN = "the cause is unknown: check the poses (order, handedness), the calibration, the unit of the depth"
_REGISTER = "read it with --register-depth, which registers the depth by this fit"


@dataclass(frozen=True, slots=True, kw_only=True)
class Params:
    """Tuned parameters of the verdict."""

    plausible_m: tuple[float, float] = param(
        (0.1, 10.0), "m", "Range of plausible median depths; outside it the unit differs from the format's"
    )
    depth: tuple[float, float] = param(
        (0.1, 0.35),
        "share",
        "Fraction of the median frame with depth below which a recording is unusable, and usable with care",
    )
    unsure: float = param(0.5, "share", "Fraction of depth with low confidence above which it is reported")
    gravity_deg: float = param(
        1.0, "deg", "Deviation of gravity from the planes above which it is reported", source="phones: 0.5"
    )
    tilt_deg: float = param(
        3.0,
        "deg",
        "Maximum corrected gravity deviation without a warning",
        source="a worktop of 60 cm is then 3 cm higher at its back",
    )
    masks_px: float = param(
        4.0,
        "px",
        "Offset of depth from colour, in pixels of 640, above which it is unusable for masks",
        source="a handle's width at 2 m",
    )
    lost: float = param(0.05, "share", "Fraction of damaged, unposed or dropped frames above which it is reported")
    frames: tuple[int, int] = param(
        (5, 20), "count", "Number of frames below which a recording is unusable, and usable with care"
    )
    overlap: float = param(0.03, "share", "Minimum overlap of neighbours for poses and depth to be checked")
    noise_mm: tuple[float, float] = param(
        (8.0, 3.0), "score", "Expected disagreement of good frames in mm: at 0 m, and increase per m²"
    )
    wrong: float = param(3.0, "ratio", "Ratio of the disagreement to the expected one above which a recording is unusable")
    drift_mm: tuple[float, float] = param(
        (45.0, 150.0), "score", "Drift in mm above which a recording is usable with care, and unusable"
    )
    drift_scale: float = param(
        0.075,
        "ratio",
        "Maximum deviation of a scale factor from one that drift can explain",
        source="3 cm over 2.5 m of a walk read as 5 %",
    )
    blurred: float = param(0.2, "share", "Fraction of blurred frames above which it is reported")
    white: float = param(0.2, "share", "Fraction of white pixels in the median frame above which it is reported")
    black: float = param(0.3, "share", "Fraction of black pixels in the median frame above which it is reported")
    flicker: float = param(0.25, "share", "Fraction of steps between frames with flicker above which it is reported")
    path_m: float = param(0.15, "m", "Minimum length of the camera path")
    sides: float = param(0.15, "share", "Minimum fraction of the surface seen from three sides")
    held_m: tuple[float, float] = param((0.7, 2.2), "m", "Range of plausible median camera heights above the floor")
    worktop_m: float = param(0.9, "m", "Typical height of a worktop", source="0.85 to 0.95 m")
    usual_m: tuple[float, float] = param((0.68, 0.98), "m", "Range of heights of tables and worktops, including scan error")
    furniture_m: tuple[float, float] = param(
        (0.5, 1.4), "m", "Range of heights searched for a worktop, above seats and below shelves"
    )


class _Share(NamedTuple):
    """A measure of a defect, with the remark made above a limit (a field of Params)."""

    figure: str
    limit: str
    cause: str
    text: str
    advice: str


_FRAMES = (
    _Share("unreadable_share", "lost", "frames_unreadable", "{} of the frames are damaged", "copy the recording again"),
    _Share("without_pose_share", "lost", "poses_lost", "{} of the frames have no usable pose", "film again, more slowly"),
    _Share("missing_share", "lost", "dropped_frames", "{} of the frames were dropped", "close other apps and film again"),
)
_PICTURES = (
    _Share("blurred_share", "blurred", "blur", "{} of the frames are blurred", "move more slowly, in more light"),
    _Share(
        "overexposed_share", "white", "overexposed", "{} of the median picture is white", "film away from windows and lamps"
    ),
    _Share("underexposed_share", "black", "underexposed", "{} of the median picture is black", "switch the light on"),
    _Share(
        "flicker_share",
        "flicker",
        "flicker",
        "the brightness changes in {} of the steps between frames",
        "lock the exposure while filming",
    ),
)


def judge(
    figures: CaptureFigures,
    convention: Finding | None,
    scale: Finding | None,
    registration: Registration | None,
    unit: Unit | None = None,
) -> tuple[Remark, ...]:
    """Remarks, worst first; among equals, causes before symptoms. Planes of wrongly read poses say nothing about gravity."""
    params = tuned(Params)
    depth, recording = _depth(figures, unit), _recording(figures)
    if figures.depth_coverage < params.depth[0]:  # all else follows from that
        return (*depth, *recording)
    found = (
        *depth,
        *(_gravity(figures) if convention is None else ()),
        *_conventions(figures, convention, scale, registration),
        *recording,
        *_tracking(figures, explained=convention is not None or scale is not None),
        *_shares(figures, _PICTURES),
        *_room(figures),
    )
    return tuple(sorted(found, key=lambda r: -VERDICTS.index(r.verdict)))


def plausible(median_m: float) -> bool:
    """Whether a recording's median depth may be in metres."""
    least, most = tuned(Params).plausible_m
    return least < median_m < most


def worst(remarks: tuple[Remark, ...]) -> Verdict:
    """The worst verdict among the remarks, "good" without one."""
    return max((r.verdict for r in remarks), key=VERDICTS.index, default="good")


def _depth(figures: CaptureFigures, unit: Unit | None) -> list[Remark]:
    params, shares, coverage = tuned(Params), figures.confidence_shares, figures.depth_coverage
    if coverage >= params.depth[1]:
        return []
    recorded = figures.recorded_depth_m
    if recorded is not None and not plausible(recorded):
        text = f"the median recorded depth is {recorded:.4g} m: not in the unit of the format"
        return [_remark("unusable", "depth_unit", text, _unit_advice(unit))]
    unsure = shares is not None and shares[0] > params.unsure
    text = f"usable depth covers only {coverage:.0%} of the median frame"
    advice = "stay 0.5 to 3 m away, in good light"
    if shares and unsure:
        text = f"{text}: {shares[0]:.0%} of the depth has low confidence"
    if coverage < params.depth[0]:
        advice = f"{advice}, or check the {'confidence files' if unsure else 'unit of the depth'}"
    verdict: Verdict = "unusable" if coverage < params.depth[0] else "usable with care"
    return [_remark(verdict, "confidence" if unsure else "depth_coverage", text, advice)]


def _gravity(figures: CaptureFigures) -> list[Remark]:
    off = figures.up_file_off_deg
    if off is None or off <= tuned(Params).gravity_deg:
        return []
    if figures.up_corrected:
        text = f"the recording's gravity is {off:.1f}° off its level and upright planes; the planes are used"
        verdict: Verdict = "good" if off <= tuned(Params).tilt_deg else "usable with care"
        return [_remark(verdict, "gravity_off", text, "no action is needed if the scan is upright; else set up by hand")]
    text = f"the recording's gravity is {off:.1f}° off its level and upright planes, which are too few to rely on"
    return [_remark("usable with care", "gravity_off", text, "film more of the floor and the walls, or set up by hand")]


def _unit_advice(unit: Unit | None) -> str:
    if unit is None:
        return "export it again, or give the factor that converts it to metres with --depth-scale"
    sure = "the views agree for" if unit.measured else "it may be"
    return f"{sure} {unit.text}: read it with --depth-scale {unit.factor:g}"


def _conventions(
    figures: CaptureFigures, convention: Finding | None, scale: Finding | None, registration: Registration | None
) -> list[Remark]:
    remarks = []
    if convention is not None:
        gain = f"{convention.agreement_so:.0%} of neighbours agree if corrected, {convention.agreement_given:.0%} as recorded"
        remarks.append(
            _remark(
                "unusable",
                convention.cause,
                f"{convention.text}: {gain}",
                "correct the poses in the files, or where they were written",
            )
        )
    if registration is not None and registration.wrong:
        remarks.append(_unregistered(registration))
    if scale is not None:
        gain = f"views disagree by {scale.error_so_mm:.0f} mm if corrected, {scale.error_given_mm:.0f} mm as recorded"
        verdict: Verdict = "usable with care" if _may_be_drift(scale, figures) else "unusable"
        mend = f", such as --depth-scale {scale.factor:.3g}" if scale.cause == "depth_scale" and scale.factor else ""
        advice = f"correct the calibration or the unit of the depth{mend}"
        remarks.append(_remark(verdict, scale.cause, f"{scale.text}: {gain}", advice))
    return remarks


def _unregistered(found: Registration) -> Remark:
    """Remark on unregistered depth, unusable only where masks suffer: a phone's depth pixel is 2.5 px of 640."""
    verdict: Verdict = "unusable" if found.off_px > tuned(Params).masks_px else "usable with care"
    if found.focal_only:
        text = f"the colour camera's focal length is off by {abs(1 / found.focal_factor - 1):.0%}"
        gain = f": depth lies {found.off_px:.0f} px of 640 off the image"
        return _remark(verdict, "colour_focal_length", text + gain, f"correct the colour calibration, or {_REGISTER}")
    text = f"the depth is not registered to the colour images: it is {found.off_px:.0f} px of 640 off"
    fit = f" (fits with {found.focal_factor:.3f} x the focal length, {found.shift_mm[0]:.0f} and {found.shift_mm[1]:.0f} mm)"
    return _remark(verdict, "unregistered", text + fit, f"export registered depth, or {_REGISTER}")


def _recording(figures: CaptureFigures) -> list[Remark]:
    params, remarks = tuned(Params), _shares(figures, _FRAMES)
    if figures.longest_gap_s and remarks and remarks[-1].cause == "dropped_frames":
        text = f"{remarks[-1].text}, the longest gap is {figures.longest_gap_s:.1f} s"
        remarks[-1] = replace(remarks[-1], text=text)
    few = f"only {figures.frames} frames"
    if figures.frames < params.frames[0]:
        remarks.append(_remark("unusable", "few_frames", few, "film for at least ten seconds"))
    elif figures.frames < params.frames[1]:
        remarks.append(_remark("usable with care", "few_frames", few, "film longer: more views give better masks"))
    return remarks


def _shares(figures: CaptureFigures, checks: Sequence[_Share]) -> list[Remark]:
    found = [(check, getattr(figures, check.figure)) for check in checks]
    return [
        _remark("usable with care", check.cause, check.text.format(f"{share:.0%}"), check.advice)
        for check, share in found
        if share > getattr(tuned(Params), check.limit)
    ]


def _tracking(figures: CaptureFigures, *, explained: bool) -> list[Remark]:
    params, remarks = tuned(Params), []
    if figures.pose_jumps and not explained:
        text = f"tracking jumped {figures.pose_jumps} times, by up to {figures.largest_jump_m:.2f} m"
        remarks.append(_remark("usable with care", "pose_jumps", text, "things may appear twice; film again, more slowly"))
    error = figures.pair_error_mm
    if error is None or figures.pair_overlap < params.overlap:
        advice = "film more slowly, so that frames overlap"
        text = "neighbouring frames hardly overlap: poses and depth could not be checked"
        return [*remarks, _remark("usable with care", "no_overlap", text, advice)]
    limit = _noise_mm(figures)
    if error > limit and not explained:
        text = f"neighbouring frames disagree by {error:.0f} mm, expected at most {limit:.0f} mm"
        verdict: Verdict = "unusable" if error > params.wrong * limit else "usable with care"
        remarks.append(_remark(verdict, "disagreement", text, _UNKNOWN))
    if figures.drift_mm is not None and figures.drift_mm > params.drift_mm[0] and not explained:
        text = f"the poses drift: revisited surfaces are {figures.drift_mm:.0f} mm apart"
        verdict = "unusable" if figures.drift_mm > params.drift_mm[1] else "usable with care"
        refined = "they were refined as far as the scan allows; " if figures.poses_source == "refined" else ""
        remarks.append(_remark(verdict, "drift", text, f"{refined}film more slowly, turn less at once, and avoid blank walls"))
    return remarks


def _may_be_drift(scale: Finding, figures: CaptureFigures) -> bool:
    """Whether drift of some centimetres can explain this scale: a small deviation, with disagreement below sensor noise."""
    if scale.factor is None or scale.error_given_mm is None:
        return False
    return abs(scale.factor - 1.0) < tuned(Params).drift_scale and scale.error_given_mm < _noise_mm(figures)


def _noise_mm(figures: CaptureFigures) -> float:
    """Expected disagreement of good frames in mm: sensor noise grows with the square of the distance."""
    least, more = tuned(Params).noise_mm
    return least + more * figures.median_depth_m**2


def _room(figures: CaptureFigures) -> list[Remark]:
    params, remarks = tuned(Params), []
    if figures.path_m < params.path_m:
        text = f"the camera moved only {figures.path_m:.2f} m"
        remarks.append(_remark("usable with care", "short_path", text, "walk around the objects"))
    elif figures.seen_from_three < params.sides:
        text = f"only {figures.seen_from_three:.0%} of the surface is seen from three sides"
        remarks.append(_remark("usable with care", "one_sided", text, "walk around the objects"))
    if figures.up_source == "assumed":
        text = "neither the recording nor its planes show which way is up"
        remarks.append(_remark("usable with care", "up_unknown", text, "set it by hand"))
    if figures.up_rival is not None:
        up = ", ".join(f"{value:.3g}" for value in figures.up_rival)
        text = "the recording has no gravity, and its images may lie on their side: up is in doubt"
        remarks.append(_remark("usable with care", "up_in_doubt", text, f"if the scan is tilted, set up by hand to [{up}]"))
    if not figures.floor_found:
        remarks.append(
            _remark("usable with care", "no_floor", "no floor was found", "film part of the floor, or set its height by hand")
        )
    remarks += _scale_by_furniture(figures)
    height = figures.camera_height_m
    if height is not None and not params.held_m[0] < height < params.held_m[1]:
        text = f"the camera was held {height:.2f} m above the estimated floor"
        remarks.append(
            _remark("usable with care", "camera_height", text, "check the floor's height and the scale of the poses")
        )
    return remarks


def _scale_by_furniture(figures: CaptureFigures) -> list[Remark]:
    """A hint if no level surface has the height of a worktop or a table; it does not lower the verdict."""
    params = tuned(Params)
    heights = [z for z in figures.level_heights_m if params.furniture_m[0] < z < params.furniture_m[1]]
    if not heights or any(params.usual_m[0] <= z <= params.usual_m[1] for z in heights):
        return []
    nearest = min(heights, key=lambda z: abs(z - params.worktop_m))
    off = nearest / params.worktop_m - 1.0
    text = f"the level surface nearest to a worktop's height is at {nearest:.2f} m; tables and worktops are at 0.70 to 0.95 m"
    size = f"if it is one, all lengths are about {abs(off):.0%} too {'large' if off > 0 else 'small'}"
    return [_remark("good", "furniture_height", text, f"{size}: check against a known length")]


def _remark(verdict: Verdict, cause: str, text: str, advice: str) -> Remark:
    return Remark(verdict=verdict, cause=cause, text=text, advice=advice)
