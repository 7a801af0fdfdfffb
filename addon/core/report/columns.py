"""What the page's tables call the figures: key -> heading, with its unit."""

from __future__ import annotations

CHOICE_COLUMNS = {
    "case": "picture",
    "goal": "error below, px",
    "method": "cheapest setting",
    "value": "step (model lengths) or tolerance (rad)",
    "error_p99_px_outside_band": "its error (99 %), px",
    "ns_per_ray": "ns a ray",
    "faster": "times as fast as the paper's default",
}
ERROR_COLUMNS = {
    "error_max_px": "largest error, px",
    "error_rms_px": "RMS, px",
    "error_median_px": "median, px",
    "error_p99_px": "99 %, px",
    "error_p99_px_outside_band": "99 %, px, without near-critical band",
    "misclassified_percent": "rays that end elsewhere, %",
    "failed_percent": "failed rays, %",
    "drift_max": "largest drift of what the law conserves, relative",
    "steps_mean": "mean steps",
    "steps_max": "most steps",
    "rejected_mean": "mean rejected steps",
}
WORK_COLUMNS = {
    "pipeline": "pipeline",
    "integrator": "integrator",
    "step_control": "step control",
    "value": "step (model lengths) or tolerance (rad)",
    **ERROR_COLUMNS,
    "estimate_exceeded_percent": "rays with truth > estimate, %",
    "estimate_factor_p99": "truth / estimate, 99 %",
    "time_min_ms": "least time, ms",
    "time_median_ms": "median time, ms",
    "ns_per_ray": "ns a ray",
    "ns_per_ray_step": "ns a ray and step",
    "front": "on the front",
    "papers_default": "paper's default",
}
ESTIMATE_COLUMNS = {
    "case": "picture",
    "integrator": "integrator",
    "tolerance": "tolerance, rad",
    "estimate_exceeded_percent": "rays with truth > estimate, %",
    "estimate_over_median": "estimate / truth, median",
    "estimate_factor_p99": "truth / estimate, 99 %",
    "magnification_p99": "the law magnifies small errors, times, 99 %",
}
MAP_COLUMNS = {
    "part": "part",
    "rays": "pixels",
    "near_critical": "within 1e-3 of critical",
    "unresolved": "without a reference",
    "misclassified_percent": "end elsewhere, %",
    "error_median_px": "median error, px",
    "error_p99_px": "99 %, px",
    "error_max_px": "largest, px",
    "truth_exceeds_estimate_percent": "truth > estimate, %",
    "truth_exceeds_estimate_percent_in_band": "… of the near-critical, %",
    "truth_exceeds_tolerance_percent": "truth > tolerance, %",
    "estimate_over_truth_median": "estimate / truth, median",
}
RECOMMENDED_COLUMNS = {
    "goal_px": "error below, px",
    "pipeline": "pipeline",
    "integrator": "integrator",
    "step_control": "step control",
    "value": "step (model lengths) or tolerance (rad)",
    "promised_px": "promised, px",
    "rendered_px": "rendered, px",
    "sky_px": "of it the sky, px",
    "objects_px": "objects, px",
    "hit_distance_p99": "hit points apart, m",
    "elsewhere_percent": "rays that see something else, %",
    "ns_per_ray": "time, ns a ray",
}
ABLATION_COLUMNS = {
    "what": "with",
    "without": "without",
    "with_ms": "with, ms",
    "without_ms": "without, ms",
    "saves_percent": "saves, % of the time",
    "difference_max": "largest difference of a channel (0 to 1)",
    "pixels_that_differ_percent": "pixels that differ, %",
}
HALF_COLUMNS = {"integrator": "integrator", "ray_bits": "bits", **ERROR_COLUMNS, "time_min_ms": "least time, ms"}
STIFF_COLUMNS = {
    "case": "case",
    "value": "value",
    "integrator": "integrator",
    "tolerance": "tolerance, rad",
    "error_p99_rad": "error (99 %), rad",
    "steps_mean": "mean steps",
    "steps_max": "most steps",
    "time_min_ms": "least time, ms",
    "gain": "gain",
}
