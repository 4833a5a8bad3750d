"""Tests many switches at once by a Plackett-Burman design: each is on in half of the generators.

All trainings contribute to the effect of every switch, instead of only two as in one-by-one comparisons. Most
switches have little effect, so the distribution of all effects shows what chance alone does (Lenth 1989).
"""

import numpy as np

# Of twelve runs (Plackett and Burman 1946): its rotations, and a row in which all is off.
FIRST_ROW = "++-+++---+-"
# 97.5 % quantile of Student's t with a third of the columns as degrees of freedom, as Lenth has it.
T_QUANTILE = 2.879


def design():
    """The design matrix: rows are runs, columns are switches that are on or off."""
    first = np.array([sign == "+" for sign in FIRST_ROW])
    rotations = [np.roll(first, k) for k in range(len(first))]
    return np.array([*rotations, np.zeros(len(first), bool)])


def add_arms(arms):
    """Add the generators and arms of `[screenings]`."""
    for name, screening in arms["screenings"].items():
        add_runs(arms, name, screening)


def add_runs(arms, name, screening):
    switches = screening["switches"]
    if len(switches) > len(FIRST_ROW):
        raise SystemExit(f"arms.toml: {len(switches)} switches in [screenings.{name}], expected at most {len(FIRST_ROW)}")
    training = {key: screening[key] for key in ("images", "start") if key in screening}
    size = {key: screening[key] for key in ("pictures",) if key in screening}
    for run, row in zip(runs(name), design()):
        on = [switch for switch, is_on in zip(switches.values(), row) if is_on]
        arms["generators"][run] = size | combined(screening["base"], on)
        arms["arms"][run] = training | {"synthetic": run}


def chosen(arms, name):
    if name not in arms["screenings"]:
        raise SystemExit(f"--screening: no {name}, expected one of {', '.join(arms['screenings'])}")
    return arms["screenings"][name]


def runs(name):
    return [f"{name}_{k}" for k in range(len(design()))]


def combined(base, switches):
    generator = {"base": base, "set": []}
    for switch in switches:
        generator |= switch | {"set": generator["set"] + switch.get("set", [])}
    return generator


def effects(study, means, drawn):
    """Effect of each switch, by screening: the ratio of scores with and without it, and its interval. Includes only
    screenings whose runs are all trained."""
    return {
        name: of_switches(screening["switches"], [means[run] for run in runs(name)], [drawn[run] for run in runs(name)])
        for name, screening in study.arms["screenings"].items()
        if all(means.get(run) for run in runs(name))
    }


def of_switches(switches, means, drawn):
    logs = np.log(means)
    rounds = np.log(np.maximum(drawn, np.finfo(float).tiny))
    columns = [(on_over_off(logs, column), on_over_off(rounds, column)) for column in design().T]
    by_chance = standard_error([effect for effect, _ in columns])
    return [
        {"switch": name, **ratio(effect, np.hypot(by_chance, np.std(of_rounds)))}
        for name, (effect, of_rounds) in zip(switches, columns)
    ]


def standard_error(effects):
    """Lenth's pseudo standard error, for effects most of which are zero."""
    sizes = np.abs(effects)
    rough = 1.5 * np.median(sizes)
    return 1.5 * np.median(sizes[sizes < 2.5 * rough])


def on_over_off(logs, column):
    return logs[column].mean(0) - logs[~column].mean(0)


def ratio(effect, error):
    reach = T_QUANTILE * error
    return {"ratio": np.exp(effect), "low": np.exp(effect - reach), "high": np.exp(effect + reach)}
