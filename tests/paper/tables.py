# SPDX-License-Identifier: GPL-3.0-or-later
"""Markdown tables of measured numbers beside the paper's. Each function is named after its table and returns its lines."""

# Table 1, in mm, by restitution: Bullet, low, high.
PAPER_BALL = {0.1: (42.5, 6.8, 3.5), 0.5: (42.5, 9.5, 4.0), 0.9: (42.5, 20.1, 19.2)}
# Table 2, in us, by level.
PAPER_LEVELS = {"low": (102.2, 102.1, 104.2, 102.3, 102.8), "fine": (1387.9, 1477.5, 1407.4, 1449.6, 1494.3)}
# Sec. 4.2.1, in us: 710 for the fine shell, the hull 339 times and GImpact 1/137 times as fast; Sec. 4.2.3 for the others.
PAPER_BUNNY = {"hull": "2.1", "HACD": "30", "GImpact": "97,000", "ours, low": "100", "ours, fine": "710",
               "ours, low, L = 1": "100", "ours, low, L = 4": "100",
               "ours, low, advanced": "", "ours, fine, advanced": ""}
# Sec. 4.2.2, in Hz: maintained above the plane.
PAPER_RATES = {"L = 1": "30", "L = 4": "10", "L = 5": "10"}
FLOORS = ("plane", "box", "baked")


def pick(runs, **wanted):
    return [run for run in runs if all(run[key] == value for key, value in wanted.items())]


def one(runs, **wanted):
    found = pick(runs, **wanted)
    return found[0] if found else None


def table(head, rows):
    return ["| " + " | ".join(head) + " |", "|" + "---|" * len(head)] + ["| " + " | ".join(row) + " |" for row in rows]


def mm(metres, digits=1):
    return f"{1000 * metres:.{digits}f}"


def us(value):
    return f"{value:,.0f}" if value >= 100 else f"{value:.3g}"


def short(value):
    return f"{value:.2g}" if value < 100 else f"{value:.0f}"


def span(values):
    return f"{mm(min(values))} to {mm(max(values))}"


# --- Table 1

def ball_sides(ball):
    """(side, floor): Bullet's sphere on its box, as in the paper, then the baked balls on both."""
    ours = list(dict.fromkeys(run["side"] for run in ball["runs"] if run["side"] != "Bullet"))
    return [("Bullet", "box")] + [(side, floor) for floor in ("box", "baked") for side in ours]


def ball_depths(ball):
    head = ["side"] + [f"{what} from 1 m, {r}" for what in ("lowest point", "centre") for r in PAPER_BALL]
    rows = []
    for number, name in enumerate(("Bullet", "low", "high")):
        rows.append([f"paper: {name}"] + [f"{numbers[number]}" for numbers in PAPER_BALL.values()] + [""] * 3)
    for side, floor in ball_sides(ball):
        row = [f"{side}, {floor}"]
        for drop in (1.0, 0.5):
            for restitution in PAPER_BALL:
                run = one(ball["runs"], side=side, floor=floor, drop=drop, restitution=restitution)
                row.append(mm(run["deepest"]) + ("" if side == "Bullet" else f" ({mm(run['deepest_point'])})"))
        rows.append(row)
    return table(head, rows)


def ball_verdicts(ball):
    """The low shell against the paper's high row: met if both drops on all floors are below it."""
    rows = []
    for side in ("ours, low", "ours, low, advanced"):
        for key, what in (("deepest", "ball"), ("deepest_point", "points")):
            row = [f"{side}: {what}"]
            for restitution, (_, _, high) in PAPER_BALL.items():
                most = 1000 * max(run[key] for run in pick(ball["runs"], side=side, restitution=restitution))
                row.append(f"{most:.1f}: " + ("met" if most < high else "**missed**"))
            rows.append(row)
    return table(["worst depth, mm"] + [f"{r}: below {numbers[2]}" for r, numbers in PAPER_BALL.items()], rows)


def ball_phases(ball):
    rows = []
    for side, floor in ball_sides(ball):
        if floor == "box" and side != "Bullet":
            continue
        for restitution in PAPER_BALL:
            run = one(ball["runs"], side=side, floor=floor, drop=1.0, restitution=restitution)
            rows.append([f"{side}, {floor}", f"{restitution}", span(run["deepest_of_phases"]),
                         span(run["rebound_errors"]), mm(run["drift"])])
    return table(["side", "restitution", "deepest, mm", "first rebound less the ideal one, mm", "sideways, mm"], rows)


