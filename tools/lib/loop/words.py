# SPDX-License-Identifier: Apache-2.0
"""What the page of the loop says, in words for someone who has never seen a depth camera's error."""
import html
import math


def causes(report):
    """What the search found, each cause once: a rest is what an effect's form leaves of itself."""
    return [effect for effect in report["effects"] if not effect["is_rest"]]


def numbers_of(effect):
    """Keys with their numbers of an effect in a camera file."""
    return {key: value for key, value in effect.items() if key != "type"}


def above_noise(rms, what):
    """Part of an error that noise does not explain, in millimetres: errors of different causes add as squares."""
    return math.sqrt(max(0.0, rms[what] ** 2 - rms["noise"] ** 2))


def title(rms):
    before, after = (above_noise(rms, what) for what in ("before", "after"))
    if not rms["after"] < rms["before"]:
        return "The twin is no better for what was found"
    # A twentieth more than noise is what the noise of so many pixels may do.
    if rms["after"] <= 1.05 * rms["noise"]:
        return "The twin learned what it lacked: what is left is noise"
    return f"The twin learned what it lacked: {100 * (1 - after / before):.0f} % of its error is gone"


def hidden_list(hidden, choices):
    return "".join(f"<li>{html.escape(choices[effect['type']]['words'])}</li>" for effect in hidden)


def names_of(effect):
    """All names that the search has for it: of several, the captures cannot say which."""
    return [effect["name"], *(other if isinstance(other, str) else other["name"] for other in effect["or"])]


def found_list(report, hidden, choices):
    lines = [f"<li>{found_line(effect, hidden, choices)}</li>" for effect in causes(report)]
    missed = [choices[one["type"]]["found"] for one in hidden if not is_found(one, report)]
    lines += [f"<li><b>Not found by its name:</b> {html.escape(words)}.</li>" for words in missed]
    return "".join(lines) or "<li>Nothing.</li>"


def found_line(effect, hidden, choices):
    """One cause. Of several names that the captures do not tell apart, one that was hidden is said first."""
    names = names_of(effect)
    known = [name for name in names if name in choices]
    right = [name for name in known if any(one["type"] == name for one in hidden)]
    others = len(names) - 1
    alike = f", or {others} other form{'s' if others > 1 else ''} that these pictures do not tell apart" if others else ""
    if known:
        name = (right or known)[0]
        words = html.escape(choices[name]["found"])
        verdict = "right" if right else "was not hidden"
        return f"{words[0].upper()}{words[1:]} (<code>{name}</code>{alike}): <b>{verdict}</b>."
    along = html.escape(", ".join(effect["covariates"]))
    return f"<code>{html.escape(names[0])}</code>{alike}{', an error that goes with ' + along if along else ''}."


def is_found(hidden, report):
    """Whether the search names it, be it as one of several names."""
    return any(hidden["type"] in names_of(effect) for effect in causes(report))


def bars(rms):
    full = max(rms.values())
    rows = []
    for what, label in (("before", "before"), ("after", "after"), ("noise", "noise alone")):
        width = 0 if math.isnan(rms[what]) else 62 * rms[what] / full
        rows.append(f'<span>{label}</span><span class="bar"><i style="width:{width:.1f}%;background:var(--{what})"></i>'
                    f"{rms[what]:.1f} mm</span>")
    return "".join(rows)


def number_rows(report, hidden):
    """A row for each number of each effect that was hidden or found."""
    by_name = {effect["name"]: effect for effect in causes(report)}
    truth = {effect["type"]: numbers_of(effect) for effect in hidden}
    rows = []
    for name in [*truth, *(name for name in by_name if name not in truth)]:
        told = {one["key"]: one for one in by_name.get(name, {}).get("numbers", [])}
        for key in [*truth.get(name, {}), *(key for key in told if key not in truth.get(name, {}))]:
            was = f"{truth[name][key]:g}" if key in truth.get(name, {}) else "–"
            rows.append(f'<tr><td>{html.escape(name)}</td><td>{html.escape(key)}</td><td class="n">{was}</td>'
                        f'<td class="n">{shown_number(told.get(key))}</td></tr>')
    return "".join(rows)


def shown_number(one):
    """A number as precisely as its error allows; a dash where the search does not tell it."""
    if one is None or one["value"] is None:
        return "–"
    if not one["error"]:
        return f"{one['value']:.3g}"
    digits = max(0, 1 - math.floor(math.log10(abs(one["error"]))))
    return f"{one['value']:.{digits}f} ± {one['error']:.{digits}f}"


def in_a_line(rms, hidden, report):
    found = sum(is_found(one, report) for one in hidden)
    return (f"hidden {len(hidden)}, of these found by name {found}; error at places that were not used "
            f"{rms['before']:.2f} -> {rms['after']:.2f} mm, noise {rms['noise']:.2f} mm")
