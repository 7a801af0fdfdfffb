"""A short form of a report, and what has become worse since an older one.

Errors come again to the last digit, so that any growth is a change of the program. Times do not, and are compared as
ratios to the paper's default in the same run.
"""

from __future__ import annotations

from collections.abc import Mapping

WORSE = 1.05  # times the older error: rounding may differ between drivers
SLOWER = 1.25  # times the older ratio: near-ties and noise are below it
FLOOR = 1e-4  # pixels: below it no error is told apart

Summary = dict[str, dict[str, float | None]]


def summarise(report: Mapping[str, object]) -> Summary:
    """Setting -> its error (99th percentile, pixels), rays that end elsewhere (percent) and time as a part of that of
    the paper's default; None where it failed.
    """
    rows = report["work_precision"]
    defaults = {row["case"]: row["ns_per_ray"] for row in rows if row["papers_default"]}
    summary = {}
    for row in rows:
        if row["papers_default"]:
            continue
        base, time = defaults.get(row["case"]), row["ns_per_ray"]
        key = ", ".join(
            [row["case"], row["pipeline"], row["integrator"], row["step_control"], f"{row['value']:.6g}"],
        )
        summary[key] = {
            "error_px": row["error_p99_px"],
            "elsewhere_percent": row["misclassified_percent"],
            "time_ratio": time / base if base and time else None,
        }
    return summary


def differences(base: Summary, new: Summary) -> list[str]:
    """A sentence for everything that is worse in the new one; settings that only the older one has are named."""
    found = []
    for key in sorted(base.keys() - new.keys()):
        found.append(f"Gone: {key}")
    for key in sorted(base.keys() & new.keys()):
        old, now = base[key], new[key]
        for name, unit, growth in (("error_px", "pixel", WORSE), ("elsewhere_percent", "% elsewhere", WORSE)):
            if _worse(old[name], now[name], growth):
                found.append(f"Less accurate: {key}: {_text(old[name])} -> {_text(now[name])} {unit}")
        if _worse(old["time_ratio"], now["time_ratio"], SLOWER):
            found.append(
                f"Slower: {key}: {_text(old['time_ratio'])} -> {_text(now['time_ratio'])} of the paper's default"
            )
    return found


def _worse(old: float | None, now: float | None, growth: float) -> bool:
    if old is None:
        return False
    return now is None or now > growth * old + FLOOR


def _text(value: float | None) -> str:
    return "failed" if value is None else f"{value:.3g}"
