# SPDX-License-Identifier: GPL-3.0-or-later
"""docs/internals/paper/README.md: the method, the tables, and the cases where Bullet is better, stated only if the numbers show it."""
import matplotlib

import tables
from tables import mm, one, pick, us


def prose(text):
    """A text that is wrapped in the source, as one line."""
    return " ".join(text.split())


def lose(clauses):
    """The sentences on results that are worse than Bullet's. clauses: (whether, sentence)."""
    said = [prose(sentence) for whether, sentence in clauses if whether]
    return "**Where we lose:** " + " ".join(said) if said else "Nothing here is worse than Bullet's."


def ball_part(ball):
    low, high = ball["points"]
    radius_low, radius_high = ball["covering_radius"]
    return [
        "## Bouncing ball (Sec. 4.1, Fig. 6, Table 1)", "",
        prose(f"""Radius 0.5 m, 1 kg, g = 10 m/s^2, {ball['rate']:.0f} Hz, friction 0.5 (Bullet's default). Shells of
              {low:,} and {high:,} points (the paper: 275 and 25,880); every point of the sphere is within {mm(radius_low, 0)}
              and {mm(radius_high)} mm of one. Floors: Bullet's plane, its box, and a slab baked with voxels of 5 mm, like the
              paper's plane. The paper has Bullet's sphere on a box and its own shells on the voxelmap."""), "",
        prose("""Deepest penetration after any step, in mm: of the real ball, by its centre's height, and in brackets of the
              pointshell's points. A coarse shell lies inside the ball, so that even at rest the ball penetrates the floor by the
              gap between ball and shell. The paper's "from a height of 1 m" may mean the lowest point or the centre. Advanced: with
              `vps::bullet::ContinuousMotion`. Columns: restitution."""), "",
        *tables.ball_depths(ball), "",
        "Our low shell against the paper's high row, which is the target:", "", *tables.ball_verdicts(ball), "",
        prose(f"""The depth depends on when in a step the ball arrives. {ball['phases']} heights from 1 m on (lowest point),
              spread over one step's travel of 22.4 mm; the last column is the ball from 1 m, after 4 s:"""), "",
        *tables.ball_phases(ball), "", "![height over time](ball.svg)", "", *ball_reading(ball), ""]


def ball_reading(ball):
    def worst(side, floor, key, extreme=max):
        return 1000 * extreme(v for run in pick(ball["runs"], side=side, floor=floor, drop=1.0) for v in run[key])

    def rebound(side, floor="baked"):
        return max(abs(worst(side, floor, "rebound_errors", extreme)) for extreme in (min, max))
    bullet = worst("Bullet", "box", "deepest_of_phases")
    ours, advanced = (worst(side, "baked", "deepest_of_phases") for side in ("ours, high", "ours, high, advanced"))
    drift = 1000 * max(run["drift"] for run in ball["runs"] if run["side"].startswith("ours, high"))
    return [
        prose(f"""The paper has 42.5 mm for Bullet's sphere, here it is at most {bullet:.1f} mm. Bullet makes a contact within its
              breaking threshold, 2 % of the ball's motion disc, and stops the ball at the floor. The ball stays out, but its
              first rebound ends up to {rebound('Bullet', 'box'):.0f} mm from the ideal, because the restitution is lost with the
              approach speed. The baked ball rebounds within {rebound('ours, high'):.0f} mm (high) and {rebound('ours, low'):.0f} mm
              (low), advanced within {rebound('ours, high, advanced'):.0f} and {rebound('ours, low, advanced'):.0f} mm; advanced,
              the high shell is at most {advanced:.1f} mm deep."""), "",
        lose([(ours > bullet, f"""Without advancement the first contact is up to {ours:.1f} mm deep, about a step's travel,
                                  against Bullet's {bullet:.1f} mm."""),
              (rebound("ours, high") > 50, f"""Overlaps of less than two voxels are resolved by velocity: without advancement the
                               first rebound is up to {rebound("ours, high"):.0f} mm from the ideal one."""),
              (drift > 10, f"""A ball of facets rolls off sideways, the high one by up to {drift:.0f} mm in 4 s. Bullet's sphere does
                               not roll off.""")])]


