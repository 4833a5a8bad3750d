"""Many switches at once, by a Plackett-Burman design: each is on in half of the generators.

So every switch is judged by all trainings, where comparisons one by one judge it by two of them. As most
switches give little, the effects of all show what chance alone gives (Lenth 1989).
"""

import numpy as np

# Of twelve runs (Plackett and Burman 1946): its rotations, and a row in which all is off.
FIRST_ROW = "++-+++---+-"
# 97.5 % quantile of Student's t with a third of the columns as degrees of freedom, as Lenth has it.
T_QUANTILE = 2.879


def design():
    """Runs by columns: what is on."""
    first = np.array([sign == "+" for sign in FIRST_ROW])
    rotations = [np.roll(first, k) for k in range(len(first))]
    return np.array([*rotations, np.zeros(len(first), bool)])


def add_arms(arms):
    """The generators and arms of `[screening]`."""
    screening = arms["screening"]
    switches = screening["switches"]
    if len(switches) > len(FIRST_ROW):
        raise SystemExit(f"arms.toml: {len(switches)} switches in [screening], expected at most {len(FIRST_ROW)}")
    for k, row in enumerate(design()):
        on = [name for name, is_on in zip(switches, row) if is_on]
        arms["generators"][f"screening_{k}"] = combined(screening["base"], [switches[name] for name in on])
        arms["arms"][f"screening_{k}"] = {
            "synthetic": f"screening_{k}",
            "images": screening["images"],
            "screening": True,
        }


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
    by_chance = standard_error([effect for effect, _ in columns])
    return [
        {"switch": name, **ratio(effect, np.hypot(by_chance, np.std(of_rounds)))}
        for name, (effect, of_rounds) in zip(study.arms["screening"]["switches"], columns)
    ]


def standard_error(effects):
    """Of effects most of which are none: Lenth's pseudo standard error."""
    sizes = np.abs(effects)
    rough = 1.5 * np.median(sizes)
    return 1.5 * np.median(sizes[sizes < 2.5 * rough])


def on_over_off(logs, column):
    return logs[column].mean(0) - logs[~column].mean(0)


def ratio(effect, error):
    reach = T_QUANTILE * error
    return {"ratio": np.exp(effect), "low": np.exp(effect - reach), "high": np.exp(effect + reach)}
