"""From figures to a verdict: what matters, worst first, and what to do about it."""

from r2c2r_core.ingest.doctor.hypotheses import Finding
from r2c2r_core.ingest.doctor.registration import Registration
from r2c2r_core.ingest.doctor.report import VERDICTS, CaptureFigures, Remark, Verdict
from r2c2r_core.ingest.doctor.unit import Unit

PLAUSIBLE_M = (0.1, 10.0)  # of a recording's median depth; else its unit is another than its format's
_LEAST_DEPTH = 0.1  # of the median frame
_MASKS_SUFFER_PX = 4.0  # of 640: a handle's width at 2 m; below, sizes and masks stay within their tolerances

_FIRST = ("gravity_off",)  # heights, the floor and everything that stands follow from it
_GRAVITY_OFF_DEG = 1.5  # a phone's is within half a degree, fitted planes within one
_SMALL_TILT_DEG = 3.0  # a worktop of 60 cm is then 3 cm higher at its back; corrected, nothing is left of it
_WORKTOP_M = 0.90  # 0.85 to 0.95 m
_USUAL_M = (0.68, 0.98)  # tables (0.70 to 0.78 m) and worktops, and 2 to 3 cm of what a scan is off
_FURNITURE_M = (0.5, 1.4)  # above seats, below shelves
_REGISTER = "read it with --register-depth, which moves the depth there by this fit"
_SCALE_OF_DRIFT = 0.075  # drift of 3 cm over 2.5 m of a real iPhone walk reads as 5 %


def judge(
    figures: CaptureFigures,
    convention: Finding | None,
    scale: Finding | None,
    registration: Registration | None,
    unit: Unit | None = None,
) -> tuple[Remark, ...]:
    """Remarks, worst first; among equals, the cause before its symptoms. A gravity that is off comes before all of them."""
    depth, recording = _depth(figures, unit), _recording(figures)
    if figures.depth_coverage < _LEAST_DEPTH:  # all else follows from that
        return (*depth, *recording)
    found = (
        *depth,
        *_gravity(figures),
        *_conventions(figures, convention, scale, registration),
        *recording,
        *_tracking(figures, explained=convention is not None or scale is not None),
        *_pictures(figures),
        *_room(figures),
    )
    return tuple(sorted(found, key=lambda r: (r.cause not in _FIRST, -VERDICTS.index(r.verdict))))


def worst(remarks: tuple[Remark, ...]) -> Verdict:
    """The worst verdict among the remarks, "good" without one."""
    return max((r.verdict for r in remarks), key=VERDICTS.index, default="good")


def _depth(figures: CaptureFigures, unit: Unit | None) -> list[Remark]:
    shares = figures.confidence_shares
    low = f"{shares[0]:.0%} of the depth has low confidence" if shares and shares[0] > 0.5 else None
    if figures.depth_coverage < _LEAST_DEPTH:
        recorded = figures.recorded_depth_m
        if recorded is not None and not PLAUSIBLE_M[0] < recorded < PLAUSIBLE_M[1]:
            text = f"the recorded depth is {recorded:.4g} m in the median: another unit than the format's"
            return [_remark("unusable", "depth_unit", text, _unit_advice(unit))]
        if low:
            advice = "film by more light and from 0.5 to 3 m, or check the confidence files"
            return [
                _remark(
                    "unusable", "confidence", f"{low}, {figures.depth_coverage:.0%} of the median frame can be used", advice
                )
            ]
        text = f"usable depth covers {figures.depth_coverage:.0%} of the median frame"
        return [_remark("unusable", "depth_coverage", text, "check the unit of the depth; stay 0.5 to 3 m away")]
    if figures.depth_coverage < 0.35:
        text = f"usable depth covers only {figures.depth_coverage:.0%} of the median frame" + (f": {low}" if low else "")
        return [
            _remark("usable with care", "confidence" if low else "depth_coverage", text, "stay 0.5 to 3 m away, in good light")
        ]
    return []


def _gravity(figures: CaptureFigures) -> list[Remark]:
    off = figures.up_file_off_deg
    if off is None or off <= _GRAVITY_OFF_DEG:
        return []
    if figures.up_corrected:
        text = f"the recording's gravity is {off:.1f} deg off its level and upright planes; the planes' is taken"
        verdict: Verdict = "good" if off <= _SMALL_TILT_DEG else "usable with care"
        return [_remark(verdict, "gravity_off", text, "nothing is to be done if the scan stands upright; else set up by hand")]
    text = f"the recording's gravity is {off:.1f} deg off its level and upright planes, which are too few to be believed"
    return [_remark("usable with care", "gravity_off", text, "film more of the floor and the walls, or set up by hand")]


