"""Many switches at once, by a Plackett-Burman design: each is on in half of the generators.

So every switch is judged by all trainings, where comparisons one by one judge it by two of them. The
columns of the design that have no switch show what chance alone gives.
"""

import numpy as np

# Of twelve runs (Plackett and Burman 1946): its rotations, and a row in which all is off.
FIRST_ROW = "++-+++---+-"
# 97.5 % quantiles of Student's t by degrees of freedom, here the columns without a switch.
T_QUANTILES = {1: 12.706, 2: 4.303, 3: 3.182, 4: 2.776, 5: 2.571, 6: 2.447}


def design():
    """Runs by columns: what is on."""
    first = np.array([sign == "+" for sign in FIRST_ROW])
    rotations = [np.roll(first, k) for k in range(len(first))]
    return np.array([*rotations, np.zeros(len(first), bool)])


def add_arms(arms):
    """The generators and arms of `[screening]`."""
    screening = arms["screening"]
    switches = screening["switches"]
    spare = len(FIRST_ROW) - len(switches)
    if spare not in T_QUANTILES:
        raise SystemExit(f"arms.toml: {len(switches)} switches in [screening], expected 5 to 10")
    for k, row in enumerate(design()):
        on = [name for name, is_on in zip(switches, row) if is_on]
        arms["generators"][f"screening_{k}"] = combined(screening["base"], [switches[name] for name in on])
        arms["arms"][f"screening_{k}"] = {"synthetic": f"screening_{k}", "short": True, "screening": True}


def combined(base, switches):
    generator = {"base": base, "set": []}
    for switch in switches:
        generator |= switch | {"set": generator["set"] + switch.get("set", [])}
    return generator


def names(arms):
    return [name for name, arm in arms["arms"].items() if arm.get("screening")]


def effects(study, means, drawn):
    """What each switch gives: the ratio of scores with and without it, and its interval; nothing before
    all runs are trained."""
    runs = names(study.arms)
    if not runs or not all(means.get(run) for run in runs):
        return []
    logs = np.log([means[run] for run in runs])
    rounds = np.log(np.maximum([drawn[run] for run in runs], np.finfo(float).tiny))
    columns = [(on_over_off(logs, column), on_over_off(rounds, column)) for column in design().T]
    switches = study.arms["screening"]["switches"]
    spare = [effect for effect, _ in columns[len(switches) :]]
    by_chance = np.mean(np.square(spare))
    return [
        {"switch": name, **ratio(effect, np.sqrt(by_chance + np.var(of_rounds)), len(spare))}
        for name, (effect, of_rounds) in zip(switches, columns)
    ]


def on_over_off(logs, column):
    return logs[column].mean(0) - logs[~column].mean(0)


def ratio(effect, error, freedom):
    reach = T_QUANTILES[freedom] * error
    return {"ratio": np.exp(effect), "low": np.exp(effect - reach), "high": np.exp(effect + reach)}