def bunny_part(bunny):
    low, fine = bunny["points"]
    runs = bunny["runs"]
    plane, box = (one(runs, floor=floor, side="GImpact") for floor in ("plane", "box"))
    return [
        "## Dropped bunny (Sec. 4.2.1 and 4.2.3, Figs. 8 and 10)", "",
        prose(f"""{bunny['triangles']:,} triangles, 0.155 m long, from 0.5 m (lowest point), 1 kg, inertia diag(4.79, 4.46, 6.38)
              10^-3 kg m^2, 200 Hz, sleeping off; voxel 0.5 mm ({' x '.join(map(str, bunny['dims']))}; the paper: 306 x 305 x
              282), {low:,} and {fine:,} points (799 and 35,596). Hull of 42 vertices, HACD of 8 hulls of at most 100 vertices,
              margins of 0.5 mm, GImpact with the whole mesh; "baked" is the slab of 5 mm voxels; Bullet's shapes have no points
              to test against it. L: segmented contacts, K = 4; otherwise one manifold of up to four, K = 14."""), "",
        prose(f"""Times are the whole narrowphase of steps 201 to 600; a drop repeats to the bit, so that a step's time
              is the median of {bunny['rounds']} rounds (GImpact: one). The whole step adds the solver, and advancement
              where it is on. Deepest: the mesh's own lowest vertex below the floor, ever and in the timed steps. Speed and
              energy: at the end. Creep: mean sideways speed of the timed steps."""), "",
        *tables.bunny_steps(runs), "", "![time and speed per step](bunny.svg)", "",
        "![time and energy per step](energy.svg)", "",
        prose(f"""GImpact takes {us(plane['mean_us'])} us a step on Bullet's plane and {us(box['mean_us'])} us on its box,
              {box['mean_us'] / plane['mean_us']:,.0f} times as much, because it tests a plane vertex by vertex, but intersects
              triangles with a box; in the box it also sinks, to {mm(box['deepest'])} mm. The paper does not say which of the two
              its 97 ms are for. Ratios of means:"""), "",
        *tables.bunny_ratios(runs), "", lose(bunny_losses(runs)), ""]


def bunny_losses(runs):
    def get(side, floor, key):
        return one(runs, side=side, floor=floor)[key]
    for floor in ("plane", "box"):
        own, hull = get("ours, fine", floor, "mean_us"), get("hull", floor, "mean_us")
        yield own > hull, f"On Bullet's {floor} the hull takes {us(hull)} us a step, the fine shell {us(own)} us."
    if one(runs, side="HACD"):
        calm = get("HACD", "plane", "energy")[-1]
        louder = [f"{side} {energy:.1g}" for side in tables.PAPER_BUNNY if side.startswith("ours")
                  for energy in [get(side, "plane", "energy")[-1]] if energy > 10 * calm]
        yield louder, f"On the plane HACD ends with {calm:.1g} J. These end with more than ten times that: {'; '.join(louder)} J."
    creep = 1000 * get("ours, fine", "plane", "creep")
    yield creep > 0.1, f"The fine shell creeps over the plane at {creep:.2g} mm/s."
    for side in ("ours, low", "ours, fine"):
        speed = 1000 * get(side, "baked", "speed")[-1]
        yield speed > 5, f"On the slab \"{side}\" still moves at {speed:.2g} mm/s at the end."
    for floor in tables.FLOORS:
        speeds = [1000 * get(side, floor, "speed")[-1] for side in ("ours, fine", "ours, fine, advanced")]
        times = [get(side, floor, "mean_step_us") for side in ("ours, fine", "ours, fine, advanced")]
        yield speeds[1] > 2 * speeds[0], (
            f"On the {floor if floor != 'baked' else 'slab'} the fine bunny still moves at {speeds[1]:.2g} mm/s at the end with "
            f"advancement, at {speeds[0]:.2g} without; a whole step takes {us(times[1])} us, {us(times[0])} without.")
    dear = get("ours, fine", "baked", "mean_us") / get("ours, fine", "box", "mean_us")
    yield dear > 3, f"On the slab, a field of samples, a step of the fine shell takes {dear:.0f} times that on Bullet's box."


def levels_part(levels):
    clusters = "; ".join(f"{name} {', '.join(map(str, counts))}"
                         for name, counts in zip(("low", "fine"), levels["clusters"]))
    return [
        "## Levels of the segmentation (Table 2)", "",
        prose(f"""Mean narrowphase in us of steps 201 to 600, over {levels['rotations']} initial rotations; K = 4. Clusters of the
              levels, root first: {clusters}. Regular: one manifold, K = 14."""), "",
        *tables.level_times(levels["runs"]), "", "Bullet's, the same drops:", "", *tables.level_peers(levels["runs"]), ""]


def low_rates_part(low):
    return [
        "## Low rates (Sec. 4.2.2)", "",
        prose(f"""The same drops, {low['duration']:.0f} s each, {low['rotations']} rotations. *Above*: in the last {low['last']:.0f} s
              the centre of mass is never below the floor's top, and it never rose more than {mm(low['climbed_limit'], 0)} mm
              above its start. *Rests*: also, in those seconds the lowest vertex is never deeper than
              {mm(low['deepest_at_end_limit'], 0)} mm nor higher than {mm(low['highest_at_end_limit'], 0)} mm. The table has the
              lowest rate, in Hz, that passes in every rotation together with all higher rates tried; inf: even the highest
              fails. The paper says only that the bunny was "maintained above the plane":"""), "",
        *tables.rate_limits(low), "",
        prose("""The plane is a half space and gives a depth anywhere. The box is 1 m thick, the slab 0.5 m; a step of 1/8 s moves
              the bunny by 0.4 m."""), "",
        "Deepest ever on the plane, worst rotation, in mm:", "", *tables.rate_depths(low, "deepest"), "",
        f"Deepest in the last {low['last']:.0f} s on the plane, worst rotation, in mm:", "",
        *tables.rate_depths(low, "deepest_at_end"), "", "![depth at the end by rate](low_rates.svg)", "",
        lose(low_rate_losses(low["runs"], low["rotations"])), ""]


