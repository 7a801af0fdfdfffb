"""The benchmark's plots, as PNG."""

from __future__ import annotations

from pathlib import Path

import matplotlib

matplotlib.use("Agg")  # no window

import matplotlib.pyplot as plt

from .scaling import MOST_GROWTH


def draw(parts: dict[str, dict], folder: Path) -> list[Path]:
    """parts : the figures of each part that was measured, by its name. Returns the files."""
    folder.mkdir(parents=True, exist_ok=True)
    drawn = []
    for name, plot in PLOTS.items():
        if name in parts:
            figure, axes = plt.subplots(figsize=(8, 5), layout="constrained")
            plot(axes, parts[name])
            drawn.append(folder / f"{name}.png")
            figure.savefig(drawn[-1], dpi=110)
            plt.close(figure)
    return drawn


def table_1(axes, models: dict) -> None:
    """Three bars a model."""
    for i, label in enumerate(("unaccelerated", "accelerated", "fused")):
        seconds = [1e-3 * model[label]["milliseconds"]["trace"]["min"] for model in models.values()]
        bars = axes.bar([x + 0.27 * i for x in range(len(models))], seconds, 0.25, label=label)
        axes.bar_label(bars, fmt="%.2g", fontsize=8)
    axes.set_xticks([x + 0.27 for x in range(len(models))], list(models))
    axes.set(yscale="log", ylabel="seconds", title="Table 1")
    axes.legend(loc="upper center", bbox_to_anchor=(0.5, -0.06), ncols=3, frameon=False)


def figure_5(axes, figures: dict) -> None:
    for label, seconds in figures["seconds"].items():
        axes.plot([int(count) for count in seconds], list(seconds.values()), "o-", label=label)
    axes.set(xscale="log", yscale="log", xlabel="spheres", ylabel="seconds", title="Figure 5: Schwarzschild")
    axes.grid(alpha=0.3)
    axes.legend()


def scaling(axes, figures: dict) -> None:
    counts = [int(name) for name in figures if name.isdigit()]
    for stage, label in (("pack", "build"), ("upload", "upload"), ("trace", "trace")):
        times = [figures[str(count)]["milliseconds"][stage]["min"] for count in counts]
        axes.plot(counts, times, "o-", label=label)
    most = MOST_GROWTH * figures[str(counts[0])]["milliseconds"]["trace"]["min"]
    axes.axhline(most, color="grey", linestyle=":", label=f"{MOST_GROWTH} times the first trace")
    axes.set(xscale="log", yscale="log", xlabel="triangles", ylabel="milliseconds", title="A torus around the hole")
    axes.grid(alpha=0.3)
    axes.legend()


def cycles(axes, figures: dict) -> None:
    size, warm = next((name, value) for name, value in figures.items() if name.startswith("warm"))
    for i, (label, stages) in enumerate(
        (("Cycles", ("frame",)), ("curved", ("trace", "read")), ("straight", ("trace", "read")))
    ):
        times = [sum(row[label][stage]["min"] for stage in stages) for row in warm.values()]
        bars = axes.bar([x + 0.27 * i for x in range(len(warm))], times, 0.25, label=label)
        axes.bar_label(bars, fmt="%.0f", fontsize=8)
    axes.set_xticks([x + 0.27 for x in range(len(warm))], list(warm))
    axes.set(xlabel="triangles", ylabel="milliseconds", title=f"Against Cycles, {size}")
    axes.legend(loc="upper left")


PLOTS = {"table_1": table_1, "figure_5": figure_5, "scaling": scaling, "cycles": cycles}