# --- Figs. 8 and 10

def bunny_steps(runs):
    head = ["floor", "side", "paper, us", "mean, us", "median, us", "whole step, us", "deepest, mm", "later, mm",
            "speed, mm/s", "energy, J", "creep, mm/s"]
    rows = []
    for floor in FLOORS:
        for side, paper in PAPER_BUNNY.items():
            run = one(runs, floor=floor, side=side)
            if run:
                rows.append([floor, side, paper, us(run["mean_us"]), us(run["median_us"]), us(run["mean_step_us"]),
                             mm(run["deepest"]), mm(run["deepest_timed"], 2), short(1000 * run["speed"][-1]),
                             short(run["energy"][-1]), short(1000 * run["creep"])])
    return table(head, rows)


def bunny_ratios(runs):
    def ratio(floor, first, second):
        sides = one(runs, floor=floor, side=first), one(runs, floor=floor, side=second)
        return f"{sides[0]['mean_us'] / sides[1]['mean_us']:.3g}" if all(sides) else ""
    pairs = {("GImpact", "ours, fine"): "137", ("ours, fine", "hull"): "339", ("ours, low", "HACD"): "1.3 to 3.3"}
    return table(["ratio", "paper", "plane", "box"],
                 [[" / ".join(pair), paper, ratio("plane", *pair), ratio("box", *pair)] for pair, paper in pairs.items()])


# --- Table 2

def level_times(runs):
    names = [f"L = {level}" for level in range(1, 6)]
    rows = []
    for row in ("low", "fine"):
        rows.append([row, "paper"] + [f"{value}" for value in PAPER_LEVELS[row]] + [""])
        for floor in FLOORS:
            found = [one(runs, floor=floor, row=row, side=side) for side in names + ["regular"]]
            rows.append([row, f"ours, {floor}"] + [us(run["mean_us"]) for run in found])
    return table(["shell", ""] + names + ["regular"], rows)


def level_peers(runs):
    return table(["side", "floor", "mean, us", "deepest, mm"],
                 [[run["side"], run["floor"], us(run["mean_us"]), mm(run["deepest"])]
                  for run in pick(runs, row="Bullet")])


# --- Sec. 4.2.2

def lowest_rate(runs, key, rotations):
    """The lowest rate at which, and above which, all rotations pass; infinite if they pass at none."""
    best = float("inf")
    for run in sorted(runs, key=lambda r: -r["rate"]):
        if run[key] < rotations:
            break
        best = run["rate"]
    return best


def rate_limits(low):
    head = ["side", "paper"] + [f"{what}, {floor}" for what in ("above", "rests") for floor in FLOORS]
    rows = []
    for side in dict.fromkeys(run["side"] for run in low["runs"]):
        row = [side, next((hertz for level, hertz in PAPER_RATES.items() if side.endswith(level)), "")]
        for key in ("above", "rests"):
            for floor in FLOORS:
                runs = pick(low["runs"], side=side, floor=floor)
                row.append(f"{lowest_rate(runs, key, low['rotations']):.0f}" if runs else "")
        rows.append(row)
    return table(head, rows)


def rate_depths(low, key):
    """Depths on the plane for the worst rotation. [mm]"""
    def depth(run):
        return mm(run[key], 0) if run[key] < 10 else "through"
    runs = pick(low["runs"], floor="plane")
    rates = sorted({run["rate"] for run in runs if run["rate"] >= 5}, reverse=True)
    return table(["side"] + [f"{rate:.0f} Hz" for rate in rates],
                 [[side] + [depth(one(runs, side=side, rate=rate)) for rate in rates]
                  for side in dict.fromkeys(run["side"] for run in runs)])


# --- Sec. 4.1, stacks

def stack_times(stacks):
    rows = []
    for run in stacks["runs"]:
        seconds = sorted(run["seconds"])
        stands = seconds[0] >= stacks["duration"]
        rows.append([f"{run['count']} {run['bodies']}", run["side"],
                     "stands" if stands else f"{seconds[len(seconds) // 2]:.2f}",
                     f"{seconds[0]:.2f} to {seconds[-1]:.2f}" if len(seconds) > 1 else "",
                     mm(run["drift"]) if stands else "", us(run["mean_us"])])
    return table(["stack", "side", "stands for, median s", "least to most, s", "moved, mm", "mean narrowphase, us"], rows)