def low_rate_losses(runs, rotations):
    for floor in ("plane", "box"):
        def lowest(*sides):
            return min(tables.lowest_rate(pick(runs, side=side, floor=floor), "rests", rotations) for side in sides)
        sides = {run["side"] for run in runs if run["side"].startswith("ours")}
        best = lowest(*sides)
        discrete = lowest(*(side for side in sides if not side.endswith("advanced")))
        if one(runs, side="HACD"):
            hacd = lowest("HACD")
            yield max(best, discrete) > hacd, (
                f"On the {floor} HACD rests down to {hacd:.0f} Hz, the best of ours down to {best:.0f} Hz, and to "
                f"{discrete:.0f} Hz without advancement.")
        yield best > 5, f"The target of 5 Hz is not met on the {floor}."
    low, advanced = (tables.lowest_rate(pick(runs, side=f"ours, low, L = 4{motion}", floor="plane"), "rests", rotations)
                     for motion in ("", ", advanced"))
    yield low > 10, f"""With the low shell and L = 4 the bunny rests down to {low:.0f} Hz, and to {advanced:.0f} Hz with
                        advancement; the paper has 10 Hz."""
    still, moved = (one(runs, side=f"ours, fine, regular{motion}", floor="plane", rate=5)["deepest"]
                    for motion in ("", ", advanced"))
    yield moved > still, f"At 5 Hz advancement does not help: {mm(moved, 0)} mm deep on the plane, {mm(still, 0)} mm without."


def stacks_part(stacks):
    runs = stacks["runs"]

    def median(side, count):
        seconds = sorted(one(runs, bodies="balls", side=side, count=count)["seconds"])
        return seconds[len(seconds) // 2]
    counts = sorted({run["count"] for run in pick(runs, bodies="balls")})
    longer = [str(n) for n in counts if median("ours, high", n) > median("ours, low", n)]
    ours, boxes = (one(runs, bodies="cubes", count=10, side=side)["mean_us"] for side in ("ours", "Bullet"))
    return [
        "## Stacks (Sec. 4.1)", "",
        prose(f"""Seconds until a body is a quarter of its height from its place; {stacks['duration']:.0f} s at most,
              {stacks['rate']:.0f} Hz, g = 10 m/s^2, sleeping off, on Bullet's plane. Balls are rotated at random, {stacks['seeds']}
              seeds; cubes have sides of 1 m, all bodies 1 kg. The paper has no number: it says that balls collapse, and
              that finer shells stand longer. Bunnies do not stack well: one stands on the other's back and
              slides."""), "",
        *tables.stack_times(stacks), "",
        f"Finer shells stand longer in stacks of {' and '.join(longer) or 'no number of'} balls, in the median.", "",
        lose([(any(median("Bullet", n) > median("ours, high", n) for n in counts),
               "Bullet's spheres stand longer: their contacts lie on the line of centres to the bit."),
              (ours > boxes, f"""Ten cubes with pointshells take {us(ours)} us a step, Bullet's boxes {us(boxes)} us: use Bullet's
                                 own shapes where it has them.""")]), ""]


def page(measured):
    out = ["# The paper's evaluation, measured again", "",
           prose("""Written by `make paper` (tests/paper): Sec. 4 of Sagardia, Stouraitis and Lopes e Silva (2014), beside Bullet's own
                 algorithms in the same run. *Paper* columns have its numbers, from its machine (4 x 2.8 GHz Xeon, Bullet 2.82):
                 compare ratios, not times."""), "",
           prose(f"""{measured['machine']}; Bullet {measured['bullet']} (single precision, unpatched), vpsbake {measured['vpsbake']},
                 matplotlib {matplotlib.__version__}; rotations from SplitMix64 with state 1. Split impulses from two voxels of
                 penetration on. Depths, speeds and counts repeat to the bit on one machine; times do not.""")]
    if measured["busy"]:
        out += ["", f"The machine was busy, with a load of {measured['load']:.1f} at the start: times are not a clean measurement."]
    out.append("")
    for part, key in ((ball_part, "ball"), (bunny_part, "bunny"), (levels_part, "levels"),
                      (low_rates_part, "low_rates"), (stacks_part, "stacks")):
        out += part(measured[key])
    return "\n".join(out).rstrip() + "\n"