def _unit_advice(unit: Unit | None) -> str:
    if unit is None:
        return "export it again, or give the factor to metres with --depth-scale"
    sure = "the views agree if it is" if unit.measured else "it may be"
    return f"{sure} {unit.text}: read it with --depth-scale {unit.factor:g}"


def _conventions(
    figures: CaptureFigures, convention: Finding | None, scale: Finding | None, registration: Registration | None
) -> list[Remark]:
    remarks = []
    if convention is not None:
        gain = f"{convention.agreement_so:.0%} of neighbouring depth agrees then, {convention.agreement_given:.0%} as it is"
        remarks.append(
            _remark("unusable", convention.cause, f"{convention.text}: {gain}", "export again, or correct the poses")
        )
    if registration is not None and registration.wrong:
        remarks.append(_unregistered(registration))
    if scale is not None:
        gain = f"views disagree by {scale.error_so_mm:.0f} mm then, {scale.error_given_mm:.0f} mm as it is"
        verdict: Verdict = "usable with care" if _may_be_drift(scale, figures) else "unusable"
        mend = f", such as --depth-scale {scale.factor:.3g}" if scale.cause == "depth_scale" and scale.factor else ""
        advice = f"correct the calibration or the unit of the depth{mend}"
        remarks.append(_remark(verdict, scale.cause, f"{scale.text}: {gain}", advice))
    return remarks


def _unregistered(found: Registration) -> Remark:
    if found.focal_only:
        text = f"the colour camera's focal length is off by {abs(1 / found.focal_factor - 1):.0%}"
        gain = f": depth lies {found.off_px:.0f} px of 640 beside the picture"
        return _remark("unusable", "colour_focal_length", text + gain, f"correct the colour calibration, or {_REGISTER}")
    text = f"the depth is not registered to the colour images: it lies {found.off_px:.0f} px of 640 beside them"
    fit = f" (fits with {found.focal_factor:.3f} x the focal length, {found.shift_mm[0]:.0f} and {found.shift_mm[1]:.0f} mm)"
    verdict: Verdict = "unusable" if found.off_px > _MASKS_SUFFER_PX else "usable with care"
    return _remark(verdict, "unregistered", text + fit, f"export registered depth, or {_REGISTER}")


def _recording(figures: CaptureFigures) -> list[Remark]:
    remarks = []
    gap = f", the longest gap is {figures.longest_gap_s:.1f} s" if figures.longest_gap_s else ""
    for share, cause, text, advice in (
        (figures.unreadable_share, "frames_unreadable", "{} of the frames are damaged", "copy the recording again"),
        (figures.without_pose_share, "poses_lost", "{} of the frames have no usable pose", "film again, more slowly"),
        (figures.missing_share, "dropped_frames", "{} of the frames were dropped" + gap, "close other apps and film again"),
    ):
        if share > 0.05:
            remarks.append(_remark("usable with care", cause, text.format(f"{share:.0%}"), advice))
    if figures.frames < 5:
        remarks.append(_remark("unusable", "few_frames", f"only {figures.frames} frames", "film for at least ten seconds"))
    elif figures.frames < 20:
        remarks.append(
            _remark("usable with care", "few_frames", f"only {figures.frames} frames", "more views give better masks")
        )
    return remarks


def _tracking(figures: CaptureFigures, *, explained: bool) -> list[Remark]:
    remarks = []
    if figures.pose_jumps and not explained:
        text = f"tracking jumped {figures.pose_jumps} times, by up to {figures.largest_jump_m:.2f} m"
        remarks.append(_remark("usable with care", "pose_jumps", text, "things may appear twice; film again, more slowly"))
    error = figures.pair_error_mm
    if error is None or figures.pair_overlap < 0.03:
        advice = "film more slowly, so that frames overlap"
        text = "neighbouring frames hardly overlap: poses and depth could not be checked"
        return [*remarks, _remark("usable with care", "no_overlap", text, advice)]
    limit = _noise_mm(figures)
    if error > limit and not explained:
        text = f"neighbouring frames disagree by {error:.0f} mm, {limit:.0f} mm were expected"
        verdict: Verdict = "unusable" if error > 3 * limit else "usable with care"
        remarks.append(_remark(verdict, "disagreement", text, "poses, calibration or depth are wrong in a way not known here"))
    if figures.drift_mm is not None and figures.drift_mm > 45 and not explained:
        text = f"the poses drift: what is filmed again lies {figures.drift_mm:.0f} mm from where it was"
        verdict = "unusable" if figures.drift_mm > 150 else "usable with care"
        refined = "they were refined as far as the scan allows; " if figures.poses_source == "refined" else ""
        remarks.append(_remark(verdict, "drift", text, f"{refined}film more slowly, turn less at once, and avoid blank walls"))
    return remarks


