# SPDX-License-Identifier: GPL-3.0-or-later
"""The paper's figures from measured numbers, as SVG. The same numbers give the same file."""
import os

import matplotlib

matplotlib.use("svg")
matplotlib.rcParams.update({"svg.hashsalt": "vpsbake", "svg.fonttype": "none", "font.size": 8, "axes.grid": True,
                            "grid.alpha": 0.3, "lines.linewidth": 1, "path.simplify_threshold": 0.5,
                            "legend.fontsize": 7})
import matplotlib.pyplot as plt  # noqa: E402

from tables import pick  # noqa: E402

COLOURS = {"Bullet": "tab:red", "hull": "tab:orange", "HACD": "tab:red", "GImpact": "tab:purple",
           "ours, low": "tab:cyan", "ours, high": "tab:blue", "ours, fine": "tab:blue",
           "ours, low, L = 1": "tab:green", "ours, low, L = 4": "tab:olive"}


def save(figure, folder, name):
    figure.tight_layout()
    # Without a date, so that only the numbers change the file.
    figure.savefig(os.path.join(folder, name), metadata={"Date": None})
    plt.close(figure)


def ball(measured, folder):
    """Fig. 6: Bullet's sphere on its box, ours on the baked slab, as in the paper."""
    runs = measured["ball"]["runs"]
    figure, axes = plt.subplots(1, 3, figsize=(10, 3), sharey=True)
    for axis, restitution in zip(axes, (0.1, 0.5, 0.9)):
        for side, floor in (("Bullet", "box"), ("ours, low", "baked"), ("ours, high", "baked")):
            run, = pick(runs, side=side, floor=floor, drop=1.0, restitution=restitution)
            axis.plot([i / measured["ball"]["rate"] for i in range(1, len(run["heights"]) + 1)], run["heights"],
                      label=f"{side}, {floor}", color=COLOURS[side])
        axis.axhline(0.5 + restitution ** 2, color="black", linestyle="--", label="ideal first rebound")
        axis.set_title(f"restitution {restitution}")
        axis.set_xlabel("time, s")
    axes[0].set_ylabel("height of the centre, m")
    axes[0].legend()
    save(figure, folder, "ball.svg")


def steps(measured, folder, name, rows, columns):
    """Curves per step. rows: (key, label, scale); columns: (floor, sides)."""
    figure, axes = plt.subplots(len(rows), len(columns), figsize=(5 * len(columns), 2.6 * len(rows)), sharex=True,
                                sharey="row", squeeze=False)
    for column, (floor, sides) in enumerate(columns):
        for row, (key, label, scale) in enumerate(rows):
            axis = axes[row][column]
            for side in sides:
                for run in pick(measured["bunny"]["runs"], floor=floor, side=side):
                    # A plot cannot show more than four digits.
                    axis.plot(range(1, len(run[key]) + 1), [float(f"{max(v, 1e-12):.4g}") for v in run[key]],
                              label=side, color=COLOURS[side])
            axis.set_yscale(scale)
            if column == 0:
                axis.set_ylabel(label)
        axes[0][column].set_title(f"on the {floor}" if floor != "baked" else "on the baked slab")
        axes[-1][column].set_xlabel("step of 1/200 s")
        axes[0][column].legend(loc="upper left")
    save(figure, folder, name)


def low_rates(measured, folder):
    """Sec. 4.2.2: how deep the bunny is at the end, by rate."""
    figure, axes = plt.subplots(1, 2, figsize=(10, 3.2), sharey=True)
    sides = {"HACD": "tab:red", "hull": "tab:orange", "ours, fine, L = 1": "tab:green",
             "ours, fine, L = 4": "tab:olive", "ours, fine, L = 5": "tab:gray", "ours, fine, regular": "tab:blue",
             "ours, fine, regular, advanced": "black"}
    for axis, floor in zip(axes, ("plane", "box")):
        for side, colour in sides.items():
            runs = pick(measured["low_rates"]["runs"], floor=floor, side=side)
            # A bunny that has fallen through has no depth.
            shown = [run for run in runs if run["deepest_at_end"] < 10]
            axis.plot([run["rate"] for run in shown], [max(1000 * run["deepest_at_end"], 0.1) for run in shown],
                      marker=".", label=side, color=colour)
        axis.set_xscale("log")
        axis.set_yscale("log")
        axis.set_title(f"on the {floor}")
        axis.set_xlabel("rate, Hz")
    axes[0].set_ylabel("deepest in the last 2 s, mm")
    axes[0].legend()
    save(figure, folder, "low_rates.svg")


def write(measured, folder):
    ball(measured, folder)
    everyone = ("GImpact", "HACD", "hull", "ours, fine", "ours, low")
    steps(measured, folder, "bunny.svg", (("microseconds", "narrowphase, us", "log"), ("speed", "speed, m/s", "log")),
          (("plane", everyone), ("box", everyone)))
    few = ("HACD", "ours, low", "ours, low, L = 1", "ours, low, L = 4")
    steps(measured, folder, "energy.svg",
          (("microseconds", "narrowphase, us", "linear"), ("energy", "kinetic energy, J", "log")),
          (("plane", few), ("box", few)))
    low_rates(measured, folder)