def _may_be_drift(scale: Finding, figures: CaptureFigures) -> bool:
    """Whether a phone's drift of some centimetres looks like this scale: a small one, in disagreement below sensor noise."""
    if scale.factor is None or scale.error_given_mm is None:
        return False
    return abs(scale.factor - 1.0) < _SCALE_OF_DRIFT and scale.error_given_mm < _noise_mm(figures)


def _noise_mm(figures: CaptureFigures) -> float:
    """By how much good frames disagree: sensor noise grows with the square of the distance."""
    return 8.0 + 3.0 * figures.median_depth_m**2


def _pictures(figures: CaptureFigures) -> list[Remark]:
    remarks = []
    if figures.blurred_share > 0.2:
        text = f"{figures.blurred_share:.0%} of the frames are blurred"
        remarks.append(_remark("usable with care", "blur", text, "move more slowly, in more light"))
    if figures.overexposed_share > 0.2:
        text = f"{figures.overexposed_share:.0%} of the median picture is white"
        remarks.append(_remark("usable with care", "overexposed", text, "film away from windows and lamps"))
    if figures.underexposed_share > 0.3:
        text = f"{figures.underexposed_share:.0%} of the median picture is black"
        remarks.append(_remark("usable with care", "underexposed", text, "switch the light on"))
    if figures.flicker_share > 0.25:
        text = f"the brightness changes in {figures.flicker_share:.0%} of the steps between frames"
        remarks.append(_remark("usable with care", "flicker", text, "lock the exposure while filming"))
    return remarks


def _room(figures: CaptureFigures) -> list[Remark]:
    remarks = []
    if figures.path_m < 0.15:
        text = f"the camera moved only {figures.path_m:.2f} m"
        remarks.append(_remark("usable with care", "short_path", text, "walk around the objects"))
    elif figures.seen_from_three < 0.15:
        text = f"only {figures.seen_from_three:.0%} of the surface is seen from three sides"
        remarks.append(_remark("usable with care", "one_sided", text, "walk around the objects"))
    if figures.up_source == "assumed":
        text = "neither the recording nor its planes tell which way is up"
        remarks.append(_remark("usable with care", "up_unknown", text, "set it by hand"))
    if figures.up_rival is not None:
        up = ", ".join(f"{value:.3g}" for value in figures.up_rival)
        text = "the recording does not know gravity, and its images may lie on their side: up is in doubt"
        remarks.append(_remark("usable with care", "up_in_doubt", text, f"if the scan lies too, set up by hand to [{up}]"))
    if not figures.floor_found:
        remarks.append(
            _remark("usable with care", "no_floor", "no floor was found", "film some of it, or set its height by hand")
        )
    remarks += _scale_by_furniture(figures)
    height = figures.camera_height_m
    if height is not None and not 0.7 < height < 2.2:
        text = f"the camera was held {height:.2f} m above what was taken for the floor"
        remarks.append(
            _remark("usable with care", "camera_height", text, "check the floor's height and the scale of the poses")
        )
    return remarks


def _scale_by_furniture(figures: CaptureFigures) -> list[Remark]:
    """A hint where the level surfaces stand as no worktop and no table does; it changes nothing."""
    heights = [z for z in figures.level_heights_m if _FURNITURE_M[0] < z < _FURNITURE_M[1]]
    if not heights or any(_USUAL_M[0] <= z <= _USUAL_M[1] for z in heights):
        return []
    nearest = min(heights, key=lambda z: abs(z - _WORKTOP_M))
    off = nearest / _WORKTOP_M - 1.0
    text = f"the level surface nearest to a worktop's height stands at {nearest:.2f} m; tables and worktops at 0.70 to 0.95 m"
    size = f"if it is one, all lengths are about {abs(off):.0%} too {'large' if off > 0 else 'small'}"
    return [_remark("good", "furniture_height", text, f"{size}: measure something that you know")]


def _remark(verdict: Verdict, cause: str, text: str, advice: str) -> Remark:
    return Remark(verdict=verdict, cause=cause, text=text, advice=advice)
